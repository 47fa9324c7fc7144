"""Compiled parts of bundles, against NumPy's."""

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from polychirp.synthesis.stretch.batch_kernels import _bend
from polychirp.synthesis.stretch.path_kernels import compiled


@compiled
def bent(out, term, factor):
    _bend(out, term, factor)


def test_a_second_derivative_is_that_of_numpy():
    random = np.random.default_rng(1)
    term = random.standard_normal((13, 5)) + 1j * random.standard_normal((13, 5))
    out = np.empty_like(term)
    bent(out, term, 0.5j)
    expected = np.vstack([0.5j * chebyshev.chebder(term, 2), np.zeros((2, 5))])
    assert out == pytest.approx(expected, rel=1e-12, abs=1e-9)
