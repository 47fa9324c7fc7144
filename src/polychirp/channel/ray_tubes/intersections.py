"""What rays meet: opaque triangles, thin sheets, plates, and leaves on the way."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.geometry.bvh import Vector
from polychirp.channel.geometry.vectors import cross, dot, vector_at
from polychirp.channel.geometry.wide_bvh import (
    CLOSEST,
    OPAQUE,
    SHEET,
    Bundles,
    bundles_of,
    nearest_hit,
)
from polychirp.channel.geometry.wide_bvh import MEDIUM as MEDIUM_OF
from polychirp.channel.materials.fresnel import Media
from polychirp.channel.physical_optics.paths import scatters
from polychirp.channel.scene.blockers import (
    CENTRE,
    MEDIUM,
    NORMAL,
    Blockers,
    crosses_plate,
    into_body,
    is_beside,
)
from polychirp.channel.scene.transmission import chord
from polychirp.channel.scene.world import SKIN, Surface, World

NOTHING, FACE, PANE, PLATE = 0, 1, 2, 3

Meeting = tuple[float, int, int, int]
"""Distance, kind, number of the body or plate, and triangle."""

POSE: Final = 0
MIDDLE: Final = 12
VELOCITY: Final = 15
SOLID: Final = 18
CLOUD: Final = 19
SCATTERS: Final = 20
FILLED: Final = 21
FIRST_BUNDLE: Final = 22
FIRST_TRIANGLE: Final = 23
"""Columns of `Space.body`: `Blockers.pose`; two vectors; the radius, m, of the sphere around what
blocks and around leaves, −1 for none; whether it scatters, and whether nothing turns back within
its panes; and numbers."""

PLATE_VELOCITY: Final = 15
IS_PANE: Final = 18
"""Columns of `Space.plate` beside those of `Blockers.plate`."""


class Space(NamedTuple):
    """All that tubes meet, in few arrays: a kernel takes every array as some eight words.

    ``bundle``, ``triangle`` as in `Bundles`, those of all bodies behind one another; ``body``
    ``(body, 24)``, columns `POSE` …; ``plate`` ``(plate, 19)``; ``room`` as in
    `Bundles`.
    """

    bundle: NDArray[np.float32]
    triangle: FloatArray
    body: FloatArray
    plate: FloatArray
    room: int


@lru_cache(maxsize=64)
def _bundles(surface: Surface, materials: tuple[str, ...]) -> Bundles:
    """Boxes of a surface's opaque faces and panes; media as numbers into ``materials``."""
    number = np.array([materials.index(name) for name in surface.materials], dtype=np.int64)
    opaque, pane = (number[surface.tree_medium[role]] for role in ("opaque", "pane"))
    return bundles_of((surface.trees["opaque"], surface.trees["pane"]), (opaque, -1 - pane))


@lru_cache(maxsize=4)
def _all_bundles(
    surfaces: tuple[Surface, ...], materials: tuple[str, ...]
) -> tuple[Bundles, FloatArray]:
    """Boxes of all surfaces behind one another, and where those of each begin, ``(body, 2)``."""
    kinds = tuple(dict.fromkeys(surfaces))
    found = [_bundles(surface, materials) for surface in kinds]
    begin = np.cumsum([[0, 0]] + [[len(p.bundle), len(p.triangle)] for p in found], axis=0)
    both = Bundles(
        np.concatenate([p.bundle for p in found]),
        np.concatenate([p.triangle for p in found]),
        max(p.room for p in found),
    )
    return both, begin[[kinds.index(surface) for surface in surfaces]].astype(np.float64)


