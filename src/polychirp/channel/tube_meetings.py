"""What rays meet: opaque triangles, thin sheets, plates, and leaves on the way."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.blockers import (
    CENTRE,
    MEDIUM,
    NORMAL,
    OPAQUE,
    PANES,
    Blockers,
    face_normal,
    hit_body,
    into_body,
    is_beside,
    nodes_of,
)
from polychirp.channel.fresnel import Media
from polychirp.channel.legs import chord
from polychirp.channel.nearest import nearest_hit
from polychirp.channel.optics import Vector
from polychirp.channel.vectors import dot, vector, vector_at
from polychirp.channel.world import SKIN

NOTHING, FACE, PANE, PLATE = 0, 1, 2, 3

Meeting = tuple[float, int, int, int]
"""Distance, kind, number of the body or plate, and triangle."""


class Bodies(NamedTuple):
    """What rays need to know of bodies and plates, in the world.

    ``centre``, ``radius`` of spheres around the bodies, m; ``velocity`` of bodies and
    ``plate_velocity``, m/s; ``scatters`` ``(body,)``; ``is_pane`` ``(plate,)``; numbers of the
    bodies that are ``solid`` (have opaque faces or panes) and ``cloudy``.
    """

    centre: FloatArray
    radius: FloatArray
    velocity: FloatArray
    plate_velocity: FloatArray
    scatters: BoolArray
    is_pane: BoolArray
    solid: IntArray
    cloudy: IntArray


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _meet_tree(
    faces: Blockers,
    nodes: tuple[int, int],
    start: Vector,
    along: Vector,
    span: tuple[float, float],
    boxes: IntArray,
) -> tuple[float, int]:
    """Distance and triangle of the first face of a body's tree, in its frame; infinite: a miss."""
    return nearest_hit(
        faces.box,
        faces.skip,
        faces.first,
        faces.size,
        faces.triangle,
        nodes,
        start,
        along,
        span,
        boxes,
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _is_in_reach(
    bodies: Bodies, body: int, point: Vector, direction: Vector, span: tuple[float, float]
) -> bool:
    """Whether a ray meets the sphere around a body."""
    c, r = bodies.centre[body], bodies.radius[body]
    gap = (c[0] - point[0], c[1] - point[1], c[2] - point[2])
    along = dot(gap, direction)
    room = r * r - dot(gap, gap) + along * along
    if room < 0.0:
        return False
    half = math.sqrt(room)
    return bool(along + half > span[0] and along - half < span[1])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _meet_plates(
    blockers: Blockers, point: Vector, direction: Vector, span: tuple[float, float]
) -> tuple[float, int]:
    """Distance and number of the first plate; ``span[1]`` and −1 for none."""
    best, found, plate = span[1], -1, blockers.plate
    for p in range(plate.shape[0]):
        n, c = vector_at(plate, p, NORMAL), vector_at(plate, p, CENTRE)
        slope = n[0] * direction[0] + n[1] * direction[1] + n[2] * direction[2]
        gx, gy, gz = point[0] - c[0], point[1] - c[1], point[2] - c[2]
        height = n[0] * gx + n[1] * gy + n[2] * gz
        # most plates lie behind: no need to know how far
        if height * slope >= 0.0:
            continue
        t = -height / slope
        if not span[0] < t < best:
            continue
        gx, gy, gz = gx + t * direction[0], gy + t * direction[1], gz + t * direction[2]
        if not is_beside(plate, p, (gx, gy, gz)):
            best, found = t, p
    return best, found


@njit(cache=True, nogil=True, error_model="numpy")
def meet(
    faces: Blockers,
    bodies: Bodies,
    point: Vector,
    direction: Vector,
    nearest: float,
    known: Meeting,
    boxes: IntArray,
) -> Meeting:
    """What a ray meets first beyond ``nearest`` m, if not what is known of one body.

    ``boxes``: room for `DEPTH` numbers, as `nearest_hit` needs it.
    """
    best, kind, number, triangle = known
    known_body = number
    distance, plate = _meet_plates(faces, point, direction, (nearest, best))
    if plate >= 0:
        best, kind, number, triangle = distance, PLATE, plate, 0
    for b in bodies.solid:
        if b == known_body or not _is_in_reach(bodies, b, point, direction, (nearest, best)):
            continue
        found = _meet_body(faces, b, point, direction, (nearest, best), boxes)
        if found[0] < best:
            best, kind, number, triangle = found
    return best, kind, number, triangle


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _meet_body(
    faces: Blockers,
    body: int,
    point: Vector,
    direction: Vector,
    span: tuple[float, float],
    boxes: IntArray,
) -> Meeting:
    """What of a body a ray meets first; at an infinite distance for a miss."""
    start, along = into_body(faces, body, point, direction)
    nodes = nodes_of(faces, OPAQUE, body)
    distance, triangle = _meet_tree(faces, nodes, start, along, span, boxes)
    kind = FACE if distance < np.inf else NOTHING
    shorter, nodes = (span[0], min(span[1], distance)), nodes_of(faces, PANES, body)
    before, t = _meet_tree(faces, nodes, start, along, shorter, boxes)
    if before < distance:
        distance, kind, triangle = before, PANE, t
    return distance, kind, body, triangle


@njit(cache=True, nogil=True, error_model="numpy")
def meet_alone(
    faces: Blockers, body: int, point: Vector, direction: Vector, boxes: IntArray
) -> Meeting:
    """What of a body a new ray would meet first, were nothing else there."""
    return _meet_body(faces, body, point, direction, (SKIN, np.inf), boxes)


@njit(cache=True, nogil=True, error_model="numpy")
def fade(
    faces: Blockers, media: Media, bodies: Bodies, point: Vector, d: Vector, distance: float
) -> float:
    """What clouds of leaves leave of the amplitude on the way to what a ray meets."""
    loss = 0.0
    way = (distance * d[0], distance * d[1], distance * d[2])
    for b in bodies.cloudy:
        if _is_in_reach(bodies, b, point, d, (0.0, distance)):
            start, along = into_body(faces, b, point, way)
            share, triangle = chord(faces, b, start, along, (0.0, 1.0))
            if share > 0.0:
                loss += media.attenuation[faces.medium[triangle]] * share * distance
    return math.exp(-0.5 * loss)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def surface_of(
    faces: Blockers, bodies: Bodies, kind: int, number: int, triangle: int
) -> tuple[Vector, int, Vector]:
    """Normal, medium and velocity of what was met."""
    if kind == PLATE:
        return (
            vector_at(faces.plate, number, NORMAL),
            int(faces.plate[number, MEDIUM]),
            vector(bodies.plate_velocity[number]),
        )
    normal, medium = face_normal(faces, number, triangle), faces.medium[triangle]
    return normal, medium, vector(bodies.velocity[number])


@njit(cache=True, nogil=True, error_model="numpy")
def is_behind(
    faces: Blockers, bodies: Bodies, hider: int, body: int, point: Vector, direction: Vector
) -> bool:
    """Whether a body hides all of the sphere around another from a new ray."""
    c, r = bodies.centre[body], bodies.radius[body]
    away = (c[0] - point[0], c[1] - point[1], c[2] - point[2])
    near = math.sqrt(dot(away, away)) - r
    if near <= SKIN or not _is_in_reach(bodies, hider, point, direction, (SKIN, near)):
        return False
    start, along = into_body(faces, hider, point, direction)
    nodes = nodes_of(faces, OPAQUE, hider)
    return hit_body(faces, nodes, start, along, (SKIN, near), True)[0] < np.inf
