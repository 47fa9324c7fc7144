"""Early stopping of points whose detection probability is known well enough.

A decision is based on trials 0…k−1, where k is a multiple of `TRIALS_PER_DECISION`, so that it does
not depend on the number of workers or on the order of outcomes. Trials from k on that had already
begun stay in the log and are left out of the results.
"""

import math
from collections.abc import Sequence
from operator import and_
from typing import Final

import numpy as np

from polychirp.scoring.statistics import proportion
from polychirp.study.monte_carlo.records import VictimRecord

TRIALS_PER_DECISION: Final = 20
"""Number of trials of a point between two decisions on whether it stops; chosen."""

Counts = dict[str, tuple[int, int]]
"""Numbers of targets in sight that are detected, and of all in sight, in one trial, by the name of
the victim."""


def counts_of(victims: Sequence[VictimRecord]) -> Counts:
    """Number of detected targets in sight, and of all in sight, of each victim of a trial."""
    return {
        v.name: (sum(map(and_, v.is_detected, v.is_in_sight)), sum(v.is_in_sight)) for v in victims
    }


class Stopping:
    """Number of trials that each point needs (``limit``), reduced once its interval is narrow.

    Parameters
    ----------
    num_points : number of points of the grid
    trials : greatest number of trials of each point
    half_width : 95 % interval's half width at which a point stops; None: no point stops early
    """

    def __init__(self, *, num_points: int, trials: int, half_width: float | None) -> None:
        self.limit = [trials] * num_points
        self._half_width = half_width
        self._done: list[dict[int, Counts | None]] = [{} for _ in range(num_points)]
        self._prefix = [0] * num_points

    def add(self, point: int, trial: int, counts: Counts | None) -> None:
        """Count a finished trial; ``counts`` is None if it failed."""
        self._done[point][trial] = counts
        while self._prefix[point] in self._done[point]:
            size = self._prefix[point] = self._prefix[point] + 1
            if size % TRIALS_PER_DECISION == 0 and self._is_narrow(point, size):
                self.limit[point] = min(self.limit[point], size)

    def num_done(self) -> int:
        """Number of trials that are done, over all points, without those that are not needed."""
        pairs = zip(self._done, self.limit, strict=True)
        return sum(sum(n < limit for n in done) for done, limit in pairs)

    def _is_narrow(self, point: int, size: int) -> bool:
        """True if all victims with targets in sight have narrow intervals after ``size`` trials."""
        if self._half_width is None:
            return False
        done = self._done[point]
        trials = [counts for n in range(size) if (counts := done[n]) is not None]
        names = {name for counts in trials for name in counts}
        widths = [_half_width([counts.get(name, (0, 0)) for counts in trials]) for name in names]
        known = [width for width in widths if not math.isnan(width)]
        return bool(known) and max(known) <= self._half_width


def _half_width(counts: Sequence[tuple[int, int]]) -> float:
    detected, visible = np.array(counts, dtype=np.float64).T
    return proportion(detected, visible).half_width
