"""New points at the peaks of a map, before they are fitted together with all others.

A peak is tried once in a search. It gives a new point if the residual there, after a search of the
acceleration, has the power of a point and all ramps agree that it is one. Where the powers of all
ramps together are too low for a point, no acceleration is looked for.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.jit import compiled, inlined
from polychirp.receiver.coherent.acceleration import Accelerations, accelerated
from polychirp.receiver.coherent.agreement import Agreement
from polychirp.receiver.coherent.coherent_map import CoherentMap
from polychirp.receiver.coherent.least_squares import fitted
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.peaks import GREATEST_LOSS, Peaks
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.residue import Bodies, with_residues
from polychirp.receiver.coherent.smear import likeliest_motions

MOST_AT_ONCE = 20
"""Greatest number of new points that are added together; chosen."""

MOST_SMEARED = 8
"""Number of the strongest peaks that are tried together if they show no points; chosen."""

PEAKS_AT_ONCE = 32
"""Number of peaks whose ramps are looked at together, at first; chosen: mostly one is a point."""

MOST_AGAIN = 150
"""Number of peaks that are measured again after others are subtracted; chosen: fewer are left after
the first points."""

GREATEST_SPREAD = 0.01
"""Least power of a new point over the strongest new one of a map; chosen: most side lobes are
below, and noise is measured anew for the next map."""

SHARED_BEATS = 0.2
"""Share of the ramps on which a peak may have the beats of a stronger new one; chosen: peaks of one
point's up-beats alone have one half of the ramps in common with it."""

