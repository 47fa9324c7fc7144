"""Shadow tests of rays between two points, against all opaque bodies and plates."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.bvh import paired_rays
from polychirp.channel.geometry.vectors import Vector, dot, row
from polychirp.channel.scene.blockers import (
    OPAQUE_ROLE,
    Blockers,
    crosses_plate,
    hits_body,
    in_frame_of,
    into_body,
    nodes_of,
)
from polychirp.channel.scene.world import RADAR_CLEARANCE, World, opaque_obstacles


@njit(cache=True, nogil=True, error_model="numpy")
def is_blocked(
    blockers: Blockers,
    bodies: IntArray,
    plates: IntArray,
    start: Vector,
    end: Vector,
    clearance: float,
) -> bool:
    """True if one of ``bodies`` or ``plates`` is between two points.

    Nothing within ``clearance`` m of the start blocks.
    """
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = math.sqrt(dot(way, way))
    if length <= clearance:
        return False
    nearest = clearance / length
    for p in plates:
        if crosses_plate(blockers.plate, p, start, way, nearest):
            return True
    for b in bodies:
        place, along = into_body(blockers, b, start, way)
        if hits_body(blockers, nodes_of(blockers, OPAQUE_ROLE, b), place, along, (nearest, 1.0)):
            return True
    return False


@njit(cache=True, nogil=True, parallel=True)
def _blocked(
    blockers: Blockers,
    bodies: IntArray,
    plates: IntArray,
    starts: FloatArray,
    ends: FloatArray,
    clearance: float,
) -> BoolArray:
    out = np.empty(starts.shape[0], dtype=np.bool_)
    for i in prange(starts.shape[0]):
        out[i] = is_blocked(blockers, bodies, plates, row(starts, i), row(ends, i), clearance)
    return out


def blocked(
    world: World,
    starts: FloatArray,
    ends: FloatArray,
    *,
    clearance: float = RADAR_CLEARANCE,
    but_body: int | None = None,
) -> BoolArray:
    """Mask of the rays with something opaque between their ends, m ``(ray, xyz)``: ``(ray,)``.

    Parameters
    ----------
    clearance : m from the start within which nothing blocks
    but_body : number of the one body that does not block
    """
    bodies, plates = opaque_obstacles(world)
    bodies = bodies[bodies != but_body]
    start, end = paired_rays(starts, ends)
    blockers = in_frame_of(world, np.eye(3), np.zeros(3))
    if world.caster == "numba":
        return np.asarray(_blocked(blockers, bodies, plates, start, end, clearance))
    from polychirp.channel.scene.embree import blocked_by_bodies

    by_plates = _blocked(blockers, bodies[:0], plates, start, end, clearance)
    return np.asarray(by_plates | blocked_by_bodies(world, bodies, start, end, clearance))
