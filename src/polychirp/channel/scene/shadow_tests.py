"""Shadow tests of the strongest paths first, so that paths that are too weak are not tested."""

from collections.abc import Callable
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray

FIRST_ROUND_SIZE: Final = 8
"""Number of paths of each pair of radars that are tested in the first round; every later round
tests twice as many as the one before. Chosen: few, since often one of the strongest is visible."""


def strongest_visible(
    power: FloatArray,
    group: IntArray,
    is_visible: Callable[[IntArray], BoolArray],
    dynamic_range: float,
) -> IntArray:
    """Numbers of the visible paths within a dynamic range of their group's strongest visible path.

    A path is not tested for shadow if it is too weak beside a visible path of an earlier round.

    Parameters
    ----------
    power : received over transmitted power, ``(path,)``
    group : number of the pair of radars, ``(path,)``
    is_visible : function from numbers of paths to a mask of those that are visible, ``(number,)``
    dynamic_range : ratio of the group's strongest visible power to the least power that is kept

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
