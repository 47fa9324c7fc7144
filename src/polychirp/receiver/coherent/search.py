"""The search for points: the strongest peaks are fitted and subtracted until noise is left.

This is orthogonal matching pursuit with Newton steps (Mamandipoor, Ramasamy and Madhow 2016): after
each set of new points all points are fitted again, and the map of what they leave shows the next.
"""

import warnings
from dataclasses import replace

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.errors import ModelWarning
from polychirp.receiver.coherent.acceleration import Accelerations
from polychirp.receiver.coherent.agreement import Agreement
from polychirp.receiver.coherent.coherent_map import CoherentMap, channel_covariance, coherent_map
from polychirp.receiver.coherent.crossing import uncrossed
from polychirp.receiver.coherent.false_alarms import threshold_of
from polychirp.receiver.coherent.growth import grown, without_growth
from polychirp.receiver.coherent.new_points import (
    GREATEST_SPREAD,
    Trial,
    apart,
    further_points,
    new_points,
    plain_points,
    shares_beats,
    still_shown,
)
from polychirp.receiver.coherent.noise import ramp_weights, whitening
from polychirp.receiver.coherent.noise_directions import NoiseDirections
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import LEAST_COUPLING, overlaps_another
from polychirp.receiver.coherent.peaks import Peaks, floors, peaks
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.profiles import Profiles
from polychirp.receiver.coherent.refinement import (
    SWEEPS_OF_ALL,
    divided,
    lobes_beside,
    pruned,
    relaxed,
    settled,
)
from polychirp.receiver.coherent.replicas import Replicas, correlations
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.residue import Bodies, with_residues
from polychirp.receiver.signal_model.grid import Grid

FALSE_PAIR_PROBABILITY = 1e-5
"""Probability, per resolution cell, with which noise makes a second point beside one; chosen: fewer
cells are tried than in the map, so that less is needed."""

GAIN_OF_NEW_POINTS = 5.0
"""Fall of the residual's power, in units of a floor, for which a step is taken between two maps;
chosen: below what makes a peak."""

MOST_MAPS = 40
"""Greatest number of maps of a search. Chosen: frames of the paper's street take 11 at most, one
with a strong point of folded range rate takes 24, and one that other radars' signals fill 10 to 25,
a second each; there, further maps bring one new point or none.
"""

MOST_ROUGH_MAPS = 2
"""Greatest number of maps of one channel that look for strong points first; chosen: further ones
show few."""

MOST_UNCROSSED = 2
"""Greatest number of times that a search goes on after crossed points were put right; chosen:
vehicles need one or two, and points of other radars may go on for long."""

LEAST_OF_PAIR = 0.5
"""Power that one point in place of two leaves beside it, over that of a new point which may be a
side lobe of both, from which two are tried; chosen: of a point three cells away, whose own signal a
new one is, at most a tenth lies there."""

LEAST_EXPLAINED = 1.5
"""Power that two points explain in addition to one, over that of a new point in the map, from which
they take its place; chosen: a new point between cells of the map explains as much once it is
fitted. The smear of a point whose acceleration was not found yet is explained no better by two."""

OTHER_RATE = 2.0
"""Difference of range rates, in cells λ/2T, from which a new point may be such a side lobe; chosen:
nearer ones are points of their own."""

SWEEPS_OF_NEW_POINTS, LAST_SWEEPS = 12, 6
"""Greatest numbers of sweeps of fits; chosen: they end before where steps are not worth taking."""


