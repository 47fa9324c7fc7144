r"""Samples whose windows contain the beginning or the ending of a ramp, for many links at once.

A corner is the beginning or the ending of a link's chirp. Where all beats are far out of band, a
sample is the sum of the contributions of the corner and of the one edge of the filter's window that
lies within the chirps. The corner of link p at :math:`t_p` contributes
:math:`\sum_j w_{pj}\, h^{(j)}(t - t_p)` (`filter_kernels.end_series`). Between the corners of one
pair of ramps h changes little, so each derivative is a polynomial in :math:`t_p`: its moments are
summed over links before samples are computed. A sample whose window has only some of the corners is
summed link by link with the same polynomials. `near_corners` has the corners near the band.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.synthesis.stretch.kernel_records import (
    EXPANSION_TOLERANCE,
    NUM_END_TERMS,
    NUMBERS_PER_BLOCK,
    Batch,
    CornerRange,
    CutExpansion,
)
from polychirp.synthesis.stretch.path_batches import (
    MOST_NODES,
    Beats,
    beats_at,
    chebyshev,
    half_time,
    num_channels,
    num_nodes,
    swept_samples,
)
from polychirp.synthesis.stretch.work_units import WorkUnit

MOST_BEAT_POWERS: Final = 8
"""Most powers of a corner's beat; corners that need more are not expanded (chosen)."""


def corner_runs(
    unit: WorkUnit, batch: Batch, near: Sequence[slice]
) -> list[tuple[slice, ComplexArray]]:
    """Runs of samples whose windows contain corners, and the sum ``(channel, sample)`` of each run.

    ``near`` are the runs with corners near the band, which are left out (`near_corners`).
    """
    if unit.whole.stop <= unit.whole.start:
        return [] if near else _short(unit, batch)
    found = []
    for side, run, around, between in _cuts(unit):
        if run.stop > run.start and around not in near:
            cut = _cut(unit, batch, side, around, between)
            if cut is not None:
                found += cut.runs(run, around)
    return found


def _cuts(unit: WorkUnit) -> tuple[tuple[int, slice, slice, tuple[float, float]], ...]:
    """Beginnings (−1) and endings (1): samples with all, with any, and extreme times of corners."""
    overlap, whole = unit.overlap, unit.whole
    begins = overlap.first_begin, overlap.last_begin
    ends = overlap.first_end, overlap.last_end
    return (
        (-1, unit.cut_by_begin, slice(unit.met.start, whole.start), begins),
        (1, unit.cut_by_end, slice(whole.stop, unit.met.stop), ends),
    )


def _short(unit: WorkUnit, batch: Batch) -> list[tuple[slice, ComplexArray]]:
    """Runs as of `corner_runs`, where every sample's window contains at least one corner.

    A window that contains both corners of every link has no edge within a chirp.
    """
    begins, ends, met = unit.cut_by_begin, unit.cut_by_end, unit.met
    overlap, half = unit.overlap, batch.taps.half
    if overlap.first_end <= overlap.last_begin:
        return []
    # windows of samples before `free` contain no ending, those from `late` on no beginning
    free = math.floor((overlap.first_end - half - unit.first) / unit.step)
    late = math.ceil((overlap.last_begin + half - unit.first) / unit.step)
    free, late = (min(max(n, met.start), met.stop) for n in (free, late))
    both = slice(max(begins.start, ends.start), min(begins.stop, ends.stop))
    early = slice(begins.start, min(begins.stop, free))
    behind = slice(max(ends.start, late), ends.stop)
    before, after = slice(met.start, min(late, free)), slice(max(late, free), met.stop)
    (_, _, _, first), (_, _, _, last) = _cuts(unit)
    begin = _cut(unit, batch, -1, slice(met.start, late), first)
    end = _cut(unit, batch, 1, slice(min(free, late), met.stop), last)
    found = []
    if both.stop > both.start and begin is not None and end is not None:
        found.append((both, begin.corners(both) + end.corners(both)))
    if early.stop > early.start and begin is not None:
        found += begin.runs(early, before)
    if behind.stop > behind.start and end is not None:
        found += end.runs(behind, after)
    return found


