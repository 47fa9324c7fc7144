"""An antenna's pattern turns with the radar that carries it."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.frames import Pose
from polychirp.model.antenna import AntennaArray, ElementPattern
from polychirp.model.radar import Radar
from polychirp.synthesis.links.links import links_between
from polychirp.testing.shapes import around

PATTERN = ElementPattern()


def amplitude(*, yaw):
    """|a| of the path from a radar at the origin, turned by ``yaw``, to one 10 m ahead of it."""
    scene = around([], [(0.0, 0.0, 0.0), (10.0, 0.0, 0.0)])
    turned = Radar(name="0", array=AntennaArray(pattern=PATTERN), mount=Pose(yaw=yaw))
    scene = replace(scene, radars=(turned, scene.radars[1]))
    links = links_between(scene, FreeSpace().trace(scene), victim=1, transmitter=0)
    return float(np.abs(links.amplitude[0]))


@pytest.mark.parametrize("yaw", [0.3, -0.9, 1.3])
def test_a_radar_that_turns_away_sends_less_by_its_pattern(yaw):
    """Power follows the gain at azimuth −yaw of the antenna, over the gain straight ahead."""
    ahead = np.array([1.0, 0.0, 0.0])
    aside = np.array([np.cos(yaw), -np.sin(yaw), 0.0])
    expected = np.sqrt(PATTERN.gain(aside) / PATTERN.gain(ahead))
    assert expected < 0.99
    assert amplitude(yaw=yaw) / amplitude(yaw=0.0) == pytest.approx(expected, rel=1e-9)
