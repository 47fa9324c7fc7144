"""Intersections of rays with the scene: opaque faces, thin sheets, plates, clouds of leaves."""

import math
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, plus, row, vector, vector_at
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
from polychirp.channel.ray_tubes.curved_facets import (
    HEIGHTS,
    IS_CURVED,
    NORMALS,
    curved_facets,
    shares_of,
    slopes_of,
)
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
from polychirp.channel.scene.world import RADAR_CLEARANCE, Role, Surface, World
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


class Bend(NamedTuple):
    """Curvature of a surface: where its normal is n, a step s along it turns n.

    The change of n is ``turn_u`` (``slope_u`` · s) + ``turn_v`` (``slope_v`` · s), without its part
    along n. The turns have no unit, the slopes are in 1/m.
    """

    turn_u: Vector
    slope_u: Vector
    turn_v: Vector
    slope_v: Vector


class Contact(NamedTuple):
    """A point at which a ray meets a surface.

    ``point`` is in the world, m; ``distance`` is the ray's length to it, m; ``normal``, ``medium``
    (a number), ``velocity``, m/s, ``yaw_rate``, rad/s, and ``part``, a number or `NO_PART`, are
    those of the surface. ``facet`` is the normal of the flat facet that stands for the surface,
    above which ``point`` lies by ``height``, m; ``bend`` is as in `Bend`, and ``is_curved`` tells
    whether it is other than `NO_BEND`.
    """

    point: Vector
    distance: float
    normal: Vector
    medium: int
    velocity: Vector
    yaw_rate: float
    part: int
    facet: Vector
    height: float
    is_curved: bool
    bend: Bend


