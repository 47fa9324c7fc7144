r"""Sweeps over groups of points: each moves by a step and gets the amplitudes that fit.

Groups follow each other: each sees what those before it leave, until no step is worth taking. With
a residual r and a change δ of a group's signals the power that is left rises by
:math:`|r - \delta|^2 - |r|^2 = -\mathrm{Re}\langle\delta, 2r - \delta\rangle`. A step that would
raise it is shortened.
"""

from dataclasses import replace
from typing import Any, NamedTuple, Self

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.jit import reordered, reordered_inner
from polychirp.receiver.coherent.group_steps import step_into
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.ramps import Ramps
from polychirp.receiver.coherent.replicas import (
    Replicas,
    bessel_into,
    product,
    replica_into,
    signal_into,
)
from polychirp.receiver.coherent.residual import Left, Residual, left_into, matches
from polychirp.receiver.coherent.solutions import REGULARISATION, inverse_into

LEAST_STEP_OF_ONE = 1e-7
"""Fall of the residual's power, as a share of a point's own, for which the point takes a step if no
other overlaps it; chosen: what is left does not show beside it."""

SHARES_OF_A_STEP = (1.0, 0.5, 0.2, 0.0)
"""Shares of a step that are tried until one lowers the residual; the last fits amplitudes alone."""


class Signals(NamedTuple):
    """Arrays of `Replicas`, and a mask of those that a residual's samples do not show as they are.

    Those of the subtracted points are gone from the frame's points; those of the points have come
    since the subtraction.
    """

    track: FloatArray
    wave: FloatArray
    amplitude: ComplexArray
    differs: BoolArray

    @classmethod
    def of(cls, replicas: Replicas, differs: BoolArray) -> Self:
        """Copies of the arrays of replicas."""
        return cls(
            track=replicas.track.copy(),
            wave=replicas.wave.copy(),
            amplitude=replicas.amplitude.copy(),
            differs=differs,
        )


class Moving(NamedTuple):
    """Points that a sweep changes in place; the columns are those of `Points`.

    Parameters
    ----------
    twin : number of the subtracted point that is the same; −1 if none is
    """

    motion: FloatArray
    sine: FloatArray
    growth: FloatArray
    floor: FloatArray
    power: FloatArray
    twin: IntArray


def swept(
    seen: Observation,
    residual: Residual,
    points: Points,
    here: Replicas,
    groups: list[IntArray],
    *,
    sweeps: int,
    least_gain: float,
) -> tuple[Points, FloatArray]:
    """Points after at most ``sweeps`` steps of each group, and the fall of the residual's power, W.

    The fall is that by each group. A group whose power falls by too little stands still from then.

    Parameters
    ----------
    residual : that of any points; what these ones leave follows from it
    here : replicas of the points
    groups : numbers of the points of each
    least_gain : least fall by a step that is worth taking, in units of a point's floor
    """
    same = matches(residual.subtracted, here)
    twin = np.full(len(points), -1)
    twin[np.nonzero(same)[1]] = np.nonzero(same)[0]
    old = Signals.of(residual.subtracted, ~np.any(same, axis=1))
    now = Signals.of(here, ~np.any(same, axis=0))
    moving = Moving(
        motion=points.motion.copy(),
        sine=points.sine.copy(),
        growth=points.growth.copy(),
        floor=points.floor.copy(),
        power=points.power.copy(),
        twin=twin,
    )
    sizes = np.array([len(one) for one in groups], dtype=np.int64)
    members = np.zeros((len(groups), int(np.max(sizes, initial=1))), dtype=np.int64)
    for row, one in zip(members, groups, strict=True):
        row[: len(one)] = one
    frame = Frame(
        ramps=seen.ramps,
        weights=seen.weight,
        mixing=seen.mixing,
        gram=seen.mixing.conj().T @ seen.mixing,
        limit=_limits(seen),
        left=residual.kernel_view(seen),
    )
    fallen = np.zeros(len(groups))
    _sweep(frame, old, now, moving, members, sizes, sweeps, least_gain, fallen)
    moved = replace(points, motion=moving.motion, amplitude=now.amplitude, power=moving.power)
    return moved, fallen


