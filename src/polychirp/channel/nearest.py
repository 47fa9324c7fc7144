"""Closest hit of a ray in a tree of boxes, near boxes first.

`caster.first_hit` walks a tree in the order in which it is stored, which needs no memory and is
best where any hit will do. For the closest hit, what is near ought to come first: it shortens the
ray, and leaves the rest out of its reach.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.caster import NOTHING, Vector, entry, first_hit, inverse_of, struck

DEPTH = 64
"""Boxes that may wait to be looked into; what is more is walked in the stored order."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _closest_of(
    triangle: FloatArray,
    which: tuple[int, int],
    origin: Vector,
    direction: Vector,
    span: tuple[float, float],
) -> tuple[float, int]:
    """Distance and number of the closest of a leaf's triangles; infinite for a miss."""
    nearest, farthest = span
    best, found = NOTHING, 0
    for t in range(which[0], which[1]):
        distance = struck(triangle, t, origin, direction)
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
    inverse = (inverse_of(direction[0]), inverse_of(direction[1]), inverse_of(direction[2]))
    best, found, size, node = NOTHING, 0, 0, nodes[0]
    if node >= nodes[1] or entry(box, node, origin, inverse, span) == np.inf:
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
            a = entry(box, one, origin, inverse, span)
            b = entry(box, other, origin, inverse, span)
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
            if entry(box, waiting[size], origin, inverse, span) < np.inf:
                node = waiting[size]
    return best, found
