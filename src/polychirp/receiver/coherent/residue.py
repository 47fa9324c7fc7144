r"""Residues: the noise that a body leaves at other points when ideal points are subtracted from it.

A body is no sum of a few ideal points: its glints move, and they change during the frame. Where one
cell takes several points, the amplitude of the body varies over the ramps. The energy E of this
variation is known: it is the part of the body's signal that the best single point does not explain.
Its course is not: the points in that cell follow it only in part. On a ramp of length T, an unknown
variation spreads from the body's beat :math:`f_b` as the side lobes of a tone do,

.. math:: \mathrm{sinc}^2[(f - f_b)\,T] \le \min\{1,\ [\pi\,(f - f_b)\,T]^{-2}\},

and variations that differ from ramp to ramp add up as noise does. At the beats of another point
they act as a noise power of a sample of :math:`E/KM` times the mean of this limit over the K ramps,
on each of M channels. A point must stand out of it as of other noise. Ideal points with cells of
their own leave none. The limit is a mean over all courses of the variation, but a body has one of
them, which adds up to more at some places. Most do so that pass nearby: they turn in view, so that
their glints slide over the metal during a frame. With a margin on what near bodies leave at points
of other speeds, hardly any false detections are left beside these; on farther bodies it would hide
more weak bodies than it leaves out errors.

Equal ramps see the same range profile of a body. What the body's points miss of it repeats with
these ramps, and adds up in phase at range rates that are folded on the body's own: multiples of
λ/2T beside it, for equal ramps T apart. There it is taken for points, of which a body causes
several. So points that are folded on a body are counted as its errors, and each of them must stand
out of the others. One of energy :math:`E_q` adds to the mean of the limits what equal ramps add in
phase beyond it (`folds`),

.. math:: \frac1K\sum_s\Big|\sum_{k\in s}\min\{1, [\pi\,(f - f_q)\,T]^{-1}\}\,
          e^{j\Delta_k}\Big|^2 - \frac1K\sum_k\min\{1, [\pi\,(f - f_q)\,T]^{-2}\},

with the sets s of equal ramps and Δ the phase between both points in the middle of a ramp.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import LEAST_COUPLING, LEAST_REDUNDANCY
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import (
    BEAT,
    Replicas,
    correlations,
    total_products,
)

LEAST_OF_SAME = 1.0 - 1e-9
"""Correlation from which two signals are that of one point; rounding makes some 1e-15."""

SPREAD_OF_BODY = 1.0
"""Greatest difference of range rates, m/s, between a point that moves with a body and one of the
body's strong points. Chosen: parts of a vehicle at some metres have as different ones; errors that
are taken for points mostly have rates that differ by more."""

WEAKEST_OF_BODY = 0.01
"""Least energy of a strong point of a body, over that of the strongest; chosen."""

NEAR_BODY_RANGE = 10.0
"""Greatest range of a near body's strongest point, m. Chosen: two lengths of a car. Cars that pass
within it turn in view by one to twelve degrees during a frame."""

SAME_SPEED = 4.0
"""Difference of range rates, in cells λ/2T, below which two points may be of one body; chosen:
parts of a body that turns or passes differ by some cells."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies:
    """Bodies among points, each of which takes several of them.

    Parameters
    ----------
    distance, rate : ranges and range rates of the points, m and m/s, ``(point,)``
    is_alike : mask of pairs of them of one speed, ``(point, point)``
    replicas, white : of the points, and their amplitudes on white channels, V, ``(point, channel)``
    strength : energies of their signals, V², ``(point,)``
    gram : sums of the products of their signals of amplitude 1, ``(point, point)``
    members : numbers of the points of all bodies, one body after the other, the strongest point of
        each first, ``(member,)``
    begin : places in ``members`` at which the bodies begin, ``(body,)``
    energy : that of every body which its best single point does not explain, V², ``(body,)``
    """

    distance: FloatArray
    rate: FloatArray
    is_alike: BoolArray
    replicas: Replicas
    white: ComplexArray
    strength: FloatArray
    gram: ComplexArray
    members: IntArray
    begin: IntArray
    energy: FloatArray

    @classmethod
    def of(cls, seen: Observation, points: Points) -> Self:
        """The bodies of points."""
        replicas, white = Replicas.of(seen, points), mixed(seen, points.amplitude)
        gram = total_products(seen, replicas, replicas)
        rate, size = points.motion[:, 1], np.diagonal(gram).real
        coupling = correlations(seen, replicas, replicas)
        repeated = np.sqrt(folds(seen, replicas, replicas) / greatest_fold(seen))
        numbers = bodies(points.strength, np.maximum(coupling, repeated))
        energy = [unexplained(gram[np.ix_(own, own)], white[own]) for own in numbers]
        return cls(
            distance=np.abs(points.motion[:, 0]),
            rate=rate,
            is_alike=_of_one_speed(seen, rate, rate),
            replicas=replicas,
            white=white,
            strength=np.sum(np.abs(white) ** 2, axis=1) * size,
            gram=gram,
            members=np.concatenate([np.zeros(0, dtype=np.int64), *numbers]),
            begin=np.cumsum([0, *map(len, numbers)])[:-1],
            energy=np.array(energy),
        )

    def residues(self, seen: Observation, at: Points, *, margin: float = 1.0) -> FloatArray:
        """Noise power of a sample that the bodies leave at points, W, ``(point,)``.

        A point's own cell does not count, nor does the body of which it is the strongest point.
        What a near body leaves at points that do not move with it is multiplied by ``margin``.
        """
        if not self.begin.size:
            return np.zeros(len(at))
        members, strongest = self.members, self.members[self.begin]
        here = Replicas.of(seen, at)
        is_alike = _of_one_speed(seen, at.motion[:, 1], self.rate)
        coupling = correlations(seen, here, self.replicas)
        is_same = coupling >= LEAST_OF_SAME
        in_cell = (is_same | ((coupling > LEAST_REDUNDANCY) & is_alike))[:, members]
        left = np.where(is_same[:, strongest], 0.0, self._energies_outside(in_cell))
        left *= side_lobes(seen, here, self.replicas[strongest])
        is_error = ~self._moves_as_strongest & ~in_cell
        errors = np.where(is_error, folds(seen, here, self.replicas)[:, members], 0.0)
        errors = np.add.reduceat(errors * self.strength[members], self.begin, axis=1)
        left += np.where(is_alike[:, strongest], 0.0, errors)
        is_near = self.distance[strongest] <= NEAR_BODY_RANGE
        weight = np.where(is_near & ~self._carries(at), margin, 1.0)
        return np.asarray((weight * left).sum(axis=1) / (seen.num_used * self.white.shape[1]))

    @property
    def _leaders(self) -> IntArray:
        """Number of the strongest point of every member's body, ``(member,)``."""
        return np.repeat(self.members[self.begin], self._sizes)

    @property
    def _sizes(self) -> IntArray:
        """Number of the members of every body, ``(body,)``."""
        return np.diff(self.begin, append=self.members.size)

    @property
    def _moves_as_strongest(self) -> BoolArray:
        """Mask of the members that have the speed of their body's strongest point."""
        return np.asarray(self.is_alike[self._leaders, self.members])

    def _carries(self, at: Points) -> BoolArray:
        """Mask of the points that move with a body, ``(point, body)``."""
        is_strong = self.strength[self.members] >= WEAKEST_OF_BODY * self.strength[self._leaders]
        moves_alike = np.abs(at.motion[:, 1:2] - self.rate[self.members]) <= SPREAD_OF_BODY
        return np.logical_or.reduceat(moves_alike & is_strong, self.begin, axis=1)

    def _energies_outside(self, in_cell: BoolArray) -> FloatArray:
        """Energies of bodies that their best single points do not explain, V², ``(point, body)``.

        Members in the cells of points, ``in_cell`` ``(point, member)``, do not count for these.
        """
        energies = np.tile(self.energy, (len(in_cell), 1))
        shared = np.logical_or.reduceat(in_cell, self.begin, axis=1)
        end = self.begin + self._sizes
        for n, body in zip(*np.nonzero(shared), strict=True):
            own = slice(self.begin[body], end[body])
            others = self.members[own][~in_cell[n, own]]
            energies[n, body] = unexplained(self.gram[np.ix_(others, others)], self.white[others])
        return energies


