"""Baseband samples of schedules."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.model.ramp_code import RampCode
from polychirp.rng import Streams
from polychirp.waveform import Pmcw, Sawtooth, Triangular
from polychirp.waveform.playing import band_edges, played

TRIANGLES = Triangular(start_frequency=3.95e9, bandwidth=100e6, ramp_duration=50e-6, idle=10e-6)
PLAN = TRIANGLES.schedule(num_sweeps=2, streams=Streams(seed=1))


def test_the_frequency_of_samples_is_that_of_the_ramps():
    """A phase step within 1/520 µs gives the frequency in the middle between two samples."""
    signal = played(PLAN, sample_rate=520e6, centre_frequency=4e9)
    steps = np.angle(signal.samples[1:] * np.conj(signal.samples[:-1])) / (2 * np.pi) * 520e6
    middle = signal.time[:-1] + 0.5 / 520e6
    rising = (middle > 1e-6) & (middle < 49e-6)
    np.testing.assert_allclose(steps[rising], -50e6 + 2e12 * middle[rising], atol=1.0)
    falling = (middle > 51e-6) & (middle < 99e-6)
    np.testing.assert_allclose(steps[falling], 150e6 - 2e12 * middle[falling], atol=1.0)


def test_between_sweeps_nothing_is_played():
    signal = played(PLAN, sample_rate=130e6)
    silent = (signal.time >= 100e-6 - 1e-12) & (signal.time < 110e-6 - 1e-12)
    assert np.all(signal.samples[silent] == 0.0)
    np.testing.assert_allclose(np.abs(signal.samples[~silent]), 1.0, atol=1e-12)


def test_the_phase_does_not_jump_from_ramp_to_ramp():
    signal = played(PLAN, sample_rate=520e6)
    apex = round(50e-6 * 520e6)
    turns = np.angle(signal.samples[apex - 2 : apex + 3])
    steps = np.diff(np.unwrap(turns)) / (2 * np.pi) * 520e6
    np.testing.assert_allclose(steps, 50e6, atol=10e3)


def test_a_carrier_not_given_is_the_middle_of_the_band():
    assert band_edges(PLAN) == pytest.approx((3.95e9, 4.05e9))
    assert played(PLAN, sample_rate=130e6).centre_frequency == pytest.approx(4e9)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"sample_rate": 90e6}, "needs 100 MS/s, not 90; raise the sample rate or narrow"),
        ({"sample_rate": 130e6, "centre_frequency": 3.75e9}, "needs 600 MS/s, not 130"),
    ],
)
def test_a_band_that_does_not_fit_is_refused(options, sentence):
    with pytest.raises(InputError, match=sentence):
        played(PLAN, **options)


def test_too_many_samples_are_refused_before_they_are_made():
    plan = Sawtooth(ramp_duration=1.0).schedule(num_sweeps=1, streams=Streams(seed=1))
    with pytest.raises(
        InputError, match="are 1e\\+09 samples, more than 2e\\+08; play fewer sweeps"
    ):
        played(plan, sample_rate=1e9)


def test_chips_multiply_the_ramp():
    """Chips of 0.5 µs are 65 samples: each has its own sign, on a ramp whose samples are known."""
    code = RampCode(value=[[1, -1, 1j]], row=np.zeros(4), chip_duration=np.full(4, 0.5e-6))
    plain, coded = (
        played(plan, sample_rate=130e6, centre_frequency=4e9)
        for plan in (PLAN, replace(PLAN, code=code))
    )
    ratio = coded.samples[:6500] / plain.samples[:6500]
    chip = np.arange(6500) // 65 % 3
    np.testing.assert_allclose(ratio, np.array([1, -1, 1j])[chip], atol=1e-12)


def test_a_carriers_band_is_that_of_its_chips():
    plan = Pmcw(carrier=79e9, order=7, chip_duration=2e-9).schedule(
        num_sweeps=1, streams=Streams(1)
    )
    low, high = band_edges(plan)
    assert 0.5 * (low + high) == pytest.approx(79e9)
    assert high - low == pytest.approx(plan.code.bandwidth)
    with pytest.raises(InputError, match="raise the sample rate"):
        played(plan, sample_rate=100e6)
