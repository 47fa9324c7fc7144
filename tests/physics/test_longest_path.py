"""`Composite.max_length` limits the paths of every mechanism, by their whole length."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.scene import Actor, PointScatterer
from polychirp.testing.shapes import around, box, mesh_of

WALL = Plate(centre=(0, 0, 0), half_u=(0, -9, 0), half_v=(0, 0, 9), material="brick", part="wall")


@pytest.mark.parametrize(
    "parts",
    [
        {"points": (PointScatterer(position=(0, 0, 0), rcs=1.0),)},
        {"plates": (WALL,)},
        {"mesh": mesh_of(box((0.5, 0.5, 0.5), 0.1))},
    ],
)
def test_an_echo_counts_by_the_way_there_and_back(parts):
    """Echoes from 60 m away are 120 m long; only the distance of 60 m was compared."""
    target = Actor(name="target", kind="object", pose=Pose(x=60.0), **parts)
    scene = around([target], [(0.0, 0.0, 0.0)])
    every = Composite(max_bounces=1).trace(scene)
    length = every.delay * SPEED_OF_LIGHT
    assert np.any(length > 115.0)
    some = replace(Composite(max_bounces=1), max_length=100.0).trace(scene)
    assert some.num_paths == np.sum(length <= 100.0)


def test_echoes_of_rough_planes_and_leaves_are_limited():
    """Random scatterers did not read the limit."""
    ground = Plate(
        centre=(30, 0, -1), half_u=(30, 0, 0), half_v=(0, 4, 0), material="asphalt", part="road"
    )
    scene = around([Actor(name="road", kind="road", plates=(ground,))], [(0.0, 0.0, 0.0)])
    tracer = Composite(max_bounces=1, diffuse=True, max_length=8.0)
    length = tracer.trace(scene).delay * SPEED_OF_LIGHT
    assert len(length)
    assert np.max(length) <= 8.0
