"""Peaks of the coherent map above its floor."""

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.jit import compiled, reordered
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

    Values are interpolated by parabolas through the logarithm of the power, along each axis.
    """
    power = seen.power
    least = GREATEST_LOSS * threshold * seen.range_floor
    cell = np.array(_maxima(power, least.astype(np.float32)), dtype=np.int64).reshape(-1, 2)
    floor = floors(seen, cell)
    by_rate, up = _vertex(power, cell, 0)
    by_range, along = _vertex(power, cell, 1)
    value = power[tuple(cell.T)].astype(np.float64) * np.exp(up + along)
    found = Peaks(
        cell=cell,
        range=axes.range[cell[:, 1]] + axes.range_step * by_range,
        range_rate=axes.range_rate[cell[:, 0]] + axes.range_rate_step * by_rate,
        ratio=value / np.maximum(floor, np.finfo(np.float64).tiny),
        floor=floor,
        is_point=seen.agreement(cell).shows_points(floor, GREATEST_LOSS * threshold),
    )
    return found[found.ratio > threshold]


def _vertex(power: NDArray[np.float32], cell: IntArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """Place, in steps, and height of the parabola through three neighbours along an axis.

    It goes through the logarithms of the power.
    """
    index, last = cell[:, axis], power.shape[axis] - 1
    is_inside = (index > 0) & (index < last)
    before, after = cell.copy(), cell.copy()
    before[:, axis], after[:, axis] = np.maximum(index - 1, 0), np.minimum(index + 1, last)
    left, here, right = (
        np.log(np.maximum(power[tuple(c.T)].astype(np.float64), 1e-300))
        for c in (before, cell, after)
    )
    bend = np.minimum(left + right - 2.0 * here, -1e-9)
    place = np.where(is_inside, np.clip(0.5 * (left - right) / bend, -0.5, 0.5), 0.0)
    return place, np.where(is_inside, -0.5 * bend * place**2, 0.0)


@compiled
def _maxima(power: Any, least: Any) -> Any:  # pragma: no cover - compiled
    """Cells above the least value of their column that none of their eight neighbours exceeds."""
    rows, columns = power.shape
    found = [(0, 0) for _ in range(0)]
    for i in range(rows):
        for j in range(columns):
            value = power[i, j]
            if value <= least[j]:
                continue
            is_peak = True
            for p in range(max(0, i - 1), min(rows, i + 2)):
                for q in range(max(0, j - 1), min(columns, j + 2)):
                    if power[p, q] > value:
                        is_peak = False
            if is_peak:
                found.append((i, j))
    return found


@reordered
def _means(power: Any, cell: Any, height: int, width: int) -> Any:  # pragma: no cover - compiled
    """Means of windows around cells, of what lies inside the map, ``(place,)``."""
    rows, columns = power.shape
    out = np.zeros(len(cell))
    for n in range(len(cell)):
        i, j = cell[n]
        top, bottom = max(0, i - height // 2), min(rows, i + height // 2 + 1)
        left, right = max(0, j - width // 2), min(columns, j + width // 2 + 1)
        rows_taken = 0  # of every other row: rows are half a cell apart
        for p in range(top + (i - top) % 2, bottom, 2):
            rows_taken += 1
            for q in range(left, right):
                out[n] += power[p, q]
        out[n] /= rows_taken * (right - left)
    return out
