"""Compiled parts of batches of links, against NumPy's."""

import numpy as np
import pytest
from numba import njit
from numpy.polynomial import chebyshev

from polychirp.synthesis.stretch.batch_kernels import second_derivative


@njit  # not cached: a cache would not see that the inner kernel changes
def compiled_derivative(out, term, factor):
    second_derivative(out, term, factor)


def test_a_second_derivative_is_that_of_numpy():
    random = np.random.default_rng(1)
    term = random.standard_normal((13, 5)) + 1j * random.standard_normal((13, 5))
    out = np.empty_like(term)
    compiled_derivative(out, term, 0.5j)
    expected = np.vstack([0.5j * chebyshev.chebder(term, 2), np.zeros((2, 5))])
    assert out == pytest.approx(expected, rel=1e-12, abs=1e-9)
