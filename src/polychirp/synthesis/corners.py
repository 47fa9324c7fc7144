r"""Windows that a beginning or an ending of a ramp cuts, for many paths at once.

Where all beats are far out of band, a sample is what the corner makes and what the one edge of the
filter's window does that lies within the chirps. The corner of path p at :math:`t_p` makes
:math:`\\sum_j w_{pj}\\, h^{(j)}(t - t_p)` (`kernels.end_series`). Corners of one pair of ramps
are much closer to each other than h changes, so that each derivative is a polynomial in
:math:`t_p`: moments are summed over paths before samples are made.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from polychirp.synthesis.bundles import FEWEST, TAU, Crossing, cosines, half_time, num_nodes, tune
from polychirp.synthesis.chirp_response import NUM_TERMS

if TYPE_CHECKING:
    from polychirp.axes import ComplexArray
    from polychirp.synthesis.tables import Tables
    from polychirp.synthesis.visits import Visit


def corner_runs(visit: Visit, tables: Tables) -> list[tuple[slice, ComplexArray]]:
    """Runs of samples, and ``(channel, sample)`` of each, whose windows all lines' corners cut.

    Only far out of band, and where there are samples that no corner cuts.
    """
    if visit.num_lines < FEWEST or visit.whole.stop <= visit.whole.start:
        return []
    overlap = visit.overlap
    cuts = (
        (visit.cut_by_begin, -1, (overlap.first_begin, overlap.last_begin)),
        (visit.cut_by_end, 1, (overlap.first_end, overlap.last_end)),
    )
    return [
        (run, _corner(visit, tables, run, side, between) + _edge(visit, tables, run, side))
        for run, side, between in cuts
        if run.stop > run.start and _is_far(visit, tables, run)
    ]


def _is_far(visit: Visit, tables: Tables, run: slice) -> bool:
    """Whether no window of the samples meets a line where its beat is near the band."""
    pairs, pair = tables.pairs, visit.pair
    tuned = tune(visit, tables, (run.start + run.stop) // 2)
    time = tables.taps.half + half_time(run.stop - run.start, visit.step)
    slide = abs(float(pairs.rate[pair])) + float(pairs.spread[pair])
    return abs(tuned.centre) - tuned.width - slide * time > float(pairs.far[pair])


def _edge(visit: Visit, tables: Tables, run: slice, side: int) -> ComplexArray:
    """What one edge of the filter's window makes."""
    count = run.stop - run.start
    spread = float(tables.pairs.spread[visit.pair])
    nodes = num_nodes(0.0, math.pi * spread * half_time(count, visit.step) ** 2)
    crossing = Crossing(
        visit=visit, tables=tables, count=count, zone=count, nodes=nodes, terms=0, side=side
    )
    return crossing.samples(run)


def _corner(
    visit: Visit, tables: Tables, run: slice, side: int, between: tuple[float, float]
) -> ComplexArray:
    """What the corners make: beginnings for side −1, endings for side 1."""
    from polychirp.synthesis.bundle_kernels import corner_sums, derivatives

    t = tables
    centre = 0.5 * (between[0] + between[1])
    width = max(0.5 * (between[1] - between[0]), 1e-12)
    terms = num_nodes(2.0 * TAU * t.taps.stopband * width, 0.0)
    node, to_terms = cosines(terms)
    channels = t.lines.element_delay.shape[1]
    sums = np.zeros((channels, NUM_TERMS, terms), dtype=np.complex128)
    corner_sums(
        sums, t.own, visit.ramp, t.sent, t.pairs, visit.pair, t.taps, t.lines, visit.low,
        visit.high, side, centre, width,
    )  # fmt: skip
    time = visit.first + np.arange(run.start, run.stop) * visit.step
    shape = derivatives(t.taps, (time[:, None] - centre - width * node).ravel(), NUM_TERMS)
    shape = shape.reshape(NUM_TERMS, time.size, terms) @ to_terms.T
    return np.asarray(np.einsum("mjr,jnr->mn", sums, shape))
