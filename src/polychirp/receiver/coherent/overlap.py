"""Overlaps of the signals of points, and the groups of points that overlap."""

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points

LEAST_COUPLING = 0.1
"""Least correlation of the signals of two points that are fitted together; chosen."""

MOST_TOGETHER = 8
"""Greatest number of points in a group; chosen: steps of larger groups take long."""


def overlaps(seen: Observation, points: Points) -> ComplexArray:
    r"""Sums over each ramp of products of pairs of signals, times powers 0, 1, 2 of the time.

    The first of a pair is conjugated and the time counts from the middle of the ramp: ``(3, point,
    point, ramp)`` in units of 1, s and s². The beats of a pair differ by :math:`\Delta`, and its
    signals by more than a tone only if their rates differ much, so that with a window of N samples
    of length T and :math:`z = \pi\Delta T` the sums are :math:`N j_0(z)`, :math:`jN\tfrac T2
    j_1(z)` and :math:`-N\tfrac{T^2}4 j_0''(z)`, of spherical Bessel functions, times the phase in
    the middle. Steps that follow from them need no exact sums.
    """
    phases = seen.phases(points.motion)
    times = seen.model.times
    half = 0.5 * (times.num_samples - 1) / times.rate
    middle = phases[..., 0] + half * (phases[..., 1] + 0.5 * half * phases[..., 2])
    beat = phases[..., 1] + half * phases[..., 2]
    reach = 0.5 * times.num_samples / times.rate
    z = 2.0 * np.pi * (beat[None] - beat[:, None]) * reach
    turn = seen.count * np.exp(2j * np.pi * ((middle[None] - middle[:, None]) % 1.0))
    near = np.abs(z) < 1e-3
    safe = np.where(near, 1.0, z)
    zeroth = np.where(near, 1.0 - z**2 / 6.0, np.sin(safe) / safe)
    first = np.where(near, z / 3.0, (np.sin(safe) / safe - np.cos(safe)) / safe)
    second = -zeroth + np.where(near, 2.0 / 3.0, 2.0 * first / safe)
    gain = np.mean(seen.shape(points.motion, points.sine)[..., 0], axis=1)
    gain *= np.sqrt(seen.weights(points.motion))
    turn *= gain.conj()[:, None] * gain[None]
    return np.stack([turn * zeroth, 1j * reach * turn * first, -(reach**2) * turn * second])


def groups_of(seen: Observation, points: Points) -> list[IntArray]:
    """Numbers of the points that are correlated with each other, group by group."""
    coupling = couplings(seen, points)
    is_free = np.ones(len(points), dtype=bool)
    groups = []
    for n in np.argsort(-np.sum(np.abs(points.amplitude) ** 2, axis=1)):
        if is_free[n]:
            own = _grown(int(n), coupling, is_free)
            is_free[own] = False
            groups.append(np.array(own))
    return groups


def couplings(seen: Observation, points: Points) -> FloatArray:
    """Magnitude of the correlation of every pair's signals, ``(point, point)``."""
    total = np.abs(overlaps(seen, points)[0].sum(axis=-1))
    size = np.sqrt(np.maximum(np.diag(total), 1e-300))
    return np.asarray(total / np.outer(size, size))


def _grown(first: int, coupling: FloatArray, is_free: BoolArray) -> list[int]:
    """The free points that are most correlated with a member of the group of ``first``."""
    own = [first]
    while len(own) < MOST_TOGETHER:
        reach = np.max(coupling[own], axis=0) * is_free
        reach[own] = 0.0
        best = int(np.argmax(reach))
        if reach[best] < LEAST_COUPLING:
            break
        own.append(best)
    return own
