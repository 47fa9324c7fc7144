r"""Windows that a beginning or an ending of a ramp cuts, for many paths at once.

Where all beats are far out of band, a sample is what the corner makes and what the one edge of the
filter's window does that lies within the chirps. The corner of path p at :math:`t_p` makes
:math:`\\sum_j w_{pj}\\, h^{(j)}(t - t_p)` (`kernels.end_series`). Corners of one pair of ramps
are much closer to each other than h changes, so that each derivative is a polynomial in
:math:`t_p`: moments are summed over paths before samples are made. A sample whose window has some
of the corners is summed path by path with the same polynomials. Near the band, lines are
interpolated between others whose samples are made one by one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Final

import numpy as np

from polychirp.synthesis.stretch.chirp_response import NUM_TERMS
from polychirp.synthesis.stretch.path_batches import (
    FEWEST,
    PATHS,
    TAU,
    TOLERANCE,
    Crossing,
    Tuning,
    cosines,
    half_time,
    num_nodes,
    num_terms,
    tune,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from polychirp.axes import ComplexArray, FloatArray
    from polychirp.synthesis.stretch.kernel_tables import Tables
    from polychirp.synthesis.stretch.work_units import Visit


MOST_POWERS: Final = 8
"""Powers of a corner's beat."""


MOST_RATES: Final = 16
"""Rates between which lines are interpolated; with more, path by path."""

ALIKE: Final = 3.0
"""What one of the lines costs between which others are interpolated, in units of one of these."""


def corner_runs(visit: Visit, tables: Tables) -> list[tuple[slice, ComplexArray]]:
    """Runs of samples, and ``(channel, sample)`` of each, whose windows lines' corners cut.

    Where no sample is without a corner, only far out of band.
    """
    if visit.num_lines < FEWEST:
        return []
    if visit.whole.stop <= visit.whole.start:
        return _short(visit, tables)
    found = []
    for side, run, around, between in _cuts(visit):
        if run.stop > run.start:
            cut = _cut(visit, tables, side, around, between)
            if cut is None:
                found += _near(visit, tables, side, run)
            else:
                found += cut.runs(run, around)
    return found


def _cuts(visit: Visit) -> tuple[tuple[int, slice, slice, tuple[float, float]], ...]:
    """Beginnings (−1) and endings (1): samples with all of them, with any, and s between them."""
    overlap, whole = visit.overlap, visit.whole
    begins = overlap.first_begin, overlap.last_begin
    ends = overlap.first_end, overlap.last_end
    return (
        (-1, visit.cut_by_begin, slice(visit.met.start, whole.start), begins),
        (1, visit.cut_by_end, slice(whole.stop, visit.met.stop), ends),
    )


def _short(visit: Visit, tables: Tables) -> list[tuple[slice, ComplexArray]]:
    """The same where every sample's window meets a corner, or two.

    Samples whose windows have both corners of every line have nothing else.
    """
    begins, ends, met = visit.cut_by_begin, visit.cut_by_end, visit.met
    overlap, half = visit.overlap, tables.taps.half
    if overlap.first_end <= overlap.last_begin:
        return []
    # windows before `free` have no ending in them, those from `late` on no beginning
    free = math.floor((overlap.first_end - half - visit.first) / visit.step)
    late = math.ceil((overlap.last_begin + half - visit.first) / visit.step)
    free, late = (min(max(n, met.start), met.stop) for n in (free, late))
    both = slice(max(begins.start, ends.start), min(begins.stop, ends.stop))
    early = slice(begins.start, min(begins.stop, free))
    behind = slice(max(ends.start, late), ends.stop)
    before, after = slice(met.start, min(late, free)), slice(max(late, free), met.stop)
    (_, _, _, first), (_, _, _, last) = _cuts(visit)
    begin = _cut(visit, tables, -1, slice(met.start, late), first)
    end = _cut(visit, tables, 1, slice(min(free, late), met.stop), last)
    found = []
    if both.stop > both.start and begin is not None and end is not None:
        found.append((both, begin.corners(both) + end.corners(both)))
    if early.stop > early.start and begin is not None:
        found += begin.runs(early, before)
    if behind.stop > behind.start and end is not None:
        found += end.runs(behind, after)
    return found