def _limits(seen: Observation) -> FloatArray:
    """Greatest step of each quantity: half a cell of range, of range rate and of acceleration."""
    rate = seen.range_rate_cell
    return np.array(
        [0.5 * seen.range_cell, 0.5 * rate, 2.0 * rate / seen.duration, 1.0 / seen.duration]
    )


class Frame(NamedTuple):
    """Arrays that all points of a frame share.

    Parameters
    ----------
    weights, mixing : those of the observation
    gram : product of ``mixing`` with its conjugate transpose, that first, ``(channel, channel)``
    limit : greatest step of each quantity of a motion, ``(4,)``
    """

    ramps: Ramps
    weights: FloatArray
    mixing: ComplexArray
    gram: ComplexArray
    limit: FloatArray
    left: Left


class _Work(NamedTuple):
    """Arrays of one group; axes as those of `Replicas`, with the group's members as points.

    Parameters
    ----------
    value, moment : matched sums times powers 0 and 1 of the time, ``(member, 2, channel, ramp)``
    matched : ``value`` added over the ramps, ``(member, channel)``
    change : step of the motion, ``(member, 4)``
    phase : by which the signal turns with it, rad, ``(member, channel)``
    """

    sums: FloatArray
    value: FloatArray
    moment: FloatArray
    matched: ComplexArray
    change: FloatArray
    phase: FloatArray


@reordered
def _sweep(
    frame: Any,
    old: Any,
    now: Any,
    moving: Any,
    members: Any,
    sizes: Any,
    sweeps: int,
    least_gain: float,
    fallen: Any,
) -> None:  # pragma: no cover - compiled
    most, channels, ramps = members.shape[1], now.wave.shape[1], now.track.shape[2]
    work = _Work(
        np.empty((3, 2, channels, ramps)),
        np.empty((most, 2, channels, ramps)),
        np.empty((most, 2, channels, ramps)),
        np.empty((most, channels), dtype=np.complex128),
        np.empty((most, 4)),
        np.empty((most, channels)),
    )
    tried = Signals(
        np.empty((most, 6, ramps)),
        np.empty((most, channels, 6, ramps)),
        np.empty((most, channels), dtype=np.complex128),
        np.empty(most, dtype=np.bool_),
    )
    stands = np.zeros(len(members), dtype=np.bool_)
    for _ in range(sweeps):
        for g in range(len(members)):
            if stands[g]:
                continue
            own = members[g, : sizes[g]]
            least = _least_fall(moving, own, least_gain)
            for j in range(own.size):
                p = own[j]
                _left_at(frame, old, now, now, p, work.sums)
                _match(now.wave[p], work.sums, work.value[j], work.moment[j], work.matched[j])
            fall = 0.0
            if step_into(frame, now, moving, own, work) >= least:
                fall = _moved(frame, old, now, moving, own, work, tried)
            fallen[g] += fall
            stands[g] = fall < least


@reordered_inner
def _least_fall(moving: Any, own: Any, least_gain: float) -> float:  # pragma: no cover - compiled
    """Fall of the residual's power by a group's step that is worth taking, W.

    The floor beside a strong point holds its own side lobes until it is subtracted. A point alone
    has only a few steps to its place, and takes them whatever this floor is.
    """
    least = np.inf
    for p in own:
        least = min(least, least_gain * moving.floor[p])
    if own.size > 1:
        return least
    return float(min(least, LEAST_STEP_OF_ONE * moving.power[own[0]] * moving.floor[own[0]]))


