"""The choice of a receiver by the ramps, and the receivers that a study file can name."""

from dataclasses import fields

import pytest

from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import AutoReceiver, receiver_for
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, FixedTriangular, Sawtooth, Triangular
from tests.support.schedules import drawn_chirps

CHIRPS = Sawtooth(bandwidth=1e9, ramp_duration=40e-6, idle=20e-6)


def ramps(waveform):
    return waveform.schedule(num_sweeps=8, streams=Streams(seed=1))


@pytest.mark.parametrize(
    "schedule",
    [
        ramps(Triangular()),
        ramps(DiverseTriangular()),
        ramps(FixedTriangular()),
        ramps(Triangular(bandwidth=1e9, ramp_duration=50e-6)),
        drawn_chirps(8, seed=1),
    ],
    ids=["equal", "diverse", "fixed", "short", "one direction"],
)
def test_other_ramps_have_the_coherent_receiver(schedule):
    assert isinstance(receiver_for(AutoReceiver(), schedule), CoherentReceiver)
    assert receiver_for(AutoReceiver(), schedule).dynamic_range == CoherentReceiver().dynamic_range


def test_equal_chirps_have_the_range_doppler_receiver():
    assert isinstance(receiver_for(AutoReceiver(), ramps(CHIRPS)), RangeDoppler)


@pytest.mark.parametrize("named", [CoherentReceiver(), RangeDoppler()])
def test_a_receiver_that_is_named_is_not_replaced(named):
    assert receiver_for(named, ramps(CHIRPS)) is named


@pytest.mark.parametrize("waveform", [Triangular(), CHIRPS])
def test_the_chosen_receiver_has_all_settings_that_it_knows(waveform):
    given = {
        "false_alarm_probability": 1e-5,
        "least_range": 1.5,
        "greatest_range": 45.0,
        "greatest_speed": 50.0,
        "dynamic_range": 1e5,
        "most_detections": 9,
        "angle": "capon",
    }
    chosen = receiver_for(AutoReceiver(**given), ramps(waveform))
    known = {field.name for field in fields(chosen)} & given.keys()
    assert {name: getattr(chosen, name) for name in known} == {k: given[k] for k in known}
    assert {"false_alarm_probability", "least_range", "greatest_range", "angle"} <= known


def test_a_clock_that_drifts_does_not_make_other_chirps():
    """10 ppm/s, the greatest drift of a study, changes 256 chirps of 60 µs by 1.5e-7."""
    chirps = CHIRPS.schedule(num_sweeps=256, streams=Streams(seed=1))
    drifting = chirps.as_clocked(start_time=0.0, clock_offset=1e-5, clock_drift=1e-5)
    assert isinstance(receiver_for(AutoReceiver(), drifting), RangeDoppler)