NO_BEND: Final = Bend((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
"""The `Bend` of a flat surface."""

LEAST_COSINE: Final = 0.1
"""Least cosine of incidence with which a contact is shifted to the curved surface. Chosen: at less
the ray runs along the surface, past many facets."""

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
    ``curve`` ``(triangle, column)``, as `curved_facets` gives it;
    ``body`` ``(body,)`` of type `BODY`; ``plate`` as in `Blockers`, with ``plate_velocity`` m/s
    ``(plate, xyz)`` and ``plate_is_pane`` ``(plate,)``, true for thin sheets; ``room``:
    `Bundles.stack_size`.
    """

    bundle: NDArray[np.float32]
    triangle: FloatArray
    part: IntArray
    curve: FloatArray
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


def _faces(surface: Surface, role: Role) -> IntArray:
    """Numbers of the faces that are a surface's triangles of one role, in its tree's order."""
    is_mine = np.isin(surface.medium, surface.tree_medium[role])
    return np.asarray(np.flatnonzero(is_mine)[surface.trees[role].face])


@lru_cache(maxsize=64)
def _shapes(surface: Surface) -> tuple[IntArray, FloatArray]:
    """Flat part, or `NO_PART`, and `curved_facets` of each triangle of a surface's `_bundles`."""
    opaque, pane = _faces(surface, "opaque"), _faces(surface, "pane")
    part = flat_parts_of(surface).of_face[opaque]
    curve = curved_facets(surface)[np.concatenate([opaque, pane])]
    return np.concatenate([part, np.full(len(pane), NO_PART)]), curve


@lru_cache(maxsize=4)
def _all_bundles(
    surfaces: tuple[Surface, ...], materials: tuple[str, ...]
) -> tuple[Bundles, IntArray, FloatArray, IntArray]:
    """Search trees of all surfaces, the `_shapes` of their triangles, and where each body begins.

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
    part, curve = (
        np.concatenate(columns)
        for columns in zip(*[_shapes(surface) for surface in kinds], strict=True)
    )
    return both, part, curve, begin[[kinds.index(surface) for surface in surfaces]]


def space_of(world: World, faces: Blockers) -> Space:
    """The surfaces of a world that ray tubes meet; ``faces`` has the bodies' poses and the plates.

    Bodies farther from all radars than the longest path are marked as neither solid nor leafy.
    """
    bundles, part, curve, begin = _all_bundles(world.surfaces, world.materials)
    actors = world.scene.actors
    speeds = np.array([actors[actor].velocity for actor in world.plates.actor]).reshape(-1, 3)
    return Space(
        bundle=bundles.bundle,
        triangle=bundles.triangle,
        part=part,
        curve=curve,
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
def into_frame(body: np.void, point: Vector) -> Vector:
    """A point of the world in a body's frame, m."""
    r, shift = body["rotation"], vector(body["shift"])
    return (
        dot(row(r, 0), point) + shift[0],
        dot(row(r, 1), point) + shift[1],
        dot(row(r, 2), point) + shift[2],
    )


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
    c = vector(body["centre"])
    begin = body["first_row"], body["first_triangle"]
    ray = SearchRay(
        into_frame(body, point),
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


@inlined
def _outward(body: np.void, a: Vector) -> Vector:
    """A vector of a body's frame in the world."""
    r = body["rotation"]
    return (
        r[0, 0] * a[0] + r[1, 0] * a[1] + r[2, 0] * a[2],
        r[0, 1] * a[0] + r[1, 1] * a[1] + r[2, 1] * a[2],
        r[0, 2] * a[0] + r[1, 2] * a[1] + r[2, 2] * a[2],
    )


@inlined
def flat_contact(
    point: Vector,
    distance: float,
    normal: Vector,
    medium: int,
    velocity: Vector,
    yaw_rate: float,
    part: int,
) -> Contact:
    """A contact with a flat surface."""
    return Contact(
        point, distance, normal, medium, velocity, yaw_rate, part, normal, 0.0, False, NO_BEND
    )


@inner
def contact(space: Space, start: Vector, direction: Vector, met: Intersection) -> Contact:
    """The surface at the intersection ``met`` of a ray from ``start``."""
    number = met.number
    point = plus(start, direction, met.distance)
    if met.kind == PLATE:
        normal, medium = (
            vector_at(space.plate, number, PLATE_NORMAL),
            int(space.plate[number, PLATE_MEDIUM]),
        )
        speed = row(space.plate_velocity, number)
        return flat_contact(point, met.distance, normal, medium, speed, 0.0, NO_PART)
    body, part = space.body[number], int(space.part[met.triangle])
    n = _unscaled_normal(space, met.triangle)
    size = math.sqrt(dot(n, n))
    normal = _outward(body, (n[0] / size, n[1] / size, n[2] / size))
    medium = int(space.triangle[met.triangle, TRIANGLE_MEDIUM])
    yaw_rate = float(body["yaw_rate"])
    speed = velocity_there(vector(body["velocity"]), yaw_rate, point)
    flat = flat_contact(point, met.distance, normal, medium, speed, yaw_rate, part)
    if space.curve[met.triangle, IS_CURVED] == 0.0:
        return flat
    return _curved(space, flat, direction, met)


@inlined
def _curved(space: Space, flat: Contact, direction: Vector, met: Intersection) -> Contact:
    """The contact with the curved surface for which the facet of the contact ``flat`` stands."""
    body, curve = space.body[met.number], space.curve[met.triangle]
    v, w = shares_of(space.triangle, met.triangle, into_frame(body, flat.point))
    u = 1.0 - v - w
    height = u * v * curve[HEIGHTS] + u * w * curve[HEIGHTS + 1] + v * w * curve[HEIGHTS + 2]
    a, b, c = (
        vector(curve[NORMALS : NORMALS + 3]),
        vector(curve[NORMALS + 3 : NORMALS + 6]),
        vector(curve[NORMALS + 6 : NORMALS + 9]),
    )
    n = (
        u * a[0] + v * b[0] + w * c[0],
        u * a[1] + v * b[1] + w * c[1],
        u * a[2] + v * b[2] + w * c[2],
    )
    size = math.sqrt(dot(n, n))
    turn_u = ((b[0] - a[0]) / size, (b[1] - a[1]) / size, (b[2] - a[2]) / size)
    turn_v = ((c[0] - a[0]) / size, (c[1] - a[1]) / size, (c[2] - a[2]) / size)
    slope_u, slope_v = slopes_of(space.triangle, met.triangle)
    # a ray that comes from in front meets what rises above the facet earlier
    cosine = dot(direction, flat.facet)
    if abs(cosine) < LEAST_COSINE:
        cosine = math.copysign(LEAST_COSINE, cosine)
    shift = height / cosine
    return Contact(
        plus(flat.point, direction, shift),
        flat.distance + shift,
        _outward(body, (n[0] / size, n[1] / size, n[2] / size)),
        flat.medium,
        flat.velocity,
        flat.yaw_rate,
        flat.part,
        flat.facet,
        height,
        True,
        Bend(
            _outward(body, turn_u),
            _outward(body, slope_u),
            _outward(body, turn_v),
            _outward(body, slope_v),
        ),
    )


@inlined
def turned_over(at: Contact) -> Contact:
    """A contact as seen from the other side of the surface."""
    n, f, bend = at.normal, at.facet, at.bend
    return Contact(
        at.point,
        at.distance,
        (-n[0], -n[1], -n[2]),
        at.medium,
        at.velocity,
        at.yaw_rate,
        at.part,
        (-f[0], -f[1], -f[2]),
        -at.height,
        at.is_curved,
        Bend(
            (-bend.turn_u[0], -bend.turn_u[1], -bend.turn_u[2]),
            bend.slope_u,
            (-bend.turn_v[0], -bend.turn_v[1], -bend.turn_v[2]),
            bend.slope_v,
        ),
    )


@inlined
def turn_of_normal(at: Contact, step: Vector, direction: Vector) -> Vector:
    """Change of a surface's normal over a step along it, m.

    ``direction`` is that of the ray, along which the step is seen on the facet.
    """
    flat = plus(step, direction, -dot(step, at.facet) / dot(direction, at.facet))
    u, v = dot(at.bend.slope_u, flat), dot(at.bend.slope_v, flat)
    one, other, n = at.bend.turn_u, at.bend.turn_v, at.normal
    turn = (
        u * one[0] + v * other[0],
        u * one[1] + v * other[1],
        u * one[2] + v * other[2],
    )
    return plus(turn, n, -dot(turn, n))


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
