r"""Side lobes of strong points in a map over range rate and range.

The tapered transform of a steady point of power P has, x cells beside the point and beyond the main
lobe of the taper's spectrum W, at most

.. math:: P\,L(x), \qquad L(x) = \max_{|u| \ge x} |W(u)|^2 / |W(0)|^2

(Harris 1978). A map is transformed over both of its axes, so that the product of both levels holds
for a cell that is away from the point in both.

With this power :math:`S` in a cell and a threshold T, noise and side lobes together exceed
:math:`(\sqrt S + \sqrt T)^2` less often than noise alone exceeds T, whatever their phases: of
amplitudes in several channels, the root of the mean power obeys the triangle inequality.
"""

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from scipy.fft import fft

from polychirp.axes import BoolArray, FloatArray
from polychirp.model.spectra import RangeRateMap
from polychirp.receiver.detection.cfar import Crossings
from polychirp.receiver.range_doppler.transforms import taper
from polychirp.units import from_db

MARGIN: Final = from_db(1.5)
"""Greatest power of a side lobe over those levels. Chosen: points that share a main lobe partly
cancel in it, and do not in their side lobes."""

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
    spectrum = np.abs(fft(taper(size), PLACES_PER_CELL * size)) ** 2
    half = spectrum[: PLACES_PER_CELL * size // 2 + 1]
    first_zero = int(np.argmax(np.diff(half) > 0.0))  # 0 if the main lobe fills the span
    return _Lobes(
        level=np.maximum.accumulate(half[::-1])[::-1] / half[0],
        main=(first_zero or len(half)) / PLACES_PER_CELL,
    )


def stands_out(
    found: Crossings,
    map_: RangeRateMap,
    places: tuple[FloatArray, FloatArray, FloatArray],
    *,
    num_samples: int,
) -> BoolArray:
    """True for each peak ``(peak,)`` that is neither a side lobe of stronger ones nor noise on it.

    Parameters
    ----------
    found : the peaks' cells
    map_ : transforms over ``num_samples`` samples of a ramp, and over ramps, which is circular
    places : of the peaks between the cells: range rate, m/s, range, m, and power, W
    """
    range_rate, range_, power = places
    by_rate, by_range = _lobes(len(map_.range_rate)), _lobes(num_samples)
    row = (range_rate - map_.range_rate[0]) / (map_.range_rate[1] - map_.range_rate[0])
    column = (range_ - map_.range[0]) / (map_.range[1] - map_.range[0])
    highest = max(float(lobes.at(np.asarray(lobes.main))) for lobes in (by_rate, by_range))
    least, noise = np.min(found.power, initial=np.inf), np.sqrt(found.threshold)
    lobes = np.zeros(len(power))
    for peak in np.argsort(-power, kind="stable"):
        if MARGIN * highest * power[peak] < least:
            break
        if found.power[peak] < (np.sqrt(lobes[peak]) + noise[peak]) ** 2:
            continue
        away = np.abs(found.row - row[peak])
        away = np.minimum(away, len(map_.range_rate) - away)
        beside = np.abs(found.column - column[peak])
        is_beyond = (away > by_rate.main) | (beside > by_range.main)
        lobes += is_beyond * MARGIN * power[peak] * by_rate.at(away) * by_range.at(beside)
    return np.asarray(found.power >= (np.sqrt(lobes) + noise) ** 2)
