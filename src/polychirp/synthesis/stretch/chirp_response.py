r"""Response of an IF filter to a chirp.

A chirp that has the beat f at the sample's time and the rate μ leaves the filter multiplied by

.. math:: G(f; \mu) = \int h(s)\, e^{-j2\pi f s + j\pi\mu s^2}\, ds,

with the impulse response h of length S. For μ = 0 it is the frequency response. Where a chirp
begins or ends in the window, and far out of band, h and its derivatives are used (`tap_table`).
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Final

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, IntArray, Sealed
from polychirp.model.if_filter import IfFilter
from polychirp.synthesis.stretch.kernel_records import NUM_END_TERMS, NUM_TAYLOR_TERMS
from polychirp.synthesis.stretch.nufft import correction, grid_of, window_at

ENTRIES_PER_BEAT: Final = 10
"""Entries of a table of G per 1/S of beat; chosen: interpolation is right to 5e-10."""

TABLE_SIZE_STEP: Final = 128
"""Step of the number of positive beats in a table; chosen: tables of one size share their nodes."""

MOST_TABLE_ORDERS: Final = 12
"""Greatest number of orders in the rate in a table; chosen."""

PANEL_NODES: Final = 64
"""Number of Gauss nodes in a panel of the integral; chosen."""

PANEL_CYCLES: Final = 24.0
"""Most cycles in a panel; chosen: with `PANEL_NODES` the integral is right to 1e-12."""


def far_beat(if_filter: IfFilter, rate: float) -> float:
    """Beat, Hz, beyond which the end-point series of a chirp of ``rate`` Hz/s is accurate.

    Its terms fall by the filter's band over the beat f and by rate/2πf²: at 12 times the `stopband`
    and at 5√rate the first term left out is below 1e-9 of a sample in band.
    """
    return max(12.0 * if_filter.stopband, 5.0 * math.sqrt(abs(rate)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResponseTable(Sealed):
    r"""G and its derivatives by the chirp rate, over a range of beats.

    .. math:: G(f; \mu) = \sum_j \frac{(j\pi(\mu - \mu_0))^j}{j!}
              \int h(s)\, s^{2j}\, e^{-j2\pi f s + j\pi\mu_0 s^2}\, ds

    Parameters
    ----------
    rate : Hz/s, :math:`\mu_0`
    moment : the integrals over s, divided by j!, in units of :math:`(S^2/4)^j`, ``(beat, order)``
        complex, at beats of −4, −3, … times `step_of` (G is even: negative beats need no more)
    envelope : the largest \|G\| at this beat and all tabulated beyond it, ``(beat,)``
    """

    rate: float
    moment: Annotated[ComplexArray, Axes("beat", "order", dtype=np.complex128)]
    envelope: Annotated[FloatArray, Axes("beat")]


def step_of(if_filter: IfFilter) -> float:
    """Spacing of the entries of a table, Hz."""
    return 1.0 / (ENTRIES_PER_BEAT * if_filter.support)


def response_table(
    if_filter: IfFilter, *, rate: float, highest: float, num_orders: int
) -> ResponseTable:
    """The table of one chirp rate, Hz/s, for beats of up to ``highest`` Hz in magnitude."""
    from scipy.fft import ifft

    from polychirp.synthesis.stretch.chirp_response_kernels import spread_chirp, take_table

    step = step_of(if_filter)
    last = TABLE_SIZE_STEP * math.ceil((highest / step + 6.0) / TABLE_SIZE_STEP)
    fastest = last * step + 0.5 * abs(rate) * if_filter.support
    nodes = _integral_nodes(if_filter, last, _num_panels(if_filter, fastest), num_orders)
    grid = np.zeros((num_orders, nodes.size), dtype=np.complex128)
    spread_chirp(grid, rate, nodes.half_square, nodes.weight, nodes.first, nodes.window)
    wave = ifft(grid, axis=1, norm="forward", overwrite_x=True, workers=1)
    moment, envelope = np.empty((last + 4, num_orders), dtype=np.complex128), np.empty(last + 4)
    take_table(moment, envelope, wave, nodes.correction)
    return ResponseTable(rate=rate, moment=moment, envelope=envelope)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _IntegralNodes:
    """Arrays that tables of one size share, for sums of tones (`nufft`) over the integral's nodes.

    Parameters
    ----------
    size : number of points of the grid
    half_square : s²/2 at the nodes s, ``(node,)``
    weight : weights of the integrals, times the tone of the middle beat, ``(order, node)``
    first, window : first point that a node is spread over, ``(node,)``, and window ``(node, tap)``
    correction : factor of every beat that undoes the window, ``(beat,)``
    """

    size: int
    half_square: FloatArray
    weight: ComplexArray
    first: IntArray
    window: FloatArray
    correction: FloatArray


@lru_cache(maxsize=64)
def _integral_nodes(if_filter: IfFilter, last: int, panels: int, num_orders: int) -> _IntegralNodes:
    count, step = last + 4, step_of(if_filter)
    s, weighted = _panelled_taps(if_filter, panels, num_orders)
    size, beta = grid_of(count, 2.0)
    first, window = window_at(-s * step * size, beta)
    # the sum of tones counts its samples from the middle one
    turned = np.exp(-2j * np.pi * s * (count // 2 - 4) * step)
    return _IntegralNodes(
        size=size,
        half_square=0.5 * s**2,
        weight=np.ascontiguousarray(weighted.T * turned),
        first=first,
        window=window,
        correction=correction(count, size, beta),
    )


def _num_panels(if_filter: IfFilter, fastest: float) -> int:
    """Number of panels of the support for waves of up to ``fastest`` Hz, a multiple of four."""
    panels = math.ceil(if_filter.support * (fastest + if_filter.stopband) / PANEL_CYCLES)
    return 4 * (panels // 4 + 1)


@lru_cache(maxsize=64)
def _panelled_taps(
    if_filter: IfFilter, panels: int, num_orders: int
) -> tuple[FloatArray, FloatArray]:
    """Nodes, s, and weights ``(node, order)``: h times even powers of time in S/2, over order!."""
    inner, weight = np.polynomial.legendre.leggauss(PANEL_NODES)
    centre = (2.0 * np.arange(panels) + 1.0) / panels - 1.0
    nodes = (centre[:, None] + inner / panels).ravel()
    time = 0.5 * if_filter.support * nodes
    values = np.tile(0.5 * if_filter.support / panels * weight, panels)
    values *= if_filter.impulse_response(time)
    factor = np.array([math.factorial(j) for j in range(num_orders)])
    return time, values[:, None] * nodes[:, None] ** (2 * np.arange(num_orders)) / factor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TapTable(Sealed):
    """Derivatives of h at nodes, which Taylor's series continues between them.

    Parameters
    ----------
    step : s, spacing of the nodes; the first is at −S/2, the last at S/2
    taylor : the derivatives divided by j!, ``(node, order)`` in s^-(1+j)
    """

    step: float
    taylor: Annotated[FloatArray, Axes("node", "order")]


@lru_cache(maxsize=32)
def tap_table(if_filter: IfFilter) -> TapTable:
    """The filter's table; `NUM_TAYLOR_TERMS` terms continue every derivative between its nodes."""
    support = if_filter.support
    most = NUM_END_TERMS + NUM_TAYLOR_TERMS
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
    """Number of orders with which G is right to 1e-9 for rates within ``spread`` of the table's."""
    turn = math.pi * spread * (0.5 * if_filter.support) ** 2
    order = 1
    while turn**order * _moments(if_filter)[order] > 1e-9 and order < MOST_TABLE_ORDERS:
        order += 1
    return order


@lru_cache(maxsize=32)
def _moments(if_filter: IfFilter) -> FloatArray:
    """The integrals of |h| times even powers of time in S/2, over order!, ``(order,)``."""
    _, weighted = _panelled_taps(if_filter, _num_panels(if_filter, 0.0), MOST_TABLE_ORDERS + 1)
    return np.asarray(np.abs(weighted).sum(axis=0))
