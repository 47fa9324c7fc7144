"""Groups of points whose signals are correlated, which are fitted together."""

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.replicas import Replicas, correlations

LEAST_COUPLING = 0.1
"""Least correlation of the signals of two points that are fitted together; chosen."""

LEAST_REDUNDANCY = 0.3
"""Correlation from which two points overlap much: one may be redundant, and they share a cell;
chosen."""

MOST_TOGETHER = 8
"""Greatest number of points in a group; chosen: steps of larger groups take long."""


def overlaps_another(seen: Observation, points: Replicas) -> BoolArray:
    """Mask of the points that overlap much with another, ``(point,)``."""
    coupling = correlations(seen, points, points) - np.eye(len(points))
    return np.asarray(np.any(coupling > LEAST_REDUNDANCY, axis=1), dtype=np.bool_)


def groups_of(seen: Observation, points: Replicas) -> list[IntArray]:
    """Numbers of the points of each group; the strongest point is in the first."""
    coupling = correlations(seen, points, points)
    is_free = np.ones(len(points), dtype=bool)
    groups = []
    for n in np.argsort(-np.sum(np.abs(points.amplitude) ** 2, axis=1), kind="stable"):
        if is_free[n]:
            group = _grown(int(n), coupling, is_free)
            is_free[group] = False
            groups.append(group)
    return groups


def _grown(first: int, coupling: FloatArray, is_free: BoolArray) -> IntArray:
    """The free points that are most correlated with a member of the group of ``first``."""
    own = [first]
    while len(own) < MOST_TOGETHER:
        reach = np.max(coupling[own], axis=0) * is_free
        reach[own] = 0.0
        best = int(np.argmax(reach))
        if reach[best] < LEAST_COUPLING:
            break
        own.append(best)
    return np.array(own)
