"""Kernels of ray tubes; `tubes` says what they compute and why."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.caster import first_hit
from polychirp.channel.fresnel import Media, sheet_transmission, smooth_reflection
from polychirp.channel.legs import Veil, _chord, _face_normal, _in_body, _pane_hit
from polychirp.channel.occlusion import is_blocked
from polychirp.channel.optics import (
    LIFT,
    ComplexVector,
    Vector,
    _across,
    _any_across,
    _phasor,
)
from polychirp.channel.vectors import cross, dot, vector
from polychirp.channel.world import SKIN, Blockers

FAINT = 1e-8
"""|E|² below which a wave that left with 1 is followed no further."""

OFF = 1e-6
"""m by which a ray has to be off a surface to meet another."""

PER_CHUNK = 256
"""Rays that one thread follows at a time."""

NOTHING, FACE, PANE, PLATE = 0, 1, 2, 3

Meeting = tuple[float, int, int, int]
"""Distance, kind, number of the body or plate, and triangle."""


class Bodies(NamedTuple):
    """What rays need to know of bodies and plates, in the world.

    ``centre``, ``radius`` of spheres around the bodies, m; ``velocity`` of bodies and
    ``plate_velocity``, m/s; ``scatters`` ``(body,)``; ``is_pane`` ``(plate,)``; ``face_medium``
    of the opaque triangles; numbers of the bodies that are ``opaque``, ``paned``, ``cloudy``.
    """

    centre: FloatArray
    radius: FloatArray
    velocity: FloatArray
    plate_velocity: FloatArray
    scatters: BoolArray
    is_pane: BoolArray
    face_medium: IntArray
    opaque: IntArray
    paned: IntArray
    cloudy: IntArray


class Ray(NamedTuple):
    """A tube on its way, and the fields of a wave that left V- and H-polarised, without 1/L.

    ``edge_a``, ``edge_b``: what a step to the neighbours changes of the direction; ``length`` m
    so far and its ``rate`` m/s; ``met``: bodies that have reflected it; ``turns``: those and
    plates; ``departure``; ``first``: where it met the first body.
    """

    point: Vector
    direction: Vector
    edge_a: Vector
    edge_b: Vector
    length: float
    rate: float
    met: int
    turns: int
    departure: Vector
    first: Vector
    wave_v: ComplexVector
    wave_h: ComplexVector


class Hits(NamedTuple):
    """Where tubes meet a body after another one, ``(hit, …)``.

    ``normal`` towards where the ray came from; ``side_a``, ``side_b``: sides of the footprint, m;
    ``current`` ``(hit, polarisation, kind, xyz)``: J and M, without 1/L.
    """

    point: FloatArray
    direction: FloatArray
    normal: FloatArray
    side_a: FloatArray
    side_b: FloatArray
    length: FloatArray
    rate: FloatArray
    departure: FloatArray
    first: FloatArray
    body: IntArray
    roughness: FloatArray
    current: NDArray[np.complex64]

    def of(self, which: IntArray) -> Hits:
        """The hits of these numbers."""
        return Hits(
            self.point[which],
            self.direction[which],
            self.normal[which],
            self.side_a[which],
            self.side_b[which],
            self.length[which],
            self.rate[which],
            self.departure[which],
            self.first[which],
            self.body[which],
            self.roughness[which],
            self.current[which],
        )


def empty_hits(size: int) -> Hits:
    """Room for hits."""
    return Hits(
        point=np.empty((size, 3)),
        direction=np.empty((size, 3)),
        normal=np.empty((size, 3)),
        side_a=np.empty((size, 3)),
        side_b=np.empty((size, 3)),
        length=np.empty(size),
        rate=np.empty(size),
        departure=np.empty((size, 3)),
        first=np.empty((size, 3)),
        body=np.empty(size, dtype=np.int64),
        roughness=np.empty(size),
        current=np.empty((size, 2, 2, 3), dtype=np.complex64),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _across_field(a: Vector, field: ComplexVector) -> ComplexVector:
    """The vector product a × E."""
    return (
        a[1] * field[2] - a[2] * field[1],
        a[2] * field[0] - a[0] * field[2],
        a[0] * field[1] - a[1] * field[0],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _turned_field(
    field: ComplexVector,
    before: Vector,
    after: Vector,
    side: Vector,
    turn: tuple[complex, complex],
) -> ComplexVector:
    """A field that goes on along another direction, its parts across and in a plane weighed."""
    into, out = cross(before, side), cross(after, side)
    s = turn[0] * (field[0] * side[0] + field[1] * side[1] + field[2] * side[2])
    p = turn[1] * (field[0] * into[0] + field[1] * into[1] + field[2] * into[2])
    return (
        s * side[0] + p * out[0],
        s * side[1] + p * out[1],
        s * side[2] + p * out[2],
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _ahead(point: Vector, direction: Vector, distance: float) -> Vector:
    return (
        point[0] + distance * direction[0],
        point[1] + distance * direction[1],
        point[2] + distance * direction[2],
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _turned(m: FloatArray, a: Vector) -> Vector:
    return (
        m[0, 0] * a[0] + m[0, 1] * a[1] + m[0, 2] * a[2],
        m[1, 0] * a[0] + m[1, 1] * a[1] + m[1, 2] * a[2],
        m[2, 0] * a[0] + m[2, 1] * a[1] + m[2, 2] * a[2],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _meet_body(
    faces: Blockers, body: int, point: Vector, direction: Vector, span: tuple[float, float]
) -> tuple[float, int]:
    """Distance and triangle of the first opaque face of a body; infinite for a miss."""
    m, s = faces.turn[body], faces.shift[body]
    start = _turned(m, point)
    return first_hit(
        faces.box,
        faces.skip,
        faces.first,
        faces.size,
        faces.triangle,
        (faces.root[body], faces.root[body + 1]),
        (start[0] + s[0], start[1] + s[1], start[2] + s[2]),
        _turned(m, direction),
        span,
        False,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _meet_pane(
    veil: Veil, body: int, point: Vector, direction: Vector, span: tuple[float, float]
) -> tuple[float, int]:
    """Distance and triangle of the first pane of a body; infinite for a miss."""
    start, along = _in_body(veil, body, point, direction)
    return _pane_hit(veil, body, start, along, span, False)


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def _meet_plates(
    blockers: Blockers, point: Vector, direction: Vector, span: tuple[float, float]
) -> tuple[float, int]:
    """Distance and number of the first plate; ``span[1]`` and −1 for none."""
    best, plate = span[1], -1
    for p in range(blockers.half_across.size):
        n, c = blockers.plate_normal[p], blockers.plate_centre[p]
        slope = n[0] * direction[0] + n[1] * direction[1] + n[2] * direction[2]
        gx, gy, gz = point[0] - c[0], point[1] - c[1], point[2] - c[2]
        t = -(n[0] * gx + n[1] * gy + n[2] * gz) / slope
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
def _meet(
    faces: Blockers, veil: Veil, bodies: Bodies, ray: Ray, known: Meeting, but_body: int
) -> Meeting:
    """What a ray meets first, if not what is known of ``but_body``."""
    nearest = OFF if ray.length > 0.0 else SKIN
    best, kind, number, triangle = known
    distance, plate = _meet_plates(faces, ray.point, ray.direction, (nearest, best))
    if plate >= 0:
        best, kind, number, triangle = distance, PLATE, plate, 0
    for b in bodies.opaque:
        if b != but_body and _is_in_reach(bodies, b, ray.point, ray.direction, (nearest, best)):
            distance, t = _meet_body(faces, b, ray.point, ray.direction, (nearest, best))
            if distance < best:
                best, kind, number, triangle = distance, FACE, b, t
    for b in bodies.paned:
        if b != but_body and _is_in_reach(bodies, b, ray.point, ray.direction, (nearest, best)):
            distance, t = _meet_pane(veil, b, ray.point, ray.direction, (nearest, best))
            if distance < best:
                best, kind, number, triangle = distance, PANE, b, t
    return best, kind, number, triangle


@njit(cache=True, nogil=True, error_model="numpy")
def _meet_alone(faces: Blockers, veil: Veil, body: int, ray: Ray) -> Meeting:
    """What of a body a new ray would meet first, were nothing else there."""
    best, triangle = _meet_body(faces, body, ray.point, ray.direction, (SKIN, np.inf))
    kind = FACE if best < np.inf else NOTHING
    distance, t = _meet_pane(veil, body, ray.point, ray.direction, (SKIN, best))
    if distance < best:
        best, kind, triangle = distance, PANE, t
    return best, kind, body, triangle


@njit(cache=True, nogil=True, error_model="numpy")
def _fade(veil: Veil, media: Media, bodies: Bodies, ray: Ray, distance: float) -> float:
    """What clouds of leaves leave of the amplitude on the way to what a ray meets."""
    loss = 0.0
    d = ray.direction
    way = (distance * d[0], distance * d[1], distance * d[2])
    for b in bodies.cloudy:
        if _is_in_reach(bodies, b, ray.point, d, (0.0, distance)):
            start, along = _in_body(veil, b, ray.point, way)
            share, triangle = _chord(veil, b, start, along, (0.0, 1.0))
            if share > 0.0:
                loss += media.attenuation[veil.cloud_medium[triangle]] * share * distance
    return math.exp(-0.5 * loss)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _mirrored(a: Vector, normal: Vector) -> Vector:
    turn = 2.0 * dot(a, normal)
    return a[0] - turn * normal[0], a[1] - turn * normal[1], a[2] - turn * normal[2]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _power(a: ComplexVector) -> float:
    return (
        a[0].real * a[0].real
        + a[0].imag * a[0].imag
        + a[1].real * a[1].real
        + a[1].imag * a[1].imag
        + a[2].real * a[2].real
        + a[2].imag * a[2].imag
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _induce(
    normal: Vector,
    before: Vector,
    after: Vector,
    wave: ComplexVector,
    reflected: ComplexVector,
    current: NDArray[np.complex64],
) -> None:
    """J = n×(d×E + r×E_r) and M = −n×(E + E_r)."""
    one, other = _across_field(before, wave), _across_field(after, reflected)
    j = _across_field(normal, (one[0] + other[0], one[1] + other[1], one[2] + other[2]))
    total = (wave[0] + reflected[0], wave[1] + reflected[1], wave[2] + reflected[2])
    m = _across_field(normal, total)
    for x in range(3):
        current[0, x], current[1, x] = j[x], -m[x]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _footprint(edge: Vector, ray: Ray, normal: Vector, cosine: float, length: float) -> Vector:
    """Side of a tube's footprint: L (∂D + g D), g = −(∂D·n)/(D·n)."""
    g = dot(edge, normal) / cosine
    d = ray.direction
    return (
        length * (edge[0] + g * d[0]),
        length * (edge[1] + g * d[1]),
        length * (edge[2] + g * d[2]),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _through(
    wave: ComplexVector,
    direction: Vector,
    normal: Vector,
    media: Media,
    medium: int,
    wavenumber: float,
) -> ComplexVector:
    """A field behind a sheet."""
    cosine = abs(dot(direction, normal))
    ts, tp = sheet_transmission(media, medium, cosine, wavenumber)
    side = _across(direction, normal, _any_across(normal))
    return _turned_field(wave, direction, direction, side, (ts, tp))


@njit(cache=True, nogil=True, error_model="numpy")
def _passed(
    ray: Ray, distance: float, normal: Vector, media: Media, medium: int, wavenumber: float
) -> Ray:
    """The ray behind a sheet."""
    return Ray(
        _ahead(ray.point, ray.direction, distance),
        ray.direction,
        ray.edge_a,
        ray.edge_b,
        ray.length + distance,
        ray.rate,
        ray.met,
        ray.turns,
        ray.departure,
        ray.first,
        _through(ray.wave_v, ray.direction, normal, media, medium, wavenumber),
        _through(ray.wave_h, ray.direction, normal, media, medium, wavenumber),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _bounced(
    ray: Ray, distance: float, normal: Vector, media: Media, medium: int, wavenumber: float
) -> Ray:
    """The ray after a smooth surface at rest that is no body."""
    point = _ahead(ray.point, ray.direction, distance)
    cosine = -dot(ray.direction, normal)
    after = _mirrored(ray.direction, normal)
    turn = smooth_reflection(media, medium, cosine, wavenumber)
    side = _across(ray.direction, normal, _any_across(normal))
    return Ray(
        point,
        after,
        _mirrored(ray.edge_a, normal),
        _mirrored(ray.edge_b, normal),
        ray.length + distance,
        ray.rate,
        ray.met,
        ray.turns + 1,
        ray.departure,
        point if ray.met == 0 else ray.first,
        _turned_field(ray.wave_v, ray.direction, after, side, turn),
        _turned_field(ray.wave_h, ray.direction, after, side, turn),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _with(ray: Ray, loss: float, rate: float, met: int) -> Ray:
    """A ray with a loss of amplitude, and with more of its rate and its bodies."""
    v, h = ray.wave_v, ray.wave_h
    return Ray(
        ray.point,
        ray.direction,
        ray.edge_a,
        ray.edge_b,
        ray.length,
        ray.rate + rate,
        ray.met + met,
        ray.turns,
        ray.departure,
        ray.first,
        (loss * v[0], loss * v[1], loss * v[2]),
        (loss * h[0], loss * h[1], loss * h[2]),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _record(hits: Hits, slot: int, ray: Ray, bounced: Ray, normal: Vector, body: int,
            roughness: float) -> None:  # fmt: skip
    """Keep where a ray meets a body, before and after."""
    cosine = -dot(ray.direction, normal)
    hits.point[slot] = bounced.point
    hits.direction[slot] = ray.direction
    hits.normal[slot] = normal
    hits.side_a[slot] = _footprint(ray.edge_a, ray, normal, cosine, bounced.length)
    hits.side_b[slot] = _footprint(ray.edge_b, ray, normal, cosine, bounced.length)
    hits.length[slot] = bounced.length
    hits.rate[slot] = ray.rate
    hits.departure[slot] = ray.departure
    hits.first[slot] = ray.first
    hits.body[slot] = body
    hits.roughness[slot] = roughness
    current = hits.current[slot]
    _induce(normal, ray.direction, bounced.direction, ray.wave_v, bounced.wave_v, current[0])
    _induce(normal, ray.direction, bounced.direction, ray.wave_h, bounced.wave_h, current[1])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _is_heard(ray: Ray) -> bool:
    return max(_power(ray.wave_v), _power(ray.wave_h)) > FAINT


@njit(cache=True, nogil=True, error_model="numpy")
def _surface(
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
def _follow(
    start: Ray,
    met: Meeting,
    faces: Blockers,
    veil: Veil,
    media: Media,
    bodies: Bodies,
    first_body: int,
    limits: tuple[int, float],
    hits: Hits,
    slots: tuple[int, int],
) -> int:
    """Follow a ray, of which is known what it meets, and its branches.

    Fills hits from ``slots[0]`` on, and returns the slot after the last. Beyond ``slots[1]`` hits
    are counted, but not kept.
    """
    most_turns, wavenumber = limits
    slot = slots[0]
    waiting, nothing = [start], (np.inf, NOTHING, -1, 0)
    while len(waiting) > 0:
        ray = waiting.pop()
        if ray.length > 0.0:
            met = _meet(faces, veil, bodies, ray, nothing, -1)
        distance, kind, number, triangle = met
        if kind == NOTHING:
            continue
        normal, medium, velocity = _surface(faces, veil, bodies, kind, number, triangle)
        cosine = -dot(ray.direction, normal)
        is_sheet = kind == PANE or (kind == PLATE and bodies.is_pane[number])
        if bodies.cloudy.size > 0:
            ray = _with(ray, _fade(veil, media, bodies, ray, distance), 0.0, 0)
        if is_sheet:
            # both faces of a sheet are alike
            if cosine < 0.0:
                normal, cosine = (-normal[0], -normal[1], -normal[2]), -cosine
            behind = _passed(ray, distance, normal, media, medium, wavenumber)
            if _is_heard(behind):
                waiting.append(behind)
        is_body = kind != PLATE
        # the first to reflect is the window's body
        is_turn = ray.met > 0 or (is_body and number == first_body)
        if cosine <= 0.0 or not is_turn or (is_body and not bodies.scatters[number]):
            continue
        roughness = media.roughness[medium]
        bounced = _bounced(ray, distance, normal, media, medium, wavenumber)
        if is_body and ray.met > 0:
            if slot < slots[1]:
                _record(hits, slot, ray, bounced, normal, number, roughness)
            slot += 1
        if bounced.turns < most_turns:
            phase = wavenumber * roughness * cosine
            # v·(d − r): by Fermat's principle the point may glide along the surface
            rate = -2.0 * cosine * dot(velocity, normal)
            bounced = _with(bounced, math.exp(-2.0 * phase * phase), rate, 1 if is_body else 0)
            if _is_heard(bounced):
                waiting.append(bounced)
    return slot


@njit(cache=True, nogil=True, error_model="numpy")
def _launched(window: FloatArray, row: int, column: int) -> Ray:
    """The tube in a row and a column of a window, as it leaves."""
    origin, velocity, u, v = window[0], window[1], vector(window[3]), vector(window[4])
    step_a, step_b = window[6, 0], window[6, 1]
    a, b = window[5, 0] + row * step_a, window[5, 1] + column * step_b
    d = _ahead(_ahead(vector(window[2]), u, a), v, b)
    size = math.sqrt(dot(d, d))
    d = (d[0] / size, d[1] / size, d[2] / size)
    share_a, share_b = step_a / size, step_b / size
    ua, vb = _ahead(u, d, -dot(d, u)), _ahead(v, d, -dot(d, v))
    # the basis of frames.polarisation_basis
    h = _across((0.0, 0.0, 1.0), d, (0.0, 1.0, 0.0))
    up = cross(d, h)
    return Ray(
        vector(origin),
        d,
        (share_a * ua[0], share_a * ua[1], share_a * ua[2]),
        (share_b * vb[0], share_b * vb[1], share_b * vb[2]),
        0.0,
        -dot(d, vector(velocity)),
        0,
        0,
        d,
        vector(origin),
        (complex(up[0]), complex(up[1]), complex(up[2])),
        (complex(h[0]), complex(h[1]), complex(h[2])),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _is_behind(faces: Blockers, bodies: Bodies, hider: int, body: int, ray: Ray) -> bool:
    """Whether a body hides all of the sphere around another from a new ray."""
    c, r = bodies.centre[body], bodies.radius[body]
    away = (c[0] - ray.point[0], c[1] - ray.point[1], c[2] - ray.point[2])
    near = math.sqrt(dot(away, away)) - r
    if near <= SKIN or not _is_in_reach(bodies, hider, ray.point, ray.direction, (SKIN, near)):
        return False
    return _meet_body(faces, hider, ray.point, ray.direction, (SKIN, near))[0] < np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _trace_some(
    window: FloatArray,
    tubes: tuple[int, int, int],
    faces: Blockers,
    veil: Veil,
    media: Media,
    bodies: Bodies,
    first_body: int,
    limits: tuple[int, float],
    hits: Hits,
    slots: tuple[int, int],
) -> int:
    """Follow tubes ``tubes[0]`` to ``tubes[1]`` of a window with ``tubes[2]`` columns."""
    slot, hider = slots[0], -1
    for tube in range(tubes[0], tubes[1]):
        ray = _launched(window, tube // tubes[2], tube % tubes[2])
        # what hid the body from a tube will often hide it from the next
        if hider >= 0 and _is_behind(faces, bodies, hider, first_body, ray):
            continue
        alone = _meet_alone(faces, veil, first_body, ray)
        if alone[1] == NOTHING:
            continue
        met = _meet(faces, veil, bodies, ray, alone, first_body)
        if met[1] == PLATE and not bodies.is_pane[met[2]]:
            continue
        if met[1] == FACE and met[2] != first_body:
            hider = met[2]
            continue
        slot = _follow(
            ray, met, faces, veil, media, bodies, first_body, limits, hits, (slot, slots[1])
        )
    return slot


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def trace(
    window: FloatArray,
    tubes: tuple[int, int, int],
    faces: Blockers,
    veil: Veil,
    media: Media,
    bodies: Bodies,
    first_body: int,
    limits: tuple[int, float],
    hits: Hits,
    room: int,
) -> IntArray:
    """Hits of some tubes of a window; how many in every chunk, ``(chunk,)``.

    Chunk c fills ``hits`` from ``c * room`` on. If one needs more than its ``room``, its number
    says so, and what did not fit is lost.

    Parameters
    ----------
    window : `Window.rows`, ``(7, xyz)``
    tubes : the first, the one after the last, and the number of columns
    limits : greatest number of reflections; wavenumber, 1/m
    """
    num_chunks = (tubes[1] - tubes[0] + PER_CHUNK - 1) // PER_CHUNK
    counts = np.zeros(num_chunks, dtype=np.int64)
    for chunk in prange(num_chunks):
        begin, slot = tubes[0] + chunk * PER_CHUNK, chunk * room
        some = (begin, min(begin + PER_CHUNK, tubes[1]), tubes[2])
        counts[chunk] = -slot + _trace_some(
            window, some, faces, veil, media, bodies, first_body, limits, hits, (slot, slot + room)
        )
    return counts


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _sinc(x: float) -> float:
    return math.sin(x) / x if abs(x) > 1e-6 else 1.0


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _heard(current: NDArray[np.complex64], back: Vector, field: Vector) -> complex:
    """F = J·w + (M×q)·w of one wave."""
    turned = cross(back, field)
    total = 0j
    for x in range(3):
        total += current[0, x] * field[x] + current[1, x] * turned[x]
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _radiated(hits: Hits, i: int, back: Vector, r2: float, wavenumber: float) -> complex:
    """What multiplies F: −(j/8π) dS e^{−jk(L+r2)}/(L r2) and the footprint's phases."""
    a, b, d = vector(hits.side_a[i]), vector(hits.side_b[i]), vector(hits.direction[i])
    turn = (d[0] - back[0], d[1] - back[1], d[2] - back[2])
    square = cross(a, b)
    area = math.sqrt(dot(square, square))
    half = 0.5 * wavenumber
    share = _sinc(half * dot(turn, a)) * _sinc(half * dot(turn, b))
    phase = wavenumber * hits.roughness[i] * dot(turn, vector(hits.normal[i]))
    if phase != 0.0:
        share *= math.exp(-0.5 * phase * phase)
    scale = area * share / (8.0 * math.pi * hits.length[i] * r2)
    return complex(0.0, -scale) * _phasor(wavenumber * (hits.length[i] + r2))


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def radiate(
    hits: Hits, sink: FloatArray, not_from: int, wavenumber: float
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Transfer ``(hit, receiving·transmitting)``, direction and length of all last legs.

    Zero where the receiver is behind the surface, and from the body ``not_from``. What is in
    between is not looked at.
    """
    size = hits.length.size
    transfer = np.zeros((size, 4), dtype=np.complex128)
    backs, lengths = np.zeros((size, 3)), np.zeros(size)
    for i in prange(size):
        c = hits.point[i]
        q = (sink[0] - c[0], sink[1] - c[1], sink[2] - c[2])
        r2 = math.sqrt(dot(q, q))
        q = (q[0] / r2, q[1] / r2, q[2] / r2)
        backs[i, 0], backs[i, 1], backs[i, 2] = q
        lengths[i] = r2
        if hits.body[i] == not_from or dot(q, vector(hits.normal[i])) <= 0.0:
            continue
        away = (-q[0], -q[1], -q[2])
        h = _across((0.0, 0.0, 1.0), away, (0.0, 1.0, 0.0))
        v = cross(away, h)
        weight = _radiated(hits, i, q, r2, wavenumber)
        for t in range(2):
            transfer[i, t] = weight * _heard(hits.current[i, t], q, v)
            transfer[i, 2 + t] = weight * _heard(hits.current[i, t], q, h)
    return transfer, backs, lengths


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def unhidden(
    faces: Blockers,
    near: tuple[IntArray, IntArray, IntArray, IntArray],
    hits: Hits,
    sink: FloatArray,
    which: IntArray,
) -> BoolArray:
    """Whether nothing opaque is between hits ``which`` and a receiver.

    ``near`` are bodies, where those for every last body begin, and plates likewise.
    """
    bodies, body_start, plates, plate_start = near
    out = np.empty(which.size, dtype=np.bool_)
    for row in prange(which.size):
        i = which[row]
        b = hits.body[i]
        lifted = _ahead(vector(hits.point[i]), vector(hits.normal[i]), LIFT)
        out[row] = not is_blocked(
            faces,
            bodies[body_start[b] : body_start[b + 1]],
            plates[plate_start[b] : plate_start[b + 1]],
            vector(sink),
            lifted,
            SKIN,
        )
    return out
