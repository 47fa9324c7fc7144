"""Radars of a study: number and start of their sweeps."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.study.spec import Study, StudyRadar, schedules_of
from polychirp.traffic.street import Street, Vehicle
from polychirp.waveform import Sawtooth

VICTIM = StudyRadar(
    name="front", vehicle="ego", waveform=Sawtooth(bandwidth=150e6, ramp_duration=5e-6, idle=0.0)
)
OTHER = replace(
    VICTIM,
    name="other",
    waveform=Sawtooth(bandwidth=187e6, ramp_duration=3e-6, idle=0.0),
    num_sweeps=20,
    start_time=-9e-6,
    start_spread=9e-6,
)
STUDY = Study(
    name="two",
    num_sweeps=10,
    street=Street(vehicles=(Vehicle(name="ego", x=0.0, y=0.0),)),
    radars=(VICTIM, OTHER),
)


def test_an_interferer_with_sweeps_of_its_own_covers_the_victims_frame():
    """20 sweeps of 3 µs that start up to 9 µs before ten of 5 µs end after them."""
    for seed in range(20):
        own, other = schedules_of(replace(STUDY, seed=seed))
        assert (own.num_ramps, other.num_ramps) == (10, 20)
        assert other.start_time[0] <= own.start_time[0]
        assert other.end_time[-1] >= own.end_time[-1]


def test_a_spread_start_is_drawn_uniformly_and_by_name():
    """200 seeds: mean and variance of a uniform variable, within three standard errors."""
    starts = np.array(
        [schedules_of(replace(STUDY, seed=seed))[1].start_time[0] for seed in range(200)]
    )
    late = (starts + 9e-6) / 9e-6
    assert np.all((late >= 0.0) & (late <= 1.0))
    assert abs(late.mean() - 0.5) < 3 * np.sqrt(1 / 12 / 200)
    assert late.var() == pytest.approx(1 / 12, abs=3 * np.sqrt(1 / 180 / 200))
    alone = replace(STUDY, radars=(OTHER,), seed=7)
    assert schedules_of(alone)[0].start_time[0] == starts[7]


def test_a_spread_clock_is_drawn_about_its_offset():
    """A clock that is fast by ε starts its sweeps every 3 µs / (1 + ε)."""
    clocked = replace(OTHER, clock_offset=2e-4, clock_spread=1e-4)
    intervals = np.array(
        [
            np.diff(schedules_of(replace(STUDY, radars=(clocked,), seed=seed))[0].start_time)[0]
            for seed in range(200)
        ]
    )
    drawn = (3e-6 / intervals - 1.0 - 2e-4) / 1e-4
    assert np.all(np.abs(drawn) <= 1.0)
    assert abs(drawn.mean()) < 3 * np.sqrt(1 / 3 / 200)
    assert drawn.var() == pytest.approx(1 / 3, abs=3 * np.sqrt(4 / 45 / 200))


@pytest.mark.parametrize(
    "change",
    [{"num_sweeps": 0}, {"start_spread": -1e-6}, {"clock_spread": -1e-6}, {"clock_spread": 0.01}],
)
def test_a_radar_without_sweeps_or_with_a_negative_spread_is_refused(change):
    with pytest.raises(InputError, match="front"):
        replace(VICTIM, **change)
