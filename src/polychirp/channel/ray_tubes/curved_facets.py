r"""Facets that stand for a curved surface: its normals and its height over each facet.

Meshes approximate curved bodies by flat facets. A mirror of flat facets throws a patch of light
from each of them, with gaps and overlaps between, where the curved body spreads its light evenly.
Ray tubes therefore meet a curved surface instead. With the barycentric coordinates
:math:`\lambda_i` of a point of a facet, and the normals :math:`n_i` at its corners :math:`x_i`,
the curved surface lies above the point by

.. math:: h = \lambda_0\lambda_1 c_{01} + \lambda_0\lambda_2 c_{02} + \lambda_1\lambda_2 c_{12},
    \qquad c_{ij} = \tfrac12 (n_j - n_i)\cdot(x_j - x_i)

and its normal is along :math:`\sum\lambda_i n_i` (Phong 1975). For a paraboloid h is exact. Both
are continuous from facet to facet.

The normal at a corner is the mean of those of the facets that meet there, weighted with their
angles. Only facets count whose normals are within `LEAST_BEND` of each other: the border between
others is a sharp edge of the body.

**Limits.** The outline of a curved surface, and its shadow, are those of the facets. A mesh of a
curved body whose facets bend by `LEAST_BEND` or more remains a polyhedron.
"""

from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, vector_at
from polychirp.channel.physical_optics.flat_faces import POSITION_STEP, row_codes
from polychirp.channel.physical_optics.kernels import SHADOW_RAY_LIFT
from polychirp.channel.ray_tubes.flat_parts import LEAST_BEND
from polychirp.channel.scene.world import Surface
from polychirp.jit import inlined

LEAST_TURN: Final = 1e-6
"""Difference of two normals, rad, below which they are taken as equal. Chosen: above rounding."""

IS_CURVED: Final = 0
"""Column of a facet's table, as of those that follow: 1 if it is curved, 0 if it is flat."""

HEIGHTS: Final = 1
"""First of three columns with c₀₁, c₀₂ and c₁₂, m."""

NORMALS: Final = 4
"""First of nine columns with the normals at the three corners."""

NUM_COLUMNS: Final = 13
"""Columns of a facet's table."""


@lru_cache(maxsize=64)
def curved_facets(surface: Surface) -> FloatArray:
    """Table of the facets of a surface, ``(face, NUM_COLUMNS)``, in the surface's frame.

    Examples
    --------
    >>> from polychirp.channel.scene.world import surface_of
    >>> from polychirp.testing.shapes import box, mesh_of, sphere
    >>> bool(np.any(curved_facets(surface_of(mesh_of(box((1, 1, 1), 0.5)), ("opaque",)))[:, 0]))
    False
    >>> ball = curved_facets(surface_of(mesh_of(sphere(0.5, 0.1)), ("opaque",)))
    >>> bool(np.all(ball[:, HEIGHTS] > 0))
    True
    """
    normal = corner_normals(surface)
    corner = surface.centroid[:, None] + surface.corner
    heights = np.stack(
        [
            0.5 * np.sum((normal[:, j] - normal[:, i]) * (corner[:, j] - corner[:, i]), axis=-1)
            for i, j in ((0, 1), (0, 2), (1, 2))
        ],
        axis=-1,
    )
    turn = np.max(np.linalg.norm(normal - surface.normal[:, None], axis=-1), axis=-1)
    # a hollow must not be so deep that its own facet hides it from the radars
    is_curved = (turn > LEAST_TURN) & np.all(heights > -4.0 * SHADOW_RAY_LIFT, axis=-1)
    table = np.column_stack([is_curved, heights, normal.reshape(-1, 9)])
    return np.asarray(table, dtype=np.float64)


def corner_normals(surface: Surface) -> FloatArray:
    """Unit normals of the curved surface at the corners of its facets, ``(face, corner, xyz)``."""
    corner = surface.centroid[:, None] + surface.corner
    weighted = _angles(corner).reshape(-1, 1) * np.repeat(surface.normal, 3, axis=0)
    face = np.repeat(surface.normal, 3, axis=0)
    place = corner.reshape(-1, 3) / POSITION_STEP
    point = row_codes(place, np.zeros(len(place), dtype=np.int64))
    order = np.argsort(point, kind="stable")
    total = weighted.copy()
    size = np.bincount(point)
    # for every place in the order, the number of corners at its point from there on
    rest = np.cumsum(size)[point[order]] - np.arange(order.size)
    begin = np.arange(order.size)
    for step in range(1, int(size.max(initial=1))):
        begin = begin[rest[begin] > step]
        one, other = order[begin], order[begin + step]
        near = _is_smooth(face[one], face[other])
        one, other = one[near], other[near]
        # a corner occurs at most once in each of the two lists
        total[one] += weighted[other]
        total[other] += weighted[one]
    total /= np.linalg.norm(total, axis=-1, keepdims=True)
    return np.asarray(total.reshape(-1, 3, 3))


def _is_smooth(one: FloatArray, other: FloatArray) -> BoolArray:
    """Mask ``(corner,)`` of the pairs of normals ``(corner, xyz)`` that belong to one surface."""
    return np.asarray(np.sum(one * other, axis=-1) > np.cos(LEAST_BEND))


def _angles(corner: FloatArray) -> FloatArray:
    """Angles of triangles ``(face, corner, xyz)`` at their corners, rad ``(face, corner)``."""
    there = np.roll(corner, -1, axis=1) - corner
    back = np.roll(corner, 1, axis=1) - corner
    across = np.linalg.norm(np.cross(there, back), axis=-1)
    return np.asarray(np.arctan2(across, np.sum(there * back, axis=-1)))


@inlined
def shares_of(triangle: FloatArray, row: int, point: Vector) -> tuple[float, float]:
    """Barycentric coordinates λ₁ and λ₂ of a point of a triangle of `Bundles`."""
    start = vector_at(triangle, row, 0)
    away = (point[0] - start[0], point[1] - start[1], point[2] - start[2])
    one, other = slopes_of(triangle, row)
    return dot(one, away), dot(other, away)


@inlined
def slopes_of(triangle: FloatArray, row: int) -> tuple[Vector, Vector]:
    """Gradients of λ₁ and λ₂ in the plane of a triangle of `Bundles`, 1/m."""
    u, v = vector_at(triangle, row, 3), vector_at(triangle, row, 6)
    n = cross(u, v)
    square = dot(n, n)
    one, other = cross(v, n), cross(n, u)
    return (
        (one[0] / square, one[1] / square, one[2] / square),
        (other[0] / square, other[1] / square, other[2] / square),
    )
