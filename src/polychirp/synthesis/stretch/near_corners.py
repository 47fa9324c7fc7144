r"""Samples whose windows contain a corner near the band: links are summed before the filter.

A corner is the beginning or the ending of a link's chirp. Such a sample is the integral of the
impulse response h times the beats x of all links over the sample's window. Between two samples, h
changes little: it is a polynomial of low degree. With Legendre's polynomials :math:`P_j`, the
interval of length Δ from the time :math:`t_k` on contributes to the sample at t

.. math:: \int_{t_k}^{t_k+\Delta} h(t-s)\, x(s)\, ds = \sum_j g_j(t - t_k)\, M_{kj}, \qquad
          M_{kj} = \int_{t_k}^{t_k+\Delta} P_j\!\left(2\frac{s-t_k}{\Delta} - 1\right) x(s)\, ds .

The coefficients :math:`g_j` of h are the same for all samples. The moments :math:`M_{kj}` follow
from the sum of all links at the nodes of a quadrature, so that a link costs one multiplication per
node of the interval, and no integral of its own for every sample.

Intervals begin where windows begin. The last of a window ends within an interval: its contribution
is one more moment, that with h itself.
"""

import math
from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.model.if_filter import IfFilter
from polychirp.synthesis.stretch.kernel_records import (
    EXPANSION_TOLERANCE,
    NUM_PANEL_NODES,
    WindowSeries,
)
from polychirp.synthesis.stretch.work_units import WorkUnit

SERIES_TOLERANCE: Final = 0.1 * EXPANSION_TOLERANCE
"""Greatest sum of the coefficients that are left out, relative to that of all; chosen."""


def near_runs(unit: WorkUnit, far: float) -> list[slice]:
    """Runs of a unit's samples whose windows contain corners with beats below ``far``, Hz."""
    overlap, met, whole = unit.overlap, unit.met, unit.whole
    begins_near, ends_near = overlap.begin_beat < far, overlap.end_beat < far
    if whole.stop <= whole.start:
        return [met] if begins_near or ends_near else []
    runs = [slice(met.start, whole.start)] if begins_near else []
    runs += [slice(whole.stop, met.stop)] if ends_near else []
    return [run for run in runs if run.stop > run.start]


@lru_cache(maxsize=32)
def window_series(if_filter: IfFilter, step: float) -> WindowSeries:
    """Legendre coefficients of h over a sample's window; ``step`` is Δ, s."""
    window = if_filter.support / step
    num_steps = math.floor(window)
    # a wave at the stop edge needs about π terms per cycle, and some more
    most = math.ceil(1.3 * math.pi * if_filter.stopband * step) + 20
    node, weight = np.polynomial.legendre.leggauss(2 * most)
    into = np.arange(num_steps)[:, None] + 0.5 * (node + 1.0)
    height = if_filter.impulse_response(step * (0.5 * window - into))
    legendre = np.polynomial.legendre.legvander(node, most - 1)
    series = (height * weight) @ legendre * (np.arange(most) + 0.5)
    size = np.abs(series).sum(axis=0)
    beyond = np.cumsum(size[::-1])[::-1]
    orders = int(np.count_nonzero(beyond > SERIES_TOLERANCE * beyond[0]))
    gain = np.zeros((num_steps + 1, orders + 1))
    gain[:-1, :-1] = series[:, :orders]
    gain[-1, -1] = 1.0
    place, part = np.polynomial.legendre.leggauss(NUM_PANEL_NODES)
    return WindowSeries(
        share=window - num_steps,
        num_steps=num_steps,
        gain=gain,
        node=0.5 * (place + 1.0),
        weight=0.5 * part,
    )