def with_residues(
    seen: Observation, points: Points, others: Bodies, *, margin: float = 1.0
) -> Points:
    """Points whose floors hold the residues there, and whose powers refer to these floors.

    ``margin`` multiplies what a near body leaves at points that do not move with it.
    """
    floor = points.floor + others.residues(seen, points, margin=margin)
    return replace(points, floor=floor, power=points.strength / floor)


def bodies(strength: FloatArray, coupling: FloatArray) -> list[IntArray]:
    """Numbers of the points of every body of several points, the strongest one first.

    A body is the strongest point that is in no other body, and those whose signals are correlated
    with it, on all ramps or on equal ones.
    """
    is_free = np.ones(strength.size, dtype=np.bool_)
    found = []
    for strongest in np.argsort(-strength):
        near = is_free & (coupling[strongest] > LEAST_COUPLING)
        near[strongest] = False
        if is_free[strongest] and np.any(near):
            found.append(np.append(strongest, np.flatnonzero(near)))
            is_free[found[-1]] = False
    return found


def side_lobes(seen: Observation, every: Replicas, tones: Replicas) -> FloatArray:
    """Limits of the power at every point's beats of tones at other beats, ``(point, tone)``.

    They are relative to the tones' own powers, and means over the ramps.
    """
    times, is_used = seen.model.times, seen.count > 0
    reach = (np.pi * times.num_samples / times.rate)[is_used]
    beat, other = every.track[:, None, BEAT, is_used], tones.track[:, BEAT, is_used]
    return np.asarray(np.mean(1.0 / np.maximum(reach * np.abs(beat - other), 1.0) ** 2, axis=-1))


