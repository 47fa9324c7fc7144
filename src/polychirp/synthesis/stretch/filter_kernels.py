"""Compiled reading of the filter's tables: h, its derivatives, G, and ends far out of band."""

import math
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.jit import compiled, inlined
from polychirp.synthesis.stretch.kernel_records import (
    NUM_END_TERMS,
    NUM_TAYLOR_TERMS,
    Response,
    Taps,
)

END_TERM_TOLERANCE: Final = 1e-10
"""Limit of the first term left out of an end-point series, over the pass band's gain; chosen."""


@inlined
def tap(taps: Taps, s: float) -> float:
    """The impulse response h at the time s, by Taylor's series from the nearest node."""
    node = int((s + taps.half) / taps.step + 0.5)
    off = s + taps.half - node * taps.step
    value = 0.0
    for j in range(NUM_TAYLOR_TERMS - 1, -1, -1):
        value = value * off + taps.taylor[node, j]
    return value


@inlined
def derivative(taps: Taps, s: float, order: int) -> float:
    """The derivative of h of an order at the time s, by Taylor's series from the nearest node."""
    node = int((s + taps.half) / taps.step + 0.5)
    off = s + taps.half - node * taps.step
    value = 0.0
    for j in range(order + NUM_TAYLOR_TERMS - 1, order - 1, -1):
        value = value * off + _FALLING[order, j] * taps.taylor[node, j]
    return value


_FALLING: Final = np.array(
    [
        [math.perm(j, order) if j >= order else 0 for j in range(NUM_END_TERMS + NUM_TAYLOR_TERMS)]
        for order in range(NUM_END_TERMS)
    ],
    dtype=np.float64,
)


@compiled
def derivatives(taps: Taps, time: FloatArray, orders: int) -> FloatArray:
    """The impulse response and its derivatives at times within its support, ``(order, time)``."""
    out = np.empty((orders, time.size))
    for n in range(time.size):
        s = min(max(time[n], -taps.half), taps.half)
        for j in range(orders):
            out[j, n] = derivative(taps, s, j)
    return out


@inlined
def tabulated_gain(response: Response, beat: float, detune: complex) -> complex:
    """G by Lagrange's polynomial through eight entries of its table; G is even in the beat.

    ``detune`` is jπ(μ − μ₀)S²/4: the table has G for the rate μ in powers of it.
    """
    place = abs(beat) / response.step
    node = int(place)
    x = place - node
    low = node + 1  # tables begin four entries below zero
    # products of all distances but one
    d0, d1, d2, d3 = x + 3.0, x + 2.0, x + 1.0, x
    d4, d5, d6, d7 = x - 1.0, x - 2.0, x - 3.0, x - 4.0
    lower, upper = d0 * d1 * d2 * d3, d4 * d5 * d6 * d7
    left, right = d0 * d1 * upper, d6 * d7 * lower
    inner_left, inner_right = d2 * d3 * upper, d4 * d5 * lower
    w0, w1 = _LAGRANGE[0] * (d1 * inner_left), _LAGRANGE[1] * (d0 * inner_left)
    w2, w3 = _LAGRANGE[2] * (d3 * left), _LAGRANGE[3] * (d2 * left)
    w4, w5 = _LAGRANGE[4] * (d5 * right), _LAGRANGE[5] * (d4 * right)
    w6, w7 = _LAGRANGE[6] * (d7 * inner_right), _LAGRANGE[7] * (d6 * inner_right)
    # Horner's rule over the orders in the rate
    moment = response.moment
    total = 0.0j
    for j in range(moment.shape[1] - 1, -1, -1):
        total = (
            total * detune
            + (w0 * moment[low, j] + w1 * moment[low + 1, j])
            + (w2 * moment[low + 2, j] + w3 * moment[low + 3, j])
            + (w4 * moment[low + 4, j] + w5 * moment[low + 5, j])
            + (w6 * moment[low + 6, j] + w7 * moment[low + 7, j])
        )
    return total


_LAGRANGE: Final = tuple(
    (-1.0) ** (7 - i) / (math.factorial(i) * math.factorial(7 - i)) for i in range(8)
)


@inlined
def table_reach(response: Response, limit: float) -> float:
    """Beat, Hz, from which on the table's gain is below ``limit``; ∞ if it is not at the end."""
    low, high = 4, response.envelope.size - 1
    if response.envelope[high] >= limit:
        return np.inf
    while high - low > 1:
        middle = (low + high) // 2
        if response.envelope[middle] < limit:
            high = middle
        else:
            low = middle
    return float(high - 4) * response.step


@inlined
def _num_end_terms(taps: Taps, beat: float, rate: float) -> int:
    """Number of terms that the end-point series needs for `END_TERM_TOLERANCE`."""
    most: int = taps.bessel.shape[0]
    q = 1.0 / abs(beat)
    size, per_order = taps.peak / math.tau * q, 2.0 / math.tau * abs(rate) * q
    for j in range(1, most):
        size *= (taps.stopband + j * per_order) * q
        if size < END_TERM_TOLERANCE:
            return j
    return most


@inlined
def end_series(taps: Taps, beat: float, rate: float, weight: ComplexArray) -> int:
    """Fill in the weights of h and its derivatives in the contribution of an end; their number.

    Repeated partial integration of ∫h(s) exp(j2πψ) ds, where −dψ/ds is the beat f − μs: with q the
    inverse of it and c = j/2π, an upper end at s contributes Σ_j (−1)^j c^(j+1) D_j times the
    exponential there, D_0 = hq, D_(j+1) = q D_j', or D_j = Σ_i B_ji μ^i h^(j−i) q^(j+1+i) with
    the coefficients B of Bessel's polynomials. ``beat`` is that at the end, Hz.
    """
    count = _num_end_terms(taps, beat, rate)
    q = 1.0 / beat
    weight[:count] = 0.0
    c = complex(0.0, q / math.tau)
    for j in range(count):
        chirping = 1.0
        for i in range(j + 1):
            weight[j - i] += c * (chirping * taps.bessel[j, i])
            chirping *= rate * q
        c *= complex(0.0, -q / math.tau)
    return count


@compiled
def end_weights(taps: Taps, beat: FloatArray, rate: float) -> ComplexArray:
    """`end_series` at several beats, ``(beat, order)``."""
    out = np.zeros((beat.size, taps.bessel.shape[0]), dtype=np.complex128)
    for n in range(beat.size):
        end_series(taps, beat[n], rate, out[n])
    return out


@inlined
def edge_gain(taps: Taps, node: int, beat: float, rate: float) -> complex:
    """Contribution of an edge of the filter's window, relative to the chirp's value there.

    It is `end_series` with h and its derivatives at a node, its real and imaginary parts apart.
    """
    q = 1.0 / beat
    e, lean = q / math.tau, rate * q
    real, imag, c = 0.0, 0.0, e
    for j in range(_num_end_terms(taps, beat, rate)):
        total, chirping = 0.0, 1.0
        for i in range(j + 1):
            order = j - i
            total += chirping * taps.bessel[j, i] * (_FACTORIAL[order] * taps.taylor[node, order])
            chirping *= lean
        total *= -c if j & 2 else c
        if j & 1:
            real += total
        else:
            imag += total
        c *= e
    return complex(real, imag)


_FACTORIAL: Final = tuple(float(math.factorial(j)) for j in range(NUM_END_TERMS))
