"""Intersections of rays with the scene: opaque faces, thin sheets, plates, clouds of leaves."""

import math
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, row, vector, vector_at
from polychirp.channel.geometry.wide_bvh import (
    EITHER_KIND,
    OPAQUE_KIND,
    SHEET_KIND,
    TRIANGLE_KIND,
    TRIANGLE_MEDIUM,
    Bundles,
    SearchRay,
    bundles_of,
    nearest_hit,
)
from polychirp.channel.materials.fresnel import Media
from polychirp.channel.physical_optics.paths import scatters
from polychirp.channel.ray_tubes.flat_parts import NO_PART, flat_parts_of
from polychirp.channel.scene.blockers import (
    PLATE_CENTRE,
    PLATE_MEDIUM,
    PLATE_NORMAL,
    Blockers,
    into_body,
    is_beside,
)
from polychirp.channel.scene.transmission import chord
from polychirp.channel.scene.world import RADAR_CLEARANCE, Surface, World
from polychirp.jit import inlined, inner

NO_SURFACE, FACE, PANE, PLATE = 0, 1, 2, 3
"""Kinds of `Intersection`: none; opaque face of a body; thin sheet of a body; plate."""

Notes = NDArray[np.float32]
"""Working memory of `nearest_hit`: `Space.room` numbers."""

Span = tuple[float, float]
"""Least and greatest distance along a ray, m, between which hits count."""

NO_BODY: Final = -1
"""Number that stands for no body where a ray does not start on a body."""


class Intersection(NamedTuple):
    """A surface that a ray meets, at a ``distance`` along the ray, m, infinite if it meets none.

    ``kind`` is `NO_SURFACE`, `FACE`, `PANE` or `PLATE`; ``number`` is a row of `Space.body` or
    `Space.plate`; ``triangle`` is a row of `Space.triangle` if the surface is a body's.
    """

    distance: float
    kind: int
    number: int
    triangle: int


NO_INTERSECTION: Final = Intersection(np.inf, NO_SURFACE, 0, 0)
"""The `Intersection` of a ray that meets no surface."""


class Contact(NamedTuple):
    """A point at which a ray meets a surface.

    ``point`` is in the world, m; ``distance`` is the ray's length to it, m; ``normal``, ``medium``
    (a number), ``velocity``, m/s, and ``part``, a number or `NO_PART`, are those of the surface.
    """

    point: Vector
    distance: float
    normal: Vector
    medium: int
    velocity: Vector
    part: int


BODY: Final = np.dtype(
    [
        ("rotation", np.float64, (3, 3)),  # takes a vector of the world to the body's frame
        ("shift", np.float64, 3),  # m, added to a point after the rotation
        ("centre", np.float64, 3),  # of the sphere around the body, m, in the world
        ("velocity", np.float64, 3),  # m/s, of the body's matter as if at the world's origin
        ("yaw_rate", np.float64),  # rad/s
        ("radius", np.float64),  # of the sphere around the body, m
        ("first_row", np.int64),  # where the body begins in `Space.bundle`
        ("first_triangle", np.int64),  # where the body begins in `Space.triangle`
        ("is_solid", np.bool_),  # has faces or sheets, and is within the longest path
        ("has_leaves", np.bool_),  # has leaves, and is within the longest path
        ("scatters", np.bool_),  # its faces reflect; other bodies only block
        ("is_vehicle", np.bool_),  # its thin sheets reflect on their outer side only
    ],
    align=True,
)
"""Record of a body, as the compiled functions take it."""


class Space(NamedTuple):
    """All surfaces that ray tubes meet, in few arrays, as each costs time in compiled calls.

    ``bundle``, ``triangle`` as in `Bundles`, those of all bodies one after another; ``part``
    ``(triangle,)``, the number of each triangle's flat part among its body's, or `NO_PART`;
    ``body`` ``(body,)`` of type `BODY`; ``plate`` as in `Blockers`, with ``plate_velocity`` m/s
    ``(plate, xyz)`` and ``plate_is_pane`` ``(plate,)``, true for thin sheets; ``room``:
    `Bundles.stack_size`.
    """

    bundle: NDArray[np.float32]
    triangle: FloatArray
    part: IntArray
    body: NDArray[np.void]
    plate: FloatArray
    plate_velocity: FloatArray
    plate_is_pane: BoolArray
    room: int


