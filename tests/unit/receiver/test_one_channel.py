"""A radar with one receiving channel finds range and range rate, and knows no azimuth."""

import numpy as np
import pytest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.frames import Pose
from polychirp.model.antenna import AntennaArray
from polychirp.model.detection import Detections
from polychirp.receiver.clustering import Body, merged
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.study.check import check
from polychirp.study.spec import Study, StudyRadar
from polychirp.study.trial import run_trial
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.waveform import Triangular


@pytest.mark.parametrize("angle", ["root-music", "bartlett", "capon"])
def test_a_point_is_found_without_its_azimuth(angle):
    """The radar stands at x = 2.4 m, the point at (12 m, 1 m) at the same height."""
    study = Study(
        name="one-channel",
        num_sweeps=2,
        tracer=FreeSpace(),
        refresh_interval=5e-3,
        street=Street(
            vehicles=(Vehicle(name="ego", x=0.0, y=0.0, max_edge=0.3, coarseness=6.0),),
            points=(Point(name="post", x=12.0, y=1.0, z=0.5, rcs=10.0),),
        ),
        radars=(
            StudyRadar(
                name="front",
                vehicle="ego",
                waveform=Triangular(bandwidth=5e8, ramp_duration=5e-4),
                mount=Pose(x=2.4, z=0.5),
                array=AntennaArray(num_channels=1),
            ),
        ),
        targets=("post",),
        receiver=CoherentReceiver(angle=angle, greatest_range=15.0, greatest_speed=20.0),
    )
    check(study)
    victim = run_trial(study).victim("front")
    assert victim.score.is_detected.tolist() == [True]
    assert victim.detections.range[0] == pytest.approx(np.hypot(9.6, 1.0), abs=1e-3)
    assert np.isnan(victim.detections.azimuth[0])
    assert np.isnan(victim.score.azimuth_error[0])


@pytest.mark.parametrize("place", ["nearest", "strongest", "mean"])
def test_points_without_azimuth_are_grouped_by_range(place):
    found = Detections(
        time=0.0,
        range=[10.0, 20.0, 11.5],
        range_rate=[-5.0, 3.0, -5.2],
        azimuth=[np.nan] * 3,
        power=[3.0, 2.0, 1.0],
        snr=[9.0, 8.0, 7.0],
    )
    one = merged(found, Body(place=place))
    assert one.power.tolist() == [4.0, 2.0]
    assert np.all((one.range >= 10.0) & (one.range <= 20.0))
    assert np.all(np.isnan(one.azimuth))
