"""Compiled parts of `chirp_response`: a chirp at the nodes of the integral, and its table."""

import math

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.jit import compiled
from polychirp.synthesis.stretch.nufft import WINDOW_WIDTH
from polychirp.synthesis.unit_phasors import units


@compiled
def spread_chirp(
    grid: ComplexArray, rate: float, half_square: FloatArray, weight: ComplexArray,
    first: IntArray, window: FloatArray,
) -> None:  # fmt: skip
    """Spread the nodes' ``weight`` (order, node) times a chirp over ``grid`` (order, point).

    ``half_square`` is s²/2 of each node, ``rate`` is in Hz/s. ``window`` (node, `WINDOW_WIDTH`)
    are factors for the points from ``first`` on. Points below zero are at the grid's end.
    """
    orders, count = weight.shape
    lowest = first.min()
    points = first.max() - lowest + WINDOW_WIDTH
    real, imag = np.zeros((orders, points)), np.zeros((orders, points))
    cycles, x, y = np.empty(count), np.empty(count), np.empty(count)
    for p in range(count):
        cycles[p] = rate * half_square[p]
    units(cycles, x, y)
    # real and imaginary parts apart, so that the compiler can use vector instructions
    for j in range(orders):
        for p in range(count):
            w = weight[j, p] * complex(x[p], y[p])
            low = first[p] - lowest
            for i in range(WINDOW_WIDTH):
                real[j, low + i] += window[p, i] * w.real
                imag[j, low + i] += window[p, i] * w.imag
        for n in range(points):
            grid[j, (lowest + n) % grid.shape[1]] = complex(real[j, n], imag[j, n])


@compiled
def take_table(
    moment: ComplexArray, envelope: FloatArray, wave: ComplexArray, correction: FloatArray
) -> None:
    """Fill in ``moment`` (beat, order) and ``envelope`` (beat,) from ``wave`` (order, point).

    The wave begins with the beat in the middle; the beats before it are at the wave's end.
    """
    count, orders = moment.shape
    size, middle = wave.shape[1], count // 2
    for n in range(count):
        place = n - middle if n >= middle else n - middle + size
        for j in range(orders):
            moment[n, j] = correction[n] * wave[j, place]
    # the largest magnitude from each beat on
    largest = 0.0
    for n in range(count - 1, -1, -1):
        value = moment[n, 0]
        largest = max(largest, value.real * value.real + value.imag * value.imag)
        envelope[n] = math.sqrt(largest)
