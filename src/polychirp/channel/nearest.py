"""Closest hit of a ray in a tree of boxes, near boxes first.

`caster.first_hit` walks a tree in the order in which it is stored, which needs no memory and is
best where any hit will do. For the closest hit, what is near ought to come first: it shortens the
ray, and leaves the rest out of its reach.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.caster import NOTHING, Vector, _inverse, first_hit

DEPTH = 64
"""Boxes that may wait to be looked into; what is more is walked in the stored order."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _entry(
    box: FloatArray, node: int, origin: Vector, inverse: Vector, span: tuple[float, float]
) -> float:
    """Where a ray enters a box; infinite if not within its span."""
    a, b = (box[node, 0] - origin[0]) * inverse[0], (box[node, 3] - origin[0]) * inverse[0]
    enter, leave = min(a, b), max(a, b)
    a, b = (box[node, 1] - origin[1]) * inverse[1], (box[node, 4] - origin[1]) * inverse[1]
    enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    a, b = (box[node, 2] - origin[2]) * inverse[2], (box[node, 5] - origin[2]) * inverse[2]
    enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    # a flat box must not be missed by rounding
    slack = 1e-12 * (abs(enter) + abs(leave))
    if enter > leave + slack or leave + slack < span[0] or enter - slack > span[1]:
        return np.inf
    return float(enter - slack)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _closest_of(
    triangle: FloatArray,
    which: tuple[int, int],
    origin: Vector,
    direction: Vector,
    span: tuple[float, float],
) -> tuple[float, int]:
    """Distance and number of the closest of a leaf's triangles; infinite for a miss."""
    dx, dy, dz = direction
    nearest, farthest = span
    best, found = NOTHING, 0
    for t in range(which[0], which[1]):
        ux, uy, uz = triangle[t, 3], triangle[t, 4], triangle[t, 5]
        vx, vy, vz = triangle[t, 6], triangle[t, 7], triangle[t, 8]
        px, py, pz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
        volume = ux * px + uy * py + uz * pz
        if volume == 0.0:
            continue
        scale = 1.0 / volume
        sx, sy = origin[0] - triangle[t, 0], origin[1] - triangle[t, 1]
        sz = origin[2] - triangle[t, 2]
        alpha = (sx * px + sy * py + sz * pz) * scale
        if alpha < 0.0 or alpha > 1.0:
            continue
        qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
        beta = (dx * qx + dy * qy + dz * qz) * scale
        if beta < 0.0 or alpha + beta > 1.0:
            continue
        distance = (vx * qx + vy * qy + vz * qz) * scale
        if nearest < distance < farthest:
            farthest, best, found = distance, distance, t
    return best, found


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_hit(
    box: FloatArray,
    skip: IntArray,
    first: IntArray,
    count: IntArray,
    triangle: FloatArray,
    nodes: tuple[int, int],
    origin: Vector,
    direction: Vector,
    span: tuple[float, float],
    waiting: IntArray,
) -> tuple[float, int]:
    """What `first_hit` finds if the closest is asked for.

    ``waiting`` is room for the numbers of boxes: `DEPTH` of them for any sensible tree.
    """
    inverse = (_inverse(direction[0]), _inverse(direction[1]), _inverse(direction[2]))
    best, found, size, node = NOTHING, 0, 0, nodes[0]
    if node >= nodes[1] or _entry(box, node, origin, inverse, span) == np.inf:
        return best, found
    while node >= 0:
        distance, t = NOTHING, 0
        if count[node] > 0:
            leaf = (first[node], first[node] + count[node])
            distance, t = _closest_of(triangle, leaf, origin, direction, span)
        elif size == waiting.size:
            part = (node, skip[node])
            distance, t = first_hit(
                box, skip, first, count, triangle, part, origin, direction, span, False
            )
        elif skip[node] > node + 1:
            one, other = node + 1, skip[node + 1]
            a = _entry(box, one, origin, inverse, span)
            b = _entry(box, other, origin, inverse, span)
            if b < a:
                one, other, a, b = other, one, b, a
            if b < np.inf:
                waiting[size] = other
                size += 1
            if a < np.inf:
                node = one
                continue
        if distance < NOTHING:
            best, found, span = distance, t, (span[0], distance)
        # what has been found may be nearer than what waits
        node = -1
        while size > 0 and node < 0:
            size -= 1
            if _entry(box, waiting[size], origin, inverse, span) < np.inf:
                node = waiting[size]
    return best, found