@lru_cache(maxsize=64)
def _bundles(surface: Surface, materials: tuple[str, ...]) -> Bundles:
    """Search tree of a surface's opaque faces and panes; media are indices of ``materials``."""
    number = np.array([materials.index(name) for name in surface.materials], dtype=np.int64)
    opaque, pane = (number[surface.tree_medium[role]] for role in ("opaque", "pane"))
    return bundles_of(
        (surface.trees["opaque"], surface.trees["pane"]), (opaque, pane), (OPAQUE_KIND, SHEET_KIND)
    )


@lru_cache(maxsize=64)
def _parts(surface: Surface) -> IntArray:
    """Flat part, or `NO_PART`, of each triangle of a surface's `_bundles`."""
    opaque, pane = surface.trees["opaque"], surface.trees["pane"]
    is_opaque = np.isin(surface.medium, surface.tree_medium["opaque"])
    of_face = flat_parts_of(surface).of_face[is_opaque]
    return np.concatenate([of_face[opaque.face], np.full(len(pane.face), NO_PART)])


@lru_cache(maxsize=4)
def _all_bundles(
    surfaces: tuple[Surface, ...], materials: tuple[str, ...]
) -> tuple[Bundles, IntArray, IntArray]:
    """Search trees of all surfaces, the flat parts of their triangles, and where each body begins.

    It begins at a bundle and a triangle, ``(body, 2)``.
    """
    kinds = tuple(dict.fromkeys(surfaces))
    found = [_bundles(surface, materials) for surface in kinds]
    begin = np.cumsum([[0, 0]] + [[len(p.bundle), len(p.triangle)] for p in found], axis=0)
    both = Bundles(
        np.concatenate([p.bundle for p in found]),
        np.concatenate([p.triangle for p in found]),
        max(p.stack_size for p in found),
    )
    part = np.concatenate([_parts(surface) for surface in kinds])
    return both, part, begin[[kinds.index(surface) for surface in surfaces]]


def space_of(world: World, faces: Blockers) -> Space:
    """The surfaces of a world that ray tubes meet; ``faces`` has the bodies' poses and the plates.

    Bodies farther from all radars than the longest path are marked as neither solid nor leafy.
    """
    bundles, part, begin = _all_bundles(world.surfaces, world.materials)
    actors = world.scene.actors
    speeds = np.array([actors[actor].velocity for actor in world.plates.actor]).reshape(-1, 3)
    return Space(
        bundle=bundles.bundle,
        triangle=bundles.triangle,
        part=part,
        body=_body_table(world, faces, begin),
        plate=faces.plate,
        plate_velocity=speeds,
        plate_is_pane=world.plate_is_pane,
        room=bundles.stack_size,
    )


def _body_table(world: World, faces: Blockers, begin: IntArray) -> NDArray[np.void]:
    """The bodies of a world, ``(body,)`` of type `BODY`."""
    gap = world.scene.radar_position[:, None] - world.centre
    away = np.min(np.linalg.norm(gap, axis=-1), axis=0) - world.radius
    is_near = away <= world.max_length
    has = {
        role: np.array([s.trees[role].face.size > 0 for s in world.surfaces]) & is_near
        for role in ("opaque", "pane", "cloud")
    }
    columns: dict[str, Any] = {
        "rotation": faces.pose[:, :9].reshape(-1, 3, 3),
        "shift": faces.pose[:, 9:],
        "centre": world.centre,
        "velocity": world.velocity_at(np.arange(len(world.body)), np.zeros(3)),
        "yaw_rate": world.yaw_rate,
        "radius": world.radius,
        "first_row": begin[:, 0],
        "first_triangle": begin[:, 1],
        "is_solid": has["opaque"] | has["pane"],
        "has_leaves": has["cloud"],
        "scatters": [scatters(world, body) for body in range(len(world.body))],
        "is_vehicle": [world.scene.actors[actor].kind == "vehicle" for actor in world.body],
    }
    table = np.zeros(len(world.body), dtype=BODY)
    for name, values in columns.items():
        table[name] = values
    return table


