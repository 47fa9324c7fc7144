"""Peaks of the coherent map above its floor."""

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.jit import compiled, inlined, reordered
from polychirp.receiver.coherent.coherent_map import CoherentMap
from polychirp.receiver.signal_model.grid import Grid

WINDOW = (129, 9)
"""Range rates and ranges of the map around a cell from which its local floor is taken; chosen: some
30 cells of range rate and two of range on either side hold most of what a subtraction leaves."""

GREATEST_LOSS = 0.6
"""Least value of the map in a cell next to a peak, over the peak's own; 0.66 in theory."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Peaks:
    """Local maxima of the map.

    Parameters
    ----------
    cell : indices of range rate and range, ``(peak, 2)``
    range, range_rate : interpolated between cells, m and m/s, ``(peak,)``
    ratio : interpolated value over the noise power of a sample, ``(peak,)``
    floor : that noise power, W, ``(peak,)``
    is_point : mask of the peaks at which the ramps show points (`agreement`), ``(peak,)``
    """

    cell: IntArray
    range: FloatArray
    range_rate: FloatArray
    ratio: FloatArray
    floor: FloatArray
    is_point: BoolArray

    @property
    def power(self) -> FloatArray:
        """Interpolated value of the map, W, ``(peak,)``."""
        return self.ratio * self.floor

    def __getitem__(self, which: BoolArray | IntArray) -> Self:
        chosen = {field.name: getattr(self, field.name)[which] for field in fields(self)}
        return replace(self, **chosen)


def floors(seen: CoherentMap, cell: IntArray) -> FloatArray:
    """Noise power of a sample at cells ``(place, 2)`` of the map, W, ``(place,)``.

    It is that of the cell's range, or the mean of a window around the cell where
    this is greater: there a subtraction has left a residue, and a peak must stand out of it.
    """
    near = _means(seen.power, cell, *WINDOW) / seen.num_channels
    return np.asarray(np.maximum(near, seen.range_floor[cell[:, 1]]))


def peaks(seen: CoherentMap, axes: Grid, threshold: float) -> Peaks:
    """Peaks whose interpolated value exceeds ``threshold`` times the floor.

    It exceeds that of its range rate too, where bursts make a ridge over all ranges. Values are
    interpolated by parabolas through the logarithm of the power, along each axis.
    """
    least = (GREATEST_LOSS * threshold * seen.range_floor).astype(np.float32)
    cell, place, value = _maxima(seen.power, least)
    may_exceed = value > threshold * seen.range_floor[cell[:, 1]]  # the floor is this or higher
    cell, place, value = cell[may_exceed], place[may_exceed], value[may_exceed]
    floor = floors(seen, cell)
    exceeds = value > threshold * np.maximum(floor, seen.rate_floor[cell[:, 0]])
    cell, place, value, floor = (v[exceeds] for v in (cell, place, value, floor))
    return Peaks(
        cell=cell,
        range=axes.range[cell[:, 1]] + axes.range_step * place[:, 1],
        range_rate=axes.range_rate[cell[:, 0]] + axes.range_rate_step * place[:, 0],
        ratio=value / np.maximum(floor, np.finfo(np.float64).tiny),
        floor=floor,
        is_point=seen.agreement(cell).shows_points(floor, GREATEST_LOSS * threshold),
    )


@inlined
def _vertex(left: Any, here: Any, right: Any) -> Any:  # pragma: no cover - compiled
    """Place, in steps, and height of the parabola through the logarithms of three neighbours."""
    left, here, right = np.log(left), np.log(here), np.log(right)
    bend = min(left + right - 2.0 * here, -1e-9)
    place = max(-0.5, min(0.5, 0.5 * (left - right) / bend))
    return place, -0.5 * bend * place * place


@compiled
def _maxima(power: Any, least: Any) -> Any:  # pragma: no cover - compiled
    """Maxima: cells above the least value of their column that none of eight neighbours exceeds.

    Returns
    -------
    cell : indices, ``(maximum, 2)``
    place : of the interpolated maximum from the cell, in steps, ``(maximum, 2)``
    value : interpolated, ``(maximum,)``
    """
    rows, columns = power.shape
    cell = np.empty((power.size, 2), dtype=np.int64)  # memory is taken where it is written
    place, value = np.empty((power.size, 2)), np.empty(power.size)
    tiny = 1e-300
    n = 0
    for i in range(rows):
        for j in range(columns):
            here = power[i, j]
            if here <= least[j]:
                continue
            if (j > 0 and power[i, j - 1] > here) or (j + 1 < columns and power[i, j + 1] > here):
                continue  # as most cells, which saves the loop over all neighbours
            greatest = here
            for p in range(max(0, i - 1), min(rows, i + 2)):
                for q in range(max(0, j - 1), min(columns, j + 2)):
                    greatest = max(greatest, power[p, q])
            if greatest > here:
                continue
            cell[n] = i, j
            up, along = 0.0, 0.0
            place[n] = 0.0
            here = max(np.float64(here), tiny)
            if 0 < i < rows - 1:
                before, after = np.float64(power[i - 1, j]), np.float64(power[i + 1, j])
                place[n, 0], up = _vertex(max(before, tiny), here, max(after, tiny))
            if 0 < j < columns - 1:
                before, after = np.float64(power[i, j - 1]), np.float64(power[i, j + 1])
                place[n, 1], along = _vertex(max(before, tiny), here, max(after, tiny))
            value[n] = here * np.exp(up + along)
            n += 1
    return cell[:n].copy(), place[:n].copy(), value[:n].copy()


@reordered
def _means(power: Any, cell: Any, height: int, width: int) -> Any:  # pragma: no cover - compiled
    """Means of windows around cells, of what lies inside the map, ``(place,)``.

    Of every other row: rows are half a cell apart. They follow from sums over all rows before.
    """
    rows, columns = power.shape
    half = width // 2
    reach = height // 4  # rows of the window above and below, of every other row
    kept = 4 * reach + 4
    row = np.zeros(columns + 2 * half, dtype=np.float32)
    recent = np.zeros((kept, columns))  # sums over ranges of the last rows that were added
    window = np.zeros((2, columns))  # sums of the windows around even and around odd rows
    out = np.empty(len(cell))
    order = np.argsort(cell[:, 0])
    n = 0
    for last in range(rows + 2 * reach):
        new, old, total = recent[last % kept], recent[(last + 2) % kept], window[last % 2]
        if last < rows:
            for j in range(columns):
                row[half + j] = power[last, j]
        for j in range(columns):
            total[j] -= old[j]
            new[j] = 0.0
        if last < rows:
            for q in range(2 * half + 1):
                for j in range(columns):
                    new[j] += row[q + j]
        for j in range(columns):
            total[j] += new[j]
        middle = last - 2 * reach
        above, below = min(middle // 2, reach), min((rows - 1 - middle) // 2, reach)
        while n < len(cell) and cell[order[n], 0] == middle:
            j = cell[order[n], 1]
            inside = min(columns, j + half + 1) - max(0, j - half)
            out[order[n]] = total[j] / ((above + below + 1) * inside)
            n += 1
    return out