def find_points(
    seen: Observation,
    samples: Residual,
    axes: Grid,
    *,
    threshold: float,
    dynamic_range: float,
    most: int,
    residue_margin: float = 1.0,
) -> tuple[Points, Residual, Observation, int | None]:
    """Points whose power exceeds ``threshold`` times the noise power of a sample.

    With them come what they leave, and the observation with its noise. The search ends after
    `MOST_MAPS` maps in any case; the number of peaks that it did not try then comes last, for
    `warn_of_peaks`, and None otherwise.

    Parameters
    ----------
    samples : the residual of no points
    dynamic_range : power ratio of the strongest point to the weakest peak that is tried, and to the
        weakest point that is kept
    most : number of points at which the search ends
    residue_margin : power ratio by which, at the end, points that do not move with a near body
        stand out of what it leaves more than they do of noise
    """
    channels = seen.samples.shape[0]
    points, top = Points.none(channels), np.zeros(2)
    if not np.any(seen.present):
        return points, samples, seen, None
    residual, untried = samples, None
    accelerations = Accelerations.of(seen)
    memory = np.empty((axes.range_rate.size, axes.range.size), dtype=np.float32)  # of all maps
    is_tried = np.zeros(memory.shape, dtype=bool)
    num_rough, num_uncrossed = MOST_ROUGH_MAPS, 0
    for number in range(1, MOST_MAPS + 1):
        seen, profiles = adapted(seen, residual, axes, is_rough=num_rough > 0)
        residual = residual.weighted(seen)
        seen_map = coherent_map(seen, profiles, memory)
        points = with_floors(points, seen_map, axes)
        points, residual = strong(seen, residual, points, threshold)
        shown = float(seen_map.power.max()) if num_rough else 0.0
        top = np.maximum(top, np.max(strengths(seen, points), axis=1, initial=shown))
        found = away(seen, peaks(seen_map, axes, threshold))
        found = found[found.power * dynamic_range >= top.min()]
        trial = Trial.of(seen_map, residual, accelerations, threshold=threshold, is_tried=is_tried)
        before = residual
        points, trial, fresh = with_pairs(trial, points, new_points(trial, found))
        residual = trial.residual
        if residual is not before and not len(fresh):
            continue
        if num_rough == 0 and (not len(fresh) or len(points) >= most):
            before = residual
            points, residual = uncrossed(seen, residual, points)
            num_uncrossed += 1
            if residual is before or len(points) >= most or num_uncrossed > MOST_UNCROSSED:
                break
            continue
        if num_rough == 0:
            points, residual = all_added(trial, points, found, fresh, most=most)
        elif len(fresh):
            points, residual = added(seen, residual, points, fresh)
        num_rough = num_rough - 1 if num_rough and len(fresh) else 0
        if number == MOST_MAPS:
            trial = trial.after(residual)
            untried = int(np.count_nonzero(trial.shows_points(trial.left(found))))
    points, residual = finished(
        seen, residual, points, axes, threshold, dynamic_range, margin=residue_margin
    )
    return points, residual, seen, untried


def warn_of_peaks(number: int) -> None:
    """Warn of a search that ended before it tried ``number`` peaks."""
    warnings.warn(
        f"the receiver 'coherent' stopped after {MOST_MAPS} maps of a frame, with {number} peaks "
        "not tried: signals of other radars fill it; weak points may be missing. A mitigation, "
        "or a lower false_alarm_probability, leaves fewer peaks",
        ModelWarning,
        stacklevel=3,
    )


def finished(
    seen: Observation,
    residual: Residual,
    points: Points,
    axes: Grid,
    threshold: float,
    dynamic_range: float,
    *,
    margin: float,
) -> tuple[Points, Residual]:
    """The points that are left at the end of a search, fitted once more, and what they leave."""
    points, residual = settled(seen, residual, points, sweeps=LAST_SWEEPS)
    least = threshold_of(FALSE_PAIR_PROBABILITY, num_channels=points.amplitude.shape[1])
    points, residual = divided(seen, residual, points, least)
    points, residual = pruned(seen, residual, points, min(least, threshold))
    points, residual = above_noise(seen, residual, points, axes, threshold, dynamic_range)
    bodies = Bodies.of(seen, points)
    tested = with_residues(seen, points, bodies, margin=margin)
    kept = standing_out(seen, tested, threshold, dynamic_range)
    if len(kept) < len(points):
        kept, residual = settled(seen, residual.after(seen, kept), kept, sweeps=LAST_SWEEPS)
        kept = standing_out(seen, kept, threshold, dynamic_range)
    return kept, residual


