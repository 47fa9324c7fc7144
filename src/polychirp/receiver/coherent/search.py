"""The search for points: the strongest peaks are fitted and subtracted until noise is left.

This is orthogonal matching pursuit with Newton steps (Mamandipoor, Ramasamy and Madhow 2016): after
each set of new points all points are fitted again, and the map of what they leave shows the next.
"""

from dataclasses import replace

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.receiver.coherent.acceleration import accelerated
from polychirp.receiver.coherent.agreement import Agreement
from polychirp.receiver.coherent.coherent_map import CoherentMap, channel_covariance, coherent_map
from polychirp.receiver.coherent.false_alarms import threshold_of
from polychirp.receiver.coherent.least_squares import fitted
from polychirp.receiver.coherent.noise import ramp_weights, whitening
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import LEAST_COUPLING
from polychirp.receiver.coherent.peaks import Peaks, floors, peaks
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.profiles import Profiles
from polychirp.receiver.coherent.refinement import (
    SWEEPS_OF_ALL,
    divided,
    overlaps_another,
    pruned,
    relaxed,
    settled,
)
from polychirp.receiver.coherent.replicas import Replicas, correlations
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.residue import with_residues
from polychirp.receiver.signal_model.grid import Grid

MOST_AT_ONCE = 20
"""Greatest number of new points between two maps; chosen: the maps take as long as their fit."""

MOST_SMEARED = 8
"""Number of the strongest peaks that are tried together if they show no points; chosen."""

GREATEST_SPREAD = 0.01
"""Least power of a new point over the strongest new one; chosen: most side lobes are below."""

FALSE_PAIR_PROBABILITY = 1e-5
"""Probability, per resolution cell, with which noise makes a second point beside one; chosen: fewer
cells are tried than in the map, so that less is needed."""

GAIN_OF_NEW_POINTS = 5.0
"""Fall of the residual's power, in units of a floor, for which a step is taken between two maps;
chosen: below what makes a peak."""

SHARED_BEATS = 0.2
"""Share of the ramps on which a peak may have the beats of a stronger new one; chosen: peaks of one
point's up-beats alone have one half of the ramps in common with it."""

CLOSE_BEATS = 3.0
"""Difference of two beats, in resolutions of a ramp, below which they count as the same; chosen."""

SWEEPS_OF_NEW_POINTS, LAST_SWEEPS = 12, 6
"""Greatest numbers of sweeps of fits; chosen: they end before where steps are not worth taking."""


def find_points(
    seen: Observation,
    axes: Grid,
    *,
    threshold: float,
    dynamic_range: float,
    most: int,
) -> tuple[Points, Observation]:
    """Points whose power exceeds ``threshold`` times the noise power of a sample.

    The observation comes back with the noise that they leave.

    Parameters
    ----------
    dynamic_range : power ratio of the map's greatest value to the weakest peak that is tried
    most : number of points at which the search ends
    """
    channels = seen.samples.shape[0]
    points, top = Points.none(channels), 0.0
    if not np.any(seen.present):
        return points, seen
    residual = Residual.of(seen, points)
    is_tried = np.zeros((axes.range_rate.size, axes.range.size), dtype=bool)
    is_white = False
    while True:
        seen, profiles = adapted(seen, residual, axes, is_white=is_white)
        seen_map = coherent_map(seen, profiles)
        points = with_floors(points, seen_map, axes)
        points, residual = strong(seen, residual, points, threshold)
        top = max(top, float(seen_map.power.max()), float(np.max(points.strength, initial=0.0)))
        found = peaks(seen_map, axes, threshold)
        found = found[found.power * dynamic_range >= top]
        fresh = new_points(seen, residual, found, is_tried, threshold)
        if is_white and (not len(fresh) or len(points) >= most):
            break
        if len(fresh):
            points, residual = added(seen, residual, points, fresh)
        is_white = True
    points, residual = settled(seen, points, sweeps=LAST_SWEEPS)
    least = threshold_of(FALSE_PAIR_PROBABILITY, num_channels=channels)
    points, residual = divided(seen, residual, points, least)
    points, residual = pruned(seen, residual, points, min(least, threshold))
    kept = standing_out(seen, with_residues(seen, points), threshold, dynamic_range)
    if len(kept) < len(points):
        kept, _ = settled(seen, kept, sweeps=LAST_SWEEPS)
        kept = standing_out(seen, kept, threshold, dynamic_range)
    return kept, seen


