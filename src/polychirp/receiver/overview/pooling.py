"""Maps with fewer cells, for figures."""

import numpy as np

from polychirp.axes import FloatArray, IntArray


def pooled(values: FloatArray, *, most: int, axis: int) -> FloatArray:
    """Maxima of groups of neighbours along an axis, so that at most ``most`` cells are left.

    >>> pooled(np.array([1.0, 5.0, 2.0, 3.0, 4.0]), most=3, axis=0)
    array([5., 3., 4.])
    """
    starts = group_starts(values.shape[axis], most)
    return np.asarray(np.maximum.reduceat(values, starts, axis=axis))


def group_means(values: FloatArray, *, most: int) -> FloatArray:
    """Means of the same groups along an axis of its own: the places of pooled cells.

    >>> group_means(np.array([0.0, 1.0, 2.0, 3.0, 4.0]), most=3)
    array([0.5, 2.5, 4. ])
    """
    starts = group_starts(values.size, most)
    counts = np.diff(np.append(starts, values.size))
    return np.asarray(np.add.reduceat(values, starts) / counts)


def group_starts(size: int, most: int) -> IntArray:
    """First number of each of at most ``most`` groups of equally many neighbours.

    >>> group_starts(5, 3).tolist()
    [0, 2, 4]
    """
    return np.arange(0, size, max(1, -(-size // most)))
