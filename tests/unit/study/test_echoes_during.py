"""The echoes of the whole frame explain detections, moved to the time of these."""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.paths import Bounce
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.study.trial import ECHO_INSTANTS, echoes_during
from polychirp.testing.paths import HandPath, paths_of
from polychirp.waveform import Triangular

SCENE = Scene(
    time=0.0,
    actors=(Actor(name="car", kind="vehicle"),),
    radars=(Radar(name="front"),),
    carriers=(0,),
)
RAMPS = Triangular().schedule(num_sweeps=16, streams=Streams(3))


def snapshots(times, rate=10.0):
    """One echo at each time, of a body that is 20 m away at time 0 and recedes."""
    return [
        paths_of(
            HandPath(
                delay=2 * (20.0 + rate * time) / SPEED_OF_LIGHT,
                delay_rate=2 * rate / SPEED_OF_LIGHT,
                gain=1e-6,
                bounces=(Bounce.SCATTERING,),
            ),
            reference_time=float(time),
        )
        for time in times
    ]


def test_every_instant_of_the_frame_counts_with_its_share_of_the_power():
    end = float(RAMPS.end_time[-1])
    times = np.linspace(0.1, 0.9, 5) * end
    found = echoes_during(RAMPS, 0.5 * end, SCENE, snapshots(times), victim=0)
    assert found.range == pytest.approx(np.full(5, 20.0 + 10.0 * 0.5 * end), rel=1e-12)
    one = echoes_during(RAMPS, 0.5 * end, SCENE, snapshots(times[:1]), victim=0)
    assert found.power.sum() == pytest.approx(one.power.sum())


def test_instants_outside_of_the_frame_do_not_count():
    end = float(RAMPS.end_time[-1])
    times = np.array([-1e-3, 0.2 * end, 0.8 * end, end + 1e-3])
    assert echoes_during(RAMPS, 0.0, SCENE, snapshots(times), victim=0).range.size == 2


def test_the_nearest_instant_counts_if_none_is_in_the_frame():
    times = np.array([-3e-3, -1e-3])
    found = echoes_during(RAMPS, 0.0, SCENE, snapshots(times), victim=0)
    assert found.range == pytest.approx([20.0], rel=1e-12)


def test_many_instants_are_thinned_out_evenly():
    end = float(RAMPS.end_time[-1])
    times = np.linspace(0.0, end, 100)
    found = echoes_during(RAMPS, 0.0, SCENE, snapshots(times, rate=0.0), victim=0)
    assert found.range.size == ECHO_INSTANTS