def standing_out(
    seen: Observation, points: Points, threshold: float, dynamic_range: float
) -> Points:
    """The points above the threshold, or above a lower one if they overlap another.

    Those below the dynamic range are left out: beside a strong point, they are made of what was not
    tried and of what its model lacks.
    """
    least = threshold_of(FALSE_PAIR_PROBABILITY, num_channels=points.amplitude.shape[1])
    needed = np.where(overlaps_another(seen, points), min(least, threshold), threshold)
    weakest = np.max(points.strength, initial=0.0) / dynamic_range
    return points[(points.power >= needed) & (points.strength >= weakest)]


def adapted(
    seen: Observation, residual: Residual, axes: Grid, *, is_white: bool
) -> tuple[Observation, Profiles]:
    """The observation with the noise that the residual shows, and its profiles.

    The channels are made white only if ``is_white``: side lobes of a strong point fill the map, and
    would count as noise from its direction.
    """
    seen = replace(seen, weight=ramp_weights(seen, residual.samples))
    profiles = Profiles.of(seen, residual.spectra, axes)
    if not is_white:
        return seen, profiles
    mixing = whitening(channel_covariance(seen, profiles))
    return replace(seen, mixing=mixing), profiles.mixed(mixing)


def with_floors(points: Points, seen_map: CoherentMap, axes: Grid) -> Points:
    """Points with the floors of the cells in which they are."""
    row = np.rint((points.motion[:, 1] - axes.range_rate[0]) / axes.range_rate_step)
    column = np.rint((points.motion[:, 0] - axes.range[0]) / axes.range_step)
    last = np.array(seen_map.power.shape) - 1
    cell = np.clip(np.stack([row, column], axis=1), 0, last).astype(np.int64)
    own = floors(seen_map, cell)
    return replace(points, floor=own, power=points.power * points.floor / own)


def new_points(
    seen: Observation, residual: Residual, found: Peaks, is_tried: BoolArray, threshold: float
) -> Points:
    """The first points that peaks show which have not been tried; none if no peak shows any."""
    while True:
        found = found[~is_tried[tuple(found.cell.T)]]
        fresh = smeared_points(seen, residual, found, is_tried, threshold)
        fresh = plain_points(seen, residual, found, fresh, is_tried, threshold)
        if len(fresh) or not np.any(found.is_point):
            return fresh


def plain_points(
    seen: Observation,
    residual: Residual,
    found: Peaks,
    others: Points,
    is_tried: BoolArray,
    threshold: float,
) -> Points:
    """The new points ``others``, and those at peaks that show points and have no beats of theirs.

    ``is_tried`` is set at all peaks that are tried.
    """
    found = found[found.is_point]
    chosen = distinct(
        seen,
        np.append(others.motion[:, 0], found.range),
        np.append(others.motion[:, 1], found.range_rate),
        np.append(others.strength, found.power),
    )
    tried = found[chosen[chosen >= len(others)] - len(others)]
    mark(is_tried, tried)
    fresh = starts(seen, residual, tried)
    shown = Agreement.at(seen, residual, fresh)
    return others + fresh[shown.shows_points(fresh.floor, threshold)]


def smeared_points(
    seen: Observation, residual: Residual, found: Peaks, is_tried: BoolArray, threshold: float
) -> Points:
    """New points at the strongest peaks if the very strongest shows none.

    An acceleration may have smeared it: the ramps agree only after its correction, and it succeeds
    from some of the peaks that the point causes. ``is_tried`` is set at those that show no point.
    """
    found = found[np.argsort(-found.power, kind="stable")[:MOST_SMEARED]]
    if not len(found.power) or found.is_point[0]:
        return Points.none(seen.samples.shape[0])
    fresh = starts(seen, residual, found)
    shown = Agreement.at(seen, residual, fresh)
    is_point = shown.shows_points(fresh.floor, threshold)
    mark(is_tried, found[~is_point])
    best = distinct(seen, fresh.motion[:, 0], fresh.motion[:, 1], shown.power)
    best = best[is_point[best]]
    mark(is_tried, found[best])
    return fresh[best]


