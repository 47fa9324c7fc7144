"""Tests whether an opaque body or plate lies between two points."""

import math

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.bvh import paired_rays
from polychirp.channel.geometry.vectors import Vector, dot, row
from polychirp.channel.scene.blockers import (
    OPAQUE_ROLE,
    Blockers,
    crosses_plate,
    hits_body,
    in_world_frame,
    into_body,
    nodes_of,
)
from polychirp.channel.scene.world import RADAR_CLEARANCE, World, opaque_obstacles
from polychirp.jit import compiled, inner
from polychirp.threads import in_ranges


@inner
def is_blocked(
    blockers: Blockers,
    bodies: IntArray,
    plates: IntArray,
    start: Vector,
    end: Vector,
    clearance: float,
) -> bool:
    """True if one of ``bodies`` or ``plates`` lies between two points (m).

    Surfaces within ``clearance`` (m) of the start are ignored.
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


@compiled
def _find_blocked(
    begin: int,
    end: int,
    blockers: Blockers,
    bodies: IntArray,
    plates: IntArray,
    rays: tuple[FloatArray, FloatArray],
    clearance: float,
    out: BoolArray,
) -> None:
    starts, ends = rays
    for i in range(begin, end):
        out[i] = is_blocked(blockers, bodies, plates, row(starts, i), row(ends, i), clearance)


def _blocked(
    blockers: Blockers,
    bodies: IntArray,
    plates: IntArray,
    rays: tuple[FloatArray, FloatArray],
    clearance: float,
) -> BoolArray:
    out = np.empty(len(rays[0]), dtype=np.bool_)
    in_ranges(_find_blocked, len(out), blockers, bodies, plates, rays, clearance, out, least=50)
    return out


def blocked(
    world: World,
    starts: FloatArray,
    ends: FloatArray,
    *,
    clearance: float = RADAR_CLEARANCE,
    but_body: int | None = None,
    among: tuple[IntArray, IntArray] | None = None,
) -> BoolArray:
    """Mask ``(ray,)`` of the rays that an opaque body or plate blocks between their ends.

    Parameters
    ----------
    starts, ends : m, in the world, ``(ray, xyz)``
    clearance : distance from the start, m, within which surfaces are ignored
    but_body : number of a body that is ignored, such as the ray's own; none by default
    among : numbers of the bodies and of the opaque plates that can block a ray; None: all
    """
    bodies, plates = opaque_obstacles(world) if among is None else among
    bodies = bodies[bodies != but_body]
    rays = paired_rays(starts, ends)
    blockers = in_world_frame(world)
    if world.caster == "numba":
        return _blocked(blockers, bodies, plates, rays, clearance)
    from polychirp.channel.scene.embree import blocked_by_bodies

    by_plates = _blocked(blockers, bodies[:0], plates, rays, clearance)
    return np.asarray(by_plates | blocked_by_bodies(world, bodies, *rays, clearance))
