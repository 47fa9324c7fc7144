"""A whole trial of a radar with two transmitting elements, on points."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.errors import CapabilityError
from polychirp.model.antenna import AntennaArray, ArrayErrors
from polychirp.model.if_frame import PARTS
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.study.spec import Study, StudyRadar
from polychirp.study.trial import run_trial
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.waveform import DiverseTriangular, PhaseCoded, TimeDivision, Triangular

RADAR = StudyRadar(
    name="front",
    vehicle="car",
    waveform=Triangular(bandwidth=300e6, ramp_duration=0.5e-3),
    array=AntennaArray(num_transmitters=2),
    coding=TimeDivision(),
)


def study(speed=0.0, **fields):
    street = Street(
        vehicles=(Vehicle(name="car", x=0.0, y=0.0),),
        points=(Point(name="post", x=10.0, y=3.0, z=0.5, rcs=10.0, velocity=(speed, 0.0, 0.0)),),
    )
    return Study(
        name="mimo",
        street=street,
        num_sweeps=8,
        radars=(replace(RADAR, **fields),),
        targets=("post",),
        tracer=FreeSpace(),
        refresh_interval=1.0,
    )


@pytest.mark.parametrize("coding", [TimeDivision(), PhaseCoded()], ids=repr)
@pytest.mark.parametrize("speed", [0.0, 7.1])
def test_a_coded_radar_finds_a_point_where_it_is(coding, speed):
    """At 7.1 m/s its phase turns by 3.7 cycles from triangle to triangle."""
    trial = run_trial(study(speed, coding=coding))
    (victim,) = trial.victims
    assert victim.frame.array.num_channels == 8
    total = sum(victim.parts[part] for part in PARTS)
    assert np.abs(total - victim.frame.samples).max() <= 1e-12 * np.abs(total).max()
    assert victim.score.is_detected.tolist() == [True]
    assert victim.score.azimuth_error[0] == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize("speed", np.random.default_rng(3).uniform(1.0, 12.0, 4))
def test_side_lobes_of_a_moving_point_are_no_noise_from_its_direction(speed):
    """On eight ramps they fill the map, and the decoded channels differ from those of one wave."""
    (victim,) = run_trial(replace(study(float(speed)), receiver=CoherentReceiver())).victims
    assert victim.score.is_detected.tolist() == [True]
    assert victim.score.range_rate_error[0] == pytest.approx(0.0, abs=0.01)


def test_errors_of_the_array_are_drawn_for_the_scene_and_shift_the_bearing():
    trial = run_trial(study(array_errors=ArrayErrors(phase=0.2)))
    (victim,) = trial.victims
    assert np.any(trial.scene.radars[0].array.channel_phases)
    assert 2e-3 < abs(victim.score.azimuth_error[0]) < 0.2


def test_a_code_that_cannot_be_told_apart_is_refused_before_the_work():
    with pytest.raises(CapabilityError, match="whose sweeps are equal"):
        run_trial(study(waveform=DiverseTriangular()))
