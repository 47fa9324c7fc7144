"""Repeated steps of all points until they fit, and points that turn out to be redundant."""

from dataclasses import replace

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.receiver.coherent.least_squares import step_from
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import LEAST_COUPLING, couplings, groups_of
from polychirp.receiver.coherent.points import Points, without
from polychirp.receiver.coherent.signals import moments

LEAST_GAIN = 0.5
"""Fall of the residual's power, in units of a point's floor, for which a step is worth taking;
chosen: noise makes differences of 1."""

SHARES_OF_A_STEP = (1.0, 0.5, 0.2, 0.0)
"""Shares of a step that are tried until one lowers the residual; the last fits amplitudes alone."""

LEAST_REDUNDANCY = 0.3
"""Correlation with a stronger point from which a point may be redundant; chosen."""

LEAST_LOBE = 2.0
"""Power of a lobe beside a point, over its mean in noise, from which a second point is tried;
chosen."""

SWEEPS_OF_A_PAIR = 12
"""Sweeps of the fit of two points in place of one; chosen: near points take many."""

SWEEPS_WITHOUT_A_POINT = 4
"""Sweeps over its neighbours that decide if a point is redundant; chosen: fits near their optimum
have ended by then."""


def relaxed(
    seen: Observation,
    residual: ComplexArray,
    points: Points,
    *,
    sweeps: int,
) -> tuple[Points, ComplexArray]:
    """Points after at most ``sweeps`` over all groups, and the residual.

    Every group sees the residual that the groups before it have left. A step that would not lower
    the residual's power is not taken, so that the fit never becomes worse; the sweeps end when no
    step is worth taking.
    """
    for _ in range(sweeps):
        any_moved = False
        for group in groups_of(seen, points):
            before = points[group]
            sums = moments(residual, seen.present, seen.phases(before.motion), seen.model.times)
            step = step_from(seen, before, sums)
            if step.gain < LEAST_GAIN:
                points = points.replaced(group, replace(before, power=step.points.power))
                continue
            better = _better(seen, residual, before, sums)
            if better is not None:
                points, residual, any_moved = points.replaced(group, better[0]), better[1], True
        if not any_moved:
            break
    return points, residual


def _better(
    seen: Observation, residual: ComplexArray, before: Points, sums: ComplexArray
) -> tuple[Points, ComplexArray] | None:
    """Points after the longest step that lowers the residual, and it; None if there is none.

    ``sums`` are the `moments` of the residual for the points ``before``.
    """
    for share in SHARES_OF_A_STEP:
        points = step_from(seen, before, sums, share=share).points
        after = without(seen, residual, before.negated + points)
        if _rise(seen, residual, after, before) < 0:
            return points, after
    return None


def divided(
    seen: Observation, residual: ComplexArray, points: Points, threshold: float
) -> tuple[Points, ComplexArray]:
    """Points, two in place of one where these leave less by ``threshold`` floors or more.

    Two points nearer than a cell leave lobes on either side of the one that is fitted to both, each
    of which may be below the threshold of the map.
    """
    for n in np.argsort(-points.strength):
        fresh = _lobe(seen, residual, points[np.array([n])])
        if fresh is None:
            continue
        near = np.flatnonzero(couplings(seen, points)[n] > LEAST_COUPLING)
        group, left = relaxed(
            seen, without(seen, residual, fresh), points[near] + fresh, sweeps=SWEEPS_OF_A_PAIR
        )
        if _rise(seen, left, residual, points[near]) >= threshold * points.floor[n]:
            moved = np.arange(len(near))
            points = points.replaced(near, group[moved]) + group[np.array([len(near)])]
            residual = left
    return points, residual


def _lobe(seen: Observation, residual: ComplexArray, one: Points) -> Points | None:
    """Start of a second point where the residual within a cell of one point is strongest.

    None is returned if the residual is no stronger there than noise is.
    """
    steps = np.linspace(-2.0, 2.0, 5)
    offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    motion = np.repeat(one.motion, len(offsets), axis=0)
    motion[:, :2] += offsets * [0.5 * seen.range_cell, 0.5 * seen.range_rate_cell]
    places = replace(one[np.zeros(len(offsets), dtype=np.int64)], motion=motion)
    sums = moments(residual, seen.present, seen.phases(motion), seen.model.times)
    shape = seen.shape(motion, places.sine).conj() * seen.weights(motion)[:, None, :, None]
    size = seen.weights(motion) @ seen.count
    matched = np.einsum("pmki,ipmk->pm", shape, sums) / size[:, None]
    power = np.sum(np.abs(matched @ seen.mixing.T) ** 2, axis=1) * size / one.floor[0]
    best = np.array([np.argmax(power)])
    if power[best[0]] < LEAST_LOBE * matched.shape[1]:
        return None
    return replace(places, amplitude=matched)[best]


def overlaps_another(seen: Observation, points: Points) -> BoolArray:
    """Mask of the points that overlap much with another, ``(point,)``."""
    coupling = couplings(seen, points) - np.eye(len(points))
    return np.asarray(np.any(coupling > LEAST_REDUNDANCY, axis=1), dtype=np.bool_)


def pruned(
    seen: Observation, residual: ComplexArray, points: Points, threshold: float
) -> tuple[Points, ComplexArray]:
    """Points without those that the others replace at no loss, once these are fitted again.

    A fit that stood still beside its optimum leaves a residue, which was taken for a point. A loss
    below ``threshold``, in units of a point's floor, is none.
    """
    is_kept = np.ones(len(points), dtype=bool)
    coupling = couplings(seen, points)
    for weakest in np.argsort(points.strength):
        strength = points.strength
        is_stronger = is_kept & (strength > strength[weakest])
        if not np.any(coupling[weakest, is_stronger] > LEAST_REDUNDANCY):
            continue
        is_near = is_kept & (coupling[weakest] > LEAST_COUPLING)
        is_near[weakest] = False
        near = np.flatnonzero(is_near)
        added = without(seen, residual, points[np.array([weakest])].negated)
        others, alone = relaxed(seen, added, points[near], sweeps=SWEEPS_WITHOUT_A_POINT)
        loss = _rise(seen, residual, alone, points[np.array([weakest])])
        if loss < threshold * points.floor[weakest]:
            is_kept[weakest] = False
            points, residual = points.replaced(near, others), alone
    return points[is_kept], residual


def _rise(seen: Observation, before: ComplexArray, after: ComplexArray, points: Points) -> float:
    """Rise of the power of all samples, where noise is white, by a change of ``points``."""
    weight = np.mean(seen.weights(points.motion), axis=0)
    return float(weight @ (_energies(seen, after) - _energies(seen, before)))


def _energies(seen: Observation, residual: ComplexArray) -> FloatArray:
    """Sum of the powers of all samples of every ramp, of white channels, ``(ramp,)``."""
    parts = np.tensordot(seen.mixing, residual, 1).view(np.float64)
    return np.asarray(np.einsum("mkn,mkn->k", parts, parts))
