"""Peak, width and side lobes of a correlation."""

from dataclasses import dataclass

import numpy as np

from polychirp.axes import FloatArray
from polychirp.correlation.base import Correlation


@dataclass(frozen=True, slots=True, kw_only=True)
class Lobes:
    """Peak, width and side lobes of a correlation.

    Parameters
    ----------
    peak : amplitude |R| of the main lobe, interpolated between lags by a parabola
    lag : s, lag of the peak, interpolated in the same way
    width : s, full width at half the peak's power; infinite if the power does not fall that far
    peak_side_lobe : ratio, greatest power outside the main lobe to the power of the peak
    integrated_side_lobe : ratio, energy outside the main lobe to the energy in it
    median : ratio, median power over all lags to the power of the peak
    """

    peak: float
    lag: float
    width: float
    peak_side_lobe: float
    integrated_side_lobe: float
    median: float


def lobes(correlation: Correlation) -> Lobes:
    """Measure a correlation, whose lags should be closer than a quarter of 1/bandwidth.

    The main lobe reaches to the first minimum on each side of the lag of greatest power. The
    correlation of different signals is a plateau with ripples: its width and side lobes say little.

    >>> lag = np.linspace(-20.0, 20.0, 4001)
    >>> found = lobes(Correlation(amplitude=np.sinc(lag), lag=lag))
    >>> round(found.width, 3), round(found.peak_side_lobe, 4)
    (0.886, 0.0472)
    """
    power = correlation.power
    top = int(np.argmax(power))
    peak, place = _parabola(power, top)
    first, last = _null(power[top::-1]), _null(power[top:])
    inside = power[top - first : top + last + 1]
    outside = np.concatenate([power[: top - first], power[top + last + 1 :]])
    energy = float(inside.sum())
    return Lobes(
        peak=float(np.sqrt(peak)),
        lag=float(correlation.lag[top]) + place * correlation.spacing,
        width=(_half(power[top::-1], peak, -place) + _half(power[top:], peak, place))
        * correlation.spacing,
        peak_side_lobe=float(outside.max(initial=0.0)) / peak,
        integrated_side_lobe=float(outside.sum()) / energy,
        median=float(np.median(power)) / peak,
    )


def _parabola(power: FloatArray, top: int) -> tuple[float, float]:
    """Power of the peak by a parabola over three lags, and its place in steps from ``top``."""
    if not 0 < top < power.size - 1:
        return float(power[top]), 0.0
    left, middle, right = (float(value) for value in power[top - 1 : top + 2])
    bend = left - 2.0 * middle + right
    if bend == 0.0:
        return middle, 0.0
    place = 0.5 * (left - right) / bend
    return middle - 0.25 * (left - right) * place, place


def _null(side: FloatArray) -> int:
    """Number of steps from the first lag of ``side`` to the first minimum."""
    rises = np.flatnonzero(np.diff(side) > 0)
    return int(rises[0]) if rises.size else side.size - 1


def _half(side: FloatArray, peak: float, place: float) -> float:
    """Steps from the peak, ``place`` after ``side[0]``, to half its power: Bessel, on four lags."""
    below = np.flatnonzero(side < 0.5 * peak)
    if not below.size:
        return float("inf")
    n = int(below[0])
    if n == 0:
        return 0.0
    before, behind = float(side[n - 1]), float(side[n])
    near = side[max(0, n - 2) : n + 2]
    bend = float(np.diff(near, 2).mean()) if near.size == 4 else 0.0
    straight = (before - 0.5 * peak) / (before - behind)
    bent = straight + 0.5 * straight * (straight - 1.0) * bend / (before - behind)
    return n - 1 + bent - place
