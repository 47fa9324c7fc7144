"""Trees, poses and plates of a scene in flat tables for compiled code, in any one frame.

Compiled code passes an array as some eight machine words, which it copies at every call of another
compiled function. Few large tables are therefore faster than many small ones: each plate is one
row, each pose of a body is one row, and the trees of all bodies share tables, one body after the
other. `Blockers` is a flat tuple, as parallel loops cannot take tuples of tuples.
"""

import math
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.geometry.bvh import Boxes, first_hit
from polychirp.channel.geometry.vectors import Vector, cross, dot, vector_at
from polychirp.channel.scene.world import World
from polychirp.jit import inlined, inner

OPAQUE_ROLE, PANE_ROLE, CLOUD_ROLE = 0, 1, 2
"""First indices of `Blockers.root`, in the order of `world.ROLES`."""

PLATE_NORMAL: Final = 0
PLATE_CENTRE: Final = 3
PLATE_ACROSS: Final = 6
PLATE_ALONG: Final = 9
PLATE_HALF_ACROSS: Final = 12
PLATE_HALF_ALONG: Final = 13
PLATE_MEDIUM: Final = 14
"""First columns of the fields of `Blockers.plate`: four vectors of three columns (unit normal,
centre in m, two unit vectors along the sides), two half lengths in m, number of the material."""


class Blockers(NamedTuple):
    """Everything that a ray can meet.

    ``box`` to ``triangle`` are as in `Tree`, for the trees of all bodies, each in its body's own
    frame: body b has the nodes ``root[role, b, 0]:root[role, b, 1]``. ``medium`` ``(triangle,)`` is
    the number of a triangle's material in the world. ``pose`` ``(body, 12)`` holds the rotation
    matrix, row by row, and then the shift, m, that take a point to the frame of each body.
    ``plate`` ``(plate, 15)`` has the columns `PLATE_NORMAL` to `PLATE_MEDIUM`.
    """

    box: FloatArray
    skip: IntArray
    first: IntArray
    size: IntArray
    triangle: FloatArray
    medium: IntArray
    root: IntArray
    pose: FloatArray
    plate: FloatArray


def in_frame_of(world: World, rotation: FloatArray, position: FloatArray) -> Blockers:
    """Blockers of a world in a frame at ``position`` (m) that is turned by ``rotation``."""
    back = np.swapaxes(world.rotation, 1, 2)
    shift = np.einsum("bij,bj->bi", back, position - world.position)
    plates, forest = world.plates, world.forest
    return Blockers(
        *forest.tree[:5],
        medium=world.forest_medium,
        root=forest.root,
        pose=np.concatenate([(back @ rotation).reshape(-1, 9), shift], axis=1),
        plate=np.column_stack(
            [
                plates.normal @ rotation,
                (plates.centre - position) @ rotation,
                plates.across @ rotation,
                plates.along @ rotation,
                plates.half_across,
                plates.half_along,
                plates.medium,
            ]
        ),
    )


@lru_cache(maxsize=2)
def in_world_frame(world: World) -> Blockers:
    """Blockers of a world in its own frame, cached because many tests of few rays need them."""
    return in_frame_of(world, np.eye(3), np.zeros(3))


@inlined
def _turned(pose: FloatArray, b: int, v: Vector) -> Vector:
    return (
        dot(vector_at(pose, b, 0), v),
        dot(vector_at(pose, b, 3), v),
        dot(vector_at(pose, b, 6), v),
    )


@inlined
def into_body(blockers: Blockers, b: int, start: Vector, way: Vector) -> tuple[Vector, Vector]:
    """A point and a direction in the frame of a body."""
    place, shift = _turned(blockers.pose, b, start), vector_at(blockers.pose, b, 9)
    return (
        (place[0] + shift[0], place[1] + shift[1], place[2] + shift[2]),
        _turned(blockers.pose, b, way),
    )


@inlined
def nodes_of(blockers: Blockers, role: int, b: int) -> tuple[int, int]:
    """Number of the first node of a body's tree of one role, and of the last node plus 1."""
    return blockers.root[role, b, 0], blockers.root[role, b, 1]


@inlined
def _boxes(b: Blockers) -> Boxes:
    return Boxes(b.box, b.skip, b.first, b.size, b.triangle)


@inlined
def first_hit_in_body(
    blockers: Blockers,
    nodes: tuple[int, int],
    start: Vector,
    way: Vector,
    span: tuple[float, float],
) -> tuple[float, int]:
    """Fraction of a leg (in the body's frame) at its first hit (∞: none), and triangle's number."""
    return first_hit(_boxes(blockers), nodes, start, way, span, False)


@inlined
def hits_body(
    blockers: Blockers,
    nodes: tuple[int, int],
    start: Vector,
    way: Vector,
    span: tuple[float, float],
) -> bool:
    """True if a leg (in the body's frame) meets any triangle of the tree's ``nodes``."""
    return first_hit(_boxes(blockers), nodes, start, way, span, True)[0] < math.inf


@inner
def face_normal(blockers: Blockers, b: int, triangle: int) -> Vector:
    """Unit normal of a triangle of a body, in the frame of the blockers."""
    n = cross(vector_at(blockers.triangle, triangle, 3), vector_at(blockers.triangle, triangle, 6))
    size, pose = math.sqrt(dot(n, n)), blockers.pose
    return (
        (pose[b, 0] * n[0] + pose[b, 3] * n[1] + pose[b, 6] * n[2]) / size,
        (pose[b, 1] * n[0] + pose[b, 4] * n[1] + pose[b, 7] * n[2]) / size,
        (pose[b, 2] * n[0] + pose[b, 5] * n[1] + pose[b, 8] * n[2]) / size,
    )


@inlined
def is_beside(plate: FloatArray, p: int, gap: Vector) -> bool:
    """True if a point in a plate's plane lies outside the plate; ``gap`` m: from its centre."""
    if abs(dot(vector_at(plate, p, PLATE_ACROSS), gap)) > plate[p, PLATE_HALF_ACROSS]:
        return True
    return bool(abs(dot(vector_at(plate, p, PLATE_ALONG), gap)) > plate[p, PLATE_HALF_ALONG])


@inner
def crosses_plate(plate: FloatArray, p: int, start: Vector, way: Vector, nearest: float) -> bool:
    """True if a leg crosses a plate after the fraction ``nearest`` of its length and before 1."""
    n, c = vector_at(plate, p, PLATE_NORMAL), vector_at(plate, p, PLATE_CENTRE)
    slope = dot(n, way)
    if slope == 0.0:
        return False
    gap = (start[0] - c[0], start[1] - c[1], start[2] - c[2])
    t = -dot(n, gap) / slope
    if not nearest < t < 1.0:
        return False
    meet = (gap[0] + t * way[0], gap[1] + t * way[1], gap[2] + t * way[2])
    return not is_beside(plate, p, meet)