@inlined
def is_in_reach(body: np.void, point: Vector, direction: Vector, span: Span) -> bool:
    """True if a ray meets the sphere around a body within ``span``."""
    c, radius = vector(body["centre"]), body["radius"]
    gap = (c[0] - point[0], c[1] - point[1], c[2] - point[2])
    along = dot(gap, direction)
    room = radius * radius - dot(gap, gap) + along * along
    if room < 0.0:
        return False
    half = math.sqrt(room)
    return bool(along + half > span[0] and along - half < span[1])


@inlined
def _meet_plates(plate: FloatArray, point: Vector, direction: Vector, span: Span) -> Intersection:
    """First intersection with a plate within a span."""
    best, found = span[1], NO_INTERSECTION
    for p in range(plate.shape[0]):
        n, c = vector_at(plate, p, PLATE_NORMAL), vector_at(plate, p, PLATE_CENTRE)
        gx, gy, gz = point[0] - c[0], point[1] - c[1], point[2] - c[2]
        height = n[0] * gx + n[1] * gy + n[2] * gz
        # most plates are farther than ``best``, or behind the ray: they need no test of borders
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
            best, found = t, Intersection(t, PLATE, p, 0)
    return found


@inlined
def _nearest_of_body(
    space: Space, b: int, point: Vector, direction: Vector, span: Span, wanted: int, notes: Notes
) -> tuple[float, int]:
    """Distance of the nearest hit on body ``b``, m, and the row of `Space.triangle` that is hit."""
    body = space.body[b]
    x, y, z = row(body["rotation"], 0), row(body["rotation"], 1), row(body["rotation"], 2)
    c, shift = vector(body["centre"]), vector(body["shift"])
    begin = body["first_row"], body["first_triangle"]
    ray = SearchRay(
        (dot(x, point) + shift[0], dot(y, point) + shift[1], dot(z, point) + shift[2]),
        (dot(x, direction), dot(y, direction), dot(z, direction)),
        span,
        dot((c[0] - point[0], c[1] - point[1], c[2] - point[2]), direction),
    )
    bundles = Bundles(space.bundle, space.triangle, space.room)
    distance, triangle = nearest_hit(bundles, begin, ray, wanted, notes)
    return distance, triangle + begin[1]


@inner
def meet_body(
    space: Space, b: int, point: Vector, direction: Vector, span: Span, notes: Notes
) -> Intersection:
    """First intersection of a ray with body ``b`` within ``span``."""
    distance, triangle = _nearest_of_body(space, b, point, direction, span, EITHER_KIND, notes)
    if distance == np.inf:
        return NO_INTERSECTION
    is_pane = space.triangle[triangle, TRIANGLE_KIND] == SHEET_KIND
    kind = PANE if is_pane else FACE
    return Intersection(distance, kind, b, triangle)


@inner
def meet(
    space: Space,
    point: Vector,
    direction: Vector,
    nearest: float,
    known: Intersection,
    home: int,
    notes: Notes,
) -> Intersection:
    """First intersection of a ray beyond ``nearest`` m.

    ``known`` is the ray's intersection with the body ``home``, or `NO_INTERSECTION` if it has not
    been searched. ``home``, from which the ray starts, or `NO_BODY`, is then searched first.
    """
    best = known
    if best.kind == NO_SURFACE and home != NO_BODY:
        best = meet_body(space, home, point, direction, (nearest, best.distance), notes)
    found = _meet_plates(space.plate, point, direction, (nearest, best.distance))
    if found.kind == PLATE:
        best = found
    for b in range(space.body.size):
        span = (nearest, best.distance)
        if b == home or not space.body[b]["is_solid"]:
            continue
        if is_in_reach(space.body[b], point, direction, span):
            found = meet_body(space, b, point, direction, span, notes)
            if found.distance < best.distance:
                best = found
    return best


@inlined
def is_sheet(space: Space, met: Intersection) -> bool:
    """True if an intersection is with a thin sheet, be it of a body or a plate."""
    return bool(met.kind == PANE or (met.kind == PLATE and space.plate_is_pane[met.number]))


