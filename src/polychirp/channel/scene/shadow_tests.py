"""Shadow rays for the strongest paths first, so that paths which are too weak need none."""

from collections.abc import Callable
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray

FIRST_ROUND_SIZE: Final = 8
"""Paths of each pair that are tested in the first round; every round has twice as many as the one
before. Chosen."""


def strongest_visible(
    power: FloatArray,
    group: IntArray,
    is_visible: Callable[[IntArray], BoolArray],
    dynamic_range: float,
) -> IntArray:
    """Numbers of the visible paths within a dynamic range of their group's strongest visible path.

    Paths that are weaker are not tested: a hidden path costs a ray only if it would be among the
    strong ones.

    Parameters
    ----------
    power : ratio, ``(path,)``
    group : number of the pair, ``(path,)``
    is_visible : mask ``(number,)`` of the visible ones among the paths with some numbers
    dynamic_range : ratio of powers

    Examples
    --------
    The strongest is hidden; the last is too weak beside the second:

    >>> power, group = np.array([9.0, 4.0, 3.0, 0.1]), np.zeros(4, dtype=np.int64)
    >>> strongest_visible(power, group, lambda numbers: numbers > 0, 10.0)
    array([1, 2])
    """
    if not len(power):
        return np.zeros(0, dtype=np.int64)
    order = np.lexsort((-power, group))
    counts = np.bincount(group)
    rank = np.arange(len(power)) - np.repeat(np.cumsum(counts) - counts, counts)
    best, found = np.zeros(len(counts)), [np.zeros(0, dtype=np.int64)]
    begin, size = 0, FIRST_ROUND_SIZE
    while begin < counts.max():
        mine = order[(rank >= begin) & (rank < begin + size)]
        mine = mine[(power[mine] > 0) & (power[mine] * dynamic_range >= best[group[mine]])]
        mine = mine[is_visible(mine)]
        np.maximum.at(best, group[mine], power[mine])
        found.append(mine)
        begin, size = begin + size, 2 * size
    kept = np.sort(np.concatenate(found))
    return np.asarray(kept[power[kept] * dynamic_range >= best[group[kept]]])
