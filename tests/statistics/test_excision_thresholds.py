"""Thresholds over the median of overlapping slices against drawn rows of noise."""

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.special import gammaincc, gammainccinv

from polychirp.receiver.mitigation.row_median import median_factors
from polychirp.receiver.mitigation.stft_excision import HOPS_PER_WINDOW, hann_transform

DRAWS = 3000


def shared(slices):
    """Correlation of slices that are 0, 1, … hops apart: what their windows share."""
    window = hann_transform(64).win
    hop = window.size // HOPS_PER_WINDOW
    out = np.zeros(slices)
    for lag in range(min(slices, HOPS_PER_WINDOW)):
        out[lag] = np.sum(window[lag * hop :] * window[: window.size - lag * hop])
    return out / out[0]


def exceeded(factor, *, slices, looks, place):
    """Probability that the cell at a place of a row of noise exceeds a multiple of the median.

    For drawn other parts of the row it is the tail of the cell's own Gamma distribution beyond the
    power t² at which it does, so that 1e-5 needs no millions of draws. The cells are complex normal
    with the correlation ρ: the others are ρ z + e, with the cell's z along the first look and with
    e independent of it.
    """
    draw = np.random.default_rng(12)
    near = shared(slices)
    root = np.linalg.cholesky(toeplitz(near) + 1e-9 * np.eye(slices))
    white = draw.normal(size=(2, DRAWS, looks, slices)) * np.sqrt(0.5)
    row = (white[0] + 1j * white[1]) @ root.T
    own = near[np.abs(np.arange(slices) - place)]
    rest = row - row[..., [place]] * own
    level = np.sqrt(gammainccinv(looks, np.geomspace(0.5, 1e-9, 50)))
    over = np.empty((DRAWS, level.size))
    for column, t in enumerate(level):
        power = np.abs(own * t + rest[:, 0]) ** 2 + np.sum(np.abs(rest[:, 1:]) ** 2, axis=1)
        over[:, column] = 2.0 * np.log(t) - np.log(np.median(power, axis=1))
    over = np.maximum.accumulate(over, axis=1)
    tail = np.log(gammaincc(looks, level**2))
    found = [np.interp(np.log(factor), one, tail, right=-np.inf) for one in over]
    return float(np.mean(np.exp(found)))


@pytest.mark.parametrize("probability", [1e-3, 1e-5])
@pytest.mark.parametrize(("slices", "looks"), [(33, 4), (89, 4), (89, 1)])
def test_drawn_rows_exceed_the_threshold_as_often_as_stated(slices, looks, probability):
    """At the end of a row, where a cell has neighbours on one side alone, and in its middle."""
    factor = median_factors(slices, np.array([float(looks)]), probability=probability)[0]
    for place in (0, slices // 2):
        found = exceeded(factor[place], slices=slices, looks=looks, place=place)
        assert 0.7 < found / probability < 1.3


def test_a_row_of_many_slices_has_the_threshold_of_a_known_median():
    """Of four looks: the tail's quantile over the median of the Gamma distribution."""
    known = gammainccinv(4.0, 1e-6) / gammainccinv(4.0, 0.5)
    many = median_factors(20_000, np.array([4.0]), probability=1e-6)
    assert many[0, 10_000] == pytest.approx(known, rel=2e-3)
