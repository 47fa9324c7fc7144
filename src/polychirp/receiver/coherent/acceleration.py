"""Range acceleration of new points: a search over range rates and accelerations near a peak.

A body that passes at a distance of some metres has a range acceleration of up to 100 m/s². Its peak
in the map of constant range rates is smeared over many cells, and a fit that starts there without
an acceleration ends on a side lobe.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.receiver.coherent.agreement import Agreement
from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas
from polychirp.receiver.coherent.residual import Residual

LEAST_ACCELERATION, GREATEST_ACCELERATION = -10.0, 170.0
"""Accelerations that are tried, m/s²; chosen: a car that brakes in front, and one that passes at
2.5 m with 20 m/s."""

GREATEST_CROSSING_SPEED = 30.0
"""Greatest speed across the line of sight, m/s, whose acceleration at a range is believed; chosen:
a car on a country road."""

MOST_BLOCKS = 48
"""Number of blocks of ramps over which a search adds; chosen: it limits the size of the search."""

LEAST_RISE = 1.5
"""Rise of the coherent power from which an acceleration is believed; chosen."""

RANGE_CELLS = 2.0
"""Range cells by which the range of an accelerated peak may be off; chosen."""

WIDE_STEPS = (0.75, 2.0)
"""Steps of range rate, in cells λ/2T, and of acceleration, in such cells per frame, of the first
searches from one start; chosen: the nearest one loses 2.5 dB at most, which the last search gains.
"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Blocks:
    """Blocks of neighbouring ramps, whose sums are turned together.

    Parameters
    ----------
    first : number of the first ramp of every block, ``(block,)``
    elapsed : mean time of its ramps from the middle of the frame, s, ``(block,)``
    """

    first: IntArray
    elapsed: FloatArray

    @classmethod
    def of(cls, seen: Observation) -> Self:
        """Blocks of all ramps."""
        ramps = seen.middle.size
        first = np.linspace(0, ramps, min(ramps, MOST_BLOCKS) + 1).astype(np.int64)[:-1]
        number = np.diff(np.append(first, ramps))
        return cls(
            first=first, elapsed=np.add.reduceat(seen.middle - seen.model.time, first) / number
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Steps:
    """Steps of a motion that a search tries.

    Parameters
    ----------
    turn : phasors of the blocks, ``(block, step)``
    step : of range rate, m/s, and acceleration, m/s², ``(step, 2)``
    """

    turn: NDArray[np.complex64]
    step: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Accelerations:
    """Steps of range rate and acceleration that are tried in a frame.

    Parameters
    ----------
    wide : from every start, and again where beats are those of the best of them
    near : around the best of these
    """

    blocks: _Blocks
    wide: _Steps
    near: _Steps

    @classmethod
    def of(cls, seen: Observation) -> Self:
        """Those of the ramps of an observation."""
        blocks = _Blocks.of(seen)
        return cls(blocks=blocks, wide=_wide(seen, blocks), near=_near(seen, blocks))


def accelerated(
    seen: Observation, residual: Residual, points: Points, tried: Accelerations
) -> Points:
    """New points with the ranges, range rates and accelerations near theirs that have most power.

    A search reaches as far as the phases from block to block are unambiguous. So it starts from
    several accelerations. The range may be wrong as well: the strongest peak of an accelerated body
    is where its rising or its falling ramps alone add up. Where all power at a point's beats adds
    up without an acceleration, none is looked for.
    """
    if not len(points):
        return points
    size = Replicas.of(seen, points).size(seen)
    still = Agreement.of(seen, _sums(seen, residual, points), size)
    by_noise = np.log(len(tried.wide.step)) * points.floor
    least = np.maximum(LEAST_RISE * still.power, still.power + by_noise)
    smeared = np.flatnonzero(still.greatest_power(points.floor) > least)
    steps = np.arange(0.0, GREATEST_ACCELERATION, 2.0 * float(np.max(tried.wide.step[:, 1])))
    found = _best(
        seen,
        residual,
        points[smeared],
        tried,
        offsets=steps[:, None] * np.array([0.0, 0.0, 1.0, 0.0]),
        least=(least * size.sum(axis=1))[smeared],
    )
    is_moved = np.any(found.motion != points.motion[smeared], axis=1)
    is_moved &= found.motion[:, 2] * np.abs(found.motion[:, 0]) <= GREATEST_CROSSING_SPEED**2
    cells = np.arange(-RANGE_CELLS, RANGE_CELLS + 0.5, 0.5)
    ranged = _best(
        seen,
        residual,
        found[is_moved],
        tried,
        offsets=cells[:, None] * np.array([seen.range_cell, 0.0, 0.0, 0.0]),
        least=np.zeros(np.count_nonzero(is_moved)),
    )
    return points.replaced(smeared[is_moved], ranged)


def _best(
    seen: Observation,
    residual: Residual,
    points: Points,
    tried: Accelerations,
    *,
    offsets: FloatArray,
    least: FloatArray,
) -> Points:
    """Points with the motions near theirs plus an offset that have most power, if over ``least``.

    Parameters
    ----------
    offsets : of the motion from which searches start, ``(start, 4)``
    least : power that a motion must have, ``(point,)``
    """
    count = len(points)
    if not count:
        return points
    every = points[np.tile(np.arange(count), len(offsets))]
    motion = (points.motion + offsets[:, None]).reshape(-1, 4)
    power = np.zeros((len(every), 1))
    for steps in (tried.wide, tried.wide, tried.near):
        sums = _sums(seen, residual, replace(every, motion=motion))
        power = _power(np.add.reduceat(sums, tried.blocks.first, axis=2), steps.turn)
        motion = motion + np.pad(steps.step[np.argmax(power, axis=1)], ((0, 0), (1, 1)))
    reached = np.max(power, axis=1).reshape(len(offsets), count)
    best, place = np.argmax(reached, axis=0), np.arange(count)
    is_better = reached[best, place] > least
    found = motion.reshape(len(offsets), count, 4)[best, place]
    return replace(points, motion=np.where(is_better[:, None], found, points.motion))


def _sums(seen: Observation, residual: Residual, points: Points) -> ComplexArray:
    """Sums over each ramp without the points' phases, ``(point, channel, ramp)``."""
    here = Replicas.of(seen, points)
    return mixed(seen, here.matched(residual.sums(seen, here)))


def _power(sums: ComplexArray, turns: NDArray[np.complex64]) -> FloatArray:
    """Power that adds up in phase after each turn, over all channels, ``(point, hypothesis)``."""
    out = np.zeros((len(sums), turns.shape[1]), dtype=np.float32)
    for channel in sums.astype(np.complex64).transpose(1, 0, 2):
        total = channel @ turns
        out += total.real**2 + total.imag**2
    return out.astype(np.float64)


def _wide(seen: Observation, blocks: _Blocks) -> _Steps:
    """Steps over all accelerations whose phases from block to block are unambiguous.

    The greatest one changes the phase by half a cycle from block to block at the ends of the frame.
    """
    unit = seen.range_rate_cell / seen.duration
    greatest = min(GREATEST_ACCELERATION, unit * blocks.elapsed.size)
    step = WIDE_STEPS[1] * unit
    first, last = np.rint(max(LEAST_ACCELERATION, -greatest) / step), np.ceil(greatest / step)
    rate_step = WIDE_STEPS[0] * seen.range_rate_cell
    reach = np.ceil(0.5 * greatest * seen.duration / rate_step)
    return _steps(
        seen,
        blocks,
        rate_step * np.arange(-reach, reach + 1.0),
        step * np.arange(first, last + 1.0),
    )


def _near(seen: Observation, blocks: _Blocks) -> _Steps:
    """Small steps up to the next ones of `_wide`."""
    share = np.arange(-1.0, 1.25, 0.25)
    cell = seen.range_rate_cell
    rates, accelerations = (
        WIDE_STEPS[0] * cell * share,
        WIDE_STEPS[1] * cell / seen.duration * share,
    )
    return _steps(seen, blocks, rates, accelerations)


def _steps(
    seen: Observation, blocks: _Blocks, rates: FloatArray, accelerations: FloatArray
) -> _Steps:
    """All pairs of steps of range rate and of acceleration."""
    wave = -4j * np.pi / seen.wavelength
    by_rate = np.exp(wave * rates * blocks.elapsed[:, None])
    by_acceleration = np.exp(0.5 * wave * accelerations * blocks.elapsed[:, None] ** 2)
    turn = by_rate.astype(np.complex64)[:, :, None] * by_acceleration.astype(np.complex64)[:, None]
    steps = np.stack(np.meshgrid(rates, accelerations, indexing="ij"), axis=-1)
    return _Steps(turn=turn.reshape(blocks.elapsed.size, -1), step=steps.reshape(-1, 2))
