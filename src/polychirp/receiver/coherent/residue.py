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

from dataclasses import replace

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


def with_residues(seen: Observation, points: Points, others: Points | None = None) -> Points:
    """Points whose floors hold the residues there, and whose powers refer to these floors.

    The bodies are those of ``others``; None for the points themselves.
    """
    floor = points.floor + residues(seen, points if others is None else others, points)
    return replace(points, floor=floor, power=points.strength / floor)


def residues(seen: Observation, points: Points, at: Points) -> FloatArray:
    """Noise power of a sample that the bodies of ``points`` leave at others, W, ``(point,)``.

    A point's own cell does not count, nor does the body of which it is the strongest point.
    """
    every, here = Replicas.of(seen, points), Replicas.of(seen, at)
    gram = total_products(seen, every, every)
    coupling = correlations(seen, here, every)
    white = mixed(seen, points.amplitude)
    out = np.zeros(len(at))
    for body in bodies(points.strength, correlations(seen, every, every)):
        lobe = side_lobes(seen, here, every[body[:1]])
        for n in np.flatnonzero(coupling[:, body[0]] < LEAST_OF_SAME):
            others = body[coupling[n, body] <= LEAST_REDUNDANCY]
            energy = unexplained(gram[np.ix_(others, others)], white[others])
            out[n] += energy * lobe[n] / (seen.num_used * white.shape[1])
    return out


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
