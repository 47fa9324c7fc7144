"""When a point has had enough trials: decided on whole blocks from the first trial on.

A decision looks at trials 0…k−1 with k a multiple of `BLOCK`, whichever worker ran them and in
whatever order they came back, so that it is the same for any number of workers. Trials beyond
the stop that had begun meanwhile are kept on disk and left out of the results.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from polychirp.scoring.statistics import proportion
from polychirp.study.monte_carlo.records import VictimRecord

BLOCK: Final = 20
"""Trials between two looks at an interval."""

Counts = dict[str, tuple[int, int]]
"""Of each victim: targets found, targets in sight."""


def counts_of(victims: Sequence[VictimRecord]) -> Counts:
    """Targets found and targets in sight of each victim of a trial."""
    return {v.name: (sum(v.is_detected), sum(v.is_visible)) for v in victims}


class Stopping:
    """Of every point: how many trials it needs, as far as that is known.

    Parameters
    ----------
    num_points : of the grid
    trials : of each point, at most
    half_width : of the interval at which a point stops; None means never
    """

    def __init__(self, *, num_points: int, trials: int, half_width: float | None) -> None:
        self.limit = [trials] * num_points
        self._half_width = half_width
        self._done: list[dict[int, Counts | None]] = [{} for _ in range(num_points)]
        self._prefix = [0] * num_points

    def add(self, point: int, trial: int, counts: Counts | None) -> None:
        """Take note of a trial; ``counts`` is None where it failed."""
        self._done[point][trial] = counts
        while self._prefix[point] in self._done[point]:
            self._prefix[point] += 1
            if self._prefix[point] % BLOCK == 0 and self._is_narrow(point, self._prefix[point]):
                self.limit[point] = min(self.limit[point], self._prefix[point])

    def num_done(self) -> int:
        """Trials done of those that are needed."""
        pairs = zip(self._done, self.limit, strict=True)
        return sum(sum(n < limit for n in done) for done, limit in pairs)

    def _is_narrow(self, point: int, size: int) -> bool:
        """Whether ``size`` trials tell enough of every victim that had targets in sight."""
        if self._half_width is None:
            return False
        done = self._done[point]
        trials = [counts for n in range(size) if (counts := done[n]) is not None]
        names = {name for counts in trials for name in counts}
        widths = [_half_width([counts.get(name, (0, 0)) for counts in trials]) for name in names]
        known = [width for width in widths if not math.isnan(width)]
        return bool(known) and max(known) <= self._half_width


def _half_width(counts: Sequence[tuple[int, int]]) -> float:
    hits, seen = np.array(counts, dtype=np.float64).T
    return proportion(hits, seen).half_width