def _cut(
    visit: Visit, tables: Tables, side: int, around: slice, between: tuple[float, float]
) -> _Cut | None:
    """The cut, unless some window meets a line where its beat is near the band."""
    tuned = tune(visit, tables, (around.start + around.stop) // 2)
    time = tables.taps.half + half_time(around.stop - around.start, visit.step)
    slide = (abs(tuned.rate) + tuned.spread) * time
    if abs(tuned.centre) - tuned.width - slide <= float(tables.pairs.far[visit.pair]):
        return None
    centre = 0.5 * (between[0] + between[1])
    width = max(0.5 * (between[1] - between[0]), 1e-12)
    corner = tuned.at(centre)
    corner.width += width * (abs(tuned.rate) + tuned.spread)
    if _num_powers(corner) > MOST_POWERS:
        return None
    return _Cut(visit=visit, tables=tables, side=side, tuned=tuned, corner=corner, width=width)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Cut:
    """Beginnings (side −1) or endings (1) of lines: ``width`` s around the time of ``corner``.

    ``corner`` is how beats are there, ``tuned`` near the middle of the samples.
    """

    visit: Visit
    tables: Tables
    side: int
    tuned: Tuning
    corner: Tuning
    width: float

    def runs(self, run: slice, around: slice) -> list[tuple[slice, ComplexArray]]:
        """The samples ``around``: those of ``run`` have all the corners, the others some."""
        some = [*range(around.start, run.start), *range(run.stop, around.stop)]
        return [
            (run, self.corners(run) + self.edges(run)),
            *((slice(n, n + 1), self.partly(n)) for n in some),
        ]

    def edges(self, run: slice) -> ComplexArray:
        """What one edge of the filter's window makes."""
        count = run.stop - run.start
        crossing = Crossing(
            visit=self.visit, tables=self.tables, tuned=self.tuned, count=count, zone=count,
            terms=0, orders=0, side=self.side,
        )  # fmt: skip
        return crossing.samples(run)

    def corners(self, run: slice) -> ComplexArray:
        """What the corners make where windows have all of them."""
        from polychirp.synthesis.stretch.batch_kernels import corner_columns, derivatives

        visit, t, corner = self.visit, self.tables, self.corner
        gain = _powers(t, corner)
        terms = num_nodes(2.0 * TAU * t.taps.stopband * self.width, 0.0)
        node, to_terms = cosines(terms)
        columns = partial(
            corner_columns, own=t.own, k=visit.ramp, sent=t.sent, i=visit.sent, lines=t.lines,
            side=self.side, centre=corner.middle, width=self.width, beat=corner.centre,
            beat_width=corner.width,
        )  # fmt: skip
        sums = _sums_of(visit, t, columns, terms, len(gain))
        time = visit.first + np.arange(run.start, run.stop) * visit.step
        off = time[:, None] - corner.middle - self.width * node
        shape = derivatives(t.taps, off.ravel(), NUM_TERMS).reshape(NUM_TERMS, time.size, terms)
        weighted = -self.side * np.einsum("mre,ej->mjr", sums, gain)
        return np.asarray(np.einsum("mjr,jnr->mn", weighted, shape @ to_terms.T))

    def partly(self, sample: int) -> ComplexArray:
        """One sample whose window has some of the corners, ``(channel, 1)``."""
        from polychirp.synthesis.stretch.batch_kernels import cut_sums, derivatives

        visit, t, corner, half = self.visit, self.tables, self.corner, self.tables.taps.half
        time = visit.first + sample * visit.step
        edge = self.tuned.at(time - self.side * half)
        latest = min(time - corner.middle + self.width, half)
        earliest = max(time - corner.middle - self.width, -half)
        middle, width = 0.5 * (latest + earliest), max(0.5 * (latest - earliest), 1e-12)
        node, _ = cosines(num_nodes(2.0 * TAU * t.taps.stopband * width, 0.0))
        shape = derivatives(t.taps, middle + width * node, NUM_TERMS) @ _to_powers(node.size).T
        other = derivatives(t.taps, np.array([self.side * half]), NUM_TERMS)[:, 0]
        out = np.zeros(t.lines.element_delay.shape[1], dtype=np.complex128)
        scale = np.array([corner.centre, corner.width, middle, width, edge.centre, edge.width])
        cut_sums(
            out, t.own, visit.ramp, t.sent, visit.sent, half, t.lines, visit.low, visit.high,
            self.side, time, _powers(t, corner) @ shape,
            _powers(t, edge) @ other, scale,
        )  # fmt: skip
        return out[:, None]


def _near(visit: Visit, tables: Tables, side: int, run: slice) -> list[tuple[slice, ComplexArray]]:
    """The run where the corners are near the band, interpolated between lines that are alike.

    A line's samples depend on nothing but its phase, beat and rate: where a beginning or an ending
    is that of the transmitted ramp, beat and rate tell when it is. Samples are left out whose
    windows do not have the corners of all combinations of the lines' beats and rates.
    """
    from polychirp.synthesis.stretch.batch_kernels import alike, crossing_columns

    t, overlap, half = tables, visit.overlap, tables.taps.half
    duration, slope = t.own.duration[visit.ramp], abs(t.sent.slope[visit.sent])
    is_own = overlap.last_begin == 0.0, overlap.first_end == duration
    is_mixed = overlap.first_begin == 0.0, overlap.last_end == duration
    cut = 0 if side < 0 else 1
    if slope == 0.0 or (is_mixed[cut] and not is_own[cut]):
        return []
    tuned = tune(visit, t, (run.start + run.stop) // 2)
    # how much later a corner is by the greatest distance of the beat, and of the rate
    later, later_by_rate, fast = 0.0, 0.0, 0.0
    if not is_own[cut]:
        later = tuned.width / slope
        later_by_rate = 0.5 * tuned.spread * t.sent.frequency[visit.sent] / slope**2
        fast = float(t.pairs.far[visit.pair]) + t.taps.stopband
        between = (overlap.first_begin, overlap.last_begin) if cut == 0 else (
            overlap.first_end, overlap.last_end)  # fmt: skip
        first = between[1] + 2.0 * (later + later_by_rate) - half - visit.first
        last = between[0] - 2.0 * (later + later_by_rate) + half - visit.first
        run = slice(
            max(run.start, math.ceil(first / visit.step)),
            min(run.stop, math.floor(last / visit.step) + 1),
        )
    count = run.stop - run.start
    if count <= 0:
        return []
    tuned = tuned.at(visit.first + (run.start + count // 2) * visit.step)
    reach = half + half_time(count, visit.step)
    terms = num_terms(1.0, tuned.width * reach + fast * later) + 4
    powers = num_nodes(TAU * fast * later_by_rate, math.pi * tuned.spread * reach**2) + 2
    lines = visit.num_lines * t.lines.element_delay.shape[1]
    # sums are over powers of the rate's distance: many of them lose digits
    if powers > MOST_RATES or terms * powers * ALIKE > lines:
        return []
    node, to_terms = cosines(terms)
    rates = tuned.rate + tuned.spread * cosines(powers)[0]
    real, imag = np.zeros((2, powers, terms, count))
    alike(
        real, imag, t.own, visit.ramp, t.sent, t.pairs, visit.pair, t.taps, tuned.middle,
        tuned.centre + tuned.width * node, rates, visit.first + run.start * visit.step,
        visit.step, is_own,
    )  # fmt: skip
    gain = np.einsum(
        "ej,jin,ri->ern", _to_powers(powers), real + 1j * imag, to_terms, optimize=True
    )
    columns = partial(
        crossing_columns, own=t.own, k=visit.ramp, sent=t.sent, pairs=t.pairs, pair=visit.pair,
        lines=t.lines, middle=tuned.middle, centre=tuned.centre, width=tuned.width,
    )  # fmt: skip
    sums = _sums_of(visit, t, columns, terms, powers)
    return [(run, np.einsum("mre,ern->mn", sums, gain))]


def _sums_of(
    visit: Visit, tables: Tables, columns: Callable[..., None], terms: int, powers: int
) -> ComplexArray:
    """Sums over the visit's lines of terms times values, ``(channel, term, power)``.

    ``columns`` fills in ``term`` (channel, term, path) and ``value`` (channel, path, 2 × power) of
    the lines from ``low`` on.
    """
    channels = tables.lines.element_delay.shape[1]
    total = np.zeros((channels, terms, 2 * powers))
    block = max(64, PATHS // terms)
    for low in range(visit.low, visit.high, block):
        count = min(block, visit.high - low)
        term = np.empty((channels, terms, count))
        value = np.empty((channels, count, 2 * powers))
        columns(term=term, value=value, low=low)
        total += term @ value
    return total.view(np.complex128)


def _num_powers(tuned: Tuning) -> int:
    """Powers of the beat's distance that 1/beat needs."""
    lean, count = 0.5 * tuned.width / abs(tuned.centre), 1
    while 2.0 * lean**count > TOLERANCE and count <= MOST_POWERS:
        count += 1
    return count


def _powers(tables: Tables, tuned: Tuning) -> ComplexArray:
    """Weights of the impulse response's derivatives, ``(power of the beat's distance, order)``."""
    from polychirp.synthesis.stretch.batch_kernels import end_weights

    node, _ = cosines(_num_powers(tuned))
    beat = tuned.centre + tuned.width * node
    return np.asarray(_to_powers(node.size) @ end_weights(tables.taps, beat, tuned.rate))


@lru_cache(maxsize=64)
def _to_powers(count: int) -> FloatArray:
    """From values at Chebyshev's nodes to coefficients of powers."""
    return np.asarray(np.linalg.inv(cosines(count)[0][:, None] ** np.arange(count)))
