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
their own leave none.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import LEAST_COUPLING
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.refinement import LEAST_REDUNDANCY
from polychirp.receiver.coherent.replicas import (
    BEAT,
    Replicas,
    correlations,
    total_products,
)

LEAST_OF_SAME = 1.0 - 1e-9
"""Correlation from which two signals are that of one point; rounding makes some 1e-15."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bodies:
    """Bodies among points, each of which takes several of them.

    Parameters
    ----------
    replicas, white : of the points, and their amplitudes on white channels, V, ``(point, channel)``
    gram : sums of the products of their signals of amplitude 1, ``(point, point)``
    numbers : of the points of every body, the strongest one first
    energy : that of every body which its best single point does not explain, V², ``(body,)``
    """

    replicas: Replicas
    white: ComplexArray
    gram: ComplexArray
    numbers: list[IntArray]
    energy: FloatArray

    @classmethod
    def of(cls, seen: Observation, points: Points) -> Self:
        """The bodies of points."""
        replicas, white = Replicas.of(seen, points), mixed(seen, points.amplitude)
        gram = total_products(seen, replicas, replicas)
        numbers = bodies(points.strength, correlations(seen, replicas, replicas))
        energy = [unexplained(gram[np.ix_(own, own)], white[own]) for own in numbers]
        return cls(
            replicas=replicas, white=white, gram=gram, numbers=numbers, energy=np.array(energy)
        )

    def residues(self, seen: Observation, at: Points) -> FloatArray:
        """Noise power of a sample that the bodies leave at points, W, ``(point,)``.

        A point's own cell does not count, nor does the body of which it is the strongest point.
        """
        out = np.zeros(len(at))
        if not self.numbers:
            return out
        here = Replicas.of(seen, at)
        coupling = correlations(seen, here, self.replicas)
        for body, whole in zip(self.numbers, self.energy, strict=True):
            energy = np.full(len(at), whole)
            for n in np.flatnonzero(np.any(coupling[:, body] > LEAST_REDUNDANCY, axis=1)):
                others = body[coupling[n, body] <= LEAST_REDUNDANCY]
                energy[n] = unexplained(self.gram[np.ix_(others, others)], self.white[others])
            energy[coupling[:, body[0]] >= LEAST_OF_SAME] = 0.0
            out += energy * side_lobes(seen, here, self.replicas[body[:1]])
        return np.asarray(out / (seen.num_used * self.white.shape[1]))


def with_residues(seen: Observation, points: Points, others: Bodies) -> Points:
    """Points whose floors hold the residues there, and whose powers refer to these floors."""
    floor = points.floor + others.residues(seen, points)
    return replace(points, floor=floor, power=points.strength / floor)


def bodies(strength: FloatArray, coupling: FloatArray) -> list[IntArray]:
    """Numbers of the points of every body of several points, the strongest one first.

    A body is the strongest point that is in no other body, and those that are fitted together with
    it because their signals are correlated.
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


def side_lobes(seen: Observation, every: Replicas, tone: Replicas) -> FloatArray:
    """Limit of the power at every point's beats of a tone at other beats, ``(point,)``.

    It is relative to the tone's own power, and a mean over the ramps.
    """
    times = seen.model.times
    apart = np.abs(every.track[:, BEAT] - tone.track[:, BEAT]) * times.num_samples / times.rate
    lobe = 1.0 / np.maximum(np.pi * apart, 1.0) ** 2
    return np.asarray(lobe[:, seen.count > 0].mean(axis=1))


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
