"""The wavelet's filter bank and threshold against other derivations."""

from math import comb

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.receiver.mitigation.wavelet import (
    HIGH_PASS,
    LOW_PASS,
    joined,
    split,
    stein_risk,
    stein_threshold,
)

MOMENTS = LOW_PASS.size // 2


def factorized_filter():
    """The minimum-phase root of Daubechies' polynomial, as her book derives it."""
    # y = (2 - z - 1/z) / 4, times z: zeros of sum of C(N-1+k, k) y^k, in pairs z and 1/z
    zeros = np.roots([comb(MOMENTS - 1 + k, k) for k in range(MOMENTS)][::-1])
    inside = []
    for y in zeros:
        pair = np.roots([1.0, 4.0 * y - 2.0, 1.0])
        inside.append(pair[np.argmin(np.abs(pair))])
    taps = np.real(np.poly([*inside, *[-1.0] * MOMENTS]))
    return taps * np.sqrt(2.0) / taps.sum()


def test_the_filter_is_the_spectral_factor_of_daubechies_polynomial():
    assert pytest.approx(factorized_filter(), abs=1e-11) == LOW_PASS


def test_filters_are_orthonormal_and_the_high_pass_has_four_vanishing_moments():
    for shift in range(0, LOW_PASS.size, 2):
        end = LOW_PASS.size - shift
        assert LOW_PASS[shift:] @ LOW_PASS[:end] == pytest.approx(float(shift == 0), abs=1e-11)
        assert HIGH_PASS[shift:] @ LOW_PASS[:end] == pytest.approx(0.0, abs=1e-11)
    for power in range(MOMENTS):
        moment = HIGH_PASS @ np.arange(HIGH_PASS.size, dtype=float) ** power
        assert moment == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("levels", [1, 2, 4])
@pytest.mark.parametrize("count", [16, 64, 272])
def test_bands_join_to_the_samples_and_keep_their_power(levels, count):
    draw = np.random.default_rng(1)
    samples = draw.normal(size=(3, count)) + 1j * draw.normal(size=(3, count))
    bands = split(samples, levels)
    assert np.abs(joined(bands) - samples).max() < 1e-10
    power = sum(np.sum(np.abs(band) ** 2) for band in bands)
    assert power == pytest.approx(np.sum(np.abs(samples) ** 2), rel=1e-11)


def test_a_length_that_cannot_be_halved_is_refused():
    with pytest.raises(InputError, match="halved 4 times"):
        split(np.ones(24, dtype=complex), 4)


@pytest.mark.parametrize("parts", [1, 2])
@pytest.mark.parametrize("threshold", [0.5, 1.5, 3.0])
def test_steins_estimate_is_the_mean_squared_error_of_shrinking(parts, threshold):
    """Of known coefficients with drawn noise; the mean of 1600 draws of 1000."""
    draw = np.random.default_rng(2)
    mean = np.zeros((1000, parts))
    mean[:50, 0] = 6.0
    estimates, errors = [], []
    for _ in range(1600):
        drawn = mean + draw.normal(size=mean.shape)
        level = np.sqrt(np.sum(drawn**2, axis=1))
        shrunk = drawn * np.maximum(1.0 - threshold / level, 0.0)[:, None]
        errors.append(np.sum((shrunk - mean) ** 2))
        estimates.append(stein_risk(level, np.array([threshold]), parts=parts)[0])
    difference = np.array(estimates) - np.array(errors)
    spread = difference.std() / np.sqrt(difference.size)
    assert abs(difference.mean()) < 4.0 * spread
    assert spread < 0.01 * np.mean(errors)


def test_noise_alone_has_the_universal_threshold_and_dense_bursts_a_lower_one():
    draw = np.random.default_rng(3)
    noise = np.abs(draw.normal(size=1024))
    assert stein_threshold(noise, parts=1) == pytest.approx(np.sqrt(2.0 * np.log(1024)))
    noise[:200] += 10.0
    assert stein_threshold(noise, parts=1) < 3.0
