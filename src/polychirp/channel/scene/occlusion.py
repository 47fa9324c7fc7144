"""Whether anything of a scene stands between two points."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.bvh import Vector, rays
from polychirp.channel.geometry.vectors import dot
from polychirp.channel.scene.blockers import (
    OPAQUE,
    Blockers,
    crosses_plate,
    hit_body,
    in_frame_of,
    into_body,
    nodes_of,
)
from polychirp.channel.scene.world import SKIN, World, everything_opaque


@njit(cache=True, nogil=True, error_model="numpy")
def is_blocked(
    blockers: Blockers,
    bodies: IntArray,
    plates: IntArray,
    start: Vector,
    end: Vector,
    skin: float,
) -> bool:
    """Whether one of ``bodies`` or ``plates`` is between two points, ``skin`` m off the start."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = math.sqrt(dot(way, way))
    if length <= skin:
        return False
    nearest = skin / length
    for p in plates:
        if crosses_plate(blockers.plate, p, start, way, nearest):
            return True
    for b in bodies:
        place, along = into_body(blockers, b, start, way)
        nodes = nodes_of(blockers, OPAQUE, b)
        if hit_body(blockers, nodes, place, along, (nearest, 1.0), True)[0] < math.inf:
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
    from polychirp.channel.scene.embree import blocked_by_bodies

    by_plates = _blocked(blockers, bodies[:0], plates, start, end, skin)
    return np.asarray(by_plates | blocked_by_bodies(world, bodies, start, end, skin))