def space_of(world: World, faces: Blockers) -> Space:
    """What tubes meet in a world of bodies, ``faces`` in the world's frame.

    Bodies farther from all radars than the longest path are left out.
    """
    bundles, begin = _all_bundles(world.surfaces, world.materials)
    gap = world.scene.radar_position[:, None] - world.centre
    away = np.min(np.linalg.norm(gap, axis=-1), axis=0) - world.radius
    is_near = away <= world.max_length
    has = {
        role: np.array([s.trees[role].face.size > 0 for s in world.surfaces]) & is_near
        for role in ("opaque", "pane", "cloud")
    }
    actors = world.scene.actors
    speeds = np.array([actors[actor].velocity for actor in world.plates.actor]).reshape(-1, 3)
    return Space(
        bundle=bundles.bundle,
        triangle=bundles.triangle,
        body=np.column_stack(
            [
                faces.pose,
                world.centre,
                world.velocity,
                np.where(has["opaque"] | has["pane"], world.radius, -1.0),
                np.where(has["cloud"], world.radius, -1.0),
                [scatters(world, body) for body in range(len(world.body))],
                [actors[actor].kind == "vehicle" for actor in world.body],
                begin,
            ]
        ),
        plate=np.column_stack([faces.plate, speeds, world.plate_is_pane]),
        room=bundles.room,
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _is_in_reach(
    body: FloatArray,
    b: int,
    radius: float,
    point: Vector,
    direction: Vector,
    span: tuple[float, float],
) -> bool:
    """Whether a ray meets a sphere around a body; none of a negative radius."""
    if radius < 0.0:
        return False
    c = vector_at(body, b, MIDDLE)
    gap = (c[0] - point[0], c[1] - point[1], c[2] - point[2])
    along = dot(gap, direction)
    room = radius * radius - dot(gap, gap) + along * along
    if room < 0.0:
        return False
    half = math.sqrt(room)
    return bool(along + half > span[0] and along - half < span[1])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _meet_plates(
    plate: FloatArray, point: Vector, direction: Vector, span: tuple[float, float]
) -> tuple[float, int]:
    """Distance and number of the first plate; ``span[1]`` and −1 for none."""
    best, found = span[1], -1
    for p in range(plate.shape[0]):
        n, c = vector_at(plate, p, NORMAL), vector_at(plate, p, CENTRE)
        gx, gy, gz = point[0] - c[0], point[1] - c[1], point[2] - c[2]
        height = n[0] * gx + n[1] * gy + n[2] * gz
        # most plates lie farther than what is known, or behind: no need to know where
        if abs(height) >= best:
            continue
        slope = n[0] * direction[0] + n[1] * direction[1] + n[2] * direction[2]
        if height * slope >= 0.0:
            continue
        t = -height / slope
        if not span[0] < t < best:
            continue
        gx, gy, gz = gx + t * direction[0], gy + t * direction[1], gz + t * direction[2]
        if not is_beside(plate, p, (gx, gy, gz)):
            best, found = t, p
    return best, found


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _into(body: FloatArray, b: int, start: Vector, way: Vector) -> tuple[Vector, Vector]:
    """A point and a direction in the frame of a body."""
    x, y, z = vector_at(body, b, POSE), vector_at(body, b, POSE + 3), vector_at(body, b, POSE + 6)
    shift = vector_at(body, b, POSE + 9)
    return (
        (dot(x, start) + shift[0], dot(y, start) + shift[1], dot(z, start) + shift[2]),
        (dot(x, way), dot(y, way), dot(z, way)),
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _middle(space: Space, b: int, point: Vector, direction: Vector) -> float:
    """How far along a ray it is nearest to the middle of a body, m."""
    c = vector_at(space.body, b, MIDDLE)
    return dot((c[0] - point[0], c[1] - point[1], c[2] - point[2]), direction)


@njit(cache=True, nogil=True, error_model="numpy")
def meet_body(
    space: Space,
    b: int,
    point: Vector,
    direction: Vector,
    span: tuple[float, float],
    waiting: NDArray[np.float32],
) -> Meeting:
    """What of a body a ray meets first; at an infinite distance for a miss.

    ``waiting``: room, `Space.room` numbers.
    """
    start, along = _into(space.body, b, point, direction)
    begin = int(space.body[b, FIRST_BUNDLE]), int(space.body[b, FIRST_TRIANGLE])
    distance, triangle = nearest_hit(
        space.bundle,
        space.triangle,
        begin,
        start,
        along,
        span,
        _middle(space, b, point, direction),
        CLOSEST,
        waiting,
    )
    triangle += begin[1]
    if distance == np.inf:
        return distance, NOTHING, b, triangle
    return distance, FACE if space.triangle[triangle, MEDIUM_OF] >= 0.0 else PANE, b, triangle


@njit(cache=True, nogil=True, error_model="numpy")
def meet(
    space: Space,
    point: Vector,
    direction: Vector,
    nearest: float,
    known: Meeting,
    home: int,
    waiting: NDArray[np.float32],
) -> Meeting:
    """What a ray meets first beyond ``nearest`` m, if not what is known of body ``home``.

    Where nothing is known, that body, which the ray leaves, is looked at first; −1: there is none.
    """
    best, kind, number, triangle = known
    if kind == NOTHING and home >= 0:
        best, kind, number, triangle = meet_body(
            space, home, point, direction, (nearest, best), waiting
        )
    distance, plate = _meet_plates(space.plate, point, direction, (nearest, best))
    if plate >= 0:
        best, kind, number, triangle = distance, PLATE, plate, 0
    for b in range(space.body.shape[0]):
        radius = space.body[b, SOLID]
        span = (nearest, best)
        if b == home or not _is_in_reach(space.body, b, radius, point, direction, span):
            continue
        found = meet_body(space, b, point, direction, span, waiting)
        if found[0] < best:
            best, kind, number, triangle = found
    return best, kind, number, triangle


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def is_near_leaves(space: Space, point: Vector, direction: Vector, distance: float) -> bool:
    """Whether a ray comes near a cloud of leaves on the way to what it meets."""
    for b in range(space.body.shape[0]):
        radius = space.body[b, CLOUD]
        if _is_in_reach(space.body, b, radius, point, direction, (0.0, distance)):
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def fade(
    faces: Blockers, media: Media, body: FloatArray, point: Vector, d: Vector, distance: float
) -> float:
    """What clouds of leaves leave of the amplitude on the way to what a ray meets."""
    loss = 0.0
    way = (distance * d[0], distance * d[1], distance * d[2])
    for b in range(body.shape[0]):
        if _is_in_reach(body, b, body[b, CLOUD], point, d, (0.0, distance)):
            start, along = into_body(faces, b, point, way)
            share, triangle = chord(faces, b, start, along, (0.0, 1.0))
            if share > 0.0:
                loss += media.attenuation[faces.medium[triangle]] * share * distance
    return math.exp(-0.5 * loss)


@njit(cache=True, nogil=True, error_model="numpy")
def surface_of(space: Space, met: Meeting) -> tuple[Vector, int, Vector]:
    """Normal, medium and velocity of what was met."""
    number = met[2]
    if met[1] == PLATE:
        return (
            vector_at(space.plate, number, NORMAL),
            int(space.plate[number, MEDIUM]),
            vector_at(space.plate, number, PLATE_VELOCITY),
        )
    triangle, body = space.triangle, space.body
    u, v = vector_at(triangle, met[3], 3), vector_at(triangle, met[3], 6)
    n = cross(u, v)
    size = math.sqrt(dot(n, n))
    medium = int(triangle[met[3], MEDIUM_OF])
    normal = (
        (body[number, 0] * n[0] + body[number, 3] * n[1] + body[number, 6] * n[2]) / size,
        (body[number, 1] * n[0] + body[number, 4] * n[1] + body[number, 7] * n[2]) / size,
        (body[number, 2] * n[0] + body[number, 5] * n[1] + body[number, 8] * n[2]) / size,
    )
    return normal, medium if medium >= 0 else -1 - medium, vector_at(body, number, VELOCITY)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def is_in_front(space: Space, met: Meeting, direction: Vector) -> bool:
    """Whether a ray meets a body's face from the side of its normal."""
    body, b = space.body, met[2]
    along = (
        dot(vector_at(body, b, POSE), direction),
        dot(vector_at(body, b, POSE + 3), direction),
        dot(vector_at(body, b, POSE + 6), direction),
    )
    n = cross(vector_at(space.triangle, met[3], 3), vector_at(space.triangle, met[3], 6))
    return bool(dot(n, along) < 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def is_behind(
    space: Space,
    hider: int,
    body: int,
    point: Vector,
    direction: Vector,
    waiting: NDArray[np.float32],
) -> bool:
    """Whether a body hides all of the sphere around another from a new ray."""
    c = vector_at(space.body, body, MIDDLE)
    away = (c[0] - point[0], c[1] - point[1], c[2] - point[2])
    near = math.sqrt(dot(away, away)) - space.body[body, SOLID]
    if near <= SKIN:
        return False
    return _is_hit(space, hider, point, direction, (SKIN, near), OPAQUE, waiting)


@njit(cache=True, nogil=True, error_model="numpy")
def _is_hit(
    space: Space,
    b: int,
    point: Vector,
    direction: Vector,
    span: tuple[float, float],
    wanted: int,
    waiting: NDArray[np.float32],
) -> bool:
    """Whether a ray meets anything `OPAQUE`, or any `SHEET`, of a body."""
    if not _is_in_reach(space.body, b, space.body[b, SOLID], point, direction, span):
        return False
    start, along = _into(space.body, b, point, direction)
    begin = int(space.body[b, FIRST_BUNDLE]), int(space.body[b, FIRST_TRIANGLE])
    middle = _middle(space, b, point, direction)
    found = nearest_hit(
        space.bundle, space.triangle, begin, start, along, span, middle, wanted, waiting
    )
    return found[0] < np.inf


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _heading(start: Vector, end: Vector) -> tuple[Vector, float]:
    """Unit vector and length of a leg, m; at least a hair's breadth."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = max(math.sqrt(dot(way, way)), 1e-12)
    return (way[0] / length, way[1] / length, way[2] / length), length


@njit(cache=True, nogil=True, error_model="numpy")
def is_hidden(
    space: Space,
    bodies: IntArray,
    plates: IntArray,
    start: Vector,
    end: Vector,
    waiting: NDArray[np.float32],
) -> bool:
    """What `occlusion.is_blocked` says of the leg from a radar to a point."""
    direction, length = _heading(start, end)
    span, way = (SKIN, length), (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    if length <= SKIN:
        return False
    for p in plates:
        if crosses_plate(space.plate, p, start, way, SKIN / length):
            return True
    for b in bodies:  # noqa: SIM110 (compiled code knows no generators)
        if _is_hit(space, b, start, direction, span, OPAQUE, waiting):
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def find_veils(
    space: Space,
    bodies: IntArray,
    start: Vector,
    end: Vector,
    waiting: NDArray[np.float32],
    found: IntArray,
) -> int:
    """Fill ``found`` with the bodies that veil the leg from a radar to a point; how many do.

    Those whose sheets are on it, and those whose leaves may be, in their order.
    """
    direction, length = _heading(start, end)
    span, size = (SKIN, length), 0
    for b in bodies:
        leaves = space.body[b, CLOUD]
        if _is_in_reach(space.body, b, leaves, start, direction, span) or _is_hit(
            space, b, start, direction, span, SHEET, waiting
        ):
            found[size] = b
            size += 1
    return size