@inlined
def is_near_leaves(space: Space, point: Vector, direction: Vector, distance: float) -> bool:
    """True if a ray meets the sphere around a body with leaves within ``distance`` m."""
    for b in range(space.body.size):
        body = space.body[b]
        if body["has_leaves"] and is_in_reach(body, point, direction, (0.0, distance)):
            return True
    return False


@inner
def fade(
    space: Space, faces: Blockers, media: Media, point: Vector, d: Vector, distance: float
) -> float:
    """Factor, 0 to 1, by which leaves reduce a ray's amplitude along ``distance`` m."""
    loss = 0.0
    way = (distance * d[0], distance * d[1], distance * d[2])
    for b in range(space.body.size):
        body = space.body[b]
        if body["has_leaves"] and is_in_reach(body, point, d, (0.0, distance)):
            start, along = into_body(faces, b, point, way)
            share, triangle = chord(faces, b, start, along, (0.0, 1.0))
            if share > 0.0:
                loss += media.attenuation[faces.medium[triangle]] * share * distance
    return math.exp(-0.5 * loss)


@inlined
def _unscaled_normal(space: Space, triangle: int) -> Vector:
    """Normal of a triangle in its body's frame, as long as twice the triangle's area."""
    return cross(vector_at(space.triangle, triangle, 3), vector_at(space.triangle, triangle, 6))


@inlined
def velocity_there(at_origin: Vector, yaw_rate: float, point: Vector) -> Vector:
    """Velocity, m/s, of a turning body's matter at a point, m, given that at the world's origin."""
    x, y, z = at_origin
    return (x - yaw_rate * point[1], y + yaw_rate * point[0], z)


@inner
def contact(space: Space, point: Vector, met: Intersection) -> Contact:
    """The surface at the intersection ``met``, which is at ``point``."""
    number = met.number
    if met.kind == PLATE:
        return Contact(
            point,
            met.distance,
            vector_at(space.plate, number, PLATE_NORMAL),
            int(space.plate[number, PLATE_MEDIUM]),
            row(space.plate_velocity, number),
            NO_PART,
        )
    n, r = _unscaled_normal(space, met.triangle), space.body[number]["rotation"]
    size = math.sqrt(dot(n, n))
    normal = (
        (r[0, 0] * n[0] + r[1, 0] * n[1] + r[2, 0] * n[2]) / size,
        (r[0, 1] * n[0] + r[1, 1] * n[1] + r[2, 1] * n[2]) / size,
        (r[0, 2] * n[0] + r[1, 2] * n[1] + r[2, 2] * n[2]) / size,
    )
    medium = int(space.triangle[met.triangle, TRIANGLE_MEDIUM])
    body, part = space.body[number], int(space.part[met.triangle])
    speed = velocity_there(vector(body["velocity"]), body["yaw_rate"], point)
    return Contact(point, met.distance, normal, medium, speed, part)


@inlined
def is_in_front(space: Space, met: Intersection, direction: Vector) -> bool:
    """True if a ray meets a body's face from the side of its normal."""
    rotation = space.body[met.number]["rotation"]
    x, y, z = row(rotation, 0), row(rotation, 1), row(rotation, 2)
    along = (dot(x, direction), dot(y, direction), dot(z, direction))
    return bool(dot(_unscaled_normal(space, met.triangle), along) < 0.0)


@inner
def is_behind(
    space: Space, hider: int, body: int, point: Vector, direction: Vector, notes: Notes
) -> bool:
    """True if ``hider`` blocks a ray from a radar before the sphere around ``body`` begins."""
    c = vector(space.body[body]["centre"])
    away = (c[0] - point[0], c[1] - point[1], c[2] - point[2])
    near = math.sqrt(dot(away, away)) - space.body[body]["radius"]
    if near <= RADAR_CLEARANCE:
        return False
    return is_hit(space, hider, point, direction, (RADAR_CLEARANCE, near), OPAQUE_KIND, notes)


@inner
def is_hit(
    space: Space, b: int, point: Vector, direction: Vector, span: Span, wanted: int, notes: Notes
) -> bool:
    """True if a ray meets a face of kind ``wanted`` of body ``b`` within ``span``."""
    body = space.body[b]
    if not (body["is_solid"] and is_in_reach(body, point, direction, span)):
        return False
    return _nearest_of_body(space, b, point, direction, span, wanted, notes)[0] < np.inf