def above_noise(
    seen: Observation,
    residual: Residual,
    points: Points,
    axes: Grid,
    threshold: float,
    dynamic_range: float,
) -> tuple[Points, Residual]:
    """The points that stand out of the noise from their own directions, and what they leave.

    Of two points that nearly cancel each other, either may exceed noise of which both together are
    a peak: what one explains in addition must exceed that noise too. Noise is measured again after
    some points are left out: those that were peaks of it have lowered it.
    """
    least = threshold_of(FALSE_PAIR_PROBABILITY, num_channels=points.amplitude.shape[1])
    while len(points):
        profiles = Profiles.of(seen, residual.spectra, axes).mixed(seen.mixing)
        raised = NoiseDirections.of(seen, profiles).below(seen, points)
        if raised is points:
            break
        points, residual = pruned(seen, residual, raised, min(least, threshold))
        points = standing_out(seen, points, threshold, dynamic_range)
        if len(points) == len(raised):
            break
        points, residual = settled(seen, residual.after(seen, points), points, sweeps=LAST_SWEEPS)
    return points, residual


def standing_out(
    seen: Observation, points: Points, threshold: float, dynamic_range: float
) -> Points:
    """The points above the threshold, or above a lower one if they overlap another.

    Those below the dynamic range are left out: beside a strong point, they are made of what was not
    tried and of what its model lacks.
    """
    least = threshold_of(FALSE_PAIR_PROBABILITY, num_channels=points.amplitude.shape[1])
    is_shared = overlaps_another(seen, Replicas.of(seen, points))
    needed = np.where(is_shared, min(least, threshold), threshold)
    strength = strengths(seen, points)
    weakest = np.max(strength, axis=1, initial=0.0) / dynamic_range
    is_strong = np.any(strength >= weakest[:, None], axis=0)
    return points[(points.power >= needed) & is_strong]


def strengths(seen: Observation, points: Points) -> FloatArray:
    """Power of every point in all samples, W ``(2, point)``: as received, and in white channels.

    What makes the noise of the channels white changes points by tens of dB: it lowers those from
    where noise comes, such as leakage with its phase noise, and raises others, such as ghosts. A
    point is in the dynamic range if it is so either way.
    """
    received = np.sum(np.abs(points.amplitude) ** 2, axis=1) * np.sum(seen.count)
    return np.stack([received, points.strength])


def adapted(
    seen: Observation, residual: Residual, axes: Grid, *, is_rough: bool
) -> tuple[Observation, Profiles]:
    """The observation with the noise that the residual shows, and its profiles.

    Rough ones are those of the first channel alone. They show strong points, until whose
    subtraction channels are not made white: side lobes of a strong point fill the map, and would
    count as noise from its direction.
    """
    seen = replace(seen, weight=ramp_weights(seen, residual.spectra))
    if is_rough:
        return seen, Profiles.of(seen, residual.spectra, axes, num_channels=1)
    profiles = Profiles.of(seen, residual.spectra, axes)
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


def strong(
    seen: Observation, residual: Residual, points: Points, threshold: float
) -> tuple[Points, Residual]:
    """The possible points above the threshold, fitted to the floors of now, and what they leave.

    Fits end where no step gains `GAIN_OF_NEW_POINTS` floors. Once the side lobes of strong points
    are gone, and ramps with interference count less, floors are tens of dB lower: what further
    steps would gain stands out of them, and would become new points beside the old ones.
    """
    is_kept = points.power >= threshold
    is_kept &= keeps_away(seen, points.motion[:, 0], points.motion[:, 1])
    if not np.all(is_kept):
        points = points[is_kept]
        residual = residual.after(seen, points)
    if not len(points):
        return points, residual
    return settled(seen, residual, points, sweeps=SWEEPS_OF_ALL, least_gain=GAIN_OF_NEW_POINTS)


