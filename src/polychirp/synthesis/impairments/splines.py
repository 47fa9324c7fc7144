"""Compiled splines on a uniform grid, without SciPy's search and recursion at every place."""

from functools import lru_cache

import numpy as np

from polychirp.axes import FloatArray
from polychirp.jit import compiled


@lru_cache(maxsize=4)
def basis(degree: int) -> FloatArray:
    """Weights of the coefficients, ``(power, coefficient)``, in powers of the distance from a knot.

    >>> (5040 * basis(7)[0]).round().tolist()
    [1.0, 120.0, 1191.0, 2416.0, 1191.0, 120.0, 1.0, 0.0]
    """
    from scipy.interpolate import BSpline

    spline = BSpline.basis_element(np.arange(degree + 2.0), extrapolate=False)
    place = 0.5 - 0.5 * np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    values = spline(place[:, None] + np.arange(degree, -1.0, -1.0))
    return np.ascontiguousarray(np.linalg.solve(place[:, None] ** np.arange(degree + 1), values))


@compiled
def evaluate(
    out: FloatArray, place: FloatArray, coefficients: FloatArray, weight: FloatArray
) -> None:
    """Fill ``out`` with the spline's values at ``place``, which counts intervals from the first.

    Interval n uses the coefficients from n on; ``weight`` is that of `basis`. A place beyond an end
    gets the value at that end.
    """
    intervals = coefficients.size - weight.shape[1] + 1
    value = np.empty(weight.shape[1])
    for p in range(place.size):
        at = min(max(place[p], 0.0), float(intervals))
        n = min(int(at), intervals - 1)
        x = at - n
        for i in range(value.size):
            value[i] = weight[weight.shape[0] - 1, i]
        for power in range(weight.shape[0] - 2, -1, -1):
            for i in range(value.size):
                value[i] = value[i] * x + weight[power, i]
        total = 0.0
        for i in range(value.size):
            total += value[i] * coefficients[n + i]
        out[p] = total
