"""What every waveform family keeps to; a new family is one line in `FAMILIES`."""

from typing import get_args

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.ramp import continuous_phase
from polychirp.rng import Streams
from polychirp.testing.conformance import check_waveform
from polychirp.waveform import (
    AnyWaveform,
    DiverseSawtooth,
    DiverseTriangular,
    FixedTriangular,
    Hopping,
    Mfsk,
    Noise,
    PermutedChirps,
    PhaseCodedRamp,
    PhaseCodedSawtooth,
    Pmcw,
    Sawtooth,
    SlopeSequence,
    Subframes,
    Triangular,
    Waveform,
)

FAMILIES = [
    Sawtooth(),
    Sawtooth(direction="down", idle=1e-4),
    Subframes(ramps_per_subframe=4),
    Subframes(intervals=(30e-6, 37e-6), ramps_per_subframe=3, direction="down"),
    Triangular(),
    Triangular(order="down-first", idle=1e-4),
    DiverseTriangular(),
    DiverseTriangular(start_frequency_spread=50e6, random_order=True, idle=1e-4),
    FixedTriangular(),
    FixedTriangular(order="down-first", idle=1e-4),
    DiverseSawtooth(),
    DiverseSawtooth(start_frequency_spread=1e8, idle=(0.0, 1e-6), direction="down"),
    DiverseSawtooth(every="frame", start_frequency_spread=1e8),
    Hopping(),
    Hopping(every="frame", channels=(76e9, 76.1e9), direction="down"),
    PhaseCodedSawtooth(),
    PhaseCodedSawtooth(num_phases=4, direction="down"),
    PermutedChirps(),
    PermutedChirps(num_pieces=3, jump=1e-6),
    SlopeSequence(),
    SlopeSequence(slopes=(1e12, -5e11, 3e11), idle=1e-5),
    PhaseCodedRamp(),
    PhaseCodedRamp(num_chips=16, chip_duration=1e-6, direction="down"),
    Pmcw(),
    Pmcw(code="gold", order=7, periods=2),
    Pmcw(code="almost-perfect", order=6, idle=0.0),
    Noise(num_chips=64),
    Mfsk(),
    Mfsk(num_steps=16, shift=2e8, idle=1e-6),
]
DRAWN = [family for family in FAMILIES if "Diverse" in repr(family) or "Fixed" in repr(family)]
CODED = (PhaseCodedSawtooth,)
"""Families whose start phases hold a code."""

FIELDS = ("start_time", "duration", "start_frequency", "slope", "start_phase", "sweep")


def arrays(waveform: Waveform, *, num_sweeps: int = 16, seed: int = 1, radar: str = "front"):
    schedule = waveform.schedule(num_sweeps=num_sweeps, streams=Streams(seed).of(radar))
    return {name: np.asarray(getattr(schedule, name)) for name in FIELDS}


@pytest.fixture(params=FAMILIES, ids=repr)
def waveform(request: pytest.FixtureRequest) -> Waveform:
    return request.param


def test_every_family_of_a_study_keeps_to_this():
    union, _ = get_args(AnyWaveform)
    assert {type(family) for family in FAMILIES} == set(get_args(union))


def test_a_family_keeps_the_laws_that_plug_ins_keep(waveform):
    assert isinstance(waveform, Waveform)
    check_waveform(waveform)


def test_ramps_follow_each_other_without_overlap(waveform):
    ramps = arrays(waveform, num_sweeps=50)
    gap = ramps["start_time"][1:] - (ramps["start_time"] + ramps["duration"])[:-1]
    assert ramps["start_time"][0] == 0.0
    assert np.all(gap > -1e-15)


def test_sweeps_are_counted_from_zero_without_a_hole(waveform):
    assert set(arrays(waveform, num_sweeps=7)["sweep"]) == set(range(7))
    assert np.all(np.diff(arrays(waveform, num_sweeps=7)["sweep"]) >= 0)


def test_the_phase_never_jumps_between_ramps(waveform):
    if isinstance(waveform, CODED):
        pytest.skip("its start phases hold a code")
    ramps = arrays(waveform)
    expected = continuous_phase(
        duration=ramps["duration"],
        start_frequency=ramps["start_frequency"],
        slope=ramps["slope"],
    )
    np.testing.assert_array_equal(ramps["start_phase"], expected)


def test_the_same_seed_gives_the_same_ramps(waveform):
    for name, values in arrays(waveform).items():
        np.testing.assert_array_equal(values, arrays(waveform)[name])


def test_a_longer_schedule_begins_with_the_shorter_one(waveform):
    short, long = arrays(waveform, num_sweeps=5), arrays(waveform, num_sweeps=16)
    for name, values in short.items():
        np.testing.assert_array_equal(values, long[name][: values.size])


def test_a_schedule_without_sweeps_is_refused(waveform):
    with pytest.raises(InputError, match="num_sweeps is 0; a schedule needs 1 or more"):
        waveform.schedule(num_sweeps=0, streams=Streams(1))


@pytest.mark.parametrize("waveform", DRAWN, ids=repr)
def test_different_radars_draw_different_slopes(waveform):
    mine, other = arrays(waveform, radar="front"), arrays(waveform, radar="rear")
    assert not np.intersect1d(mine["slope"], other["slope"]).size


@pytest.mark.parametrize("waveform", DRAWN, ids=repr)
def test_another_seed_draws_different_slopes(waveform):
    assert not np.intersect1d(
        arrays(waveform, seed=1)["slope"], arrays(waveform, seed=2)["slope"]
    ).size