def keeps_away(seen: Observation, distance: FloatArray, rate: FloatArray) -> BoolArray:
    """Mask of the points that do not run through the radar during the frame, ``(point,)``.

    Ghosts of radars that start earlier have negative ranges.

    Parameters
    ----------
    distance, rate : m and m/s in the middle of the frame, ``(point,)``
    """
    return np.asarray(np.abs(distance) > 0.5 * seen.duration * np.abs(rate), dtype=np.bool_)


def away(seen: Observation, found: Peaks) -> Peaks:
    """The peaks at which a point would not run through the radar."""
    return found[keeps_away(seen, found.range, found.range_rate)]


def with_pairs(trial: Trial, points: Points, fresh: Points) -> tuple[Points, Trial, Points]:
    """Points, two in place of one where new points may be side lobes of both, and the others.

    One point in place of two that are nearer than a cell, with opposite phases, leaves most of
    their power. It has side lobes at the beats of the two at other range rates, which would be
    taken for points. Where two leave more than noise too, there is a body, and no two points; where
    they explain no more than a new point, that one is added.
    """
    if not len(points) or not len(fresh):
        return points, trial, fresh
    seen, threshold = trial.seen, trial.threshold
    is_shared = shares_beats(seen, points.motion, fresh.motion)
    apart = np.abs(points.motion[:, 1:2] - fresh.motion[:, 1])
    is_shared &= apart > OTHER_RATE * seen.range_rate_cell
    lobe = np.max(np.where(is_shared, fresh.power, 0.0), axis=1)
    least = np.where(lobe > 0.0, LEAST_OF_PAIR * lobe, np.inf)
    after, residual = divided(seen, trial.residual, points, threshold, least_lobe=least)
    explained = trial.residual.energy - residual.energy
    strongest = np.max(fresh.strength[np.any(is_shared, axis=0)], initial=0.0)
    if len(after) == len(points) or explained < LEAST_EXPLAINED * strongest:
        return points, trial, fresh
    _, left = lobes_beside(seen, residual, after[np.arange(len(points), len(after))])
    if np.any(left > threshold):
        return points, trial, fresh
    shown = Agreement.at(seen, residual, fresh)
    is_point = shown.power > threshold * fresh.floor
    is_point &= shown.shows_points(fresh.floor, threshold)
    return after, trial.after(residual), fresh[is_point]


def all_added(
    trial: Trial,
    points: Points,
    found: Peaks,
    fresh: Points,
    *,
    most: int,
) -> tuple[Points, Residual]:
    """All points, with ``fresh`` and those that other peaks of one map show after each addition.

    A map takes as long as some additions. Peaks much weaker than the strongest new point, and those
    with the beats of any, wait for the next map, which has the floors that are left then.
    """
    found = found[found.power >= GREATEST_SPREAD * np.max(fresh.strength)]
    while len(fresh) and len(points) < most:
        fresh = further_points(trial, found, fresh)
        points, residual = added(trial.seen, trial.residual, points, fresh)
        trial = trial.after(residual)
        found = still_shown(trial, apart(trial.seen, found, fresh))
        fresh, _ = plain_points(trial, found, Points.none(points.amplitude.shape[1]))
    return points, trial.residual


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
    every = without_growth(seen, points, fresh) + fresh
    replicas = Replicas.of(seen, every)
    coupling = correlations(seen, replicas[len(points) :], replicas)
    near = np.flatnonzero(np.max(coupling, axis=0) > LEAST_COUPLING)
    every, _ = relaxed(
        seen, residual, every, sweeps=SWEEPS_OF_NEW_POINTS, free=near, least_gain=GAIN_OF_NEW_POINTS
    )
    every, _ = relaxed(seen, residual, every, sweeps=SWEEPS_OF_ALL, least_gain=GAIN_OF_NEW_POINTS)
    every, _ = grown(seen, residual, every)
    return every, residual.after(seen, every)
