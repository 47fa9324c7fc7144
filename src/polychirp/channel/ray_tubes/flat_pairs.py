r"""Waves over two flat parts of different bodies: a window of the first, the currents of the last.

Tubes take the shadow of the first part on the last one for sharp. That shadow is blurred over a
Fresnel zone, √(λx) over a distance x, and what two plates return off the specular direction comes
from there. So the hits of tubes that one flat part reflected and that end on another are replaced
by hits at the middles of small cells of all of the last part, lit by the image of the transmitter
in the first part, times W of `fresnel_window`. Everything else is as for tubes: the currents
radiate to every receiver, and a path is the mean of both ways round.

**Which pairs.** The parts are those of `flat_parts`, of two bodies, and do not touch: at a common
edge the wave of one part goes on in the other. Legs that pass a sheet are left to the tubes.
Most of a vehicle's small parts are hidden; of 54,000 pairs in a street of eight fitted vehicles, 61
pass a wave on. So only pairs are tried whose first part the transmitter sees, and whose last part a
receiver sees (`seen_parts`).

**Length and directions.** Where the last part is in the shadow of the first, the wave comes from
the point of the first that is nearest to the specular one. The delay, its rate, the direction of
departure, and the tests for obstacles are those of the way over this point.
"""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, row, vector
from polychirp.channel.materials.fresnel import Media
from polychirp.channel.physical_optics.facet_integral import phasor
from polychirp.channel.physical_optics.kernels import SHADOW_RAY_LIFT, any_normal_to
from polychirp.channel.ray_tubes.fields import mirrored_by, ray_along, reflected
from polychirp.channel.ray_tubes.flat_parts import LEAST_GAP, NO_PART, FlatPart
from polychirp.channel.ray_tubes.fresnel_window import window
from polychirp.channel.ray_tubes.intersections import (
    NO_BODY,
    NO_INTERSECTION,
    Notes,
    Space,
    fade,
    flat_contact,
    is_near_leaves,
    meet,
    velocity_there,
)
from polychirp.channel.ray_tubes.radiation import HIT, Hits, put, record
from polychirp.channel.scene.blockers import Blockers
from polychirp.channel.scene.occlusion import blocked
from polychirp.channel.scene.world import RADAR_CLEARANCE, World
from polychirp.jit import compiled, inlined, inner
from polychirp.threads import in_ranges

WIDEST_STEP: Final = 0.0125
"""Greatest side, m, of the parallelograms that the facets of the last part are cut into. Chosen:
1.5° off the specular direction, plates of 0.12 to 0.25 m are then right to 0.07 dB in the median
and 0.5 dB at worst. Half as much takes four times as long; twice as much is worse by some dB."""

LEAST_SHARE: Final = 0.01
"""Least |W| with which a cell is computed. Chosen: −40 dB of a mirror's wave."""

SHADOW_SHARE: Final = 0.5
"""Bound of |W| times the distance from the part's border in units of (u, v), in its shadow. A
straight edge has 1/(π√2) = 0.23; two parallel edges have twice that at most."""

CLEAR_MARGIN: Final = 1e-4
"""Distance, m, from the end of a leg within which a hit is taken as the surface where it ends."""

MIN_COSINE: Final = 1e-3
"""Least cosine of incidence on the first part: at less, the specular point is too far away."""

MIN_LEG: Final = 1e-6
"""Distance, m, behind a reflection at which the search for obstacles begins, as `MIN_STEP`."""


class PlacedPart(NamedTuple):
    """A flat part in the world.

    ``velocity`` m/s ``(xyz,)`` is that of its body's matter as if at the world's origin, and
    ``yaw_rate`` its body's, rad/s; ``roughness`` is its rms height, m; ``body`` and ``number``,
    among the body's parts, say which it is.
    """

    shape: FlatPart
    velocity: FloatArray
    yaw_rate: float
    roughness: float
    body: int
    number: int


class Transmitter(NamedTuple):
    """A transmitter at ``origin``, m, that moves with ``velocity``, m/s, ``(xyz,)``."""

    origin: FloatArray
    velocity: FloatArray


