"""`Extent`: the size of a group of points, as one radar sees it."""

from dataclasses import dataclass

import numpy as np

from polychirp.axes import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Extent:
    """Size of a group of points that a radar sees; a single point has a length of 0.

    Parameters
    ----------
    num_points : number of points
    length : m, greatest difference of their ranges
    width : m, greatest distance between them across the line of sight to their middle; NaN if the
        radar measures no azimuth
    range_rate_span : m/s, greatest difference of their range rates
    """

    num_points: int
    length: float
    width: float
    range_rate_span: float


def extent_of(*, range: FloatArray, range_rate: FloatArray, azimuth: FloatArray) -> Extent:
    """Extent of points with these ranges, m, range rates, m/s, and azimuths, rad: ``(point,)``.

    Elevations are neglected: the width is too large by less than 1 % below 8 degrees.

    Examples
    --------
    The side of a car, from 10 to 14 m ahead and 2 m to the left:

    >>> place = np.array([10 + 2j, 12 + 2j, 14 + 2j])
    >>> found = extent_of(range=np.abs(place), range_rate=np.zeros(3), azimuth=np.angle(place))
    >>> round(found.length, 2), round(found.width, 2)
    (3.94, 0.66)
    """
    if not range.size:
        return Extent(num_points=0, length=0.0, width=0.0, range_rate_span=0.0)
    place = range * np.exp(1j * azimuth)
    middle = np.angle(np.sum(place))
    across = range * np.sin(azimuth - middle)
    return Extent(
        num_points=range.size,
        length=float(np.ptp(range)),
        width=float(np.ptp(across)),
        range_rate_span=float(np.ptp(range_rate)),
    )
