"""Compiled splines on a uniform grid, against SciPy's."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from polychirp.synthesis.impairments.splines import basis, evaluate


@pytest.mark.parametrize("degree", [3, 7])
def test_compiled_splines_are_those_of_scipy_and_stay_what_they_are_beyond_their_ends(degree):
    random = np.random.default_rng(1)
    coefficients = random.standard_normal(40)
    spline = BSpline(np.arange(40.0 + degree + 1) - degree, coefficients, degree)
    last = 40 - degree
    place = np.array(
        [-2.0, 0.0, 0.25, 7.0, last - 1e-9, last, last + 3.0, *random.uniform(0.0, last, 50)]
    )
    out = np.empty(place.shape)
    evaluate(out, place, coefficients, basis(degree))
    assert out == pytest.approx(spline(np.clip(place, 0.0, last)), abs=1e-13)
