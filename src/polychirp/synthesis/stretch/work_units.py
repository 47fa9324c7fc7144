"""Work units of the engine, each of a row of samples, a pair of ramps and a run of links."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from polychirp.model.if_filter import IfFilter
from polychirp.synthesis.stretch.chirp_response import far_beat
from polychirp.synthesis.stretch.kernel_records import (
    LinkTable,
    Overlap,
    Ramps,
    Taps,
    Window,
    WorkTable,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkUnit:
    """A row of samples, a pair of ramps that meets their windows, and a run of links.

    Parameters
    ----------
    row, ramp, sent : numbers of the row of samples, the victim's ramp and the transmitted one
    pair, overlap : number of the pair of ramps, and its overlap
    part : part of the contribution to which all the links belong
    low, high : the links are ``low:high``
    limit : gain below which the sum of these links need not be added
    first, step : s, first sample from the start of ``ramp``, and interval between samples
    met : samples whose windows meet some link's chirp
    whole : samples whose windows are within every link's chirp
    cut_by_begin, cut_by_end : samples whose windows contain the beginning, or the ending, of every
        link's chirp
    """

    row: int
    ramp: int
    sent: int
    pair: int
    overlap: Overlap
    part: int
    low: int
    high: int
    limit: float
    first: float
    step: float
    met: slice
    whole: slice
    cut_by_begin: slice
    cut_by_end: slice

    @property
    def num_links(self) -> int:
        """Number of links."""
        return self.high - self.low


def work_units_of(
    if_filter: IfFilter, own: Ramps, window: Window, links: LinkTable, taps: Taps,
    overlaps: Sequence[Overlap], floor: float,
) -> list[WorkUnit]:  # fmt: skip
    """All units with gains that may be above the links' limits, in order of rows and ramps."""
    half = taps.half
    victims = [overlap.victim_ramp for overlap in overlaps]
    start = np.searchsorted(victims, np.arange(own.start.size + 1))
    runs = [_runs(links, snapshot, floor) for snapshot in range(links.start.size - 1)]
    last = window.first + (window.num_samples - 1) * window.step
    end = own.start + own.duration
    low = np.searchsorted(end, own.start + window.first - half)
    high = np.searchsorted(own.start, own.start + last + half)
    found = []
    for row in range(own.start.size):
        for ramp in range(int(low[row]), int(high[row])):
            first = float(window.first[row] + (own.start[row] - own.start[ramp]))
            grid = _Grid(first=first, step=window.step, count=int(window.num_samples[row]))
            for pair in range(int(start[ramp]), int(start[ramp + 1])):
                overlap = overlaps[pair]
                if not _is_met(grid, overlap, half):
                    continue
                begins = grid.between(overlap.last_begin - half, overlap.first_begin + half)
                ends = grid.between(overlap.last_end - half, overlap.first_end + half)
                gain = _largest_gain(taps, far_beat(if_filter, overlap.steepest), grid, overlap)
                found += [
                    WorkUnit(
                        row=row, ramp=ramp, sent=overlap.sent_ramp, pair=pair,
                        overlap=overlap, part=run.part,
                        low=run.low, high=run.high, limit=run.limit, first=first,
                        step=window.step, cut_by_begin=begins, cut_by_end=ends,
                        met=grid.around(overlap.first_begin - half, overlap.last_end + half),
                        whole=grid.between(overlap.last_begin + half, overlap.first_end - half),
                    )
                    for run in runs[int(links.snapshot[ramp])]
                    if gain >= run.least
                ]  # fmt: skip
    return found


def work_table(units: Sequence[tuple[WorkUnit, slice]]) -> WorkTable:
    """Table of units, each at the given slice of its samples."""
    rows = [
        (unit.part, unit.row, unit.ramp, unit.pair, unit.low, unit.high, some.start, some.stop)
        for unit, some in units
    ]
    return WorkTable(*np.array(rows, dtype=np.int64).reshape(-1, 8).T.copy())


def gaps(unit: WorkUnit, done: Sequence[slice]) -> list[tuple[WorkUnit, slice]]:
    """The unit at each run of its samples that are in none of ``done``.

    >>> from types import SimpleNamespace
    >>> [some for _, some in gaps(SimpleNamespace(met=slice(2, 9)), [slice(4, 6), slice(8, 9)])]
    [slice(2, 4, None), slice(6, 8, None)]
    """
    found, place = [], unit.met.start
    for run in [*sorted(done, key=lambda run: run.start), slice(unit.met.stop, unit.met.stop)]:
        if run.start > place:
            found.append((unit, slice(place, run.start)))
        place = max(place, run.stop)
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class _Grid:
    """Samples of a row: time of the first and interval, s, and number of samples."""

    first: float
    step: float
    count: int

    def between(self, begin: float, end: float) -> slice:
        """Samples from ``begin`` to before ``end``, s; samples on a border are left out."""
        return self._rounded(begin, end, 1e-9)

    def around(self, begin: float, end: float) -> slice:
        """Samples as of `between`; samples on a border are included."""
        return self._rounded(begin, end, -1e-9)

    def _rounded(self, begin: float, end: float, margin: float) -> slice:
        low = math.ceil((begin - self.first) / self.step + margin)
        high = math.ceil((end - self.first) / self.step - margin)
        low = min(max(low, 0), self.count)
        return slice(low, min(max(high, low), self.count))


class _Run(NamedTuple):
    """Links of one part, all weak or all strong; their least limit, and the limit of their sum."""

    part: int
    low: int
    high: int
    least: float
    limit: float


def _runs(links: LinkTable, snapshot: int, floor: float) -> list[_Run]:
    """Runs of a snapshot's links."""
    low, high = int(links.start[snapshot]), int(links.start[snapshot + 1])
    kind = 2 * links.part[low:high] + links.is_weak[low:high]
    kinds = np.arange(2 * int(links.part.max(initial=0)) + 3)
    borders = low + np.searchsorted(kind, kinds)
    found = []
    for number, (a, b) in enumerate(pairwise(borders.tolist())):
        if b > a:
            root = math.sqrt(float(np.sum(np.abs(links.amplitude[a:b]) ** 2)))
            least = float(links.limit[a:b].min())
            found.append(_Run(number // 2, a, b, least, 0.25 * floor / max(root, 1e-300)))
    return found


def _is_met(grid: _Grid, overlap: Overlap, half: float) -> bool:
    last = grid.first + (grid.count - 1) * grid.step
    begins, ends = overlap.first_begin - half, overlap.last_end + half
    return overlap.highest >= 0.0 and begins < last and grid.first < ends


def _largest_gain(taps: Taps, far: float, grid: _Grid, overlap: Overlap) -> float:
    """Bound on a link's gain: ∞ near the band, else the values of an integral's two ends.

    An end far out of band has the value h/2πf, and terms of at most half of that follow. Here h is
    taken at the edges of its support unless a chirp begins or ends in a sample's window.
    """
    if overlap.lowest < far:
        return math.inf
    last = grid.first + (grid.count - 1) * grid.step
    cut = overlap.last_begin + taps.half > grid.first or overlap.first_end - taps.half < last
    return 3.0 * (taps.peak if cut else taps.edge) / (2.0 * math.pi * overlap.lowest)
