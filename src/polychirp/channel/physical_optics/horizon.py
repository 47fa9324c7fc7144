r"""Horizons of points on a body: elevations above which a ray does not meet the same body again.

Elevation is measured from the plane that is normal to the surface's normal at the point. For a ray
that starts above the horizon, the body need not be tested.
"""

import math
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.geometry.bvh import Tree
from polychirp.channel.geometry.vectors import Vector, dot, row, vector_at
from polychirp.jit import compiled, inlined, inner
from polychirp.threads import in_ranges

FULL_HORIZON_SINE: Final = 0.95
"""Limit of a horizon's sine (chosen). If a bound reaches it, the search stops and the sine is set
to 1: so few rays start above such a horizon that hardly any test would be saved."""


def horizons(tree: Tree, points: FloatArray, normals: FloatArray) -> FloatArray:
    r"""Sine of the elevation above which no ray from a point meets the tree, ``(point,)``.

    It is an upper bound. Each triangle that reaches above the plane through the point has a bound:
    its greatest height above the plane, over the least distance of its bounding box. The greatest
    bound is returned, or 1 from `FULL_HORIZON_SINE` on. ``points`` (m) and ``normals`` (unit
    vectors) are ``(point, xyz)``, in the tree's frame.

    A wall is 1 m high and 2 m away:

    >>> from polychirp.channel.geometry.bvh import grow_tree
    >>> wall = np.array([[[2.0, -1, 0], [2.0, 1, 0], [2.0, 0, 1]]])
    >>> float(horizons(grow_tree(wall), np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))[0])
    0.5
    """
    if not tree.face.size:
        return np.zeros(len(points))
    out = np.zeros(len(points))
    where = np.ascontiguousarray(points), np.ascontiguousarray(normals)
    in_ranges(_fill_horizons, len(points), tree, where, out, least=20)
    return out


@compiled
def _fill_horizons(
    begin: int, end: int, tree: Tree, where: tuple[FloatArray, FloatArray], out: FloatArray
) -> None:
    points, normals = where
    box, skip, first, size, triangle = tree.box, tree.skip, tree.first, tree.size, tree.triangle
    for i in range(begin, end):
        point, normal = row(points, i), row(normals, i)
        best, node = 0.0, 0
        while node < skip.size and best < FULL_HORIZON_SINE:
            low, high = vector_at(box, node, 0), vector_at(box, node, 3)
            if _sine(low, high, point, _height(low, high, point, normal)) <= best:
                node = skip[node]
                continue
            for t in range(first[node], first[node] + size[node]):
                best = max(best, _sine_of_triangle(triangle, t, point, normal))
            node += 1
        out[i] = best if best < FULL_HORIZON_SINE else 1.0


@inlined
def _height(low: Vector, high: Vector, point: Vector, normal: Vector) -> float:
    """Greatest height of a box above the plane through a point."""
    return float(
        max(normal[0] * (low[0] - point[0]), normal[0] * (high[0] - point[0]))
        + max(normal[1] * (low[1] - point[1]), normal[1] * (high[1] - point[1]))
        + max(normal[2] * (low[2] - point[2]), normal[2] * (high[2] - point[2]))
    )


@inlined
def _sine(low: Vector, high: Vector, point: Vector, height: float) -> float:
    """Ratio of ``height`` to the least distance of a box from a point, 0 … 1."""
    if height <= 0.0:
        return 0.0
    x = max(low[0] - point[0], 0.0, point[0] - high[0])
    y = max(low[1] - point[1], 0.0, point[1] - high[1])
    z = max(low[2] - point[2], 0.0, point[2] - high[2])
    away = math.sqrt(x * x + y * y + z * z)
    return min(1.0, height / away) if away > 0.0 else 1.0


@inner
def _sine_of_triangle(triangle: FloatArray, t: int, point: Vector, normal: Vector) -> float:
    """Bound of one triangle: its greatest height over the least distance of its box."""
    a, u, v = vector_at(triangle, t, 0), vector_at(triangle, t, 3), vector_at(triangle, t, 6)
    above = dot(normal, (a[0] - point[0], a[1] - point[1], a[2] - point[2]))
    height = above + max(0.0, dot(normal, u), dot(normal, v))
    low = (
        a[0] + min(0.0, u[0], v[0]),
        a[1] + min(0.0, u[1], v[1]),
        a[2] + min(0.0, u[2], v[2]),
    )
    high = (
        a[0] + max(0.0, u[0], v[0]),
        a[1] + max(0.0, u[1], v[1]),
        a[2] + max(0.0, u[2], v[2]),
    )
    return float(_sine(low, high, point, height))
