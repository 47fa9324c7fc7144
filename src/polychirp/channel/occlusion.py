"""Whether anything of a scene stands between two points."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.caster import Vector, first_hit, rays
from polychirp.channel.world import SKIN, Blockers, World, everything_opaque, in_frame_of


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def is_blocked(
    blockers: Blockers,
    bodies: IntArray,
    plates: IntArray,
    start: Vector,
    end: Vector,
    skin: float,
) -> bool:
    """Whether one of ``bodies`` or ``plates`` is between two points, ``skin`` m off the start."""
    dx, dy, dz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    if length <= skin:
        return False
    nearest = skin / length
    for p in plates:
        n, c = blockers.plate_normal[p], blockers.plate_centre[p]
        slope = n[0] * dx + n[1] * dy + n[2] * dz
        if slope == 0.0:
            continue
        gx, gy, gz = start[0] - c[0], start[1] - c[1], start[2] - c[2]
        t = -(n[0] * gx + n[1] * gy + n[2] * gz) / slope
        if not nearest < t < 1.0:
            continue
        gx, gy, gz = gx + t * dx, gy + t * dy, gz + t * dz
        u, v = blockers.plate_across[p], blockers.plate_along[p]
        if abs(u[0] * gx + u[1] * gy + u[2] * gz) > blockers.half_across[p]:
            continue
        if abs(v[0] * gx + v[1] * gy + v[2] * gz) <= blockers.half_along[p]:
            return True
    root = blockers.root
    for b in bodies:
        m, s = blockers.turn[b], blockers.shift[b]
        distance, _ = first_hit(
            blockers.box,
            blockers.skip,
            blockers.first,
            blockers.size,
            blockers.triangle,
            (root[b], root[b + 1]),
            (
                m[0, 0] * start[0] + m[0, 1] * start[1] + m[0, 2] * start[2] + s[0],
                m[1, 0] * start[0] + m[1, 1] * start[1] + m[1, 2] * start[2] + s[1],
                m[2, 0] * start[0] + m[2, 1] * start[1] + m[2, 2] * start[2] + s[2],
            ),
            (
                m[0, 0] * dx + m[0, 1] * dy + m[0, 2] * dz,
                m[1, 0] * dx + m[1, 1] * dy + m[1, 2] * dz,
                m[2, 0] * dx + m[2, 1] * dy + m[2, 2] * dz,
            ),
            (nearest, 1.0),
            True,
        )
        if distance < math.inf:
            return True
    return False


@njit(cache=True, nogil=True, parallel=True)
def _blocked(
    blockers: Blockers,
    bodies: IntArray,
    plates: IntArray,
    starts: FloatArray,
    ends: FloatArray,
    skin: float,
) -> BoolArray:
    out = np.empty(starts.shape[0], dtype=np.bool_)
    for i in prange(starts.shape[0]):
        a, b = starts[i], ends[i]
        out[i] = is_blocked(blockers, bodies, plates, (a[0], a[1], a[2]), (b[0], b[1], b[2]), skin)
    return out


def blocked(
    world: World,
    starts: FloatArray,
    ends: FloatArray,
    *,
    skin: float = SKIN,
    but_body: int | None = None,
) -> BoolArray:
    """Whether anything stands between points of the world, m ``(ray, xyz)``.

    Parameters
    ----------
    skin : m from the start within which nothing blocks
    but_body : number of the one body that does not block
    """
    bodies, plates = everything_opaque(world)
    bodies = bodies[bodies != but_body]
    start, end = rays(starts, ends)
    blockers = in_frame_of(world, np.eye(3), np.zeros(3))
    if world.caster == "numba":
        return np.asarray(_blocked(blockers, bodies, plates, start, end, skin))
    from polychirp.channel.embree import blocked_by_bodies

    by_plates = _blocked(blockers, bodies[:0], plates, start, end, skin)
    return np.asarray(by_plates | blocked_by_bodies(world, bodies, start, end, skin))
