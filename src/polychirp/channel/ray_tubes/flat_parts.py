"""Flat parts of bodies that end at sharp edges: plates, signs, sides of boxes.

`physical_optics.flat_faces` has the flat parts that a single reflection is integrated over. Here a
part must also end where its surface ends or bends by `LEAST_BEND` or more: where a curved surface
goes on, the reflected wave has no edge.
"""

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.geometry.closest_point import closest_points
from polychirp.channel.physical_optics.flat_faces import NORMAL_STEP, POSITION_STEP, row_codes
from polychirp.channel.scene.world import Surface, World

LEAST_AREA: Final = 0.005
"""Least area of a part, m², a square of 7 cm. Chosen: smaller parts bring little power, and cars
have many. Twice as much would leave out plates of 0.1 m."""

MOST_AREA: Final = 1.3
"""Greatest area of a part, m². Chosen: such a part has 10,000 cells in `flat_pairs`, which take
30 ms for each part that lights it. With eight boxes as large as cars, all sides took 18 s and tubes
0.3 s. The larger a part, the less matters a Fresnel zone."""

LEAST_BEND: Final = np.radians(20.0)
"""Least angle, rad, by which a surface bends at an edge of a part. Chosen: what is beyond such an
edge reflects 40° aside, far outside the Fresnel zone of any part."""

MOST_EDGES: Final = 16
"""Greatest number of straight edges of a part. Chosen: the time of a window grows with it. Discs,
as of wheels, have more."""

LEAST_GAP: Final = 0.02
"""Distance, m, within which two parts are taken as joined. Chosen: five wavelengths at 79 GHz. At a
common edge the wave of one part goes on in the other and is not diffracted."""

SAMPLES_PER_EDGE: Final = 9
"""Points of an edge whose distances from another part are compared with `LEAST_GAP` (chosen)."""

NO_PART: Final = -1
"""Number of the part of a triangle that belongs to none."""


class FlatPart(NamedTuple):
    """A flat part of a body, in any one frame.

    ``corner`` m ``(facet, corner, xyz)`` are its facets; ``border`` m ``(edge, end, xyz)`` its
    straight edges, on whose left it lies as seen from the tip of ``normal`` ``(xyz,)``; ``medium``
    is the number of its material.
    """

    corner: FloatArray
    border: FloatArray
    normal: FloatArray
    medium: int

    def moved(self, rotation: FloatArray, position: FloatArray) -> "FlatPart":
        """The part in the frame in which its body has this rotation and position (m)."""
        turn = np.ascontiguousarray(rotation.T)
        return self._replace(
            corner=self.corner @ turn + position,
            border=self.border @ turn + position,
            normal=self.normal @ turn,
        )


class FlatParts(NamedTuple):
    """Flat parts of a surface; ``of_face`` ``(face,)`` is the part of a face or `NO_PART`."""

    parts: tuple[FlatPart, ...]
    of_face: IntArray


@lru_cache(maxsize=64)
def flat_parts_of(surface: Surface) -> FlatParts:
    """Opaque flat parts of a surface; media are numbers into its materials."""
    face = np.flatnonzero(np.isin(surface.medium, np.unique(surface.tree_medium["opaque"])))
    of_face = np.full(len(surface.area), NO_PART, dtype=np.int64)
    height = np.sum(surface.centroid * surface.normal, axis=1, keepdims=True)
    where = np.concatenate([surface.normal / NORMAL_STEP, height / POSITION_STEP], axis=1)
    plane = row_codes(where[face], surface.medium[face])
    if not np.any(np.bincount(plane, surface.area[face]) >= LEAST_AREA):
        return FlatParts((), of_face)
    corner = surface.centroid[face, None] + surface.corner[face]
    vertex = corner.reshape(-1, 3)
    point = row_codes(vertex / POSITION_STEP, np.zeros(len(vertex), dtype=np.int64)).reshape(-1, 3)
    start, end = point.reshape(-1), np.roll(point, -1, axis=1).reshape(-1)
    owner = np.repeat(np.arange(len(face)), 3)
    # pairs of edges that join the same points, and the facets that have them
    key = np.minimum(start, end) * (np.max(point) + 1) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, other = order[same], order[same + 1]
    is_flat = plane[owner[one]] == plane[owner[other]]
    inside = owner[one[is_flat]], owner[other[is_flat]]
    links = coo_array((np.ones(len(inside[0])), inside), shape=(len(face), len(face)))
    part = connected_components(links, directed=False)[1]
    first, second = owner[one[~is_flat]], owner[other[~is_flat]]
    normal = surface.normal[face]
    is_soft = np.sum(normal[first] * normal[second], axis=1) > np.cos(LEAST_BEND)
    area = np.bincount(part, surface.area[face])
    can = (area >= LEAST_AREA) & (area <= MOST_AREA)
    can[part[np.concatenate([first[is_soft], second[is_soft]])]] = False
    is_border = np.ones(len(start), dtype=np.bool_)
    is_border[np.concatenate([one[is_flat], other[is_flat]])] = False
    found: list[FlatPart] = []
    for number in np.flatnonzero(can):
        mine = np.flatnonzero(part == number)
        edges = (3 * mine[:, None] + np.arange(3)).reshape(-1)
        edges = edges[is_border[edges]]
        loops = _straight(start[edges], end[edges], vertex[edges], vertex[_following(edges)])
        if len(loops) <= MOST_EDGES:
            of_face[face[mine]] = len(found)
            found.append(
                FlatPart(corner[mine], loops, normal[mine[0]], int(surface.medium[face[mine[0]]]))
            )
    return FlatParts(tuple(found), of_face)


