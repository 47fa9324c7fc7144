"""Compiled kernel that counts the training cells below a level."""

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.jit import compiled


@compiled
def count_below(padded: FloatArray, level: FloatArray, offsets: IntArray) -> IntArray:
    """Number of every cell's training cells that are below the cell's level: ``(row, column)``.

    The inner loop runs along a row, contiguous in memory and without a branch, so that the compiler
    turns it into vector instructions.

    Parameters
    ----------
    padded : the map, continued on all sides by the reach of the CFAR window
    level : level of every cell, in the unit of the map, ``(row, column)``
    offsets : row and column of every training cell from the tested cell on, ``(training cell, 2)``
    """
    rows, columns = level.shape
    top = (padded.shape[0] - rows) // 2
    left = (padded.shape[1] - columns) // 2
    count = np.zeros((rows, columns), dtype=np.int64)
    for i in range(rows):
        row_count, row_level = count[i], level[i]
        for k in range(offsets.shape[0]):
            first = left + offsets[k, 1]
            source = padded[i + top + offsets[k, 0], first : first + columns]
            for j in range(columns):
                row_count[j] += source[j] < row_level[j]
    return count
