"""Repeated steps of all points until they fit, and points that turn out to be redundant."""

from dataclasses import replace

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.receiver.coherent.growth import grown, without_growth
from polychirp.receiver.coherent.least_squares import mixed, sines
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import (
    LEAST_COUPLING,
    LEAST_REDUNDANCY,
    groups_of,
    overlaps_another,
)
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas, correlations, sums_of
from polychirp.receiver.coherent.residual import Residual, unlike
from polychirp.receiver.coherent.sweeps import swept

LEAST_GAIN = 0.5
"""Fall of the residual's power, in units of a point's floor, for which a step is worth taking;
chosen: noise makes differences of 1."""

MOST_SUBTRACTIONS = 3
"""Greatest number of exact residuals that `settled` takes; chosen: steps between two of them are
right to some per cent."""

SWEEPS_OF_ALL = 4
"""Greatest number of sweeps over all points between two exact residuals; chosen."""

ERROR_OF_SUMS = 0.01
"""Greatest error of powers from approximate sums, as a share of the strongest point that
changes; chosen: below it, an exact residual is taken."""

LEAST_LOBE = 3.0
"""Power of a lobe beside a point, over its mean in noise, from which a second point is tried;
chosen."""

SAME_POINT = 0.95
"""Correlation of the signals of two points from which they are one; chosen: a fifth of a cell
apart. Nearer ones have great amplitudes that nearly cancel each other, and with them wrong
azimuths."""

SWEEPS_OF_A_PAIR = 12
"""Sweeps of the fit of two points in place of one; chosen: near points take many."""

SWEEPS_WITHOUT_A_POINT = 4
"""Sweeps over its neighbours that decide if a point is redundant; chosen: fits near their optimum
have ended by then."""


def settled(
    seen: Observation,
    residual: Residual,
    points: Points,
    *,
    sweeps: int = SWEEPS_OF_ALL,
    least_gain: float = LEAST_GAIN,
) -> tuple[Points, Residual]:
    """Points fitted to the samples, and the exact residual; no fit raises its power.

    ``residual`` is what the points leave before.
    """
    for _ in range(MOST_SUBTRACTIONS):
        moved, any_moved = relaxed(seen, residual, points, sweeps=sweeps, least_gain=least_gain)
        moved, any_grown = grown(seen, residual, moved)
        if not (any_moved or any_grown):
            return moved, residual
        after = residual.after(seen, moved)
        if after.energy >= residual.energy:
            break
        points, residual = moved, after
    return points, residual


def relaxed(
    seen: Observation,
    residual: Residual,
    points: Points,
    *,
    sweeps: int,
    free: IntArray | None = None,
    least_gain: float = LEAST_GAIN,
) -> tuple[Points, bool]:
    """Points after at most ``sweeps`` steps of all groups, and if any has moved.

    A step that would not lower the power of what the group leaves is not taken; the sweeps end when
    no step is worth taking. The residual is that of other points, which may be near these ones.

    Parameters
    ----------
    free : numbers of the points that may move; None for all
    least_gain : fall of the power, in units of a point's floor, for which a step is taken
    """
    free = np.arange(len(points)) if free is None else free
    here = Replicas.of(seen, points)
    groups = [free[own] for own in groups_of(seen, here[free])]
    points, fallen = swept(
        seen, residual, points, here, groups, sweeps=sweeps, least_gain=least_gain
    )
    moved = [own for own, fall in zip(groups, fallen, strict=True) if fall > 0.0]
    if not moved:
        return points, False
    return _turned(seen, points, np.concatenate(moved)), True


def _turned(seen: Observation, points: Points, which: IntArray) -> Points:
    """Points of which those numbered ``which`` have the azimuths of their amplitudes."""
    sine = points.sine.copy()
    sine[which] = sines(seen, points.amplitude[which])
    return replace(points, sine=sine)


def inner_products(seen: Observation, points: Replicas, sums: ComplexArray) -> FloatArray:
    """Real parts of the products of points' signals with others, V², ``(point,)``.

    Parameters
    ----------
    sums : of the others at the points, as of `Residual.sums`
    """
    matched = mixed(seen, points.matched(sums).sum(axis=-1))
    own = mixed(seen, points.amplitude)
    return np.asarray(np.einsum("pm,pm->p", own.conj(), matched).real)


