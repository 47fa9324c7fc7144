"""Nearest point of every triangle to a place, and the triangles whose front faces the place."""

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, vector
from polychirp.jit import compiled, inlined, inner


def closest_points(corners: FloatArray, place: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Point of every triangle that is nearest to a place, and mask of the fronts that face it.

    Parameters
    ----------
    corners : m, ``(face, corner, xyz)``
    place : m, ``(xyz,)``

    Returns
    -------
    point : m, ``(face, xyz)``
    is_front : ``(face,)``; true if the corners turn counter-clockwise as seen from the place

    Examples
    --------
    >>> flat = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    >>> closest_points(flat, np.array([2.0, 2.0, 1.0]))
    (array([[0.5, 0.5, 0. ]]), array([ True]))
    """
    point = np.empty((len(corners), 3))
    is_front = np.empty(len(corners), dtype=np.bool_)
    _closest_points(np.ascontiguousarray(corners), place, point, is_front)
    return point, is_front


@compiled
def _closest_points(
    corners: FloatArray, place: FloatArray, point: FloatArray, is_front: BoolArray
) -> None:
    p = vector(place)
    for face in range(len(corners)):
        a, b, c = vector(corners[face, 0]), vector(corners[face, 1]), vector(corners[face, 2])
        u, v, w = _between(a, b), _between(a, c), _between(a, p)
        is_front[face] = dot(cross(u, v), w) > 0.0
        point[face, 0], point[face, 1], point[face, 2] = _closest_in_triangle(a, b, c, p)


@inner
def _closest_in_triangle(a: Vector, b: Vector, c: Vector, p: Vector) -> Vector:
    """Foot of the perpendicular from p if it is in the triangle, else the nearest side's point."""
    u, v, w = _between(a, b), _between(a, c), _between(a, p)
    uu, uv, vv, wu, wv = dot(u, u), dot(u, v), dot(v, v), dot(w, u), dot(w, v)
    area = uu * vv - uv * uv
    if area > 0.0:
        s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
        if s >= 0.0 and t >= 0.0 and s + t <= 1.0:
            return (
                a[0] + s * u[0] + t * v[0],
                a[1] + s * u[1] + t * v[1],
                a[2] + s * u[2] + t * v[2],
            )
    best = _closest_on_side(a, b, p)
    for other in (_closest_on_side(b, c, p), _closest_on_side(c, a, p)):
        off, gap = _between(p, other), _between(p, best)
        if dot(off, off) < dot(gap, gap):
            best = other
    return best


@inlined
def _closest_on_side(start: Vector, end: Vector, p: Vector) -> Vector:
    side = _between(start, end)
    share = dot(_between(start, p), side) / max(dot(side, side), 1e-300)
    share = min(max(share, 0.0), 1.0)
    return start[0] + share * side[0], start[1] + share * side[1], start[2] + share * side[2]


@inlined
def _between(a: Vector, b: Vector) -> Vector:
    """Vector from a to b."""
    return b[0] - a[0], b[1] - a[1], b[2] - a[2]
