r"""Side lobes of strong points in a map over range rate and range.

The tapered transform of a steady point of power P has, x cells beside the point and beyond the main
lobe of the taper's spectrum W, at most

.. math:: P\,L(x), \qquad L(x) = \max_{|u| \ge x} |W(u)|^2 / |W(0)|^2

(Harris 1978). A map is transformed over both of its axes, so that the product of both levels holds
for a cell that is away from the point in both.

With this power :math:`S` in a cell and a threshold T, noise and side lobes together exceed
:math:`(\sqrt S + \sqrt T)^2` less often than noise alone exceeds T, whatever their phases: of
amplitudes in several channels, the root of the mean power obeys the triangle inequality.

Where mitigation leaves gaps, the samples' weights are a part of the window, and the level is that
of the transform of both tapers and the weights, which has no product form (`GapLobes`). Gaps at
drawn places spread it over the map, where it is a part of the floor already.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final, NamedTuple, Self

import numpy as np
from scipy.fft import fft, fft2

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.model.spectra import RangeRateMap
from polychirp.receiver.detection.cfar import Crossings
from polychirp.receiver.range_doppler.transforms import taper
from polychirp.units import from_db

LOBE_MARGIN: Final = from_db(1.5)
"""Greatest power of a side lobe over those levels. Chosen: points that share a main lobe partly
cancel in it, and do not in their side lobes."""

FLOOR_REACH: Final = 11
"""Distance, in cells, up to which side lobes of gaps count as a part of a cell's floor; chosen, as
far as training cells reach."""

LEAST_NOISE: Final = 0.1
"""Least share of a floor that counts as noise; chosen."""

STEPS_PER_CELL: Final = 4
"""Number of places per cell to which peaks are rounded for the side lobes of gaps (chosen)."""

NEGLIGIBLE_LOBE: Final = 0.03
"""Power of a side lobe over the least threshold below which it is left out. Chosen: with noise, it
would raise a threshold by 1.4 dB."""

PLACES_PER_CELL: Final = 32
"""Number of places per cell at which levels are tabulated (chosen)."""


class _Lobes(NamedTuple):
    """Levels ``(place,)`` of a taper's spectrum over its peak, and cells from peak to first zero.

    A level is the highest one at this place or further from the peak.
    """

    level: FloatArray
    main: float

    def at(self, away: FloatArray) -> FloatArray:
        """Levels at distances from the peak, in cells."""
        place = (away * PLACES_PER_CELL).astype(np.int64)
        return self.level[np.minimum(place, len(self.level) - 1)]


@lru_cache(maxsize=32)
def _lobes(size: int) -> _Lobes:
    """The lobes of the taper of a transform of ``size``."""
    half = _half_spectrum(taper(size))
    first_zero = int(np.argmax(np.diff(half) > 0.0))  # 0 if the main lobe fills the span
    return _Lobes(level=_envelope(half), main=(first_zero or len(half)) / PLACES_PER_CELL)


def _half_spectrum(window: FloatArray) -> FloatArray:
    """Power spectra of windows ``(…, sample)`` at the places from the peak to half of the span."""
    size = window.shape[-1]
    spectrum = np.abs(fft(window, PLACES_PER_CELL * size)) ** 2
    return np.asarray(spectrum[..., : PLACES_PER_CELL * size // 2 + 1])


def _envelope(half: FloatArray) -> FloatArray:
    """Highest level of a half spectrum at each place or further from the peak, over the peak."""
    return np.asarray(np.maximum.accumulate(half[::-1])[::-1] / half[0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GapLobes:
    """Side lobes of points where samples have weights.

    Parameters
    ----------
    window : tapers times weights, ``(sweep of the code, block, fast)``, with beats that grow
    """

    window: FloatArray
    _patterns: dict[tuple[int, int], FloatArray] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, weight: FloatArray, ramps: IntArray, *, is_falling: bool) -> Self:
        """The side lobes for weights ``(ramp, fast)``.

        ``ramps`` are the numbers of the ramps, ``(block, sweep of the block)``. Beats of falling
        ramps are negative, so that their samples are taken backwards.
        """
        tapers = taper(len(ramps))[:, None] * taper(weight.shape[1])
        forwards = weight[:, ::-1] if is_falling else weight
        return cls(window=tapers * forwards[ramps.T])

    @property
    def highest(self) -> float:
        """Highest level of all side lobes."""
        return float(self._pattern(0, 0).max())

    def around(self, row: float, column: float, shape: tuple[int, int]) -> FloatArray:
        """Levels of the side lobes of a peak in all cells of a map of a shape, mean over sweeps.

        The peak is at fractional numbers of cells. Levels in its main lobe are zero.
        """
        up, right = round(STEPS_PER_CELL * row), round(STEPS_PER_CELL * column)
        pattern = self._pattern(up % STEPS_PER_CELL, right % STEPS_PER_CELL)
        rows = np.arange(shape[0]) - up // STEPS_PER_CELL
        columns = np.arange(shape[1]) - right // STEPS_PER_CELL
        return np.asarray(pattern[np.ix_(rows % len(pattern), columns % len(pattern.T))])

    def _pattern(self, up: int, right: int) -> FloatArray:
        """Levels in cells ``(block, fast)`` around a peak a few steps beyond the first cell."""
        if (up, right) not in self._patterns:
            turns, near = [], []
            for steps, size in ((up, self.window.shape[1]), (right, self.window.shape[2])):
                place = steps / STEPS_PER_CELL
                cells = np.arange(size)
                turns.append(np.exp(2j * np.pi * place * cells / size))
                near.append(_apart(cells, place, size) <= _lobes(size).main)
            turned = self.window * turns[0][:, None] * turns[1]
            spectra = fft2(turned.astype(np.complex64), overwrite_x=True)
            power = np.sum(spectra.real**2 + spectra.imag**2, axis=0)
            power[np.ix_(*near)] = 0.0
            peak = float(np.sum(self.window.sum(axis=(1, 2)) ** 2))
            self._patterns[up, right] = power / max(peak, 1e-300)
        return self._patterns[up, right]


def lobes_over_range(
    num_ranges: int, *, num_samples: int, gaps: GapLobes | None = None
) -> FloatArray:
    """Highest side lobe over its peak at 0, 1, … ranges beside it, at the same range rate.

    It is zero in the main lobe. Gaps at the same place of all ramps raise it; those that move from
    ramp to ramp are spread over the range rates.

    >>> (10.0 * np.log10(lobes_over_range(9, num_samples=128)[3:])).round(1)
    array([-54.5, -57.8, -60.3, -62.4, -64.4, -66.3])
    """
    lobes = _lobes(num_samples)
    if gaps is not None:
        half = _half_spectrum(gaps.window.sum(axis=1)).mean(axis=0)
        lobes = lobes._replace(level=_envelope(half) if half[0] > 0.0 else lobes.level)
    cells = np.arange(num_ranges)
    away = np.minimum(cells, num_samples - cells).astype(np.float64)  # transforms are circular
    return np.where(away > lobes.main, LOBE_MARGIN * lobes.at(away), 0.0)


def stands_out(
    found: Crossings,
    map_: RangeRateMap,
    places: tuple[FloatArray, FloatArray, FloatArray],
    *,
    num_samples: int,
    gaps: GapLobes | None = None,
) -> BoolArray:
    """True for each peak ``(peak,)`` that is neither a side lobe of stronger ones nor noise on it.

    Parameters
    ----------
    found : the peaks' cells
    map_ : transforms over ``num_samples`` samples of a ramp, and over ramps, which is circular
    places : of the peaks between the cells: range rate, m/s, range, m, and power, W
    gaps : side lobes that weights of samples cause; None if all have the same
    """
    range_rate, range_, power = places
    by_rate, by_range = _lobes(len(map_.range_rate)), _lobes(num_samples)
    row, column = _cells(range_rate, map_.range_rate), _cells(range_, map_.range)
    highest = max(float(lobes.at(np.asarray(lobes.main))) for lobes in (by_rate, by_range))
    if gaps is not None:
        highest = max(highest, gaps.highest)
    least, noise = np.min(found.threshold, initial=np.inf), np.sqrt(found.threshold)
    lobes, in_map = np.zeros(len(power)), np.zeros(map_.power.shape)
    for peak in np.argsort(-power, kind="stable"):
        if LOBE_MARGIN * highest * power[peak] < NEGLIGIBLE_LOBE * least:
            break
        if found.power[peak] < (np.sqrt(lobes[peak]) + noise[peak]) ** 2:
            continue
        away = _apart(found.row, row[peak], len(map_.range_rate))
        beside = np.abs(found.column - column[peak])
        is_beyond = (away > by_rate.main) | (beside > by_range.main)
        level = is_beyond * by_rate.at(away) * by_range.at(beside)
        if gaps is not None:
            around = gaps.around(float(row[peak]), float(column[peak]), map_.power.shape)
            level = np.maximum(level, around[found.row, found.column])
            in_map += power[peak] * around
        lobes += LOBE_MARGIN * power[peak] * level
    if gaps is not None and len(power):
        noise = np.sqrt(found.threshold * _share_of_noise(found, in_map))
    return np.asarray(found.power >= (np.sqrt(lobes) + noise) ** 2)


def _cells(value: FloatArray, axis: FloatArray) -> FloatArray:
    """Places on an axis of a map in cells; 0 on an axis of a single cell."""
    if axis.size < 2:
        return np.zeros(value.shape)
    return np.asarray((value - axis[0]) / (axis[1] - axis[0]))


def _apart(cells: FloatArray | IntArray, cell: float, count: int) -> FloatArray:
    """Distances of cells from a cell, on a circle of ``count`` cells."""
    away = np.abs(cells - cell)
    return np.asarray(np.minimum(away, count - away))


def _share_of_noise(found: Crossings, lobes: FloatArray) -> FloatArray:
    """Share of each cell's floor that is not made of the side lobes ``(range rate, range)``.

    A ridge of lobes is not in a floor that is an ordered statistic, so that the median around the
    cell counts. Lobes of gaps at drawn places are distributed like noise, whose median is ln 2 of
    its mean.
    """
    rows, columns = lobes.shape
    steps = np.arange(-FLOOR_REACH, FLOOR_REACH + 1, 2)
    row = (found.row[:, None] + steps) % rows
    column = np.clip(found.column[:, None] + steps, 0, columns - 1)
    mean = np.median(lobes[row[:, :, None], column[:, None]], axis=(1, 2)) / np.log(2.0)
    return np.asarray(np.clip(1.0 - mean / found.floor, LEAST_NOISE, 1.0))
