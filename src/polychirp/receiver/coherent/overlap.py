"""Correlations of the signals of points, and the groups of points that are fitted together."""

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.replicas import Replicas, total_products

LEAST_COUPLING = 0.1
"""Least correlation of the signals of two points that are fitted together; chosen."""

MOST_TOGETHER = 8
"""Greatest number of points in a group; chosen: steps of larger groups take long."""


def couplings(seen: Observation, first: Replicas, second: Replicas) -> FloatArray:
    """Magnitude of the correlation of pairs of signals of amplitude 1, ``(first, second)``."""
    total = total_products(seen, first, second)
    sizes = (np.sqrt(np.maximum(one.weight @ seen.count, 1e-300)) for one in (first, second))
    return np.asarray(np.abs(total) / np.outer(*sizes))


def groups_of(seen: Observation, points: Replicas) -> IntArray:
    """Number of the group of every point: points that are correlated share one, ``(point,)``."""
    coupling = couplings(seen, points, points)
    group = np.full(len(points), -1)
    number = 0
    for n in np.argsort(-np.sum(np.abs(points.amplitude) ** 2, axis=1)):
        if group[n] < 0:
            group[_grown(int(n), coupling, group < 0)] = number
            number += 1
    return group


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