def divided(
    seen: Observation,
    residual: Residual,
    points: Points,
    threshold: float,
    *,
    least_lobe: FloatArray | None = None,
) -> tuple[Points, Residual]:
    """Points, two in place of one where these leave less by ``threshold`` floors or more.

    Two points nearer than a cell leave lobes on either side of the one that is fitted to both, each
    of which may be below the threshold of the map. Points that overlap another are not divided:
    those of a body, whose scatterers no number of points explains.

    Parameters
    ----------
    least_lobe : power of a lobe, in floors, from which each point is tried; `LEAST_LOBE` by default
    """
    if least_lobe is None:
        least_lobe = np.full(len(points), LEAST_LOBE * points.amplitude.shape[1])
    is_alone = ~overlaps_another(seen, Replicas.of(seen, points))
    alone = np.flatnonzero(is_alone & np.isfinite(least_lobe))
    if not alone.size:
        return points, residual
    lobes, lobe = lobes_beside(seen, residual, points[alone])
    is_strong = lobe >= least_lobe[alone]
    alone, lobes = alone[is_strong], lobes[is_strong]
    here = Replicas.of(seen, points)
    is_near = correlations(seen, here[alone], here) > LEAST_COUPLING
    second = len(points) + np.arange(len(alone))
    tried, _ = relaxed(
        seen,
        residual,
        without_growth(seen, points, lobes) + replace(lobes, growth=np.zeros(len(lobes))),
        sweeps=SWEEPS_OF_A_PAIR,
        free=np.append(np.flatnonzero(np.any(is_near, axis=0)), second),
    )
    every, is_new = points, np.zeros(len(alone), dtype=np.bool_)
    both = Replicas.of(seen, tried)
    is_apart = np.diagonal(correlations(seen, both[alone], both[second])) < SAME_POINT
    for n in np.flatnonzero(is_apart)[np.argsort(-points.strength[alone[is_apart]])]:
        near = np.flatnonzero(is_near[n])
        pair = points.replaced(near, tried[near]) + tried[second[[n]]]
        if _falls(seen, residual, pair, threshold * points.floor[alone[n]]):
            every, is_new[n] = every.replaced(near, tried[near]), True
    every += tried[second[is_new]]
    return (every, residual.after(seen, every)) if np.any(is_new) else (points, residual)


def _falls(seen: Observation, residual: Residual, after: Points, least: float) -> bool:
    """True if the residual's power falls by ``least`` or more if other points are subtracted."""
    gone, come = unlike(residual.subtracted, Replicas.of(seen, after))
    old, new = residual.subtracted[gone], Replicas.of(seen, after[come])
    change = new + old.negated
    sums = 2.0 * residual.sums(seen, change) - sums_of(seen, change, change)
    fall = float(np.sum(inner_products(seen, change, sums)))
    strength = np.append(residual.points.strength[gone], after.strength[come])
    if abs(fall - least) > ERROR_OF_SUMS * float(np.max(strength, initial=0.0)):
        return fall > least
    return residual.energy - residual.after(seen, after).energy >= least


def lobes_beside(
    seen: Observation, residual: Residual, points: Points
) -> tuple[Points, FloatArray]:
    """Starts of second points where the residual within a cell of each point is strongest.

    With them comes its power there, in floors, ``(point,)``.
    """
    grid = np.linspace(-2.0, 2.0, 5)
    offsets = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    offsets = offsets * [0.5 * seen.range_cell, 0.5 * seen.range_rate_cell]
    count = len(points)
    motion = points.motion + np.pad(offsets, ((0, 0), (0, 2)))[:, None]
    places = replace(points[np.tile(np.arange(count), len(offsets))], motion=motion.reshape(-1, 4))
    here = Replicas.of(seen, places)
    size = here.size(seen).sum(axis=1)
    matched = here.matched(residual.sums(seen, here)).sum(axis=-1) / size[:, None]
    power = np.sum(np.abs(matched @ seen.mixing.T) ** 2, axis=1) * size / places.floor
    power = power.reshape(len(offsets), count)
    best = np.argmax(power, axis=0) * count + np.arange(count)
    lobes = replace(places, amplitude=matched)[best]
    return lobes, np.max(power, axis=0)


def pruned(
    seen: Observation, residual: Residual, points: Points, threshold: float
) -> tuple[Points, Residual]:
    """Points without those that the others replace at no loss, once these are fitted again.

    A fit that stood still beside its optimum leaves a residue, which was taken for a point. A loss
    below ``threshold``, in units of a point's floor, is none. Of points that are alike, the weaker
    ones are left out at any loss.
    """
    kept = np.arange(len(points))
    every = Replicas.of(seen, points)
    coupling = correlations(seen, every, every)
    order = np.argsort(points.strength)
    for weakest in order:
        others = kept[kept != weakest]
        strength = points.strength
        is_stronger = strength[others] > strength[weakest]
        if not np.any(coupling[weakest, others[is_stronger]] > LEAST_REDUNDANCY):
            continue
        free = np.flatnonzero(coupling[weakest, others] > LEAST_COUPLING)
        alone, _ = relaxed(seen, residual, points[others], sweeps=SWEEPS_WITHOUT_A_POINT, free=free)
        least = -threshold * points.floor[weakest]
        is_alike = bool(np.any(coupling[weakest, others] > SAME_POINT))
        if is_alike or _falls(seen, residual, alone, least):
            points, kept = points.replaced(others, alone), others
            residual = residual.after(seen, alone)
    return points[kept], residual
