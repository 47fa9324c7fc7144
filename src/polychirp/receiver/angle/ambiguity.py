r"""Directions that an array cannot tell apart, and the window in which it tells all apart.

Waves of the direction cosines :math:`u` and :math:`u + g` give the channels the same phases if
:math:`|\sum_m e^{j2\pi p_m g}|` is M, the number of elements: g is a *grating lobe*. A uniform line
of the step d has them at multiples of λ/d. A sparse array may have lobes that are almost as high,
and noise decides between them.

The lobes of a rectangle are along its axes, and at their sums. Rows that are staggered have lobes
in between: two such directions differ in azimuth and in elevation at once.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.model.antenna import ElementPattern
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

SAME_COSINE = 1e-6
"""Difference below which two direction cosines count as equal; chosen: above the rounding errors of
`refined`."""

Beam = tuple[float, float]
"""Azimuth and elevation to either side of boresight, rad."""

HALF_SPACE: Beam = (0.5 * math.pi, 0.5 * math.pi)
"""Beam of an element that sees all directions in front of it."""


def beam_of(pattern: ElementPattern) -> Beam:
    """Half of an element's 3-dB beam widths, rad, and 90° at most."""
    azimuth, elevation = 0.5 * pattern.azimuth_beamwidth, 0.5 * pattern.elevation_beamwidth
    return min(azimuth, HALF_SPACE[0]), min(elevation, HALF_SPACE[1])


class Window(NamedTuple):
    """Azimuth and elevation to either side within which no two directions look alike, rad.

    Both hold together; None is an angle that is not measured.
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

    They are the array's grating lobes, in both cosines and in one alone: a lobe beside an axis may
    reach the least power on the axis. ESPRIT has further ones than the array: it compares parts
    that are a shift δ apart, and cosines 1/δ apart are equal to it.
    """
    repeats = [[p * (n == axis) for n in range(2)] for axis, p in _repeats(elements, estimator)]
    found = [grating_lobes(elements), *_lobes_on_axes(elements), np.reshape(repeats, (-1, 2))]
    return np.concatenate(found)


def _lobes_on_axes(elements: Elements) -> Iterator[FloatArray]:
    """Lobes between directions that differ along one axis alone, for each axis of a plane."""
    for axis in elements.axes if len(elements.axes) > 1 else ():
        # such directions see the elements projected onto the axis
        place = np.zeros_like(elements.place)
        place[:, axis] = elements.place[:, axis]
        yield grating_lobes(Elements(place=place))


def unambiguous_window(elements: Elements, *, estimator: str, beam: Beam = HALF_SPACE) -> Window:
    r"""Azimuth A and elevation E to either side within which no two directions look alike.

    Directions within the window have direction cosines in the box
    :math:`|u| \le \sin A, |w| \le \sin E`. It holds no two that differ by a lobe
    :math:`(g_u, g_w)` if

    .. math:: |g_u| \ge 2 \sin A \quad\text{or}\quad |g_w| \ge 2 \sin E

    for each of the `ambiguities`. An array on a line has one greatest box, and so has a rectangle:
    half of the nearest lobe along each axis. Staggered rows leave a choice, since a greater azimuth
    goes with a smaller elevation. Of the boxes that cannot grow, that one is taken which covers
    most of the elements' ``beam``, then the one of the greatest area, then the widest in azimuth.
    Shares and areas are products of sines. So the window covers the beam if any box does.

    Other boxes that hold no lobe are not told. The condition is slightly too strict away from the
    axes, where :math:`|u| \le \cos\varepsilon \sin A`.

    Examples
    --------
    >>> row = Elements(place=[[0.0, 0.0], [0.8, 0.0], [1.6, 0.0]])
    >>> round(math.degrees(unambiguous_window(row, estimator="bartlett").azimuth), 2)
    38.68

    Two rows that are staggered by half of their elements' distance, with a lobe at (1, 1):

    >>> place = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.5, 0.5], [1.5, 0.5], [2.5, 0.5]]
    >>> staggered = Elements(place=place)
    >>> np.degrees(unambiguous_window(staggered, estimator="bartlett")).round(2)
    array([90., 30.])
    >>> upright = math.radians(20.0), math.radians(50.0)
    >>> np.degrees(unambiguous_window(staggered, estimator="bartlett", beam=upright)).round(2)
    array([30., 90.])
    """
    boxes = _boxes(np.abs(ambiguities(elements, estimator=estimator)))
    share = np.prod(np.minimum(boxes, np.sin(beam)), axis=1)
    # shares and areas that differ by rounding errors count as equal
    order = np.lexsort((boxes[:, 0], np.prod(boxes, axis=1).round(6), share.round(6)))
    angles = np.arcsin(boxes[order[-1]]).tolist()
    return Window(*(angles[axis] if axis in elements.axes else None for axis in range(2)))


def _boxes(lobes: FloatArray) -> FloatArray:
    """Sines of the windows that hold no lobe, ``(box, 2)``, of magnitudes of lobes ``(lobe, 2)``.

    Every window that cannot grow is among them: it ends at half of a lobe in azimuth, or at 90°.
    The elevation ends at half of the least lobe among those that the azimuth leaves within.
    """
    along, up = (0.5 * lobes[np.argsort(lobes[:, 0])]).T
    wide = np.append(along[along < 1.0], 1.0)
    within = np.searchsorted(along, wide - 0.5 * SAME_COSINE)
    tall = np.minimum.accumulate(np.append(1.0, up))[within]
    return np.stack([wide, tall], axis=-1)


def _repeats(elements: Elements, estimator: str) -> Iterator[tuple[int, float]]:
    """Axes along which ESPRIT's shift is longer than half a wavelength, and 1/δ of each."""
    for axis in elements.axes if estimator == "esprit" else ():
        shift = shift_along(elements, axis)
        if shift is not None and WHOLE_SPHERE * shift.length > 1.0:
            yield axis, 1.0 / shift.length


def nearest_to_boresight(
    cosines: FloatArray, elements: Elements, *, estimator: str = "bartlett", beam: Beam = HALF_SPACE
) -> FloatArray:
    """Direction cosines with the same phases as ``cosines`` ``(…, 2)``: those within the window.

    The window is that of `unambiguous_window`. Outside of it, the smallest ones are taken.
    """
    lobes = grating_lobes(elements, least=EQUAL_POWER)
    window = Window(0.0, 0.0)
    if np.any(np.all(np.abs(lobes) > SAME_COSINE, axis=1)):
        # without such lobes, the smallest cosines are within the window if any are
        window = unambiguous_window(elements, estimator=estimator, beam=beam)
    found = cosines
    for _ in range(2):  # a cosine may be two lobes away
        copies = found[..., None, :] - np.concatenate([np.zeros((1, 2)), lobes])
        far = WHOLE_SPHERE * WHOLE_SPHERE * ~_is_within(copies, window)
        best = np.argmin(np.linalg.norm(copies, axis=-1) + far, axis=-1)
        found = np.take_along_axis(copies, best[..., None, None], axis=-2)[..., 0, :]
    return np.asarray(found)


def _is_within(cosines: FloatArray, window: Window) -> BoolArray:
    """True for direction cosines ``(…, 2)`` of directions within a window."""
    azimuth, elevation = (math.sin(HALF_SPACE[0] if a is None else a) for a in window)
    left, up = np.abs(cosines[..., 0]), np.abs(cosines[..., 1])
    level = np.sqrt(np.maximum(1.0 - up**2, 0.0))
    is_low = up <= elevation + SAME_COSINE
    return np.asarray(is_low & (left <= level * azimuth + SAME_COSINE))
