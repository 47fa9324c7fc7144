"""Peaks of the coherent map above its floor."""

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.jit import compiled, inlined, inner, reordered, reordered_inner
from polychirp.receiver.coherent.coherent_map import CoherentMap
from polychirp.receiver.signal_model.grid import Grid

WINDOW = (129, 9)
"""Range rates and ranges of the map around a cell from which its local floor is taken; chosen: some
30 cells of range rate and two of range on either side hold most of what a subtraction leaves."""

GREATEST_LOSS = 0.6
"""Least value of the map in a cell next to a peak, over the peak's own; 0.66 in theory."""


MOST_MAXIMA = 4096
"""Number of maxima for which memory is taken at first; chosen: few maps have more."""

TOGETHER = 64
"""Number of ranges of a row that are left out at once if none exceeds its least value; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Peaks:
    """Local maxima of the map.

    Parameters
    ----------
    cell : indices of range rate and range, ``(peak, 2)``
    range, range_rate : interpolated between cells, m and m/s, ``(peak,)``
    ratio : interpolated value over the noise power of a sample, ``(peak,)``
    floor : that noise power, W, ``(peak,)``
    """

    cell: IntArray
    range: FloatArray
    range_rate: FloatArray
    ratio: FloatArray
    floor: FloatArray

    @property
    def power(self) -> FloatArray:
        """Interpolated value of the map, W, ``(peak,)``."""
        return self.ratio * self.floor

    def __getitem__(self, which: BoolArray | IntArray | slice) -> Self:
        chosen = {field.name: getattr(self, field.name)[which] for field in fields(self)}
        return replace(self, **chosen)


def floors(seen: CoherentMap, cell: IntArray) -> FloatArray:
    """Noise power of a sample at cells ``(place, 2)`` of the map, W, ``(place,)``.

    It is that of the cell's range, or the mean of a window around the cell where this is greater:
    there a subtraction has left a residue, and a peak must stand out of it. It is that of the
    cell's range rate where bursts make a ridge over all ranges.
    """
    if not len(cell):
        return np.zeros(0)
    is_few = len(cell) * WINDOW[0] * WINDOW[1] < seen.power.size
    near = (_near_means if is_few else _means)(seen.power, cell, *WINDOW) / seen.num_channels
    of_axes = np.maximum(seen.range_floor[cell[:, 1]], seen.rate_floor[cell[:, 0]])
    return np.asarray(np.maximum(near, of_axes))


def peaks(seen: CoherentMap, axes: Grid, threshold: float) -> Peaks:
    """Peaks whose interpolated value exceeds ``threshold`` times the floor.

    Values are interpolated by parabolas through the logarithm of the power, along each axis.
    """
    least = (GREATEST_LOSS * threshold * seen.range_floor).astype(np.float32)
    cell = _maxima(seen.power, least)
    floor = floors(seen, cell)
    needed = threshold * floor
    may_exceed = seen.power[tuple(cell.T)] > GREATEST_LOSS * needed
    cell, floor, needed = cell[may_exceed], floor[may_exceed], needed[may_exceed]
    place, value = _interpolated(seen.power, cell)
    exceeds = value > needed
    cell, place, value, floor = (v[exceeds] for v in (cell, place, value, floor))
    return Peaks(
        cell=cell,
        range=axes.range[cell[:, 1]] + axes.range_step * place[:, 1],
        range_rate=axes.range_rate[cell[:, 0]] + axes.range_rate_step * place[:, 0],
        ratio=value / np.maximum(floor, np.finfo(np.float64).tiny),
        floor=floor,
    )


@inlined
def _vertex(left: Any, here: Any, right: Any) -> Any:  # pragma: no cover - compiled
    """Place, in steps, and height of the parabola through the logarithms of three neighbours."""
    left, here, right = np.log(left), np.log(here), np.log(right)
    bend = min(left + right - 2.0 * here, -1e-9)
    place = max(-0.5, min(0.5, 0.5 * (left - right) / bend))
    return place, -0.5 * bend * place * place


@reordered_inner
def _any_exceeds(value: Any, least: Any) -> bool:  # pragma: no cover - compiled
    """True if any value exceeds the least one of its place.

    The loop has no branches, so that it takes vector instructions.
    """
    count = np.int32(0)
    for j in range(value.size):
        count += np.int32(value[j] > least[j])
    return bool(count > 0)


@reordered_inner
def _mark_maxima(
    above: Any, here: Any, below: Any, least: Any, mark: Any
) -> None:  # pragma: no cover - compiled
    """Set marks of the inner cells of a row above the least that no neighbour exceeds, in place.

    The loop has no branches, so that it takes vector instructions.
    """
    size = here.size - 2
    left, middle, right, low = here[:size], here[1 : size + 1], here[2:], least[1 : size + 1]
    a, b, c = above[:size], above[1 : size + 1], above[2:]
    d, e, f = below[:size], below[1 : size + 1], below[2:]
    out = mark[1 : size + 1]
    for j in range(size):
        greatest = max(left[j], right[j], a[j], b[j], c[j], d[j], e[j], f[j])
        out[j] = np.int32(middle[j] > low[j]) & np.int32(middle[j] >= greatest)


@inlined
def _is_maximum(power: Any, row: int, column: int) -> bool:  # pragma: no cover - compiled
    """True if none of eight neighbours exceeds a cell."""
    here, last = power[row, column], power.shape[1] - 1
    before, after = max(0, column - 1), min(last, column + 1)
    if power[row, before] > here or power[row, after] > here:
        return False  # as at most cells, which saves the loop over all neighbours
    for p in (max(0, row - 1), min(len(power) - 1, row + 1)):
        if power[p, before] > here or power[p, column] > here or power[p, after] > here:
            return False
    return True


@inner
def _interpolated_into(
    power: Any, row: int, column: int, place: Any
) -> float:  # pragma: no cover - compiled
    """Interpolated value of a maximum; its place from the cell, in steps, in place."""
    tiny, up, along = 1e-300, 0.0, 0.0
    here = max(np.float64(power[row, column]), tiny)
    place[0], place[1] = 0.0, 0.0
    if 0 < row < len(power) - 1:
        before, after = np.float64(power[row - 1, column]), np.float64(power[row + 1, column])
        place[0], up = _vertex(max(before, tiny), here, max(after, tiny))
    if 0 < column < power.shape[1] - 1:
        before, after = np.float64(power[row, column - 1]), np.float64(power[row, column + 1])
        place[1], along = _vertex(max(before, tiny), here, max(after, tiny))
    return float(here * np.exp(up + along))


@reordered
def _maxima(power: Any, least: Any) -> Any:  # pragma: no cover - compiled
    """Cells above the least of their column that no neighbour exceeds, ``(maximum, 2)``."""
    rows, columns = power.shape
    cell, n = np.empty((MOST_MAXIMA, 2), dtype=np.int64), 0
    mark = np.zeros(columns, dtype=np.int32)
    for i in range(rows):
        if n + columns > len(cell):
            more = np.empty((2 * (n + columns), 2), dtype=np.int64)
            for p in range(n):
                more[p, 0], more[p, 1] = cell[p, 0], cell[p, 1]
            cell = more
        if not _any_exceeds(power[i], least):
            continue
        _mark_maxima(power[max(0, i - 1)], power[i], power[min(rows - 1, i + 1)], least, mark)
        for j in (0, columns - 1):
            mark[j] = np.int32(power[i, j] > least[j] and _is_maximum(power, i, j))
        for first in range(0, columns, TOGETHER):
            end = min(first + TOGETHER, columns)
            count = np.int32(0)
            for j in range(first, end):
                count += mark[j]
            for j in range(first, end if count else first):
                if mark[j]:
                    cell[n, 0], cell[n, 1] = i, j
                    n += 1
    return cell[:n].copy()


@compiled
def _interpolated(power: Any, cell: Any) -> Any:  # pragma: no cover - compiled
    """Places of maxima from their cells, in steps, ``(maximum, 2)``, and interpolated values."""
    place, value = np.empty((len(cell), 2)), np.empty(len(cell))
    for n in range(len(cell)):
        value[n] = _interpolated_into(power, cell[n, 0], cell[n, 1], place[n])
    return place, value


@reordered
def _near_means(
    power: Any, cell: Any, height: int, width: int
) -> Any:  # pragma: no cover - compiled
    """The same as `_means`, one window after the other, which is faster for few cells."""
    rows, columns = power.shape
    half, reach = width // 2, height // 4
    out = np.empty(len(cell))
    for n in range(len(cell)):
        i, j = cell[n]
        above, below = min(i // 2, reach), min((rows - 1 - i) // 2, reach)
        first, end = max(0, j - half), min(columns, j + half + 1)
        total = 0.0
        for p in range(i - 2 * above, i + 2 * below + 1, 2):
            for q in range(first, end):
                total += power[p, q]
        out[n] = total / ((above + below + 1) * (end - first))
    return out


@reordered
def _means(power: Any, cell: Any, height: int, width: int) -> Any:  # pragma: no cover - compiled
    """Means of windows around cells, of what lies inside the map, ``(place,)``.

    Of every other row: rows are half a cell apart.
    """
    rows, columns = power.shape
    half, reach = width // 2, height // 4  # of every other row, as many above and below
    totals = np.zeros((2, columns))  # sums over the windows' rows, around even and around odd rows
    out = np.empty(len(cell))
    order = np.argsort(cell[:, 0])
    n = 0
    for last in range(rows + 2 * reach):
        total, gone, middle = totals[last % 2], last - 4 * reach - 2, last - 2 * reach
        if last < rows:
            for j in range(columns):
                total[j] += power[last, j]
        if gone >= 0:
            for j in range(columns):
                total[j] -= power[gone, j]
        above, below = min(middle // 2, reach), min((rows - 1 - middle) // 2, reach)
        while n < len(cell) and cell[order[n], 0] == middle:
            first, end = (
                max(0, cell[order[n], 1] - half),
                min(columns, cell[order[n], 1] + half + 1),
            )
            mean = 0.0
            for j in range(first, end):
                mean += total[j]
            out[order[n]] = mean / ((above + below + 1) * (end - first))
            n += 1
    return out
