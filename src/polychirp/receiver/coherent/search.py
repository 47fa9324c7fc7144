"""The search for points: the strongest peaks are fitted and subtracted until noise is left.

This is orthogonal matching pursuit with Newton steps (Mamandipoor, Ramasamy and Madhow 2016): after
each set of new points all points are fitted again, and the map of what they leave shows the next.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray
from polychirp.receiver.coherent.acceleration import accelerated
from polychirp.receiver.coherent.coherent_map import coherent_map
from polychirp.receiver.coherent.false_alarms import threshold_of
from polychirp.receiver.coherent.least_squares import gauss_newton
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import LEAST_COUPLING, couplings, groups_of
from polychirp.receiver.coherent.peaks import Peaks, floors, peaks
from polychirp.receiver.coherent.points import Points, without
from polychirp.receiver.coherent.refinement import (
    divided,
    overlaps_another,
    pruned,
    relaxed,
)
from polychirp.receiver.signal_model.grid import Grid

MOST_AT_ONCE = 20
"""Greatest number of new points between two maps; chosen: the maps take as long as their fit."""

GREATEST_SPREAD = 0.01
"""Least power of a new point over the strongest new one; chosen: most side lobes are below."""

FALSE_PAIR_PROBABILITY = 1e-5
"""Probability, per resolution cell, with which noise makes a second point beside one; chosen: fewer
cells are tried than in the map, so that less is needed."""

SHARED_BEATS = 0.2
"""Share of the ramps on which a peak may have the beats of a stronger new one; chosen: peaks of one
point's up-beats alone have one half of the ramps in common with it."""

CLOSE_BEATS = 3.0
"""Difference of two beats, in resolutions of a ramp, below which they count as the same; chosen."""

SWEEPS_OF_NEW_POINTS, SWEEPS_OF_ALL, LAST_SWEEPS = 12, 2, 6
"""Greatest numbers of sweeps of fits; chosen: they end before where steps are not worth taking."""


def find_points(
    seen: Observation,
    axes: Grid,
    *,
    threshold: float,
    dynamic_range: float,
    most: int,
) -> Points:
    """Points whose power exceeds ``threshold`` times the noise power of a sample.

    Parameters
    ----------
    dynamic_range : power ratio of the map's greatest value to the weakest peak that is tried
    most : number of points at which the search ends
    """
    points, residual, top = Points.none(seen.samples.shape[0]), seen.samples, 0.0
    is_tried = np.zeros((axes.range_rate.size, axes.range.size), dtype=bool)
    while True:
        power = coherent_map(seen, residual, axes)
        floor = floors(power, seen.samples.shape[0])
        points = with_floors(points, floor, axes)
        points, residual = strong(seen, residual, points, threshold)
        top = max(top, float(power.max()))
        found = peaks(power, floor, axes, threshold)
        is_new = ~is_tried[tuple(found.cell.T)] & (found.power * dynamic_range >= top)
        if not np.any(is_new) or len(points) >= most:
            break
        found = unrelated(seen, found[is_new])
        for i, j in found.cell:
            is_tried[max(0, i - 1) : i + 2, max(0, j - 1) : j + 2] = True
        points, residual = added(seen, residual, points, starts(seen, residual, found))
    points, residual = relaxed(seen, residual, points, sweeps=LAST_SWEEPS)
    least = threshold_of(FALSE_PAIR_PROBABILITY, num_channels=seen.samples.shape[0])
    points, residual = divided(seen, residual, points, least)
    points, residual = pruned(seen, residual, points, min(least, threshold))
    needed = np.where(overlaps_another(seen, points), min(least, threshold), threshold)
    return points[points.power >= needed]


def with_floors(points: Points, floor: NDArray[np.float32], axes: Grid) -> Points:
    """Points with the floors of the cells in which they are."""
    row = np.rint((points.motion[:, 1] - axes.range_rate[0]) / axes.range_rate_step)
    column = np.rint((points.motion[:, 0] - axes.range[0]) / axes.range_step)
    cell = tuple(
        np.clip(place, 0, size - 1).astype(np.int64)
        for place, size in zip((row, column), floor.shape, strict=True)
    )
    own = floor[cell].astype(np.float64)
    return replace(points, floor=own, power=points.power * points.floor / own)


def strong(
    seen: Observation, residual: ComplexArray, points: Points, threshold: float
) -> tuple[Points, ComplexArray]:
    """The points above the threshold, and the residual to which the others are added again."""
    is_weak = points.power < threshold
    if np.any(is_weak):
        residual = without(seen, residual, points[is_weak].negated)
    return points[~is_weak], residual


def unrelated(seen: Observation, found: Peaks) -> Peaks:
    """The strongest peaks; none has the beats of a stronger one, whose side lobe it may be."""
    order = np.argsort(-found.power, kind="stable")[: 8 * MOST_AT_ONCE]
    found = found[order]
    beats = seen.model.beats(found.range, found.range_rate)
    times = seen.model.times
    apart = np.abs(beats[:, None] - beats) * times.num_samples / times.rate
    is_related = np.mean(apart < CLOSE_BEATS, axis=-1) >= SHARED_BEATS
    taken: list[int] = []
    for n in range(len(beats)):
        is_bright = found.power[n] >= GREATEST_SPREAD * found.power[0]
        if is_bright and not np.any(is_related[n, taken]):
            taken.append(n)
    return found[np.array(taken[:MOST_AT_ONCE])]


def starts(seen: Observation, residual: ComplexArray, found: Peaks) -> Points:
    """Points at the peaks, accelerated where this helps, with the amplitudes that fit there."""
    zero = np.zeros(found.range.size)
    points = Points(
        motion=np.stack([found.range, found.range_rate, zero, zero], axis=-1),
        amplitude=np.zeros((zero.size, seen.samples.shape[0]), dtype=np.complex128),
        floor=found.floor,
        sine=zero,
        power=zero,
    )
    points = accelerated(seen, residual, points)
    for group in groups_of(seen, points):
        fitted = gauss_newton(seen, residual, points[group], share=0.0)
        points = points.replaced(group, fitted.points)
    return points


def added(
    seen: Observation, residual: ComplexArray, points: Points, fresh: Points
) -> tuple[Points, ComplexArray]:
    """All points, fitted again: first the new ones with their neighbours, then all."""
    every = points + fresh
    residual = without(seen, residual, fresh)
    coupling = couplings(seen, every)[len(points) :]
    near = np.flatnonzero(np.max(coupling, axis=0) > LEAST_COUPLING)
    moved, residual = relaxed(seen, residual, every[near], sweeps=SWEEPS_OF_NEW_POINTS)
    return relaxed(seen, residual, every.replaced(near, moved), sweeps=SWEEPS_OF_ALL)
