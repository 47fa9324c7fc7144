"""Range acceleration of new points: a search over range rates and accelerations near a peak.

A body that passes at a distance of some metres has a range acceleration of up to 100 m/s². Its peak
in the map of constant range rates is smeared over many cells, and a fit that starts there without
an acceleration ends on a side lobe.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas
from polychirp.receiver.coherent.residual import Residual

LEAST_ACCELERATION, GREATEST_ACCELERATION = -10.0, 130.0
"""Accelerations that are tried, m/s²; chosen: a car that brakes in front, and one that passes at
2.5 m with 18 m/s."""

MOST_BLOCKS = 48
"""Number of blocks of ramps over which a search adds; chosen: it limits the size of the search."""

LEAST_RISE = 1.5
"""Rise of the coherent power from which an acceleration is believed; chosen."""

RANGE_CELLS = 2.0
"""Range cells by which the range of an accelerated peak may be off; chosen."""

ROUNDS = 2
"""Number of searches from one start, each around the result of the one before; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Hypotheses:
    """Motions that one search tries: steps from where it starts.

    Parameters
    ----------
    first : number of the first ramp of every block, ``(block,)``
    turn : phasors of the blocks, ``(block, hypothesis)``
    step : of range rate, m/s, and acceleration, m/s², ``(hypothesis, 2)``
    """

    first: IntArray
    turn: NDArray[np.complex64]
    step: FloatArray


def accelerated(seen: Observation, residual: Residual, points: Points) -> Points:
    """New points with the ranges, range rates and accelerations near theirs that have most power.

    A search reaches as far as the phases from block to block are unambiguous. So it starts from
    several accelerations. The range may be wrong as well: the strongest peak of an accelerated body
    is where its rising or its falling ramps alone add up.
    """
    if not len(points):
        return points
    tried = _hypotheses(seen)
    steps = tried.step
    still = _sums(seen, residual, points).sum(axis=2)
    least = np.sum(np.abs(still) ** 2, axis=1)
    by_noise = np.log(len(steps)) * seen.count.sum() * points.floor
    starts = np.arange(0.0, GREATEST_ACCELERATION, 2.0 * float(np.max(steps[:, 1])))
    found = _best_of(
        seen,
        residual,
        points,
        tried,
        offsets=starts[:, None] * np.array([0.0, 0.0, 1.0, 0.0]),
        least=np.maximum(LEAST_RISE * least, least + by_noise),
    )
    moved = np.flatnonzero(np.any(found.motion != points.motion, axis=1))
    if not moved.size:
        return points
    cells = np.arange(-RANGE_CELLS, RANGE_CELLS + 0.5, 0.5)
    ranged = _best_of(
        seen,
        residual,
        found[moved],
        tried,
        offsets=cells[:, None] * np.array([seen.range_cell, 0.0, 0.0, 0.0]),
        least=np.zeros(moved.size),
    )
    return found.replaced(moved, ranged)


def _best_of(
    seen: Observation,
    residual: Residual,
    points: Points,
    tried: _Hypotheses,
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
    every = points[np.tile(np.arange(count), len(offsets))]
    motion = (points.motion + offsets[:, None]).reshape(-1, 4)
    motions, powers = [], []
    for _ in range(ROUNDS):
        sums = _sums(seen, residual, replace(every, motion=motion))
        power = _power(np.add.reduceat(sums, tried.first, axis=2), tried.turn)
        motion = motion + np.pad(tried.step[np.argmax(power, axis=1)], ((0, 0), (1, 1)))
        motions.append(motion.reshape(len(offsets), count, 4))
        powers.append(np.max(power, axis=1).reshape(len(offsets), count))
    tries, reached = np.concatenate(motions), np.concatenate(powers)
    best = np.argmax(reached, axis=0)
    place = np.arange(count)
    is_better = reached[best, place] > least
    return replace(points, motion=np.where(is_better[:, None], tries[best, place], points.motion))


def _sums(seen: Observation, residual: Residual, points: Points) -> ComplexArray:
    """Sums over each ramp without the points' phases, ``(point, channel, ramp)``."""
    here = Replicas.of(seen, points)
    return mixed(seen, here.matched(residual.sums(seen, here))[0])


def _power(sums: ComplexArray, turns: NDArray[np.complex64]) -> FloatArray:
    """Power that adds up in phase after each turn, over all channels, ``(point, hypothesis)``."""
    out = np.zeros((len(sums), turns.shape[1]), dtype=np.float32)
    for channel in sums.astype(np.complex64).transpose(1, 0, 2):
        total = channel @ turns
        out += total.real**2 + total.imag**2
    return out.astype(np.float64)


def _blocks(seen: Observation) -> tuple[FloatArray, IntArray]:
    """Times of blocks of ramps from the middle of the frame, s, and the first ramp of each."""
    ramps = seen.middle.size
    first = np.linspace(0, ramps, min(ramps, MOST_BLOCKS) + 1).astype(np.int64)[:-1]
    number = np.diff(np.append(first, ramps))
    return np.add.reduceat(seen.middle - seen.model.time, first) / number, first


def _hypotheses(seen: Observation) -> _Hypotheses:
    """Steps that change the phase by a quarter of a cycle over the frame.

    The greatest acceleration changes it by half a cycle from block to block at the ends of the
    frame.
    """
    elapsed, first = _blocks(seen)
    rate_step = 0.5 * seen.range_rate_cell
    step = seen.range_rate_cell / seen.duration
    greatest = min(GREATEST_ACCELERATION, step * elapsed.size)
    reach = np.ceil(0.5 * greatest * seen.duration / rate_step)
    rates = rate_step * np.arange(-reach, reach + 1.0)
    accelerations = np.arange(max(LEAST_ACCELERATION, -greatest), greatest + step, step)
    steps = np.stack(np.meshgrid(rates, accelerations, indexing="ij"), axis=-1).reshape(-1, 2)
    wave = -4j * np.pi / seen.wavelength
    by_rate = np.exp(wave * rates * elapsed[:, None])
    by_acceleration = np.exp(0.5 * wave * accelerations * elapsed[:, None] ** 2)
    turn = by_rate.astype(np.complex64)[:, :, None] * by_acceleration.astype(np.complex64)[:, None]
    return _Hypotheses(first=first, turn=turn.reshape(elapsed.size, -1), step=steps)
