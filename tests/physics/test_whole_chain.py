"""Laws that hold from scene to detection: tracer, synthesis and receiver together.

An empty world with isotropic antennas, so that every power is a textbook formula.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.rng import Streams
from polychirp.study.trial import trace_frame
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.waveform import DiverseTriangular, Triangular

WAVELENGTH = SPEED_OF_LIGHT / 79e9
RADAR = Radar(name="victim", array=AntennaArray(pattern=ISOTROPIC), noise_figure=1.0)
POWER = RADAR.transmit_power * RADAR.transmit_gain * RADAR.receive_gain


def detections(scene, family, *, radars=("victim",), victim=0):
    """Detections of the victim; every radar of one name draws the same ramps."""
    plans = [family.schedule(num_sweeps=4, streams=Streams(7).of(name)) for name in radars]
    snapshots = trace_frame(FreeSpace(), scene, plans, refresh_interval=1e-3)
    frame, _ = synthesize(
        Stretch(), scene, plans, snapshots, victim=victim, interferers=None, streams=Streams(1)
    )
    return CoherentReceiver().detect(frame)


def facing(distance, *, closing=0.0):
    """Two cars with a radar each at their origins, looking at each other."""
    cars = (
        Actor(name="a", kind="vehicle"),
        Actor(
            name="b",
            kind="vehicle",
            pose=Pose(x=distance, yaw=math.pi),
            velocity=(-closing, 0.0, 0.0),
        ),
    )
    other = replace(RADAR, name="other")
    return Scene(time=0.0, actors=cars, radars=(RADAR, other), carriers=(0, 1))


@pytest.mark.parametrize("family", [Triangular(), DiverseTriangular()])
def test_the_radar_equation_holds_through_the_whole_chain(family):
    """P = P_t G σ λ² / ((4π)³ R⁴), to 0.01 dB; range, rate and bearing as placed."""
    point = Actor(
        name="point",
        kind="object",
        pose=Pose(x=8.0, y=3.0),
        velocity=(4.0, 0.0, 0.0),
        points=(PointScatterer(position=(0.0, 0.0, 0.0), rcs=10.0),),
    )
    car = Actor(name="car", kind="vehicle")
    scene = Scene(time=0.0, actors=(car, point), radars=(RADAR,), carriers=(0,))
    found = detections(scene, family)
    x = 8.0 + 4.0 * found.time
    distance = math.hypot(x, 3.0)
    expected = POWER * 10.0 * WAVELENGTH**2 / ((4 * math.pi) ** 3 * distance**4)
    assert found.num_detections == 1
    assert 10 * math.log10(found.power[0] / expected) == pytest.approx(0.0, abs=0.01)
    assert found.range[0] == pytest.approx(distance, abs=1e-3)
    assert found.range_rate[0] == pytest.approx(4.0 * x / distance, abs=5e-3)
    assert found.azimuth[0] == pytest.approx(math.atan2(3.0, x), abs=2e-3)


def test_friis_holds_through_the_whole_chain():
    """P = P_t G (λ/4πd)², one way, and the twin in step appears at half its distance and speed."""
    found = detections(facing(13.2), Triangular(), radars=("same", "same"))
    expected = POWER * (WAVELENGTH / (4 * math.pi * 13.2)) ** 2
    assert found.num_detections == 1
    assert 10 * math.log10(found.power[0] / expected) == pytest.approx(0.0, abs=0.01)
    assert found.range[0] == pytest.approx(6.6, abs=1e-3)


def test_a_closing_twin_appears_at_half_its_speed():
    """A one-way delay is taken for a two-way one, at the instant to which detections refer.

    The twin's amplitude grows with 1/R, that of an echo with 1/R²: 0.9 % more or less at the ends
    of the frame, 87 dB above the noise. This leaves a weak second detection at the same place.
    """
    found = detections(facing(13.2, closing=19.0), Triangular(), radars=("same", "same"))
    assert found.range_rate[0] == pytest.approx(-9.5, abs=1e-3)
    assert found.range[0] == pytest.approx(6.6 - 9.5 * found.time, abs=1e-3)
    assert found.range[1:] == pytest.approx(found.range[0], abs=1e-3)
    assert np.all(found.power[1:] < 1e-3 * found.power[0])


def test_diverse_radars_see_no_twin():
    """Different ramps: the other's energy is spread over all ranges, and nothing is detected."""
    found = detections(facing(13.2), DiverseTriangular(), radars=("one", "two"))
    assert found.num_detections == 0


def test_diverse_radars_with_the_same_draws_do():
    """So it is the draws that separate them, not the family."""
    found = detections(facing(13.2), DiverseTriangular(), radars=("same", "same"))
    assert found.range == pytest.approx([6.6], abs=1e-3)


def test_a_reversed_pair_of_radars_sees_the_same_power():
    """Reciprocity from scene to detection."""
    first, second = (
        detections(facing(13.2), Triangular(), radars=("same", "same"), victim=v) for v in (0, 1)
    )
    assert 10 * np.log10(first.power[0] / second.power[0]) == pytest.approx(0.0, abs=0.002)
