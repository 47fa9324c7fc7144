"""What rays meet: opaque triangles, thin sheets, plates, and leaves on the way."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.caster import first_hit
from polychirp.channel.fresnel import Media
from polychirp.channel.legs import Veil, _chord, _face_normal, _in_body
from polychirp.channel.nearest import nearest_hit
from polychirp.channel.optics import Vector
from polychirp.channel.vectors import dot, vector
from polychirp.channel.world import SKIN, Blockers

NOTHING, FACE, PANE, PLATE = 0, 1, 2, 3

Meeting = tuple[float, int, int, int]
"""Distance, kind, number of the body or plate, and triangle."""


class Bodies(NamedTuple):
    """What rays need to know of bodies and plates, in the world.

    ``centre``, ``radius`` of spheres around the bodies, m; ``velocity`` of bodies and
    ``plate_velocity``, m/s; ``scatters`` ``(body,)``; ``is_pane`` ``(plate,)``; ``face_medium``
    of the opaque triangles; numbers of the bodies that are
    ``solid`` (have opaque faces or panes) and ``cloudy``.
    """

    centre: FloatArray
    radius: FloatArray
    velocity: FloatArray
    plate_velocity: FloatArray
    scatters: BoolArray
    is_pane: BoolArray
    face_medium: IntArray
    solid: IntArray
    cloudy: IntArray


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _turned(m: FloatArray, a: Vector) -> Vector:
    return (
        m[0, 0] * a[0] + m[0, 1] * a[1] + m[0, 2] * a[2],
        m[1, 0] * a[0] + m[1, 1] * a[1] + m[1, 2] * a[2],
        m[2, 0] * a[0] + m[2, 1] * a[1] + m[2, 2] * a[2],
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _in_frame(
    faces: Blockers, body: int, point: Vector, direction: Vector
) -> tuple[Vector, Vector]:
    """A point and a direction in the frame of a body."""
    m, s = faces.turn[body], faces.shift[body]
    start = _turned(m, point)
    return (start[0] + s[0], start[1] + s[1], start[2] + s[2]), _turned(m, direction)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _meet_faces(
    faces: Blockers,
    body: int,
    start: Vector,
    along: Vector,
    span: tuple[float, float],
    boxes: IntArray,
) -> tuple[float, int]:
    """Distance and triangle of the first opaque face of a body, in its frame; infinite: a miss."""
    return nearest_hit(
        faces.box,
        faces.skip,
        faces.first,
        faces.size,
        faces.triangle,
        (faces.root[body], faces.root[body + 1]),
        start,
        along,
        span,
        boxes,
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _meet_panes(
    veil: Veil,
    body: int,
    start: Vector,
    along: Vector,
    span: tuple[float, float],
    boxes: IntArray,
) -> tuple[float, int]:
    """Distance and triangle of the first pane of a body, in its frame; infinite for a miss."""
    return nearest_hit(
        veil.pane_box,
        veil.pane_skip,
        veil.pane_first,
        veil.pane_size,
        veil.pane_triangle,
        (veil.pane_root[body], veil.pane_root[body + 1]),
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
    best, plate = span[1], -1
    for p in range(blockers.half_across.size):
        n, c = blockers.plate_normal[p], blockers.plate_centre[p]
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
        u, v = blockers.plate_across[p], blockers.plate_along[p]
        if abs(u[0] * gx + u[1] * gy + u[2] * gz) > blockers.half_across[p]:
            continue
        if abs(v[0] * gx + v[1] * gy + v[2] * gz) <= blockers.half_along[p]:
            best, plate = t, p
    return best, plate


@njit(cache=True, nogil=True, error_model="numpy")
def meet(
    faces: Blockers,
    veil: Veil,
    bodies: Bodies,
    point: Vector,
    direction: Vector,
    nearest: float,
    known: Meeting,
    but_body: int,
    boxes: IntArray,
) -> Meeting:
    """What a ray meets first beyond ``nearest`` m, if not what is known of ``but_body``.

    ``boxes``: room for `DEPTH` numbers, as `nearest_hit` needs it.
    """
    best, kind, number, triangle = known
    distance, plate = _meet_plates(faces, point, direction, (nearest, best))
    if plate >= 0:
        best, kind, number, triangle = distance, PLATE, plate, 0
    for b in bodies.solid:
        if b == but_body or not _is_in_reach(bodies, b, point, direction, (nearest, best)):
            continue
        found = _meet_body(faces, veil, b, point, direction, (nearest, best), boxes)
        if found[0] < best:
            best, kind, number, triangle = found
    return best, kind, number, triangle


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _meet_body(
    faces: Blockers,
    veil: Veil,
    body: int,
    point: Vector,
    direction: Vector,
    span: tuple[float, float],
    boxes: IntArray,
) -> Meeting:
    """What of a body a ray meets first; at an infinite distance for a miss."""
    start, along = _in_frame(faces, body, point, direction)
    distance, triangle = _meet_faces(faces, body, start, along, span, boxes)
    kind = FACE if distance < np.inf else NOTHING
    before, t = _meet_panes(veil, body, start, along, (span[0], min(span[1], distance)), boxes)
    if before < distance:
        distance, kind, triangle = before, PANE, t
    return distance, kind, body, triangle


@njit(cache=True, nogil=True, error_model="numpy")
def meet_alone(
    faces: Blockers, veil: Veil, body: int, point: Vector, direction: Vector, boxes: IntArray
) -> Meeting:
    """What of a body a new ray would meet first, were nothing else there."""
    return _meet_body(faces, veil, body, point, direction, (SKIN, np.inf), boxes)


@njit(cache=True, nogil=True, error_model="numpy")
def fade(
    veil: Veil, media: Media, bodies: Bodies, point: Vector, d: Vector, distance: float
) -> float:
    """What clouds of leaves leave of the amplitude on the way to what a ray meets."""
    loss = 0.0
    way = (distance * d[0], distance * d[1], distance * d[2])
    for b in bodies.cloudy:
        if _is_in_reach(bodies, b, point, d, (0.0, distance)):
            start, along = _in_body(veil, b, point, way)
            share, triangle = _chord(veil, b, start, along, (0.0, 1.0))
            if share > 0.0:
                loss += media.attenuation[veil.cloud_medium[triangle]] * share * distance
    return math.exp(-0.5 * loss)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def surface_of(
    faces: Blockers, veil: Veil, bodies: Bodies, kind: int, number: int, triangle: int
) -> tuple[Vector, int, Vector]:
    """Normal, medium and velocity of what was met."""
    if kind == PLATE:
        return (
            vector(faces.plate_normal[number]),
            faces.plate_medium[number],
            vector(bodies.plate_velocity[number]),
        )
    velocity = vector(bodies.velocity[number])
    if kind == FACE:
        normal = _face_normal(faces.triangle[triangle], faces.turn[number])
        return normal, bodies.face_medium[triangle], velocity
    normal = _face_normal(veil.pane_triangle[triangle], veil.turn[number])
    return normal, veil.pane_medium[triangle], velocity


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
    start, along = _in_frame(faces, hider, point, direction)
    found = first_hit(
        faces.box,
        faces.skip,
        faces.first,
        faces.size,
        faces.triangle,
        (faces.root[hider], faces.root[hider + 1]),
        start,
        along,
        (SKIN, near),
        True,
    )
    return found[0] < np.inf
