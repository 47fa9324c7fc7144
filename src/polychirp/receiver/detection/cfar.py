r"""Constant-false-alarm-rate detection on maps of power, with exact thresholds.

A cell is compared with a multiple of a statistic of the training cells around it. With noise
alone every cell is the power of a complex Gaussian summed over ``num_looks`` independent
channels: exponential for one look, Gamma for more. Then the multiple for a wanted false-alarm
probability follows exactly, for every number of training cells; near an edge, where there are
fewer of them, the multiple is larger and the probability the same.

The training cells must be independent of each other. A taper correlates neighbouring cells: if
only every other cell is used (`CfarWindow.step`), the actual false-alarm probability is within
some 15 % of the wanted one.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Final, Self

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray, PerDetection, PerPathIndex, Sealed
from polychirp.errors import InputError
from polychirp.spec import Spec

LEAST_RISE: Final = 2.0
"""Ratio of the floors of two windows from which on the second one counts (`crosses_again`). Chosen:
floors of noise, of some forty cells each, do not differ by as much."""


LEAST_FALL: Final = 6.0
"""Ratio of the levels of the first and the last quarter of a row from which on it may be one of
echoes (`_is_falling`). Chosen: levels of a ridge, of eight cells or more each, differ by a factor
of 2 at one standard deviation; those of the ground, which fall with 1/R³, by 100 and more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CfarWindow(Spec):
    """Training cells around a cell of a map ``(row, column)``: a frame around guard cells.

    A cell i rows and j columns away is a training cell if the magnitude of i or of j exceeds
    ``guard`` and neither exceeds ``guard + training``. For a map of a single row, the first number
    of ``guard`` and of ``training`` must be 0.

    `RangeDoppler` has one.

    Parameters
    ----------
    guard, training : numbers of cells on either side: in row number, in column number
    step : spacing of the training cells, in row number and in column number; a spacing of 2 or
        more leaves out neighbours, which tapers correlate
    is_circular : true if the first and the last cell of an axis are neighbours, as in a Doppler
        spectrum; otherwise the window is cut off at the edge
    """

    guard: tuple[int, int] = (2, 2)
    training: tuple[int, int] = (4, 4)
    step: tuple[int, int] = (1, 1)
    is_circular: tuple[bool, bool] = (False, False)

    def __post_init__(self) -> None:
        if min(*self.guard, *self.training, *(step - 1 for step in self.step)) < 0:
            raise InputError(
                "the numbers of cells of a CFAR window must be 0 or more, and its steps 1 or more"
            )
        if self.offsets.size == 0:
            raise InputError("a CFAR window needs at least one training cell")

    @property
    def reach(self) -> tuple[int, int]:
        """Rows, and columns, from the tested cell to the outermost cell of the window."""
        return self.guard[0] + self.training[0], self.guard[1] + self.training[1]

    def fitted(self, shape: tuple[int, ...]) -> Self:
        """The same window, made smaller where it does not fit into a map of ``shape``.

        >>> CfarWindow(guard=(3, 3), training=(8, 8)).fitted((9, 64))
        CfarWindow(guard=(2, 3), training=(2, 8), step=(1, 1), is_circular=(False, False))
        """
        room = [(length - 1) // 2 for length in shape]
        guard = [min(near, far // 2) for near, far in zip(self.guard, room, strict=True)]
        training = [
            min(cells, far - near)
            for cells, far, near in zip(self.training, room, guard, strict=True)
        ]
        return replace(self, guard=(guard[0], guard[1]), training=(training[0], training[1]))

    @property
    def offsets(self) -> IntArray:
        """Row and column of each training cell from the tested cell on: ``(training cell, 2)``."""
        rows, columns = (
            _shifts(far, step) for far, step in zip(self.reach, self.step, strict=True)
        )
        near_row, near_column = self.guard
        frame = [(i, j) for i in rows for j in columns if abs(i) > near_row or abs(j) > near_column]
        return np.array(frame, dtype=np.int64).reshape(-1, 2)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Crossings(Sealed):
    """Cells of a map above their threshold, row after row.

    Parameters
    ----------
    row, column : of the cell, ``(detection,)``
    power : of the cell, in the unit of the map
    floor : mean power of noise at the cell, estimated from its training cells
    threshold : power that noise exceeds with the false-alarm probability
    """

    row: PerPathIndex
    column: PerPathIndex
    power: PerDetection
    floor: PerDetection
    threshold: PerDetection

    def chosen(self, which: BoolArray) -> Self:
        """The crossings for which ``which`` (detection,) is true."""
        return replace(
            self,
            row=self.row[which],
            column=self.column[which],
            power=self.power[which],
            floor=self.floor[which],
            threshold=self.threshold[which],
        )


@lru_cache(maxsize=4096)
def ordered_statistic_factor(
    num_cells: int, rank: int, *, false_alarm_probability: float, num_looks: float = 1
) -> float:
    r"""Factor α: noise exceeds α times the ``rank``-th smallest training cell with the probability.

    .. math:: P_{fa} = \prod_{i=0}^{k-1} \frac{N-i}{N-i+\alpha}

    for one look, N training cells and rank k (Rohling 1983, ranks from 1). For M looks
    :math:`P_{fa} = E\left[Q_M(\alpha\,Q_M^{-1}(1-u))\right]` with the order statistic's
    quantile :math:`u \sim \mathrm{Beta}(k, N-k+1)` and :math:`Q_M` the tail of the Gamma
    distribution, by Gauss–Jacobi quadrature.

    >>> ordered_statistic_factor(16, 12, false_alarm_probability=1e-3)
    7.42...
    """
    from scipy.optimize import brentq

    _check_probability(false_alarm_probability)
    excess = _order_statistic_tail(num_cells, rank, num_looks)
    wanted = np.log(false_alarm_probability)
    high = 1.0
    while np.log(excess(high)) > wanted:
        high *= 2.0
    root = brentq(lambda alpha: np.log(excess(alpha)) - wanted, 0.0, high, xtol=1e-12, rtol=1e-12)
    return float(root)


def _order_statistic_tail(num_cells: int, rank: int, num_looks: float) -> Callable[[float], float]:
    """False-alarm probability as a function of the factor α of `ordered_statistic_factor`."""
    remaining = num_cells - np.arange(rank)
    if num_looks == 1:
        return lambda alpha: float(np.exp(-np.sum(np.log1p(alpha / remaining))))
    from scipy.special import gammaincc

    value, weight = _order_statistic(num_cells, rank, num_looks)
    return lambda alpha: float(weight @ gammaincc(num_looks, alpha * value))


@lru_cache(maxsize=4096)
def _order_statistic(num_cells: int, rank: int, num_looks: float) -> tuple[FloatArray, FloatArray]:
    """Quadrature values and weights of the ``rank``-th smallest of ``num_cells`` Gamma variables.

    The weights add up to 1; each variable has the shape ``num_looks`` and the scale 1.
    """
    from scipy.special import gammaincinv, roots_jacobi

    node, weight = roots_jacobi(60, num_cells - rank, rank - 1)
    value = np.asarray(gammaincinv(num_looks, 0.5 * (1.0 + node)), dtype=np.float64)
    return value, weight / weight.sum()


def _check_probability(probability: float) -> None:
    if not 0.0 < probability < 1.0:
        raise InputError(
            f"a false-alarm probability of {probability:g} is not between 0 and 1; try 1e-4"
        )


def ordered_statistic(
    power: FloatArray,
    *,
    window: CfarWindow,
    false_alarm_probability: float,
    quantile: float = 0.75,
    num_looks: float | FloatArray = 1,
) -> Crossings:
    """Cells of ``power`` ``(row, column)`` above a multiple of an order statistic around them.

    The statistic is the k-th smallest of N training cells, k = ``quantile`` × N, rounded. Other
    targets do not mask a cell while they fill no more than N − k of its training cells.

    A cell exceeds α times the k-th smallest training cell exactly if at least k training cells
    are below the cell divided by α. So they are counted, which is faster than to sort them.

    Parameters
    ----------
    power : ``(row, column)``
    num_looks : independent exponential variables in each cell, of the map or ``(column,)``

    Raises
    ------
    InputError
        The map is smaller than the window, the probability is not between 0 and 1, or the
        quantile is not in (0, 1].

    Examples
    --------
    >>> power = np.ones((1, 32))
    >>> power[0, [7, 10]] = 100.0
    >>> window = CfarWindow(guard=(0, 1), training=(0, 8))
    >>> ordered_statistic(power, window=window, false_alarm_probability=1e-4).column
    array([ 7, 10])
    """
    from polychirp.receiver.detection.cfar_kernel import count_below

    power = _checked(power, window)
    if not 0.0 < quantile <= 1.0:
        raise InputError(
            f"an order statistic's quantile of {quantile:g} is not in (0, 1]; try 0.75"
        )
    looks = np.broadcast_to(np.asarray(num_looks, dtype=np.float64), power.shape[1:])
    count, rank = _count_and_rank(power.shape, window, quantile)
    factor = np.empty(power.shape)
    for number in np.unique(looks):
        of_number = _factors(power.shape, window, false_alarm_probability, quantile, float(number))
        factor[:, looks == number] = of_number[:, looks == number]
    padded = _padded(power, window, fill=np.inf)
    row, column = np.nonzero(count_below(padded, power / factor, window.offsets) >= rank)
    statistic = _training_statistic(padded, row, column, window, rank[row, column])
    bias = _floor_biases(count[row, column], looks[column], quantile)
    return Crossings(
        row=row,
        column=column,
        power=power[row, column],
        floor=statistic / bias,
        threshold=factor[row, column] * statistic,
    )


def crosses_again(
    power: FloatArray,
    found: Crossings,
    *,
    window: CfarWindow,
    false_alarm_probability: float,
    quantile: float = 0.75,
    num_looks: float = 1,
) -> BoolArray:
    """True for the crossings that stand out of a second window's cells too, ``(detection,)``.

    A crossing on a ridge, such as the signal of another radar that is spread over all range rates
    of a range, has a floor of its own: that of cells on the ridge. A second floor that is less than
    `LEAST_RISE` above the first changes nothing, so that noise crosses as often as before.

    Parameters
    ----------
    power, false_alarm_probability, quantile : as of `ordered_statistic`
    found : its crossings with another window
    window : the second window
    num_looks : independent exponential variables in a cell of the ridge

    Examples
    --------
    >>> power = np.ones((64, 64))
    >>> power[:, 9] = np.random.default_rng(1).exponential(size=64) + 30.0
    >>> power[5, 9] = power[5, 40] = 3000.0
    >>> wanted = {"false_alarm_probability": 1e-4}
    >>> found = ordered_statistic(power, window=CfarWindow(), **wanted)
    >>> along = CfarWindow(guard=(2, 0), training=(20, 0), is_circular=(True, False))
    >>> is_kept = crosses_again(power, found, window=along, **wanted)
    >>> found.row.size, found.column[is_kept]
    (65, array([ 9, 40]))
    """
    power = _checked(power, window)
    factor = _factors(power.shape, window, false_alarm_probability, quantile, num_looks)
    count, rank = _count_and_rank(power.shape, window, quantile)
    row, column = found.row, found.column
    padded = _padded(power, window, fill=np.inf)
    statistic = _training_statistic(padded, row, column, window, rank[row, column])
    bias = _floor_biases(count[row, column], np.full(row.size, num_looks), quantile)
    is_low = statistic / bias < LEAST_RISE * found.floor
    return np.asarray(is_low | (found.power > factor[row, column] * statistic))


def crosses_its_row(
    power: FloatArray,
    found: Crossings,
    *,
    false_alarm_probability: float,
    quantile: float,
    num_looks: FloatArray,
    side_lobe: FloatArray,
) -> BoolArray:
    r"""True for the crossings that stand out of all columns of their row, ``(detection,)``.

    A row of range rates may be a ridge, such as the signal of another radar at one range rate and
    all ranges. Side lobes of its points are subtracted from the row, and powers are divided by the
    floor of their column, which follows from the median of its rows. Of every other cell, N in all,
    s is the k-th smallest, k = ``quantile`` × N, rounded. The row is a ridge if s is `LEAST_RISE`
    times what noise of the given looks has or more, unless it falls with range as echoes do
    (`_is_falling`). A ridge is one signal and so one look: a crossing on it must exceed α s, with

    .. math:: P_{fa} = \prod_{i=0}^{k-1} \frac{N-i}{N-i+\alpha}

    The cell itself may be one of the N. If it exceeds the k-th smallest of the N − 1 others, that
    is the k-th smallest of all too, so that it crosses a little less often than stated.

    Targets of one range rate make no ridge while they fill less than 1 − ``quantile`` of the
    ranges. Cells of rows that are no ridges cross as often as before.

    Parameters
    ----------
    power, false_alarm_probability : as of `ordered_statistic`
    found : its crossings
    quantile : rank of the cell that gives the level of a row, as a share of their number
    num_looks : independent exponential variables in each cell beside ridges, ``(column,)``
    side_lobe : highest side lobe over the peak of a point, by its distance in columns ``(column,)``

    Examples
    --------
    >>> power = np.random.default_rng(1).exponential(size=(64, 64))
    >>> power[9] *= 100.0
    >>> power[5, 40] = power[9, 20] = 1e4
    >>> wanted = {"false_alarm_probability": 1e-4}
    >>> found = ordered_statistic(power, window=CfarWindow(), **wanted)
    >>> is_kept = crosses_its_row(
    ...     power, found, quantile=0.3, num_looks=np.ones(64), side_lobe=np.zeros(64), **wanted)
    >>> found.row.size > 20, found.row[is_kept], found.column[is_kept]
    (True, array([5, 9]), array([40, 20]))
    """
    from scipy.linalg import toeplitz
    from scipy.special import gammaincinv

    used = np.union1d(np.arange(0, power.shape[1], 2), found.column)
    middle = np.ones(power.shape[1])
    # rows of a copy are partitioned several times faster than columns
    middle[used] = np.partition(power.T[used], len(power) // 2, axis=1)[:, len(power) // 2]
    floor = middle * num_looks / gammaincinv(num_looks, 0.5)
    floor = np.where(np.isfinite(floor) & (floor > 0.0), floor, 1.0)
    rows, place = np.unique(found.row, return_inverse=True)
    lobes = np.nan_to_num(power[rows]) @ toeplitz(side_lobe)
    cells = (np.maximum(power[rows] - lobes, 0.0) / floor)[:, ::2]
    num_cells = cells.shape[1]
    rank = max(1, round(quantile * num_cells))
    level = np.partition(cells, rank - 1, axis=1)[:, rank - 1]
    of_noise = _mean_order_statistic(
        num_cells, quantile=quantile, num_looks=float(np.median(num_looks))
    )
    is_ridge = (level >= LEAST_RISE * of_noise) & ~_is_falling(cells, quantile)
    factor = ordered_statistic_factor(
        num_cells, rank, false_alarm_probability=false_alarm_probability
    )
    threshold = factor * level[place] * floor[found.column]
    return np.asarray(~is_ridge[place] | (found.power > threshold))


def _is_falling(cells: FloatArray, quantile: float) -> BoolArray:
    """True for each row ``(row,)`` whose quantiles over the quarters of its columns fall each time.

    They fall by `LEAST_FALL` in all. Rows of echoes, as of the ground or of a wall, do so: with the
    inverse cube of the range, the quarters' quantiles are some 25 dB apart.
    """
    levels = np.array(
        [np.quantile(part, quantile, axis=1) for part in np.array_split(cells, 4, axis=1)]
    )
    is_less = np.all(np.diff(levels, axis=0) < 0.0, axis=0)
    return np.asarray(is_less & (levels[0] >= LEAST_FALL * levels[-1]))


def _training_statistic(
    padded: FloatArray, row: IntArray, column: IntArray, window: CfarWindow, rank: IntArray
) -> FloatArray:
    """The training cell of the given rank of each cell, from a map padded for the window."""
    at = np.stack([row, column], axis=1)[:, None]
    around = window.offsets + np.array(window.reach) + at
    training = np.sort(padded[around[..., 0], around[..., 1]], axis=1)
    return np.asarray(training[np.arange(rank.size), rank - 1])


@lru_cache(maxsize=32)
def _count_and_rank(
    shape: tuple[int, ...], window: CfarWindow, quantile: float
) -> tuple[IntArray, IntArray]:
    """Number of training cells of every cell of a map, and rank among them, ``(row, column)``."""
    count = training_count(shape, window)
    return count, np.maximum(1, np.rint(quantile * count).astype(np.int64))


@lru_cache(maxsize=32)
def _factors(
    shape: tuple[int, ...],
    window: CfarWindow,
    false_alarm_probability: float,
    quantile: float,
    num_looks: float,
) -> FloatArray:
    """Factor of every cell of a map, ``(row, column)``."""
    count, _ = _count_and_rank(shape, window, quantile)
    return _for_each_count(
        count,
        lambda number: ordered_statistic_factor(
            number,
            max(1, round(quantile * number)),
            false_alarm_probability=false_alarm_probability,
            num_looks=num_looks,
        ),
    )


def _floor_biases(count: IntArray, looks: FloatArray, quantile: float) -> FloatArray:
    """Mean of the order statistic of cells of mean 1, for each cell's ``count`` and ``looks``."""
    bias = np.empty(count.shape)
    for number in np.unique(looks):
        mean = partial(_mean_order_statistic, quantile=quantile, num_looks=float(number))
        bias[looks == number] = _for_each_count(count[looks == number], mean)
    return bias


def _mean_order_statistic(num_cells: int, *, quantile: float, num_looks: float) -> float:
    """Mean of the order statistic of ``num_cells`` noise cells of mean 1."""
    rank = max(1, round(quantile * num_cells))
    if num_looks == 1:
        return float(np.sum(1.0 / (num_cells - np.arange(rank))))
    value, weight = _order_statistic(num_cells, rank, num_looks)
    return float(weight @ value) / num_looks


def training_count(shape: tuple[int, ...], window: CfarWindow) -> IntArray:
    """Number of training cells of every cell of a map: ``(row, column)``."""
    return np.rint(training_sum(np.ones(shape), window)).astype(np.int64)


def training_sum(power: FloatArray, window: CfarWindow) -> FloatArray:
    """Sum of every cell's training cells: ``(row, column)``.

    Copies of the map, shifted by the offsets of the training cells, are added, first in column
    number, then in row number. Nothing is subtracted: a strong target in the guard cells causes no
    rounding error, as it would with integral images.
    """
    padded = _padded(power, window, fill=0.0)
    rows, columns = (
        _shifts(far, step) for far, step in zip(window.reach, window.step, strict=True)
    )
    (near_row, near_column), (far_row, far_column) = window.guard, window.reach
    side = [j for j in columns if abs(j) > near_column]
    middle = [i for i in rows if abs(i) <= near_row]
    ends = [i for i in rows if abs(i) > near_row]
    total = _shifted_sum(_shifted_sum(padded, 1, side, far_column), 0, middle, far_row)
    total += _shifted_sum(_shifted_sum(padded, 1, columns, far_column), 0, ends, far_row)
    return total


def _shifts(far: int, step: int) -> list[int]:
    """Multiples of ``step`` from −far to far."""
    return list(range(-(far // step) * step, far + 1, step))


def _shifted_sum(array: FloatArray, axis: int, shifts: list[int], margin: int) -> FloatArray:
    """Sum of the array's copies shifted along an axis, without ``margin`` cells at both ends."""
    size = array.shape[axis] - 2 * margin
    total = np.zeros([size if k == axis else length for k, length in enumerate(array.shape)])
    for shift in shifts:
        part = [slice(None), slice(None)]
        part[axis] = slice(margin + shift, margin + shift + size)
        total += array[tuple(part)]
    return total


def _padded(power: FloatArray, window: CfarWindow, *, fill: float) -> FloatArray:
    """The map continued on all sides by the window's reach: circularly, or with ``fill``."""
    for axis in (0, 1):
        width = [(0, 0), (0, 0)]
        width[axis] = (window.reach[axis], window.reach[axis])
        if window.is_circular[axis]:
            power = np.pad(power, width, mode="wrap")
        else:
            power = np.pad(power, width, constant_values=fill)
    return power


def _for_each_count(count: IntArray, factor: Callable[[int], float]) -> FloatArray:
    """``factor`` of every cell's number of training cells, computed once per number."""
    number, place = np.unique(count, return_inverse=True)
    return np.array([factor(int(n)) for n in number])[place].reshape(count.shape)


def _checked(power: FloatArray, window: CfarWindow) -> FloatArray:
    power = np.ascontiguousarray(power, dtype=np.float64)
    if power.ndim != 2:
        raise InputError(f"a CFAR map has 2 axes, not {power.ndim}; give a single row as map[None]")
    for axis, name in enumerate(("row", "column")):
        if 2 * window.reach[axis] + 1 > power.shape[axis]:
            raise InputError(
                f"a CFAR window of {2 * window.reach[axis] + 1} {name}s does not fit a map of "
                f"{power.shape[axis]}; take fewer training or guard cells"
            )
    return power
