r"""What an IF filter makes of a chirp.

A chirp of beat f and rate μ at the sample's instant leaves the filter as itself times

.. math:: G(f; \mu) = \int h(s)\, e^{-j2\pi f s + j\pi\mu s^2}\, ds,

which for μ = 0 is the frequency response. Where a chirp is cut, and far out of band, the integral
is made of what happens at its ends; for that h and its derivatives are tabulated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Final

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, seal
from polychirp.model.if_filter import IfFilter

OVERSAMPLING: Final = 16
"""Entries of a response's table per 1/S of frequency."""

NUM_TERMS: Final = 6
"""Terms of the end-point series."""

TAYLOR_ORDER: Final = 6
"""Terms by which a tabulated derivative is continued between its nodes."""


def far_beat(if_filter: IfFilter, rate: float) -> float:
    """Hz, the beat beyond which the end-point series of a chirp of ``rate`` Hz/s holds.

    Its terms fall by the filter's band over f and by rate/2πf²: at twelve stop bands and at
    5√rate the first one left out is below 1e-9 of a full-scale sample.
    """
    return max(12.0 * if_filter.stopband, 5.0 * math.sqrt(abs(rate)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResponseTable:
    r"""G and its derivatives by the chirp rate, over a range of beats.

    .. math:: G(f; \mu) = \sum_j \frac{(j\pi(\mu - \mu_0))^j}{j!}
              \int h(s)\, s^{2j}\, e^{-j2\pi f s + j\pi\mu_0 s^2}\, ds

    Parameters
    ----------
    rate : Hz/s, :math:`\mu_0`
    moment : the integrals over j!, in units of :math:`(S^2/4)^j`, ``(beat, order)`` complex, at
        beats of −4, −3, … times `step_of` (G is even, so that negative beats need no more)
    envelope : the largest \|G\| at this beat and all tabulated beyond it, ``(beat,)``
    """

    rate: float
    moment: Annotated[ComplexArray, Axes("beat", "order", dtype=np.complex128)]
    envelope: Annotated[FloatArray, Axes("beat")]

    def __post_init__(self) -> None:
        seal(self)


def step_of(if_filter: IfFilter) -> float:
    """Hz between the entries of a table."""
    return 1.0 / (OVERSAMPLING * if_filter.support)


def response_table(
    if_filter: IfFilter, *, rate: float, highest: float, num_orders: int
) -> ResponseTable:
    """The table of one chirp rate for beats of up to ``highest`` Hz in magnitude."""
    support = if_filter.support
    entry = np.arange(-4, math.ceil(highest / step_of(if_filter)) + 6)
    # sixteen points per cycle of the fastest that the integrand contains, and a window that rises
    # steeply at its ends
    fastest = highest + 0.5 * abs(rate) * support + if_filter.stopband
    intervals = 1 << max(9, math.ceil(math.log2(16.0 * fastest * support)))
    s, weighted = _weighted_taps(if_filter, intervals)
    chirp = weighted * np.exp(1j * np.pi * rate * s**2)
    order = np.arange(num_orders)
    factor = np.array([math.factorial(j) for j in order])
    integrand = chirp * (2.0 * s / support) ** (2 * order[:, None]) / factor[:, None]
    # both the times and the beats begin below zero
    integrand *= np.exp(-2j * np.pi * entry[0] * step_of(if_filter) * (s + 0.5 * support))
    spectrum = _first_bins(integrand, entry.size, OVERSAMPLING * intervals)
    shift = np.exp(1j * np.pi * entry / OVERSAMPLING)
    moment = np.ascontiguousarray((spectrum * shift).T)
    envelope = np.maximum.accumulate(np.abs(moment[::-1, 0]))[::-1]
    return ResponseTable(rate=rate, moment=moment, envelope=envelope)


@lru_cache(maxsize=32)
def _weighted_taps(if_filter: IfFilter, intervals: int) -> tuple[FloatArray, FloatArray]:
    """Times from −S/2 to S/2, and h there with the weights of an integral over them."""
    support = if_filter.support
    s = (np.arange(intervals + 1) / intervals - 0.5) * support
    return s, if_filter.impulse_response(s) * _end_corrected(intervals) * (support / intervals)


def _first_bins(x: ComplexArray, count: int, size: int) -> ComplexArray:
    """The first ``count`` of the ``size`` bins of the zero-padded rows' Fourier transform.

    2nk = n² + k² − (k − n)² makes it a convolution (Bluestein 1970) as long as rows and bins, a
    small part of ``size``.
    """
    length = x.shape[1]
    n = np.arange(max(length, count), dtype=np.int64)
    turn = np.exp(-1j * np.pi * (n**2 % (2 * size)) / size)
    padded = 1 << (length + count - 1).bit_length()
    kernel = np.zeros(padded, dtype=np.complex128)
    kernel[:count] = np.conj(turn[:count])
    kernel[padded - length + 1 :] = np.conj(turn[1:length])[::-1]
    product = np.fft.fft(x * turn[:length], padded) * np.fft.fft(kernel)
    return np.asarray(np.fft.ifft(product)[:, :count] * turn[:count])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TapTable:
    """h and its derivatives, to be continued by Taylor's series.

    Parameters
    ----------
    step : s, between nodes; the first is at −S/2, the last at S/2
    taylor : the derivatives over j!, ``(node, order)`` in s^-(1+j)
    """

    step: float
    taylor: Annotated[FloatArray, Axes("node", "order")]

    def __post_init__(self) -> None:
        seal(self)


@lru_cache(maxsize=32)
def tap_table(if_filter: IfFilter) -> TapTable:
    """Nodes so close that `TAYLOR_ORDER` terms more than the end-point series needs are exact."""
    support = if_filter.support
    most = NUM_TERMS + TAYLOR_ORDER
    intervals = max(512, math.ceil(support * 20.0 * math.pi * if_filter.stopband))
    time = (np.arange(intervals + 1) / intervals - 0.5) * support
    factor = np.array([math.factorial(j) for j in range(most)])
    taylor = np.ascontiguousarray((if_filter.derivatives(time, most - 1) / factor[:, None]).T)
    return TapTable(step=support / intervals, taylor=taylor)


def bessel_coefficients(num_terms: int) -> FloatArray:
    """Coefficients of Bessel's polynomials, ``(j, i)``: (j+i)! / (2^i i! (j−i)!).

    >>> bessel_coefficients(3)
    array([[1., 0., 0.],
           [1., 1., 0.],
           [1., 3., 3.]])
    """
    out = np.zeros((num_terms, num_terms))
    for j in range(num_terms):
        for i in range(j + 1):
            factor = math.factorial(j + i) // (math.factorial(i) * math.factorial(j - i))
            out[j, i] = factor / 2**i
    return out


def num_orders(if_filter: IfFilter, spread: float) -> int:
    """Orders by which rates within ``spread`` Hz/s of the table's are right to 1e-11."""
    turn = math.pi * spread * (0.5 * if_filter.support) ** 2
    order, term = 1, turn
    while term > 1e-11 and order < 12:
        order += 1
        term *= turn / order
    return order


def _end_corrected(intervals: int) -> FloatArray:
    """Weights of Gregory's rule of order 8: the trapezoid's, put right at both ends."""
    weight = np.ones(intervals + 1)
    head = _GREGORY
    weight[: head.size] = head
    weight[-head.size :] = head[::-1]
    return weight


def _gregory(order: int) -> FloatArray:
    """First weights such that polynomials below ``order`` are integrated exactly.

    On the half-line Σ wₙ g(n) must be ∫g: moments of the sum's missing part are zeta values,
    Σ_{n≥0} n^k → ζ(−k) in Abel's sense.
    """
    bernoulli = {0: -0.5, 1: -1 / 12, 3: 1 / 120, 5: -1 / 252, 7: 1 / 240}
    n = np.arange(order, dtype=np.float64)
    moments = np.array([-bernoulli.get(k, 0.0) - (1.0 if k == 0 else 0.0) for k in range(order)])
    return 1.0 + np.linalg.solve(n ** np.arange(order)[:, None], moments)


_GREGORY: Final = _gregory(8)