def mark(is_tried: BoolArray, found: Peaks) -> None:
    """Set the cells of peaks and those next to them, in place."""
    for i, j in found.cell:
        is_tried[max(0, i - 1) : i + 2, max(0, j - 1) : j + 2] = True


def strong(
    seen: Observation, residual: Residual, points: Points, threshold: float
) -> tuple[Points, Residual]:
    """The points above the threshold, and the residual to which the others are added again.

    The weights of the residual are those of the observation.
    """
    is_weak = points.power < threshold
    if not np.any(is_weak):
        return points, residual.weighted(seen)
    points = points[~is_weak]
    return points, Residual.of(seen, points)


def distinct(
    seen: Observation, distance: FloatArray, range_rate: FloatArray, power: FloatArray
) -> IntArray:
    """Numbers of the strongest places; none has the beats of a stronger one, as side lobes have."""
    order = np.argsort(-power, kind="stable")[: 8 * MOST_AT_ONCE]
    beats = seen.model.beats(distance[order], range_rate[order])
    times = seen.model.times
    apart = np.abs(beats[:, None] - beats) * times.num_samples / times.rate
    is_related = np.mean(apart < CLOSE_BEATS, axis=-1) >= SHARED_BEATS
    taken: list[int] = []
    for n, place in enumerate(order):
        is_bright = power[place] >= GREATEST_SPREAD * power[order[0]]
        if is_bright and not np.any(is_related[n, taken]):
            taken.append(n)
    return order[np.array(taken[:MOST_AT_ONCE], dtype=np.int64)]


def starts(seen: Observation, residual: Residual, found: Peaks) -> Points:
    """Points at the peaks, accelerated where this helps, with the amplitudes that fit there.

    Their floors hold what the bodies leave that are subtracted from the residual.
    """
    zero = np.zeros(found.range.size)
    points = Points(
        motion=np.stack([found.range, found.range_rate, zero, zero], axis=-1),
        amplitude=np.zeros((zero.size, seen.samples.shape[0]), dtype=np.complex128),
        floor=found.floor,
        sine=zero,
        power=zero,
    )
    points = fitted(seen, residual, accelerated(seen, residual, points))
    return with_residues(seen, points, residual.points)


def added(
    seen: Observation, residual: Residual, points: Points, fresh: Points
) -> tuple[Points, Residual]:
    """All points, fitted again: first the new ones with their neighbours, then all.

    If the residual's power does not fall, the two halves of the new ones are added one after the
    other: one start that leads nowhere does not cost the others.
    """
    every, after = refitted(seen, residual, points, fresh)
    if after.energy < residual.energy:
        return every, after
    if len(fresh) > 1:
        half = np.arange(len(fresh)) < (len(fresh) + 1) // 2
        for part in (half, ~half):
            points, residual = added(seen, residual, points, fresh[part])
    return points, residual


def refitted(
    seen: Observation, residual: Residual, points: Points, fresh: Points
) -> tuple[Points, Residual]:
    """All points, fitted again, and what they leave."""
    every = points + fresh
    replicas = Replicas.of(seen, every)
    coupling = correlations(seen, replicas[len(points) :], replicas)
    near = np.flatnonzero(np.max(coupling, axis=0) > LEAST_COUPLING)
    every, _ = relaxed(
        seen, residual, every, sweeps=SWEEPS_OF_NEW_POINTS, free=near, least_gain=GAIN_OF_NEW_POINTS
    )
    every, _ = relaxed(seen, residual, every, sweeps=SWEEPS_OF_ALL, least_gain=GAIN_OF_NEW_POINTS)
    return every, Residual.of(seen, every)
