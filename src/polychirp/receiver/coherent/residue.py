r"""What bodies leave where ideal points are subtracted from them, as noise at other points.

A body is no sum of a few ideal points: its glints move, and they change over the frame. Where one
resolution cell takes several points, the amplitude of what is there varies over the ramps. Its
energy is known, the part E that the best single point leaves of it, but not its course: other
points in that cell follow it only in part. Over a ramp of length T, an unknown variation spreads
from the body's beat :math:`f_k` to others as the side lobes of a tone do,

.. math:: \mathrm{sinc}^2[(f - f_k)\,T_k] \le \min\{1,\ [\pi\,(f - f_k)\,T_k]^{-2}\},

and variations that differ between the K ramps add up as noise does. At the beats of another point
they have the noise power of a sample :math:`E\,\overline{\min\{\cdot\}}/KM` on each of M channels,
with the mean over the ramps. A point must stand out of it as out of other noise. It is zero for
ideal points with cells of their own, however weak they are beside each other.
"""

from dataclasses import replace

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import LEAST_COUPLING
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.refinement import LEAST_REDUNDANCY
from polychirp.receiver.coherent.replicas import Replicas, total_products


def with_residues(seen: Observation, points: Points) -> Points:
    """Points whose floors hold what bodies leave there, and whose powers refer to these floors."""
    floor = points.floor + residues(seen, points)
    return replace(points, floor=floor, power=points.strength / floor)


def residues(seen: Observation, points: Points) -> FloatArray:
    """Noise power of a sample that the bodies leave at every point, W, ``(point,)``.

    A body is the strongest point that belongs to no other body, and those that are correlated with
    it. What it leaves at a point does not count the points in that one's own cell.
    """
    every = Replicas.of(seen, points)
    gram = total_products(seen, every, every)
    size = np.maximum(np.diagonal(gram).real, 1e-300)
    coupling = np.abs(gram) / np.sqrt(np.outer(size, size))
    white = mixed(seen, points.amplitude)
    number = np.arange(len(points))
    out = np.zeros(len(points))
    for body in bodies(points.strength, coupling):
        leader = body[0]
        lobe = side_lobes(seen, every, leader)
        for n in number[number != leader]:
            others = body[coupling[n, body] <= LEAST_REDUNDANCY]
            energy = unexplained(gram[np.ix_(others, others)], white[others])
            out[n] += energy * lobe[n] / (seen.num_used * white.shape[1])
    return out


def bodies(strength: FloatArray, coupling: FloatArray) -> list[FloatArray]:
    """Numbers of the points of each body that has several, the strongest point first."""
    is_free: BoolArray = np.ones(strength.size, dtype=np.bool_)
    found = []
    for leader in np.argsort(-strength):
        if is_free[leader]:
            near = is_free & (coupling[leader] > LEAST_COUPLING)
            near[leader] = False
            is_free[near] = is_free[leader] = False
            if np.any(near):
                found.append(np.append(leader, np.flatnonzero(near)))
    return found


def side_lobes(seen: Observation, every: Replicas, leader: int) -> FloatArray:
    """Greatest power at every point's beats of a tone at those of the leader, over its own.

    It is a mean over the ramps, ``(point,)``.
    """
    times = seen.model.times
    is_used = seen.count > 0
    apart = np.abs(every.beat - every.beat[leader]) * times.num_samples / times.rate
    lobe = 1.0 / np.maximum(np.pi * apart[:, is_used], 1.0) ** 2
    return np.asarray(lobe.mean(axis=1))


def unexplained(gram: ComplexArray, white: ComplexArray) -> float:
    """Energy of points that the best single point at one of their places leaves of them, W.

    Parameters
    ----------
    gram : sums of products of their signals of amplitude 1, ``(point, point)``
    white : amplitudes on channels whose noise is white, V, ``(point, channel)``
    """
    if len(gram) < 2:
        return 0.0
    matched = gram @ white
    total = float(np.sum(white.conj() * matched).real)
    by_one = np.sum(np.abs(matched) ** 2, axis=1) / np.maximum(np.diagonal(gram).real, 1e-300)
    return max(total - float(np.max(by_one)), 0.0)
