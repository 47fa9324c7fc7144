"""Peaks of the coherent map above its floor."""

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.jit import compiled
from polychirp.receiver.coherent.coherent_map import CoherentMap
from polychirp.receiver.signal_model.grid import Grid

ROWS_FOR_FLOOR = 1000
"""Number of range rates from which the floor of a range is taken; chosen: its error is 5 %."""

NEIGHBOURS = 3
"""Number of ranges on either side over which floors are averaged; chosen."""

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


def floors(power: NDArray[np.float32], num_channels: int) -> NDArray[np.float32]:
    """Noise power of a sample at every cell of the map, W, ``(range rate, range)``.

    It is that of the cell's range (`range_floors`), or the mean of a window around the cell where
    this is greater: there a subtraction has left a residue, and a peak must stand out of it.
    """
    from scipy.ndimage import uniform_filter

    near = uniform_filter(power, WINDOW, mode="nearest") / np.float32(num_channels)
    far = range_floors(power, num_channels).astype(np.float32)
    return np.asarray(np.maximum(near, far), dtype=np.float32)


def range_floors(power: NDArray[np.float32], num_channels: int) -> FloatArray:
    """Noise power of a sample at every range, W, from the median over range rates, ``(range,)``."""
    from scipy.special import gammaincinv

    step = max(1, power.shape[0] // ROWS_FOR_FLOOR)
    median = np.median(power[::step], axis=0) / gammaincinv(num_channels, 0.5)
    padded = np.pad(median, NEIGHBOURS, mode="edge")
    width = 2 * NEIGHBOURS + 1
    return np.asarray(np.convolve(padded, np.full(width, 1.0 / width), mode="valid"))


def peaks(
    seen: CoherentMap,
    floor: NDArray[np.float32],
    axes: Grid,
    threshold: float,
) -> Peaks:
    """Peaks whose interpolated value exceeds ``threshold`` times the floor.

    Values are interpolated by parabolas through the logarithm of the power, along each axis.
    """
    ratio = seen.power / np.maximum(floor, np.float32(1e-37))
    cell = np.array(_maxima(ratio, np.float32(GREATEST_LOSS * threshold)), dtype=np.int64)
    cell = cell.reshape(-1, 2)
    level = np.log(np.maximum(ratio, np.float32(1e-30)))
    by_rate, up = _vertex(level, cell, 0)
    by_range, along = _vertex(level, cell, 1)
    value = np.exp(level[tuple(cell.T)] + up + along)
    own = floor[tuple(cell.T)].astype(np.float64)
    found = Peaks(
        cell=cell,
        range=axes.range[cell[:, 1]] + axes.range_step * by_range,
        range_rate=axes.range_rate[cell[:, 0]] + axes.range_rate_step * by_rate,
        ratio=value,
        floor=own,
        is_point=seen.agreement(cell).shows_points(own, GREATEST_LOSS * threshold),
    )
    return found[value > threshold]


def _vertex(level: NDArray[np.float32], cell: IntArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """Place, in steps, and height of the parabola through three neighbours along an axis."""
    index, last = cell[:, axis], level.shape[axis] - 1
    is_inside = (index > 0) & (index < last)
    before, after = cell.copy(), cell.copy()
    before[:, axis], after[:, axis] = np.maximum(index - 1, 0), np.minimum(index + 1, last)
    left, here, right = (level[tuple(c.T)].astype(np.float64) for c in (before, cell, after))
    bend = np.minimum(left + right - 2.0 * here, -1e-9)
    place = np.where(is_inside, np.clip(0.5 * (left - right) / bend, -0.5, 0.5), 0.0)
    return place, np.where(is_inside, -0.5 * bend * place**2, 0.0)


@compiled
def _maxima(ratio: Any, least: Any) -> Any:  # pragma: no cover - compiled
    """Cells of at least ``least`` that none of their eight neighbours exceeds."""
    rows, columns = ratio.shape
    found = [(0, 0) for _ in range(0)]
    for i in range(rows):
        for j in range(columns):
            value = ratio[i, j]
            if value < least:
                continue
            is_peak = True
            for p in range(max(0, i - 1), min(rows, i + 2)):
                for q in range(max(0, j - 1), min(columns, j + 2)):
                    if ratio[p, q] > value:
                        is_peak = False
            if is_peak:
                found.append((i, j))
    return found
