"""Compiled part of `nufft`: tones spread over the points of a grid."""

import math

import numpy as np

from polychirp.axes import FloatArray
from polychirp.jit import compiled


@compiled
def spread(grid: FloatArray, frequency: FloatArray, weight: FloatArray, window: FloatArray) -> None:
    """Spread every tone over the grid points nearest to it.

    ``grid`` (point, 2 × column) and ``weight`` (path, 2 × column) have real and imaginary parts in
    turn; ``frequency`` is in cycles per sample; ``window`` (power, tap) holds the coefficients of
    the window's polynomials (`nufft`).
    """
    size, columns = grid.shape
    degrees, width = window.shape
    value = np.empty(width)
    for p in range(frequency.size):
        # the window's value at every tap, by Horner's rule
        place = (frequency[p] - math.floor(frequency[p])) * size
        first = math.ceil(place - 0.5 * width)
        x = 2.0 * (first - (place - 0.5 * width)) - 1.0
        for i in range(width):
            value[i] = window[degrees - 1, i]
        for power in range(degrees - 2, -1, -1):
            for i in range(width):
                value[i] = value[i] * x + window[power, i]
        # the grid is periodic: taps beyond one end are added at the other
        for i in range(width):
            point = first + i
            if point < 0:
                point += size
            elif point >= size:
                point -= size
            factor = value[i]
            row, own = grid[point], weight[p]
            for c in range(columns):
                row[c] += factor * own[c]