def folds(seen: Observation, first: Replicas, second: Replicas) -> FloatArray:
    """Power that equal ramps add in phase of a tone at other beats, beyond its side lobes.

    It is relative to the tone's own power, as `side_lobes`; zero where all ramps differ:
    ``(first, second)``.
    """
    order, begin = _equal_ramps(seen)
    if begin.size == order.size:
        return np.zeros((len(first), len(second)))
    times = seen.model.times
    reach = np.pi * (times.num_samples / times.rate)[order]
    beat, other = first.track[:, None, BEAT, order], second.track[:, BEAT, order]
    lobe = 1.0 / np.maximum(reach * np.abs(beat - other), 1.0)
    turn, back = (
        one.wave[:, 0, 0, order] + 1j * one.wave[:, 0, 1, order] for one in (second, first)
    )
    turn = turn * back[:, None].conj()
    turn *= lobe / np.maximum(np.abs(turn), 1e-300)
    added = np.sum(np.abs(np.add.reduceat(turn, begin, axis=-1)) ** 2, axis=-1)
    return np.asarray(np.maximum(added - np.sum(lobe**2, axis=-1), 0.0) / order.size)


def greatest_fold(seen: Observation) -> float:
    """Greatest value of `folds`; at least 1."""
    order, begin = _equal_ramps(seen)
    sizes = np.diff(begin, append=order.size)
    return float(max(np.sum(sizes**2) / order.size - 1.0, 1.0))


def _equal_ramps(seen: Observation) -> tuple[IntArray, IntArray]:
    """Numbers of the ramps that are used, those of one slope and start frequency together.

    The second array says where those of each kind begin in the first one.
    """
    used = np.flatnonzero(seen.count > 0)
    slope, start = seen.model.schedule.slope[used], seen.model.schedule.start_frequency[used]
    order = np.lexsort((start, slope))
    is_other = (np.diff(slope[order]) != 0.0) | (np.diff(start[order]) != 0.0)
    return used[order], np.append(0, np.flatnonzero(is_other) + 1)


def _of_one_speed(seen: Observation, first: FloatArray, second: FloatArray) -> BoolArray:
    """Mask of pairs whose range rates differ by less than `SAME_SPEED`, ``(first, second)``."""
    apart = np.abs(first[:, None] - second)
    return np.asarray(apart < SAME_SPEED * seen.range_rate_cell, dtype=np.bool_)


def unexplained(gram: ComplexArray, white: ComplexArray) -> float:
    """Energy of a sum of points that the best single point at the place of one leaves, V².

    Parameters
    ----------
    gram : sums of the products of their signals of amplitude 1, ``(point, point)``
    white : amplitudes on channels whose noise is white, V, ``(point, channel)``
    """
    if len(gram) < 2:
        return 0.0
    matched = gram @ white
    total = float(np.sum(white.conj() * matched).real)
    by_one = np.sum(np.abs(matched) ** 2, axis=1) / np.maximum(np.diagonal(gram).real, 1e-300)
    return max(total - float(np.max(by_one)), 0.0)
