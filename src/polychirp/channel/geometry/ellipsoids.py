r"""Reflection by ellipsoids in geometric optics: the reflecting point, its curvature, shadows.

The ellipsoid with semi-axes :math:`a_i e_i` has the support function :math:`h(n) = |A n|`, where
the rows of A are the semi-axes. At the point whose outward unit normal is n,

.. math:: x = c + \frac{A^T A n}{h}, \qquad R_1 R_2 = \frac{(a_1 a_2 a_3)^2}{h^4}, \qquad
          R_1 + R_2 = \frac{\operatorname{tr} A^T A}{h} - \frac{|A^T A n|^2}{h^3}

with the principal radii of curvature R₁ and R₂, the eigenvalues of the Hessian of h.
"""

from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray

NUM_STEPS: Final = 4
"""Number of steps that find the reflecting point for ends at finite distances. Each step reduces
the error by the ratio of the ellipsoid's size to the distance; chosen: at 2 m from a torso, the
path's length is then within a micrometre."""


class Reflections(NamedTuple):
    """Points of ellipsoids that reflect from one end to another: shapes ``(way, ellipsoid, …)``.

    ``point`` m ``(…, xyz)``; ``normal`` ``(…, xyz)``; ``radius_product`` R₁R₂, m²; ``radius_sum``
    R₁ + R₂, m.
    """

    point: FloatArray
    normal: FloatArray
    radius_product: FloatArray
    radius_sum: FloatArray


def towards(ends: FloatArray, point: FloatArray) -> FloatArray:
    """Unit vectors from points ``(…, xyz)`` to ``ends`` ``(…, xyz)``, m."""
    way = ends - point
    return np.asarray(way / np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-12))


def bisector(point: FloatArray, ends: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Unit vectors that bisect the directions from points ``(…, xyz)`` to two ends, m."""
    both = towards(ends[0], point) + towards(ends[1], point)
    return np.asarray(both / np.maximum(np.linalg.norm(both, axis=-1, keepdims=True), 1e-12))


def reflections(
    centre: FloatArray, axes: FloatArray, ends: tuple[FloatArray, FloatArray]
) -> Reflections:
    """The reflection of every ellipsoid from one end to the other.

    Parameters
    ----------
    centre, axes : m, ``(ellipsoid, xyz)`` and ``(ellipsoid, 3, xyz)``, as in `Ellipsoids`
    ends : positions of both ends in the same frame, m ``(way, xyz)`` each

    Examples
    --------
    >>> eye = np.array([[10.0, 0.0, 0.0]])
    >>> ball = reflections(np.zeros((1, 3)), 0.5 * np.eye(3)[None], (eye, eye))
    >>> ball.point[0, 0], float(ball.radius_product[0, 0]), float(ball.radius_sum[0, 0])
    (array([0.5, 0. , 0. ]), 0.25, 1.0)
    """
    from_end, to_end = ends[0][:, None], ends[1][:, None]
    square = np.swapaxes(axes, -1, -2) @ axes
    point = np.broadcast_to(centre, (len(ends[0]), *centre.shape))
    normal, along, height = _support(square, bisector(point, (from_end, to_end)))
    for _ in range(NUM_STEPS - 1):
        point = centre + along / height[..., None]
        normal, along, height = _support(square, bisector(point, (from_end, to_end)))
    return Reflections(
        point=centre + along / height[..., None],
        normal=normal,
        radius_product=np.linalg.det(axes) ** 2 / height**4,
        radius_sum=np.trace(square, axis1=-2, axis2=-1) / height
        - np.sum(along**2, axis=-1) / height**3,
    )


def _support(square: FloatArray, normal: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The normals themselves, AᵀA n ``(way, ellipsoid, xyz)`` and h ``(way, ellipsoid)``."""
    along = np.einsum("eij,wej->wei", square, normal)
    return normal, along, np.sqrt(np.sum(normal * along, axis=-1))


def crossed(centre: FloatArray, axes: FloatArray, start: FloatArray, end: FloatArray) -> BoolArray:
    """Mask ``(way, ellipsoid)`` of the straight ways that enter an ellipsoid or begin in it.

    ``start`` and ``end`` are m ``(way, xyz)``; ``centre`` and ``axes`` are those of `Ellipsoids`.

    >>> line = np.array([[-2.0, 0.9, 0.0]]), np.array([[2.0, 0.9, 0.0]])
    >>> balls = np.array([np.eye(3), 0.8 * np.eye(3)])
    >>> crossed(np.zeros((2, 3)), balls, *line)
    array([[ True, False]])
    """
    # in the frame in which the ellipsoid is a unit sphere
    turn = axes / np.sum(axes**2, axis=-1, keepdims=True)
    origin = np.einsum("eij,wej->wei", turn, start[:, None] - centre)
    way = np.einsum("eij,wj->wei", turn, end - start)
    square = np.sum(way**2, axis=-1)
    middle = -np.sum(origin * way, axis=-1) / np.maximum(square, 1e-300)
    off = np.sum(origin**2, axis=-1) - middle**2 * square
    half = np.sqrt(np.maximum(1.0 - off, 0.0) / np.maximum(square, 1e-300))
    enters = np.maximum(middle - half, 0.0) < np.minimum(middle + half, 1.0)
    return np.asarray((off < 1.0) & enters)