CLOSE_BEATS = 3.0
"""Difference of two beats, in resolutions of a ramp, below which they count as the same; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trial:
    """A trial of peaks: the residual that shows them, and what is looked for in it.

    Parameters
    ----------
    seen_map : the map of the peaks
    bodies : those that are subtracted from the residual
    accelerations : that are looked for
    threshold : power of a point over its floor
    is_tried : mask of the map's cells that have been tried, ``(range rate, range)``, which trials
        set in place
    """

    seen: Observation
    seen_map: CoherentMap
    residual: Residual
    bodies: Bodies
    accelerations: Accelerations
    threshold: float
    is_tried: BoolArray

    @classmethod
    def of(
        cls,
        seen_map: CoherentMap,
        residual: Residual,
        accelerations: Accelerations,
        *,
        threshold: float,
        is_tried: BoolArray,
    ) -> "Trial":
        """The trial of peaks that a residual shows."""
        return cls(
            seen=seen_map.seen,
            seen_map=seen_map,
            residual=residual,
            bodies=Bodies.of(seen_map.seen, residual.points),
            accelerations=accelerations,
            threshold=threshold,
            is_tried=is_tried,
        )

    def after(self, residual: Residual) -> "Trial":
        """The trial of the same peaks in another residual."""
        if residual is self.residual:
            return self
        return replace(self, residual=residual, bodies=Bodies.of(self.seen, residual.points))

    def left(self, found: Peaks) -> Peaks:
        """The peaks that have not been tried."""
        return found[~self.is_tried[tuple(found.cell.T)]]

    def shows_points(self, found: Peaks) -> BoolArray:
        """Mask of the peaks at which the ramps show points."""
        return self.seen_map.shows_points(found.cell, found.floor, GREATEST_LOSS * self.threshold)

    def mark(self, found: Peaks) -> None:
        """Set the cells of peaks and those next to them as tried."""
        for i, j in found.cell:
            self.is_tried[max(0, i - 1) : i + 2, max(0, j - 1) : j + 2] = True

    def may_show_points(self, found: Peaks) -> BoolArray:
        """Mask of the peaks at which an acceleration may show points, ``(peak,)``.

        At the others, no phases from ramp to ramp give the power of a point that stands out of what
        the bodies leave there.
        """
        start = _at(found, self.seen)
        most = Agreement.at(self.seen, self.residual, start).greatest_power(start.floor)
        floor = with_residues(self.seen, start, self.bodies).floor
        return np.asarray(most > self.threshold * floor, dtype=np.bool_)

    def starts(self, found: Peaks) -> tuple[Points, BoolArray]:
        """Starts at the peaks, accelerated where this helps, and a mask of those that are points.

        They have the amplitudes that fit there. Their floors hold what the bodies leave that are
        subtracted from the residual.
        """
        start = _at(found, self.seen)
        if not len(start):
            return start, np.zeros(0, dtype=np.bool_)
        start = accelerated(self.seen, self.residual, start, self.accelerations)
        start = with_residues(self.seen, fitted(self.seen, self.residual, start), self.bodies)
        shown = Agreement.at(self.seen, self.residual, start)
        return start, shown.shows_points(start.floor, self.threshold)


def _at(found: Peaks, seen: Observation) -> Points:
    """Points without amplitudes at peaks."""
    zero = np.zeros(found.range.size)
    return Points(
        motion=np.stack([found.range, found.range_rate, zero, zero], axis=-1),
        amplitude=np.zeros((zero.size, seen.samples.shape[0]), dtype=np.complex128),
        floor=found.floor,
        sine=zero,
        growth=zero,
        power=zero,
    )


def new_points(trial: Trial, found: Peaks) -> Points:
    """The first points that peaks show which have not been tried; none if no peak shows any."""
    is_any = True
    fresh = Points.none(trial.seen.samples.shape[0])
    while is_any and not len(fresh):
        found = trial.left(found)
        fresh, is_any = plain_points(trial, found, smeared_points(trial, found))
    return fresh


def further_points(trial: Trial, found: Peaks, fresh: Points) -> Points:
    """The new points ``fresh``, and all that other peaks show.

    Peaks that share beats are tried one after the other, until one of them is a point.
    """
    is_any = True
    while is_any and len(fresh) < MOST_AT_ONCE:
        fresh, is_any = plain_points(trial, trial.left(found), fresh)
    return fresh


def plain_points(trial: Trial, found: Peaks, fresh: Points) -> tuple[Points, bool]:
    """The new points ``fresh``, those at peaks without their beats, and if any has been tried."""
    is_bright = found.power >= GREATEST_SPREAD * np.max(fresh.strength, initial=0.0)
    found = bright_points(trial, apart(trial.seen, found[is_bright], fresh))
    tried = found[distinct(trial.seen, _motion(found), found.power)]
    if not len(tried.power):
        return fresh, False
    trial.mark(tried)
    start, is_point = trial.starts(tried[trial.may_show_points(tried)])
    return fresh + start[is_point], True


def bright_points(trial: Trial, found: Peaks) -> Peaks:
    """The peaks that show points, without those much weaker than the strongest of them."""
    found = found[np.argsort(-found.power, kind="stable")]
    first, count = 0, PEAKS_AT_ONCE
    while first < found.power.size:
        is_point = trial.shows_points(found[first : first + count])
        if np.any(is_point):
            strongest = found.power[first + int(np.argmax(is_point))]
            found = found[first:][found.power[first:] >= GREATEST_SPREAD * strongest]
            return found[trial.shows_points(found)]
        first, count = first + count, 2 * count
    return found[:0]


def smeared_points(trial: Trial, found: Peaks) -> Points:
    """New points at the strongest peaks if the very strongest shows none.

    An acceleration may have smeared it: the ramps agree only after its correction, and it succeeds
    from some of the peaks that the point causes, or from where single ramps have most power beside
    the strongest (`smear`). Peaks that show no point are marked as tried.
    """
    found = found[np.argsort(-found.power, kind="stable")[:MOST_SMEARED]]
    if not len(found.power) or trial.shows_points(found[:1])[0]:
        return Points.none(trial.seen.samples.shape[0])
    may_be = trial.may_show_points(found)
    trial.mark(found[~may_be])
    found = found[may_be]
    start, is_point = trial.starts(found)
    if len(found.power) and not np.any(is_point):
        trial.mark(found)
        # one start suffices: the strongest peaks are mostly those of one body
        motion = likeliest_motions(trial.seen, trial.residual, _at(found[:1], trial.seen))
        found = replace(found[:1], range=motion[:, 0], range_rate=motion[:, 1])
        start, is_point = trial.starts(found)
    trial.mark(found[~is_point])
    start, found = start[is_point], found[is_point]
    best = distinct(trial.seen, start.motion, start.strength)
    trial.mark(found[best])
    return start[best]


def apart(seen: Observation, found: Peaks, fresh: Points) -> Peaks:
    """The peaks that have the beats of no new point."""
    return found[~np.any(shares_beats(seen, _motion(found), fresh.motion), axis=1)]


def still_shown(trial: Trial, found: Peaks) -> Peaks:
    """The strongest peaks at which the residual still shows points."""
    found = trial.left(found)
    found = found[trial.shows_points(found)]
    found = found[np.argsort(-found.power, kind="stable")[:MOST_AGAIN]]
    shown = Agreement.at(trial.seen, trial.residual, _at(found, trial.seen))
    ratio = shown.power / found.floor
    is_point = (ratio > trial.threshold) & shown.shows_points(found.floor, trial.threshold)
    return replace(found, ratio=ratio)[is_point]


def distinct(seen: Observation, motion: FloatArray, power: FloatArray) -> IntArray:
    """Numbers of the strongest places; none has the beats of a stronger one, as side lobes have.

    Parameters
    ----------
    motion : range, m, and range rate, m/s, in the first columns, ``(place, …)``
    power : W, ``(place,)``
    """
    order = np.argsort(-power, kind="stable")[: 8 * MOST_AT_ONCE]
    order = order[power[order] >= GREATEST_SPREAD * np.max(power, initial=0.0)]
    taken = _distinct(_cells(seen, motion[order]), seen.count.size * SHARED_BEATS, MOST_AT_ONCE)
    return np.asarray(order[taken])


def shares_beats(seen: Observation, motion: FloatArray, others: FloatArray) -> BoolArray:
    """Mask of pairs of places that have the same beats on many ramps, ``(place, other place)``."""
    out = np.empty((len(motion), len(others)), dtype=np.bool_)
    _shares(_cells(seen, motion), _cells(seen, others), seen.count.size * SHARED_BEATS, out)
    return out


def _cells(seen: Observation, motion: FloatArray) -> FloatArray:
    """Beats of places on every ramp, in resolutions of the ramp, ``(place, ramp)``."""
    duration = seen.model.times.num_samples / seen.model.times.rate
    return np.asarray(seen.model.beats(motion[:, 0], motion[:, 1]) * duration)


@inlined
def _are_same(here: Any, there: Any, least: float) -> bool:  # pragma: no cover - compiled
    """True if two places have the same beats on ``least`` ramps or more."""
    count = 0
    for k in range(here.size):
        count += abs(here[k] - there[k]) < CLOSE_BEATS
    return count >= least


@compiled
def _shares(here: Any, there: Any, least: float, out: Any) -> None:  # pragma: no cover - compiled
    for n in range(len(here)):
        for p in range(len(there)):
            out[n, p] = _are_same(here[n], there[p], least)


@compiled
def _distinct(cells: Any, least: float, most: int) -> Any:  # pragma: no cover - compiled
    """Numbers of at most ``most`` places, none of which has the beats of one before it."""
    taken, count = np.empty(most, dtype=np.int64), 0
    for n in range(len(cells)):
        is_new = count < most
        for i in range(count):
            is_new = is_new and not _are_same(cells[n], cells[taken[i]], least)
        if is_new:
            taken[count] = n
            count += 1
    return taken[:count].copy()


def _motion(found: Peaks) -> FloatArray:
    return np.stack([found.range, found.range_rate], axis=-1)
