r"""Crossed points: the rising beat of one body taken together with the falling beat of another.

On equal rising and equal falling ramps, a point at R that recedes with v has one beat on each kind,

.. math:: b_k = R + \kappa_k v, \qquad \kappa_k = t_k + f_k / s_k

as ranges, with the slopes s, the frequencies f and the mean times t of the kind k from the middle
of the frame. Two points A and B of one body have four beats. These are also those of P, with the
rising beat of A and the falling beat of B, and of Q, with the other two. The phases from ramp to
ramp tell P from A only up to the range rates :math:`n\lambda/2T` that ramps of one kind, T apart,
fold. So P and Q pass for points wherever the amplitudes of A and B are alike, most of all two
glints of one vehicle. The amplitudes tell in the end: each of P and Q must have one amplitude for
two beats of two different bodies.

Here pairs of points whose range rates are folded on each other are replaced by their crossed pairs
if these leave less of the samples.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.receiver.coherent.least_squares import inverse_of, mixed, sines
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import LEAST_COUPLING
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.ramps import ELAPSED, FREQUENCY, SLOPE, USED
from polychirp.receiver.coherent.refinement import relaxed
from polychirp.receiver.coherent.replicas import Replicas, correlations, total_products
from polychirp.receiver.coherent.residual import Residual

FEWEST_RAMPS = 3
"""Least number of ramps of one kind; chosen: fewer have no interval to compare with another."""

EVEN_INTERVALS = 1e-3
"""Greatest difference of the intervals of ramps of one kind, as a share of them; chosen: others
fold no range rate."""

SAME_FOLD = 4.0
"""Difference of two folded range rates, in cells λ/2T, up to which they may be of one body; chosen:
parts of a body that turns or passes differ by some cells."""

MOST_POINTS = 40
"""Number of the strongest points whose pairs are tried; chosen: others have little to hide."""

MOST_TRIALS = 6
"""Greatest number of crossed pairs that are fitted; chosen: each takes some ten milliseconds."""

LEAST_SHARE = 0.5
"""Power of a crossed pair before it is fitted, over that of the pair, from which it is fitted;
chosen: its places are known to a quarter of a cell."""

LEAST_FALL = 10.0
"""Fall of the residual's power, in units of a point's floor, for which a crossed pair is taken;
chosen: noise makes differences of a few."""

LEAST_RATIO = 0.03
"""Least ratio of the powers of a pair; chosen: both have about the mean of the amplitudes of the
two points whose beats they take, and share them with others."""

SWEEPS_OF_CROSSED = 12
"""Sweeps of the fit of a crossed pair with its neighbours; chosen, as for new points."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kinds:
    """Equal rising and equal falling ramps.

    ``rising`` and ``falling`` are their κ, s; ``fold`` m/s is the range rate λ/2T.
    """

    rising: float
    falling: float
    fold: float

    @classmethod
    def of(cls, seen: Observation) -> Self | None:
        """The kinds of ramps; None if there are not two, with even intervals."""
        table = seen.ramps.table
        used, slope = table[USED] > 0, table[SLOPE]
        up, down = (_kind_of(table[:, used & is_own]) for is_own in (slope > 0, slope < 0))
        if up is None or down is None:
            return None
        interval = up.interval
        if abs(interval - down.interval) > EVEN_INTERVALS * interval:
            return None
        return cls(rising=up.delay, falling=down.delay, fold=seen.wavelength / (2.0 * interval))

    def crossed(self, first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Motions that take the beats of pairs of motions across, ``(2, pair, 4)`` each.

        Parameters
        ----------
        first, second : motions of the pairs, ``(pair, 4)``

        Returns
        -------
        of the points with the rising beat of the first and the falling beat of the second, and the
        other way round; for the two folds between which their range rate is
        """
        up, down = self.rising, self.falling
        (u, d), (x, y) = (
            (one[:, 0] + up * one[:, 1], one[:, 0] + down * one[:, 1]) for one in (first, second)
        )
        aim = 0.5 * ((u - y) + (x - d)) / (up - down)
        base = np.floor((aim - first[:, 1]) / self.fold)
        found = []
        for rises, falls in ((u, y), (x, d)):
            motion = np.empty((2, *first.shape))
            motion[:, :, 2:] = 0.5 * (first[:, 2:] + second[:, 2:])
            for n in range(2):
                rate = first[:, 1] + self.fold * (base + n)
                motion[n, :, 1] = rate
                motion[n, :, 0] = 0.5 * (rises + falls - (up + down) * rate)
            found.append(motion)
        return found[0], found[1]


class _Kind(NamedTuple):
    """κ of equal ramps, and their interval, s."""

    delay: float
    interval: float


def _kind_of(ramps: FloatArray) -> _Kind | None:
    """The kind of some ramps; None if they are not equal, or their intervals uneven.

    ``ramps`` are columns of `Ramps.table`.
    """
    slope, time, frequency = ramps[SLOPE], ramps[ELAPSED], ramps[FREQUENCY]
    if slope.size < FEWEST_RAMPS or np.ptp(slope) or np.ptp(frequency):
        return None
    steps = np.diff(time)
    if np.ptp(steps) > EVEN_INTERVALS * steps[0]:
        return None
    return _Kind(float(time.mean() + frequency[0] / slope[0]), float(steps.mean()))


def uncrossed(seen: Observation, residual: Residual, points: Points) -> tuple[Points, Residual]:
    """Points of which crossed pairs are replaced where this leaves less, and what they leave.

    ``residual`` is what the points leave before.
    """
    kinds = Kinds.of(seen)
    if kinds is None or len(points) < 2:
        return points, residual
    is_open = np.ones(len(points), dtype=np.bool_)
    pairs, motions = _likely(seen, residual, points, kinds)
    for (i, j), motion in zip(pairs[:MOST_TRIALS], motions, strict=False):
        if not (is_open[i] and is_open[j]):
            continue
        tried, after = _replaced(seen, residual, points, np.array([i, j]), motion)
        least = LEAST_FALL * float(np.mean(points.floor[[i, j]]))
        if residual.energy - after.energy > least:
            points, residual = tried, after
            is_open[[i, j]] = False
    return points, residual


def _likely(
    seen: Observation, residual: Residual, points: Points, kinds: Kinds
) -> tuple[IntArray, FloatArray]:
    """Pairs whose crossed pairs have most of their power or more, the most promising ones first.

    ``(pair, 2)``, and the motions of the crossed points ``(pair, 2, 4)``.
    """
    pairs = _folded_pairs(seen, points, kinds)
    if not len(pairs):
        return pairs, np.zeros((0, 2, 4))
    motions = kinds.crossed(points.motion[pairs[:, 0]], points.motion[pairs[:, 1]])
    crossed = np.stack(motions, axis=2)  # (fold, pair, 2, 4)
    every = Replicas.of(seen, points)
    here = Replicas.of(seen, _placed(points, crossed.reshape(-1, 4)))
    white = mixed(seen, points.amplitude)
    left = _left(seen, residual, here).reshape(2, len(pairs), 2, -1)
    reach = total_products(seen, here, every).reshape(2, len(pairs), 2, -1)
    size = here.size(seen).sum(axis=1).reshape(2, len(pairs), 2, 1)
    left_before, gram = _left(seen, residual, every), total_products(seen, every, every)
    before, after = np.empty(len(pairs)), np.empty((2, len(pairs)))
    for n, pair in enumerate(pairs):
        own = gram[np.ix_(pair, pair)]
        before[n] = _captured(own, left_before[pair] + own @ white[pair])
        # what the crossed points match once the pair is added to the samples again
        value = left[:, n] + reach[:, n][..., pair] @ white[pair]
        after[:, n] = np.sum(np.abs(value) ** 2 / size[:, n], axis=(1, 2))
    best = np.argmax(after, axis=0)
    share = np.max(after, axis=0) / np.maximum(before, 1e-300)
    order = np.argsort(-share, kind="stable")
    order = order[share[order] > LEAST_SHARE]
    return pairs[order], crossed[best[order], order]


def _left(seen: Observation, residual: Residual, at: Replicas) -> ComplexArray:
    """Sums over what is left, matched to signals, on white channels, ``(point, channel)``."""
    return mixed(seen, at.matched(residual.sums(seen, at)).sum(axis=-1))


def _captured(gram: ComplexArray, value: ComplexArray) -> float:
    """Energy that points take with the amplitudes that fit best."""
    return float(np.sum(value.conj() * (inverse_of(gram) @ value)).real)


def _folded_pairs(seen: Observation, points: Points, kinds: Kinds) -> IntArray:
    """Pairs of alike points whose range rates are folded on each other, ``(pair, 2)``."""
    strong = np.sort(np.argsort(-points.strength)[:MOST_POINTS])
    rate, power = points.motion[strong, 1], _powers(points)[strong]
    apart = (rate[:, None] - rate) / kinds.fold
    near = np.abs(apart - np.rint(apart)) * kinds.fold < SAME_FOLD * seen.range_rate_cell
    alike = np.minimum.outer(power, power) > LEAST_RATIO * np.maximum.outer(power, power)
    first, second = np.nonzero(np.triu(near & alike & (np.rint(apart) != 0), 1))
    return np.stack([strong[first], strong[second]], axis=-1)


def _powers(points: Points) -> FloatArray:
    """Powers of the points' signals, V², ``(point,)``."""
    return np.asarray(np.sum(np.abs(points.amplitude) ** 2, axis=1))


def _placed(points: Points, motion: FloatArray) -> Points:
    """Points of amplitude 1 at motions, ``(point, 4)``."""
    count, channels = len(motion), points.amplitude.shape[1]
    zero = np.zeros(count)
    return Points(
        motion=motion,
        amplitude=np.ones((count, channels), dtype=np.complex128),
        floor=np.ones(count),
        sine=zero,
        growth=zero,
        power=zero,
    )


def _replaced(
    seen: Observation, residual: Residual, points: Points, pair: IntArray, motion: FloatArray
) -> tuple[Points, Residual]:
    """Points with others in the place of a pair, fitted with their neighbours, and what is left."""
    start = replace(points[pair], motion=motion, growth=np.zeros(2))
    here, old = Replicas.of(seen, start), Replicas.of(seen, points[pair])
    matched = here.matched(residual.sums(seen, here)).sum(axis=-1)
    matched = matched + total_products(seen, here, old) @ points.amplitude[pair]
    amplitude = inverse_of(total_products(seen, here, here)) @ matched
    power = np.sum(np.abs(mixed(seen, amplitude)) ** 2, axis=1) * here.size(seen).sum(axis=1)
    start = replace(
        start, amplitude=amplitude, sine=sines(seen, amplitude), power=power / start.floor
    )
    tried = points.replaced(pair, start)
    every = Replicas.of(seen, tried)
    coupling = np.max(correlations(seen, every[pair], every), axis=0)
    free = np.flatnonzero(coupling > LEAST_COUPLING)
    tried, _ = relaxed(seen, residual, tried, sweeps=SWEEPS_OF_CROSSED, free=free)
    return tried, residual.after(seen, tried)