def _cut(
    unit: WorkUnit, batch: Batch, side: int, around: slice, between: tuple[float, float]
) -> "_Cut | None":
    """Corners of one side; None if a window meets a beat near the band, or terms are too many."""
    beats = beats_at(unit, batch, (around.start + around.stop) // 2)
    time = batch.taps.half + half_time(around.stop - around.start, unit.step)
    slide = (abs(beats.rate) + beats.spread) * time
    if abs(beats.centre) - beats.width - slide <= batch.response.far:
        return None
    corner = beats.at(0.5 * (between[0] + between[1]))
    time_width = max(0.5 * (between[1] - between[0]), 1e-12)
    beat_width = corner.width + time_width * (abs(beats.rate) + beats.spread)
    corners = CornerRange(side, corner.time, time_width, corner.centre, beat_width)
    if _num_powers(corners.beat, corners.beat_width) > MOST_BEAT_POWERS:
        return None
    # a window contains corners over its own duration at most
    if _num_times(batch, min(time_width, batch.taps.half)) >= MOST_NODES:
        return None
    return _Cut(unit=unit, batch=batch, beats=beats, at=corners)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Cut:
    """Corners of links in the range ``at``; ``beats`` are those near the middle of the samples."""

    unit: WorkUnit
    batch: Batch
    beats: Beats
    at: CornerRange

    def runs(self, run: slice, around: slice) -> list[tuple[slice, ComplexArray]]:
        """Samples ``around``: windows of ``run`` contain all the corners, other windows some."""
        edges = swept_samples(self.unit, self.batch, self.beats, run, side=self.at.side)
        some = [*range(around.start, run.start), *range(run.stop, around.stop)]
        return [
            (run, self.corners(run) + edges),
            *((slice(n, n + 1), self.partly(n)) for n in some),
        ]

    def corners(self, run: slice) -> ComplexArray:
        """Contribution of the corners to samples whose windows contain all of them."""
        from polychirp.synthesis.stretch.filter_kernels import derivatives
        from polychirp.synthesis.stretch.ramp_edge_kernels import corner_columns

        unit, taps, at = self.unit, self.batch.taps, self.at
        gain = self._powers(at.beat, at.beat_width)
        terms = _num_times(self.batch, at.time_width)
        node, to_terms = chebyshev(terms)
        columns = partial(corner_columns, batch=self.batch, corners=at)
        sums = _sums_of(self.batch, columns, terms, len(gain))
        time = unit.first + np.arange(run.start, run.stop) * unit.step
        off = time[:, None] - at.time - at.time_width * node
        shape = derivatives(taps, off.ravel(), NUM_END_TERMS)
        shape = shape.reshape(NUM_END_TERMS, time.size, terms)
        weighted = -at.side * np.einsum("mre,ej->mjr", sums, gain)
        return np.asarray(np.einsum("mjr,jnr->mn", weighted, shape @ to_terms.T))

    def partly(self, sample: int) -> ComplexArray:
        """One sample whose window contains some of the corners, ``(channel, 1)``."""
        from polychirp.synthesis.stretch.filter_kernels import derivatives
        from polychirp.synthesis.stretch.ramp_edge_kernels import cut_sums

        unit, taps, at, half = self.unit, self.batch.taps, self.at, self.batch.taps.half
        time = unit.first + sample * unit.step
        edge = self.beats.at(time - at.side * half)
        # extreme times from a corner to the sample, s, as far as the window contains corners
        latest = min(time - at.time + at.time_width, half)
        earliest = max(time - at.time - at.time_width, -half)
        middle, width = 0.5 * (latest + earliest), max(0.5 * (latest - earliest), 1e-12)
        node, to_terms = chebyshev(_num_times(self.batch, width))
        shape = derivatives(taps, middle + width * node, NUM_END_TERMS) @ to_terms.T
        other = derivatives(taps, np.array([at.side * half]), NUM_END_TERMS)[:, 0]
        expansion = CutExpansion(
            corner_gain=self._powers(at.beat, at.beat_width) @ shape,
            edge_gain=self._powers(edge.centre, edge.width) @ other,
            beat=at.beat,
            beat_width=at.beat_width,
            delay=middle,
            delay_width=width,
            edge_beat=edge.centre,
            edge_width=edge.width,
        )
        out = np.zeros(num_channels(self.batch), dtype=np.complex128)
        cut_sums(out, self.batch, at.side, time, expansion)
        return out[:, None]

    def _powers(self, beat: float, width: float) -> ComplexArray:
        """Weights of the derivatives of h, ``(power of the beat's distance, order)``."""
        from polychirp.synthesis.stretch.filter_kernels import end_weights

        node, _ = chebyshev(_num_powers(beat, width))
        weights = end_weights(self.batch.taps, beat + width * node, self.beats.rate)
        return np.asarray(_to_powers(node.size) @ weights)


def _num_times(batch: Batch, width: float) -> int:
    """Number of Chebyshev nodes for h and its derivatives over ±``width``, s."""
    return num_nodes(2.0 * math.tau * batch.taps.stopband * width, 0.0)


def _num_powers(beat: float, width: float) -> int:
    """Number of powers of a beat's distance from ``beat``, up to ``width``, that 1/beat needs."""
    lean, count = 0.5 * width / abs(beat), 1
    while 2.0 * lean**count > EXPANSION_TOLERANCE and count <= MOST_BEAT_POWERS:
        count += 1
    return count


def _sums_of(batch: Batch, columns: Callable[..., None], terms: int, powers: int) -> ComplexArray:
    """Sums over the batch's links of terms times values, ``(channel, term, power)``.

    ``columns`` fills in ``term`` (channel, term, link) and ``value`` (channel, link, 2 × power) of
    the links from ``low`` on.
    """
    channels = num_channels(batch)
    total = np.zeros((channels, terms, 2 * powers))
    block = max(64, NUMBERS_PER_BLOCK // terms)
    for low in range(batch.low, batch.high, block):
        count = min(block, batch.high - low)
        term = np.empty((channels, terms, count))
        value = np.empty((channels, count, 2 * powers))
        columns(term=term, value=value, low=low)
        total += term @ value
    return total.view(np.complex128)


@lru_cache(maxsize=64)
def _to_powers(count: int) -> FloatArray:
    """Matrix from values at Chebyshev's nodes to coefficients of powers."""
    return np.asarray(np.linalg.inv(chebyshev(count)[0][:, None] ** np.arange(count)))
