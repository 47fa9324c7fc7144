"""Volume inside a closed surface of triangles, and points inside it."""

import numpy as np

from polychirp.axes import FloatArray


def enclosed_volume(corners: FloatArray) -> float:
    """Volume inside a closed surface, m³, from its triangles, m ``(face, corner, xyz)``.

    The divergence theorem gives it; it is negative if corners turn clockwise as seen from outside.

    >>> from polychirp.testing.shapes import box
    >>> round(enclosed_volume(box((1.0, 2.0, 3.0), 1.0)), 12)
    6.0
    """
    a, b, c = np.moveaxis(corners - corners.mean(axis=(0, 1)), 1, 0)
    return float(np.sum(a * np.cross(b, c)) / 6)


def winding_numbers(corners: FloatArray, points: FloatArray) -> FloatArray:
    r"""Number of times that a surface winds around points, ``(point,)``: 1 inside, 0 outside.

    It is the sum of the triangles' solid angles Ω over 4π (van Oosterom & Strackee 1983),

    .. math:: \tan\frac\Omega2 = \frac{a\cdot(b\times c)}
        {|a||b||c| + (a\cdot b)|c| + (b\cdot c)|a| + (c\cdot a)|b|}

    with the vectors a, b, c from the point to the corners. For a surface with holes, the result is
    the share of the full solid angle that the surface fills as seen from the point.

    >>> from polychirp.testing.shapes import box
    >>> points = np.array([[0.2, 0.1, 0.3], [0.6, 0.0, 0.0]])
    >>> winding_numbers(box((1.0, 1.0, 1.0), 1.0), points).round(9)
    array([1., 0.])
    """
    turns = np.empty(len(points))
    for number, point in enumerate(points):
        a, b, c = np.moveaxis(corners - point, 1, 0)
        x, y, z = (np.linalg.norm(side, axis=-1) for side in (a, b, c))
        above = np.sum(a * np.cross(b, c), axis=-1)
        below = x * y * z + np.sum(a * b, -1) * z + np.sum(b * c, -1) * x + np.sum(c * a, -1) * y
        turns[number] = np.sum(np.arctan2(above, below)) / (2 * np.pi)
    return turns