def _following(edge: IntArray) -> IntArray:
    """Number of the next corner of the same facet."""
    return np.where(edge % 3 == 2, edge - 2, edge + 1)


def _straight(start: IntArray, end: IntArray, tail: FloatArray, tip: FloatArray) -> FloatArray:
    """Edges m ``(edge, end, xyz)`` of a border, those in line joined.

    ``start`` and ``end`` ``(edge,)`` are numbers of points, ``tail`` and ``tip`` their places, m.
    """
    way = tip - tail
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    after = {point: edge for edge, point in enumerate(start)}
    is_single = np.bincount(start, minlength=int(np.max(end)) + 1) == 1
    follows = np.array([after.get(p, -1) if is_single[p] else -1 for p in end.tolist()])
    is_joined = (follows >= 0) & (np.sum(way * way[follows], axis=1) > 1.0 - NORMAL_STEP**2)
    begins = np.ones(len(start), dtype=np.bool_)
    begins[follows[is_joined]] = False
    found = []
    for edge in np.flatnonzero(begins):
        last = edge
        while is_joined[last]:
            last = follows[last]
        found.append((tail[edge], tip[last]))
    return np.array(found).reshape(-1, 2, 3)


def are_joined(one: FlatPart, other: FlatPart) -> bool:
    """True if two parts come closer to each other than `LEAST_GAP`."""
    return _comes_near(one, other) or _comes_near(other, one)


def _comes_near(one: FlatPart, other: FlatPart) -> bool:
    """True if a point of the border of ``one`` is within `LEAST_GAP` of ``other``."""
    share = np.linspace(0.0, 1.0, SAMPLES_PER_EDGE)[:, None, None]
    points = ((1.0 - share) * one.border[:, 0] + share * one.border[:, 1]).reshape(-1, 3)
    low = other.corner.min(axis=(0, 1)) - LEAST_GAP
    high = other.corner.max(axis=(0, 1)) + LEAST_GAP
    near = points[np.all((points >= low) & (points <= high), axis=1)]
    return any(
        bool(np.min(np.sum((closest_points(other.corner, p)[0] - p) ** 2, axis=1)) < LEAST_GAP**2)
        for p in near
    )


@lru_cache(maxsize=40)
def parts_in_world(world: World) -> tuple[tuple[FlatPart, ...], ...]:
    """Flat parts of every body in the frame of the world; media are numbers into its materials."""
    found = []
    for body, surface in enumerate(world.surfaces):
        media = [world.materials.index(name) for name in surface.materials]
        place = world.rotation[body], world.position[body]
        parts = flat_parts_of(surface).parts
        found.append(tuple(p.moved(*place)._replace(medium=media[p.medium]) for p in parts))
    return tuple(found)


@lru_cache(maxsize=40)
def lone_parts(world: World) -> frozenset[int]:
    """Numbers of the bodies that are one flat part and touch no flat part of another body."""
    parts = parts_in_world(world)
    alone = [
        body
        for body, mine in enumerate(parts)
        if len(mine) == 1 and len(mine[0].corner) == len(world.surfaces[body].area)
    ]
    return frozenset(
        body
        for body in alone
        if not any(
            are_joined(parts[body][0], other)
            for number, others in enumerate(parts)
            if number != body
            for other in others
        )
    )
