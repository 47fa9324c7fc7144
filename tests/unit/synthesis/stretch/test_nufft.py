"""Sums of tones, compiled and by blocks of any array library, against their definition."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.synthesis.stretch.nufft import (
    WINDOW_WIDTH,
    BlockTones,
    GriddedTones,
    grid_of,
    tones_of,
    window_at,
)

LIBRARIES = ["numpy", "array_api_strict", "cupy"]


def tones(random, count):
    """Three columns of tones all around the circle of frequencies, beyond it as well."""
    frequency = random.uniform(-1.5, 1.5, count)
    weight = random.normal(size=(count, 3)) + 1j * random.normal(size=(count, 3))
    return frequency, weight


def by_definition(frequency, weight, count):
    n = np.arange(count) - count // 2
    return np.exp(2j * np.pi * n[:, None] * frequency) @ weight


@pytest.mark.parametrize("count", [1, 2, 15, 64, 1501])
def test_a_gridded_sum_is_the_sum_of_its_tones(count):
    random = np.random.default_rng(count)
    gridded = GriddedTones(count, 3)
    expected = np.zeros((count, 3), dtype=complex)
    for _ in range(2):
        some = tones(random, 50)
        gridded.add(*some)
        expected += by_definition(*some, count)
    assert gridded.sums() == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("library", LIBRARIES)
@pytest.mark.parametrize("count", [1, 2, 15, 64, 1501])
def test_a_sum_by_blocks_is_the_sum_of_its_tones_in_any_array_library(count, library):
    xp = pytest.importorskip(library, exc_type=ImportError)
    random = np.random.default_rng(count)
    blocks = BlockTones(count, 3, xp)
    expected = np.zeros((count, 3), dtype=complex)
    for _ in range(2):
        some = tones(random, 50)
        blocks.add(*some)
        expected += by_definition(*some, count)
    assert blocks.sums() == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())


def test_blocks_hold_no_more_than_their_memory_allows(monkeypatch):
    """With room for a few numbers the paths are taken one by one, to the same sum."""
    monkeypatch.setattr("polychirp.synthesis.stretch.nufft.NUMBERS_PER_BLOCK", 1)
    random = np.random.default_rng(4)
    some = tones(random, 7)
    blocks = BlockTones(20, 3, np)
    blocks.add(*some)
    assert blocks.sums() == pytest.approx(by_definition(*some, 20), rel=1e-12)


def test_a_missing_library_is_named():
    try:
        import cupy  # noqa: F401
    except ImportError:
        with pytest.raises(InputError, match="needs CuPy"):
            tones_of("cupy")
    else:
        assert tones_of("cupy")(4, 1).count == 4


def test_the_window_about_a_place_is_kaiser_and_bessels():
    size, beta = grid_of(50, 2.0)
    place = np.array([-3.2, 0.0, 7.5, 41.999])
    first, window = window_at(place, beta)
    off = first[:, None] + np.arange(WINDOW_WIDTH) - place[:, None]
    expected = np.i0(
        beta * np.sqrt(np.maximum(1.0 - (2.0 * off / WINDOW_WIDTH) ** 2, 0.0))
    ) / np.i0(beta)
    assert size >= 100
    assert np.abs(off).max() <= 0.5 * WINDOW_WIDTH
    assert window == pytest.approx(expected, abs=1e-9)