@reordered_inner
def _left_at(
    frame: Any, old: Any, now: Any, at: Any, place: int, sums: Any
) -> None:  # pragma: no cover - compiled
    """Sums over what the points ``now`` leave, at the place of one signal of ``at``."""
    left_into(frame.ramps, frame.left, at.track[place], sums)
    count = at.track.shape[2]
    a, b, c = np.empty(count), np.empty(count), np.empty(count)
    for p in range(len(old.track)):
        if old.differs[p] and bessel_into(frame.ramps, at.track[place], old.track[p], a, b, c):
            signal_into(sums, old.wave[p], old.amplitude[p], a, b, c)
    for p in range(len(now.track)):
        if now.differs[p] and bessel_into(frame.ramps, at.track[place], now.track[p], a, b, c):
            signal_into(sums, now.wave[p], -now.amplitude[p], a, b, c)


@reordered_inner
def _match(
    wave: Any, sums: Any, value: Any, moment: Any, matched: Any
) -> None:  # pragma: no cover - compiled
    """Sums times the conjugate shape; ``matched`` gets those added over all ramps."""
    for m in range(len(wave)):
        re, im = 0.0, 0.0
        for k in range(wave.shape[2]):
            p, q, r, s = wave[m, 0, k], wave[m, 1, k], wave[m, 2, k], wave[m, 3, k]
            t, u = wave[m, 4, k], wave[m, 5, k]
            a, b = sums[0, 0, m, k], sums[0, 1, m, k]
            c, d = sums[1, 0, m, k], sums[1, 1, m, k]
            e, f = sums[2, 0, m, k], sums[2, 1, m, k]
            x = p * a + q * b + r * c + s * d + t * e + u * f
            y = p * b - q * a + r * d - s * c + t * f - u * e
            value[0, m, k], value[1, m, k] = x, y
            moment[0, m, k] = p * c + q * d + r * e + s * f
            moment[1, m, k] = p * d - q * c + r * f - s * e
            re += x
            im += y
        matched[m] = complex(re, im)


@reordered_inner
def _moved(
    frame: Any, old: Any, now: Any, moving: Any, own: Any, work: Any, tried: Any
) -> float:  # pragma: no cover - compiled
    """Fall of the residual's power after the longest share of a step that lowers it, W."""
    size, channels = own.size, now.wave.shape[1]
    ours, mine, cross = (
        np.empty((size, size, channels), dtype=np.complex128),
        np.empty((size, size, channels), dtype=np.complex128),
        np.empty((size, size, channels), dtype=np.complex128),
    )
    matched = np.empty((size, channels), dtype=np.complex128)
    inverse = np.empty((size, size), dtype=np.complex128)
    members = np.arange(size)
    motion = np.empty((size, 4))
    unused = np.empty((2, 2, channels, now.track.shape[2]))
    _products_into(frame.ramps, now, own, now, own, ours)
    for share in SHARES_OF_A_STEP:
        for j in range(size):
            p = own[j]
            for i in range(4):
                motion[j, i] = moving.motion[p, i] + share * work.change[j, i]
            replica_into(
                frame.ramps,
                frame.weights,
                motion[j],
                moving.sine[p],
                moving.growth[p],
                tried.track[j],
                tried.wave[j],
            )
            _left_at(frame, old, now, tried, j, work.sums)
            _match(tried.wave[j], work.sums, unused[0], unused[1], matched[j])
            for m in range(channels):
                turn = share * work.phase[j, m]
                tried.amplitude[j, m] = now.amplitude[p, m] * complex(np.cos(turn), -np.sin(turn))
        _products_into(frame.ramps, tried, members, tried, members, mine)
        _products_into(frame.ramps, tried, members, now, own, cross)
        _fit(now, own, tried, matched, mine, cross, inverse)
        fall = _fall(frame.gram, now, own, tried, work.matched, matched, ours, mine, cross)
        if fall > 0.0:
            for j in range(size):
                p = own[j]
                for i in range(4):
                    moving.motion[p, i] = motion[j, i]
                power = 0.0
                for m in range(channels):
                    for n in range(channels):
                        power += (
                            tried.amplitude[j, m].conjugate()
                            * frame.gram[m, n]
                            * tried.amplitude[j, n]
                        ).real
                moving.power[p] = power / moving.floor[p] / max(inverse[j, j].real, 1e-300)
                _take(old, now, moving, p, tried, j)
            return fall
    return 0.0


