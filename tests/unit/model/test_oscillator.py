"""Phase noise by its table, and ramps that are not straight."""

import tomllib

import numpy as np
import pytest

from polychirp.config.dump import dump
from polychirp.config.load import build
from polychirp.errors import InputError
from polychirp.model.oscillator import Oscillator, PhaseNoise, QuadraticError, SinusoidalError
from polychirp.study.spec import StudyRadar
from polychirp.units import from_db, to_db
from polychirp.waveform import Sawtooth


def test_between_its_entries_a_level_falls_by_decades():
    """Two entries a decade and 20 dB apart make a straight line of −20 dB per decade."""
    noise = PhaseNoise(offset=(1e6, 1e7), level=(from_db(-90.0), from_db(-110.0)))
    level = to_db(noise.density(np.array([1e6, -2e6, 5e6])))
    assert level == pytest.approx([-90.0, -90.0 - 20 * np.log10(2), -90.0 - 20 * np.log10(5)])


def test_there_is_no_noise_below_the_table_and_a_floor_above_it():
    noise = PhaseNoise(offset=(1e4, 1e6), level=(1e-8, 1e-10))
    assert noise.density(np.array([0.0, 9.9e3])).tolist() == [0.0, 0.0]
    assert noise.density(np.array([1e6, 1e9])) == pytest.approx([1e-10, 1e-10])


@pytest.mark.parametrize(
    ("table", "what"),
    [
        ({"offset": (1e4,), "level": (1e-8, 1e-9)}, "1 offsets and 2 levels"),
        ({"offset": (), "level": ()}, "one level or more"),
        ({"offset": (1e5, 1e4), "level": (1e-8, 1e-9)}, "must be positive and grow"),
        ({"offset": (0.0, 1e4), "level": (1e-8, 1e-9)}, "positive"),
        ({"offset": (1e4,), "level": (0.0,)}, "above zero"),
    ],
)
def test_a_table_that_is_none_is_refused(table, what):
    with pytest.raises(InputError, match=what):
        PhaseNoise(**table)


@pytest.mark.parametrize(
    ("error", "frequency"),
    [
        (SinusoidalError(peak=3e4, cycles=2.5), lambda x: 3e4 * np.sin(5 * np.pi * x)),
        (QuadraticError(peak=-2e4), lambda x: -8e4 * x * (1 - x)),
    ],
)
def test_the_phase_of_a_ramp_error_is_the_integral_of_its_frequency(error, frequency):
    x = np.linspace(0.0, 1.0, 2001)
    steps = 0.5 * np.diff(x) * (frequency(x)[1:] + frequency(x)[:-1])
    # the trapezoid's own error is h²/12 of the change of slope
    assert error.phase(x[1:]) == pytest.approx(np.cumsum(steps), abs=1e-6 * abs(error.peak))
    assert error.phase(np.zeros(1))[0] == 0.0


def test_an_error_without_cycles_is_refused():
    with pytest.raises(InputError, match="cycles"):
        SinusoidalError(peak=1e4, cycles=0.0)


def test_an_oscillator_that_errs_is_not_ideal():
    assert Oscillator().is_ideal
    assert not Oscillator(phase_noise=PhaseNoise()).is_ideal
    assert not Oscillator(ramp_error=QuadraticError(peak=1e3)).is_ideal


@pytest.mark.parametrize(
    "oscillator",
    [
        Oscillator(),
        Oscillator(phase_noise=PhaseNoise()),
        Oscillator(phase_noise=PhaseNoise(offset=(1e5, 2e6), level=(from_db(-80), from_db(-97)))),
        Oscillator(ramp_error=SinusoidalError(peak=50e3, cycles=3.0)),
        Oscillator(ramp_error=QuadraticError(peak=-20e3)),
    ],
)
def test_an_oscillator_reads_back_as_itself(oscillator):
    radar = StudyRadar(
        name="a",
        vehicle="car",
        waveform=Sawtooth(),
        oscillator=oscillator,
        clock_drift=0.5e-6,
        start_jitter=2e-9,
    )
    assert build(StudyRadar, tomllib.loads(dump(radar))) == radar