class Surroundings(NamedTuple):
    """Everything around both parts, as `propagation` takes it; ``wavenumber`` is in 1/m."""

    space: Space
    faces: Blockers
    media: Media
    wavenumber: float


def lit_hits(
    source: Transmitter, first: PlacedPart, last: PlacedPart, around: Surroundings, least: float
) -> Hits:
    """Hits on ``last`` of a transmitter's wave by way of ``first``, with |W| from ``least`` on."""
    side = np.linalg.norm(last.shape.corner - np.roll(last.shape.corner, 1, axis=1), axis=-1)
    # the longest side of a facet is the diagonal of two others
    longest = np.max(side, axis=1) * math.sqrt(0.5)
    count = np.ceil(longest / WIDEST_STEP - 1e-6).astype(np.int64)
    end = np.cumsum(count * (count + 1) // 2)
    hits = np.empty(int(end[-1]), dtype=HIT)
    is_lit = np.zeros(len(hits), dtype=np.bool_)
    cells = np.stack([count, np.concatenate([[0], end[:-1]])], axis=1)
    in_ranges(_light, len(count), source, first, last, around, least, cells, hits, is_lit)
    return hits.take(np.flatnonzero(is_lit))


@compiled
def _light(
    begin: int,
    end: int,
    source: Transmitter,
    first: PlacedPart,
    last: PlacedPart,
    around: Surroundings,
    least: float,
    cells: IntArray,
    hits: Hits,
    is_lit: BoolArray,
) -> None:
    """Fill the hits of the facets ``begin:end``.

    ``cells`` ``(facet, 2)`` are the number of parts of each side of a facet, and its first hit.
    """
    notes = np.empty(around.space.room, dtype=np.float32)
    for f in range(begin, end):
        n, number = cells[f, 0], cells[f, 1]
        corner = last.shape.corner[f]
        c0, c1, c2 = row(corner, 0), row(corner, 1), row(corner, 2)
        u = ((c1[0] - c0[0]) / n, (c1[1] - c0[1]) / n, (c1[2] - c0[2]) / n)
        v = ((c2[0] - c0[0]) / n, (c2[1] - c0[1]) / n, (c2[2] - c0[2]) / n)
        for i in range(n):
            for j in range(n - i):
                # all cells are parallelograms, but for the triangles along the last side
                is_triangle = i + j == n - 1
                share = 1.0 / 3.0 if is_triangle else 0.5
                a, b = i + share, j + share
                at = (
                    c0[0] + a * u[0] + b * v[0],
                    c0[1] + a * u[1] + b * v[1],
                    c0[2] + a * u[2] + b * v[2],
                )
                hit = hits[number]
                if _lit_at(at, source, first, last, around, least, notes, hit):
                    put(hit["side_a"], u)
                    put(hit["side_b"], v)
                    hit["is_triangle"] = is_triangle
                    is_lit[number] = True
                number += 1


@inlined
def _leg(start: Vector, end: Vector) -> tuple[Vector, float]:
    """Direction and length, m, of the way between two points."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    size = math.sqrt(dot(way, way))
    return (way[0] / size, way[1] / size, way[2] / size), size


@inner
def _is_clear(
    space: Space, start: Vector, leg: tuple[Vector, float], nearest: float, notes: Notes
) -> bool:
    """True if a ray meets nothing, sheets included, from ``nearest`` m to the end of a leg."""
    met = meet(space, start, leg[0], nearest, NO_INTERSECTION, NO_BODY, notes)
    return bool(met.distance > leg[1] - CLEAR_MARGIN)


@inner
def _leaves_on(around: Surroundings, start: Vector, leg: tuple[Vector, float]) -> float:
    """Factor by which leaves reduce the amplitude along a leg."""
    if not is_near_leaves(around.space, start, leg[0], leg[1]):
        return 1.0
    return fade(around.space, around.faces, around.media, start, leg[0], leg[1])


@inlined
def _velocity_on(part: PlacedPart, point: Vector) -> Vector:
    """Velocity of a part's matter at a point, m/s."""
    return velocity_there(vector(part.velocity), part.yaw_rate, point)


@inner
def _lit_at(
    at: Vector,
    source: Transmitter,
    first: PlacedPart,
    last: PlacedPart,
    around: Surroundings,
    least: float,
    notes: Notes,
    hit: np.void,
) -> bool:
    """Fill the hit at a point of ``last``, but for its sides; False if no wave comes there."""
    k, origin, normal = around.wavenumber, vector(source.origin), vector(first.shape.normal)
    corner, upright = row(first.shape.border[0], 0), vector(last.shape.normal)
    height = dot((origin[0] - corner[0], origin[1] - corner[1], origin[2] - corner[2]), normal)
    before = dot((at[0] - corner[0], at[1] - corner[1], at[2] - corner[2]), normal)
    image = (
        origin[0] - 2.0 * height * normal[0],
        origin[1] - 2.0 * height * normal[1],
        origin[2] - 2.0 * height * normal[2],
    )
    d, length = _leg(image, at)
    if before <= 0.0 or dot(d, upright) >= 0.0 or dot(d, normal) < MIN_COSINE:
        return False
    found = window(first.shape.border, normal, image, at, k)
    if abs(found.share) < least:
        return False
    there, onward = _leg(origin, found.nearest), _leg(found.nearest, at)
    if not _is_clear(around.space, origin, there, RADAR_CLEARANCE, notes):
        return False
    if not _is_clear(around.space, found.nearest, onward, MIN_LEG, notes):
        return False
    leaves = _leaves_on(around, origin, there) * _leaves_on(around, found.nearest, onward)
    own, other = _velocity_on(first, found.specular), _velocity_on(last, at)
    way, distance = _leg(origin, found.specular)
    edge = any_normal_to(way)
    ray = ray_along(origin, vector(source.velocity), way, (edge, cross(way, edge)))
    met = flat_contact(
        found.specular, distance, normal, first.shape.medium, own, first.yaw_rate, NO_PART
    )
    after = mirrored_by(ray, met, around.media, k)
    here = flat_contact(
        at, length - distance, upright, last.shape.medium, other, last.yaw_rate, NO_PART
    )
    record(hit, after, reflected(after, here, around.media, k), here, last.roughness)
    detour = there[1] + onward[1] - length
    turned = phasor(-k * detour)
    share = leaves * found.share * turned
    current = hit["current"]
    for t in range(2):
        for x in range(2):
            for axis in range(3):
                current[t, x, axis] *= share
    put(hit["departure"], there[0])
    put(hit["first_point"], found.nearest)
    hit["length"], hit["spread"] = length + detour, 1.0 / (length + detour)
    p, q, own = there[0], onward[0], _velocity_on(first, found.nearest)
    rate = -dot(p, vector(source.velocity)) + dot(own, p) - dot(own, q) + dot(other, q)
    hit["rate"] = rate - dot(other, d)
    hit["body"], hit["first_body"], hit["tube"] = last.body, first.body, -1
    hit["part"][0], hit["part"][1] = first.number, last.number
    return True


class Outlines(NamedTuple):
    """Spheres about flat parts and the parts' planes, ``(part, …)``, in the world.

    ``centre`` m ``(part, xyz)``, ``radius`` m, a ``point`` m of the plane and its ``normal``.
    """

    centre: FloatArray
    radius: FloatArray
    point: FloatArray
    normal: FloatArray


def outlines_of(parts: Sequence[PlacedPart]) -> Outlines:
    """Outlines of some flat parts, in their order."""
    corners = [part.shape.border[:, 0] for part in parts]
    centre = np.array([0.5 * (c.min(axis=0) + c.max(axis=0)) for c in corners]).reshape(-1, 3)
    away = [np.max(np.linalg.norm(c - m, axis=1)) for c, m in zip(corners, centre, strict=True)]
    return Outlines(
        centre,
        np.array(away),
        np.array([c[0] for c in corners]).reshape(-1, 3),
        np.array([part.shape.normal for part in parts]).reshape(-1, 3),
    )


def may_light(
    source: FloatArray, first: Outlines, lasts: Outlines, wavenumber: float, least: FloatArray
) -> BoolArray:
    r"""Mask ``(part,)`` of the parts ``lasts`` on which \|W\| may be ``least`` or more.

    ``source`` m ``(xyz,)`` is the place of a transmitter that is before ``first``, a single part.
    The bound of \|W\| is `SHADOW_SHARE` over the distance of the specular point from the part, in
    units of (u, v), for the points of each sphere where it is greatest.
    """
    normal, centre, radius = first.normal[0], first.centre[0], float(first.radius[0])
    height = float((source - first.point[0]) @ normal)
    image = source - 2.0 * height * normal
    way = lasts.centre - image
    # depth before the first part of the nearest and of the farthest point of each sphere
    depth = way @ normal - height
    low = depth - lasts.radius
    faces = np.sum((centre - lasts.point) * lasts.normal, axis=1) + radius > 0
    may = faces & (depth + lasts.radius > 0)
    # all of a flat part faces the image, or none of it does
    may &= np.sum((image - lasts.point) * lasts.normal, axis=1) > 0
    # near the plane of the first part, the specular point may be anywhere
    is_far = may & (low > 0)
    share = height / np.where(is_far, height + depth, 1.0)
    length = np.linalg.norm(way, axis=1)
    specular = image + share[:, None] * way
    # a point moves the specular point by no more than this
    lever = np.where(is_far, height / np.where(is_far, height + low, 1.0), 1.0)
    spread = lasts.radius * lever * length / np.where(is_far, height + depth, 1.0)
    gap = np.maximum(np.linalg.norm(specular - centre, axis=1) - radius - spread, 0.0)
    cosine = np.where(is_far, (height + low) / (length + lasts.radius), 0.0)
    legs = share * length + spread, np.maximum(length - share * length, 0.0) + lasts.radius + spread
    zones = gap * cosine * np.sqrt(wavenumber / np.pi * (1.0 / legs[0] + 1.0 / legs[1]))
    return np.asarray(may & (zones < SHADOW_SHARE / least))


def may_be_joined(one: Outlines, others: Outlines) -> BoolArray:
    """Mask ``(part,)`` of the parts that may come within `LEAST_GAP` of a single part."""
    away = np.linalg.norm(others.centre - one.centre[0], axis=1)
    return np.asarray(away <= others.radius + one.radius[0] + LEAST_GAP)


def seen_parts(world: World, place: FloatArray, parts: Sequence[PlacedPart]) -> BoolArray:
    """Mask ``(part,)`` of the parts of which ``place``, m ``(xyz,)``, sees any tested point.

    Tested are the corners and the middles of all facets. A part that is seen between these alone is
    left to the tubes.
    """
    out = np.zeros(len(parts), dtype=np.bool_)
    shapes = [part.shape for part in parts]
    some = [n for n, s in enumerate(shapes) if (place - s.border[0, 0]) @ s.normal > 0]
    if not some:
        return out
    points, counts = [], []
    for shape in (shapes[number] for number in some):
        corner = shape.corner
        tested = np.concatenate([corner.reshape(-1, 3), corner.mean(axis=1)])
        points.append(tested + SHADOW_RAY_LIFT * shape.normal)
        counts.append(len(tested))
    is_seen = ~blocked(world, place[None], np.concatenate(points))
    start = np.concatenate([[0], np.cumsum(counts)[:-1]])
    out[some] = np.logical_or.reduceat(is_seen, start)
    return out


def without_pairs(pairs: set[tuple[int, int, int, int]], hits: Hits) -> Hits:
    """The hits without those by way of two flat parts of ``pairs``.

    A pair is the first part's body and number, and the last part's body and number.
    """
    some = np.flatnonzero(np.all(hits["part"] != NO_PART, axis=1))
    if not pairs or not len(some):
        return hits
    there = hits.take(some)
    ends = there["first_body"], there["part"][:, 0], there["body"], there["part"][:, 1]
    is_kept = np.ones(len(hits), dtype=np.bool_)
    is_kept[some] = [key not in pairs for key in zip(*[e.tolist() for e in ends], strict=True)]
    return hits.take(np.flatnonzero(is_kept))