@reordered_inner
def _products_into(
    ramps: Any, here: Any, first: Any, there: Any, second: Any, out: Any
) -> None:  # pragma: no cover - compiled
    """Products of the signals of all pairs, ``(first, second, channel)``."""
    count = ramps.table.shape[1]
    a, b, c = np.empty(count), np.empty(count), np.empty(count)
    for j in range(first.size):
        for q in range(second.size):
            p, r = first[j], second[q]
            near = bessel_into(ramps, here.track[p], there.track[r], a, b, c)
            for m in range(out.shape[2]):
                out[j, q, m] = 0.0
                if near:
                    out[j, q, m] = product(here.wave[p, m], there.wave[r, m], a, b, c)


@reordered_inner
def _fit(
    now: Any, own: Any, tried: Any, matched: Any, mine: Any, cross: Any, inverse: Any
) -> None:  # pragma: no cover - compiled
    """Amplitudes that fit best at the motions tried, and the inverse of overlaps, in place."""
    size, channels = matched.shape
    gram = np.zeros((size, size), dtype=np.complex128)
    left = matched.copy()
    for j in range(size):
        for q in range(size):
            for m in range(channels):
                gram[j, q] += mine[j, q, m] / channels
                left[j, m] += cross[j, q, m] * now.amplitude[own[q], m]
                left[j, m] -= mine[j, q, m] * tried.amplitude[q, m]
    inverse_into(gram, REGULARISATION, inverse)
    for j in range(size):
        for m in range(channels):
            for q in range(size):
                tried.amplitude[j, m] += inverse[j, q] * left[q, m]


@reordered_inner
def _fall(
    gram: Any,
    now: Any,
    own: Any,
    tried: Any,
    before: Any,
    matched: Any,
    ours: Any,
    mine: Any,
    cross: Any,
) -> float:  # pragma: no cover - compiled
    """Fall of the residual's power if the signals ``tried`` come and those of the group go."""
    size, channels = matched.shape
    fall = 0.0
    come, gone = np.empty(channels, dtype=np.complex128), np.empty(channels, dtype=np.complex128)
    for j in range(size):
        for m in range(channels):
            come[m], gone[m] = 2.0 * matched[j, m], 2.0 * before[j, m]
            for q in range(size):
                come[m] += cross[j, q, m] * now.amplitude[own[q], m]
                come[m] -= mine[j, q, m] * tried.amplitude[q, m]
                gone[m] += ours[j, q, m] * now.amplitude[own[q], m]
                gone[m] -= cross[q, j, m].conjugate() * tried.amplitude[q, m]
        for m in range(channels):
            for n in range(channels):
                fall += (tried.amplitude[j, m].conjugate() * gram[m, n] * come[n]).real
                fall -= (now.amplitude[own[j], m].conjugate() * gram[m, n] * gone[n]).real
    return fall


@reordered_inner
def _take(
    old: Any, now: Any, moving: Any, point: int, tried: Any, member: int
) -> None:  # pragma: no cover - compiled
    """Let a member's signal take the place of that of a point."""
    now.differs[point] = True
    if moving.twin[point] >= 0:
        old.differs[moving.twin[point]] = True
        moving.twin[point] = -1
    for m in range(now.wave.shape[1]):
        now.amplitude[point, m] = tried.amplitude[member, m]
        for n in range(6):
            for k in range(now.track.shape[2]):
                now.wave[point, m, n, k] = tried.wave[member, m, n, k]
    for n in range(6):
        for k in range(now.track.shape[2]):
            now.track[point, n, k] = tried.track[member, n, k]
