r"""Directions that an array cannot tell apart, and the window in which it tells all apart.

Waves of the direction cosines :math:`u` and :math:`u + g` give the channels the same phases if
:math:`|\sum_m e^{j2\pi p_m g}|` is M, the number of elements: g is a *grating lobe*. A uniform line
of the step d has them at multiples of λ/d. A sparse array may have lobes that are almost as high,
and noise decides between them.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from polychirp.axes import FloatArray
from polychirp.receiver.angle.beams import beam_power, grid, highest, is_maximum, refined
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.angle.esprit import shift_along

AMBIGUOUS_POWER = 0.8
"""Least power of a lobe over that of the main lobe, with which two directions count as ambiguous.
Chosen: noise takes one such direction for the other in one of two thousand cases if the SNR of the
whole array is 20 dB, and in one of six at 10 dB."""

EQUAL_POWER = 1.0 - 1e-6
"""The same for directions that no SNR tells apart; chosen: above the rounding errors."""

WHOLE_SPHERE = 2.0
"""Greatest difference of two direction cosines."""


class Window(NamedTuple):
    """Greatest azimuth and elevation to either side that are unambiguous, rad.

    Each holds for directions that differ in this angle alone; None if it is not measured.
    """

    azimuth: float | None
    elevation: float | None


def grating_lobes(elements: Elements, *, least: float = AMBIGUOUS_POWER) -> FloatArray:
    """Differences of direction cosines, ``(lobe, 2)``, with ``least`` of the main lobe's power.

    >>> row = Elements(place=[[0.0, 0.0], [0.8, 0.0], [1.6, 0.0]])
    >>> grating_lobes(row).round(3).tolist()
    [[-1.25, 0.0], [1.25, 0.0]]
    """
    if not elements.axes:
        return np.zeros((0, 2))
    line = elements.line()
    if line is not None and line.is_uniform:
        most = math.floor(WHOLE_SPHERE * line.step * (1.0 + 1e-9))
        order = np.array([n for n in range(-most, most + 1) if n], dtype=np.float64)
        return np.stack([order * (n == line.axis) / line.step for n in range(2)], axis=-1)
    count = len(elements.place)
    factor = np.ones((count, 1), dtype=np.complex128)
    points = grid(elements, reach=WHOLE_SPHERE)
    power = beam_power(factor, elements, points) / count**2
    # between grid points a lobe is weaker by 0.1 dB
    row, column = highest(power, is_maximum(power) & (power > 0.9 * least))
    start = np.stack([points.left[row], points.up[column]], axis=-1)
    lobe = refined(start, np.repeat(factor[None], len(start), axis=0), elements)
    height = np.abs(elements.steering(lobe).mean(axis=-1)) ** 2
    far = np.linalg.norm(lobe, axis=-1)
    first_null = 0.25 / np.max(elements.extent)
    kept = lobe[(height >= least) & (far > first_null) & (far <= WHOLE_SPHERE + 1e-9)]
    _, unique = np.unique(kept.round(6) + 0.0, axis=0, return_index=True)
    return np.asarray(kept[unique])


def ambiguities(elements: Elements, *, estimator: str) -> FloatArray:
    """Differences of direction cosines that an estimator cannot tell apart, ``(lobe, 2)``.

    ESPRIT has further ones than the array: it compares parts that are a shift δ apart, and cosines
    1/δ apart are equal to it.
    """
    repeats = [[p * (n == axis) for n in range(2)] for axis, p in _repeats(elements, estimator)]
    return np.concatenate([grating_lobes(elements), np.reshape(repeats, (-1, 2))])


def unambiguous_window(elements: Elements, *, estimator: str) -> Window:
    r"""The window :math:`\pm\arcsin(|g|/2)` of the nearest lobe g along each axis.

    >>> row = Elements(place=[[0.0, 0.0], [0.8, 0.0], [1.6, 0.0]])
    >>> round(math.degrees(unambiguous_window(row, estimator="bartlett").azimuth), 2)
    38.68
    """
    angles: list[float | None] = [None, None]
    periods = dict(_repeats(elements, estimator))
    for axis in elements.axes:
        # directions that differ along this axis alone see the elements projected onto it
        place = np.zeros_like(elements.place)
        place[:, axis] = elements.place[:, axis]
        lobes = np.abs(grating_lobes(Elements(place=place))[:, axis])
        nearest = min([WHOLE_SPHERE, periods.get(axis, WHOLE_SPHERE), *lobes])
        angles[axis] = float(np.arcsin(nearest / WHOLE_SPHERE))
    return Window(*angles)


def _repeats(elements: Elements, estimator: str) -> Iterator[tuple[int, float]]:
    """Axes along which ESPRIT's shift is longer than half a wavelength, and 1/δ of each."""
    for axis in elements.axes if estimator == "esprit" else ():
        shift = shift_along(elements, axis)
        if shift is not None and WHOLE_SPHERE * shift.length > 1.0:
            yield axis, 1.0 / shift.length


def nearest_to_boresight(cosines: FloatArray, elements: Elements) -> FloatArray:
    """Smallest direction cosines with the same phases as ``cosines`` ``(…, 2)``."""
    lobes = grating_lobes(elements, least=EQUAL_POWER)
    found = cosines
    for _ in range(2):  # a cosine may be two lobes away
        copies = found[..., None, :] - np.concatenate([np.zeros((1, 2)), lobes])
        best = np.argmin(np.linalg.norm(copies, axis=-1), axis=-1)
        found = np.take_along_axis(copies, best[..., None, None], axis=-2)[..., 0, :]
    return np.asarray(found)
