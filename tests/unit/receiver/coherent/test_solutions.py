"""Small matrices in kernels, against numpy."""

import numpy as np
import pytest
from numba import njit

from polychirp.receiver.coherent.solutions import inverse_into, product_of


@njit  # not cached: a cache would not see that the inner kernel changes
def inverse_of(matrix, share):
    out = np.empty_like(matrix)
    inverse_into(matrix, share, out)
    return out


@njit
def times(first, second):
    return product_of(first, second)


def drawn(rows, columns, seed):
    draw = np.random.default_rng(seed)
    return draw.normal(size=(rows, columns)) + 1j * draw.normal(size=(rows, columns))


@pytest.mark.parametrize("size", [1, 2, 5, 32])
def test_an_inverse_times_its_matrix_is_one(size):
    """The diagonal spans twelve orders of magnitude, as range and azimuth rate do."""
    root = drawn(size, 2 * size, size) * np.logspace(-6, 6, size)[:, None]
    matrix = root @ root.conj().T
    scale = np.sqrt(np.diagonal(matrix).real)
    unit = (matrix @ inverse_of(matrix.copy(), 0.0)) / np.outer(scale, 1.0 / scale)
    assert unit == pytest.approx(np.eye(size), abs=1e-9)


def test_a_share_bounds_the_inverse_of_equal_rows():
    inverse = inverse_of(np.ones((2, 2), dtype=np.complex128), 1e-6)
    assert np.isfinite(inverse).all()
    assert inverse.sum() == pytest.approx(1.0, rel=1e-3)


def test_products_are_those_of_numpy():
    first, second = drawn(3, 5, 1), drawn(5, 2, 2)
    assert times(first, second) == pytest.approx(first @ second)
