"""Width of an array's beam, and the greatest gain that an element's beam allows."""

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.frames import direction_of
from polychirp.model.antenna import ElementPattern
from polychirp.receiver.angle.elements import Elements
from polychirp.study.spec import Study
from polychirp.units import from_db, to_db

GAIN_MARGIN: Final = from_db(1.0)
"""Ratio of gain to directivity above which a note is given. Chosen: the pattern is a model of the
main lobe, and real side lobes change its directivity by less."""

_POINTS_PER_CELL: Final = 32
"""Points per cell 1/extent at which the beam is computed; chosen: interpolation between them is
right to 1e-3 of the width."""

_POINTS: Final = 256
"""Points along either axis of a quarter of the main beam; chosen: its integral is right to 1e-4."""


def half_power_width(elements: Elements, axis: int) -> float | None:
    r"""Angle between the half-power points of the array's beam at broadside, rad.

    The beam is the sum of all elements with equal weights, across ``axis`` (0: azimuth, 1:
    elevation). That of N elements in a uniform line of the step d is 0.886 λ/(N d) wide if N is
    large. It is None if the array does not measure this angle, or is so small that no direction
    has less than half of the power.

    >>> row = Elements(place=[[0.5 * n, 0.0] for n in range(8)])
    >>> round(math.degrees(half_power_width(row, 0)), 1), half_power_width(row, 1)
    (12.8, None)
    """
    if axis not in elements.axes:
        return None
    place = elements.place[:, axis]
    step = 1.0 / math.ceil(_POINTS_PER_CELL * max(1.0, float(elements.extent[axis])))
    before, power = 1.0, 1.0
    for cosine in np.arange(step, 1.0 + 0.5 * step, step).tolist():
        before, power = power, float(np.abs(np.exp(2j * np.pi * cosine * place).mean()) ** 2)
        if power <= 0.5:
            edge = cosine - step * (0.5 - power) / (before - power)
            return 2.0 * math.asin(edge)
    return None


@lru_cache(maxsize=256)
def directivity(pattern: ElementPattern) -> float:
    r"""Greatest gain over isotropic of an element with this beam: :math:`4\pi/\int g\,d\Omega`.

    g is the gain over that of the beam's maximum. An antenna without losses has this gain, and a
    real one has less. Only a beam that is narrow has :math:`41253/(\phi\theta)` with both widths in
    degrees (Kraus); the integral holds for wide beams as well.

    >>> from polychirp.model.antenna import ISOTROPIC
    >>> directivity(ISOTROPIC)
    1.0
    >>> round(float(to_db(directivity(ElementPattern()))), 1)
    10.6
    """
    # the main beam ends where its loss is that of the floor
    reach = math.sqrt(-math.log10(pattern.floor) * 10.0 / 12.0)
    if reach == 0.0:
        return 1.0
    azimuth, elevation = (
        limit * (np.arange(_POINTS) + 0.5) / _POINTS
        for limit in (
            min(math.pi, reach * pattern.azimuth_beamwidth),
            min(0.5 * math.pi, reach * pattern.elevation_beamwidth),
        )
    )
    left, up = np.meshgrid(azimuth, elevation, indexing="ij")
    excess = pattern.gain(direction_of(left, up)) / pattern.peak_gain - pattern.floor
    cell = 4.0 * azimuth[0] * elevation[0]
    beam = 4.0 * cell * float(np.sum(excess * np.cos(up)))  # four equal quarters
    return float(4.0 * math.pi / (beam + 4.0 * math.pi * pattern.floor))


def gains_beyond_beams(study: Study) -> Iterator[str]:
    """A sentence for each pattern whose gain an antenna with its beam cannot have."""
    users: dict[ElementPattern, list[str]] = {}
    for radar in study.radars:
        users.setdefault(radar.array.pattern, []).append(f"'{radar.name}'")
    for pattern, names in users.items():
        allowed = directivity(pattern)
        if pattern.peak_gain > GAIN_MARGIN * allowed:
            more = f" and {len(names) - 1} more" if len(names) > 1 else ""
            widths = [
                f"{math.degrees(width):.3g}°"
                for width in (pattern.azimuth_beamwidth, pattern.elevation_beamwidth)
            ]
            yield (
                f"the peak_gain of {names[0]}{more} is {float(to_db(pattern.peak_gain)):.3g} dB, "
                f"and an antenna whose beam is {widths[0]} by {widths[1]} wide has "
                f"{float(to_db(allowed)):.3g} dB at most; echoes are up to "
                f"{2.0 * float(to_db(pattern.peak_gain / allowed)):.2g} dB too strong"
            )
