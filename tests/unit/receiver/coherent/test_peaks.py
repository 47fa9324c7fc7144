"""Peaks of a map and the means of windows around cells, against slow loops."""

from types import SimpleNamespace

import numpy as np
import pytest

from polychirp.receiver.coherent.noise import medians
from polychirp.receiver.coherent.peaks import (
    WINDOW,
    _interpolated,
    _maxima,
    _means,
    _near_means,
    floors,
)


def drawn(shape, seed=1):
    return np.random.default_rng(seed).exponential(size=shape).astype(np.float32)


@pytest.mark.parametrize("shape", [(5, 3), (40, 30), (130, 9), (301, 20)])
def test_means_of_windows_hold_what_lies_inside_the_map(shape):
    """Every other row counts, from the cell's own row on; the cells come in any order."""
    power = drawn(shape)
    cell = np.random.default_rng(2).integers(0, shape, size=(60, 2))
    high, wide = WINDOW[0] // 2, WINDOW[1] // 2
    slow = []
    for i, j in cell:
        rows = [p for p in range(i - high, i + high + 1) if (p - i) % 2 == 0 and 0 <= p < shape[0]]
        slow.append(power[rows, max(0, j - wide) : j + wide + 1].mean(dtype=np.float64))
    assert _means(power, cell, *WINDOW) == pytest.approx(np.array(slow), rel=1e-6)
    assert _near_means(power, cell, *WINDOW) == pytest.approx(np.array(slow), rel=1e-6)


def test_floors_are_the_greatest_of_a_range_a_range_rate_and_what_is_around():
    """Row 20 is a ridge of bursts, and column 30 a range with more noise; elsewhere there is 1 W.

    Points were held to the ridge only when they were found, and not when they were fitted: in half
    of the frames of a radar beside one of equal slopes, peaks of ridges stayed as detections.
    """
    seen = SimpleNamespace(
        power=np.full((80, 60), 0.5, dtype=np.float32),
        range_floor=np.where(np.arange(60) == 30, 4.0, 1.0),
        rate_floor=np.where(np.arange(80) == 20, 9.0, 0.0),
        num_channels=1,
    )
    seen.power[:, 40:] = 25.0
    cell = np.array([[5, 5], [5, 30], [20, 5], [20, 30], [70, 50]])
    assert floors(seen, cell) == pytest.approx([1.0, 4.0, 9.0, 9.0, 25.0])


def test_maxima_exceed_the_least_value_and_their_neighbours():
    power, least = drawn((50, 40)), np.linspace(0.5, 2.0, 40).astype(np.float32)
    slow = [
        (i, j)
        for i, j in np.ndindex(power.shape)
        if power[i, j] > least[j]
        and power[i, j] == power[max(0, i - 1) : i + 2, max(0, j - 1) : j + 2].max()
    ]
    assert _maxima(power, least).tolist() == [list(cell) for cell in slow]


def test_a_maximum_of_a_gaussian_lobe_is_interpolated_exactly():
    """The logarithm of a Gaussian lobe is a parabola."""
    row, column = np.arange(9)[:, None] - 4.2, np.arange(7) - 2.7
    power = np.exp(-0.3 * row**2 - 0.4 * column**2).astype(np.float32)
    cell = _maxima(power, np.full(7, 0.5, dtype=np.float32))
    assert cell.tolist() == [[4, 3]]
    place, value = _interpolated(power, cell)
    assert place[0] == pytest.approx([0.2, -0.3], abs=1e-5)
    assert value[0] == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("size", [1, 2, 7, 8, 101])
def test_medians_are_those_of_numpy(size):
    value = drawn((5, 4, size), seed=size)
    assert medians(value) == pytest.approx(np.median(value, axis=-1))
    assert medians(value).dtype == np.float32
