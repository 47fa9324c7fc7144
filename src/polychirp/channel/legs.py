r"""What a straight leg of a path loses in thin sheets and clouds of leaves on its way.

A sheet of glass or plastic turns the field of a wave along d, with s across the plane of incidence
and p in it, to

.. math:: E' = T_s (E\cdot s)\,s + T_p (E\cdot p)\,p

with the transmission of `fresnel.sheet` instead of the air that the sheet displaces; the wave goes
on in its direction, since a sheet's faces are parallel. Echoes between two sheets, and the shift of
the beam within one (1 mm for a pane), are left out. A cloud takes power away as
:math:`e^{-\alpha x}` over the length x inside; what it scatters is `foliage`'s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.caster import Vector, first_hit
from polychirp.channel.fresnel import Media, sheet_transmission
from polychirp.channel.vectors import cross, dot, row
from polychirp.channel.world import SKIN, UPWARDS, World

PAST = 1e-9
"""Share of a leg by which the search goes on behind a hit: two triangles share an edge."""


class Veil(NamedTuple):
    """Panes and clouds in the frame of one body. Flat, as `Blockers` is.

    ``turn``, ``shift`` ``(body, …)`` take a point of this frame to the frame of each body. The
    trees' ``medium`` ``(triangle,)`` are numbers into the world's materials.
    """

    pane_box: FloatArray
    pane_skip: IntArray
    pane_first: IntArray
    pane_size: IntArray
    pane_triangle: FloatArray
    pane_root: IntArray
    pane_medium: IntArray
    cloud_box: FloatArray
    cloud_skip: IntArray
    cloud_first: IntArray
    cloud_size: IntArray
    cloud_triangle: FloatArray
    cloud_root: IntArray
    cloud_medium: IntArray
    turn: FloatArray
    shift: FloatArray
    plate_centre: FloatArray
    plate_normal: FloatArray
    plate_across: FloatArray
    plate_along: FloatArray
    half_across: FloatArray
    half_along: FloatArray
    plate_medium: IntArray


def veil_of(world: World, rotation: FloatArray, position: FloatArray) -> Veil:
    """All panes and clouds, seen from a frame at ``position`` (m) turned by ``rotation``."""
    back = np.swapaxes(world.rotation, 1, 2)
    plates, panes, clouds = world.plates, world.panes, world.clouds
    return Veil(
        *panes.tree[:5],
        panes.root,
        world.medium_of("pane"),
        *clouds.tree[:5],
        clouds.root,
        world.medium_of("cloud"),
        turn=np.ascontiguousarray(back @ rotation),
        shift=np.einsum("bij,bj->bi", back, position - world.position),
        plate_centre=(plates.centre - position) @ rotation,
        plate_normal=plates.normal @ rotation,
        plate_across=plates.across @ rotation,
        plate_along=plates.along @ rotation,
        half_across=plates.half_across,
        half_along=plates.half_along,
        plate_medium=plates.medium,
    )


def through(
    world: World,
    starts: FloatArray,
    ends: FloatArray,
    *,
    skin: float = SKIN,
    but_body: int | None = None,
) -> ComplexArray:
    """What is left of a wave on its straight ways between points of the world, m ``(ray, xyz)``.

    Parameters
    ----------
    skin : m from the start within which nothing is met
    but_body : number of the one body that does not count

    Returns
    -------
    matrix : ``(ray, 2, 2)``, from (V, H) at the start to (V, H) at the end, both of
        `frames.polarisation_basis` along the way. Whatever is opaque counts as absent.

    Notes
    -----
    Of a leg on which the wave comes in, the matrix is that of the way back, transposed: thin
    sheets and clouds are reciprocal.
    """
    start, end = np.broadcast_arrays(starts, ends)
    out = np.zeros((len(start), 2, 2), dtype=np.complex128)
    out[:, 0, 0] = out[:, 1, 1] = 1.0
    plates = np.flatnonzero(world.plate_is_pane)
    if len(world.veiled) or len(plates):
        _through(
            veil_of(world, np.eye(3), np.zeros(3)),
            world.media,
            world.veiled[world.veiled != but_body],
            plates,
            np.ascontiguousarray(start, dtype=np.float64),
            np.ascontiguousarray(end, dtype=np.float64),
            skin,
            UPWARDS,
            world.wavenumber,
            out,
        )
    return out


def with_legs(transfer: ComplexArray, first: ComplexArray, last: ComplexArray) -> ComplexArray:
    """A transfer ``(path, 2, 2)`` with the losses of its first and its last leg.

    Both are those of `through` from the radar at their end outwards.

    >>> half = 0.5 * np.eye(2, dtype=complex)[None]
    >>> float(with_legs(np.ones((1, 2, 2), dtype=complex), half, half)[0, 0, 0].real)
    0.25
    """
    return np.asarray(np.swapaxes(last, -1, -2) @ transfer @ first)


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def _through(
    veil: Veil,
    media: Media,
    bodies: IntArray,
    plates: IntArray,
    starts: FloatArray,
    ends: FloatArray,
    skin: float,
    upwards: FloatArray,
    wavenumber: float,
    out: ComplexArray,
) -> None:
    for ray in prange(len(starts)):
        a, b = starts[ray], ends[ray]
        start, end = (a[0], a[1], a[2]), (b[0], b[1], b[2])
        if is_veiled(veil, bodies, plates, start, end, skin):
            lose(veil, media, bodies, plates, start, end, skin, upwards, wavenumber, out[ray])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _turned(matrix: FloatArray, v: Vector) -> Vector:
    return (
        matrix[0, 0] * v[0] + matrix[0, 1] * v[1] + matrix[0, 2] * v[2],
        matrix[1, 0] * v[0] + matrix[1, 1] * v[1] + matrix[1, 2] * v[2],
        matrix[2, 0] * v[0] + matrix[2, 1] * v[1] + matrix[2, 2] * v[2],
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _plate_hit(veil: Veil, p: int, start: Vector, way: Vector, nearest: float) -> bool:
    """Whether a leg crosses a plate."""
    n, c = row(veil.plate_normal, p), row(veil.plate_centre, p)
    slope = dot(n, way)
    if slope == 0.0:
        return False
    gap = (start[0] - c[0], start[1] - c[1], start[2] - c[2])
    t = -dot(n, gap) / slope
    if not nearest < t < 1.0:
        return False
    meet = (gap[0] + t * way[0], gap[1] + t * way[1], gap[2] + t * way[2])
    if abs(dot(row(veil.plate_across, p), meet)) > veil.half_across[p]:
        return False
    return bool(abs(dot(row(veil.plate_along, p), meet)) <= veil.half_along[p])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _pane_hit(
    veil: Veil,
    b: int,
    start: Vector,
    way: Vector,
    span: tuple[float, float],
    any_will_do: bool,
) -> tuple[float, int]:
    """Share of the leg, and triangle, of a body's first or any pane within a span of the leg."""
    return first_hit(
        veil.pane_box,
        veil.pane_skip,
        veil.pane_first,
        veil.pane_size,
        veil.pane_triangle,
        (veil.pane_root[b], veil.pane_root[b + 1]),
        start,
        way,
        span,
        any_will_do,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _cloud_hit(
    veil: Veil, b: int, start: Vector, way: Vector, span: tuple[float, float]
) -> tuple[float, int]:
    """Share of the leg, and triangle, of the first border of a body's cloud within a span."""
    return first_hit(
        veil.cloud_box,
        veil.cloud_skip,
        veil.cloud_first,
        veil.cloud_size,
        veil.cloud_triangle,
        (veil.cloud_root[b], veil.cloud_root[b + 1]),
        start,
        way,
        span,
        False,
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _in_body(veil: Veil, b: int, start: Vector, way: Vector) -> tuple[Vector, Vector]:
    place, shift = _turned(veil.turn[b], start), row(veil.shift, b)
    return (
        (place[0] + shift[0], place[1] + shift[1], place[2] + shift[2]),
        _turned(veil.turn[b], way),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def is_veiled(
    veil: Veil, bodies: IntArray, plates: IntArray, start: Vector, end: Vector, skin: float
) -> bool:
    """Whether a pane or a cloud of ``bodies`` or ``plates`` is on the way between two points."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = math.sqrt(dot(way, way))
    if length <= skin:
        return False
    span = (skin / length, 1.0)
    for p in plates:
        if _plate_hit(veil, p, start, way, span[0]):
            return True
    for b in bodies:
        place, along = _in_body(veil, b, start, way)
        if _pane_hit(veil, b, place, along, span, True)[0] < math.inf:
            return True
        # from inside a cloud to inside it no border is met
        if veil.cloud_root[b + 1] - veil.cloud_root[b] > 1 and (
            _chord(veil, b, place, along, span)[0] > 0.0
        ):
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def _chord(
    veil: Veil, b: int, start: Vector, way: Vector, span: tuple[float, float]
) -> tuple[float, int]:
    """Share of a leg inside a body's closed cloud, and a triangle of its border.

    A way out that was not preceded by a way in says that the leg begins inside; the first border
    behind its end says whether it ends there.
    """
    inside, entered, stop = 0.0, span[0], span[1]
    t, triangle = _cloud_hit(veil, b, start, way, (span[0], math.inf))
    border = triangle
    while t < math.inf:
        if _leaves(veil.cloud_triangle[triangle], way):
            inside += max(0.0, min(t, stop) - min(entered, stop))
        else:
            entered = t
        if t >= stop:
            break
        t, triangle = _cloud_hit(veil, b, start, way, (t * (1.0 + PAST), math.inf))
    return inside, border


@njit(cache=True, nogil=True, error_model="numpy")
def _leaves(triangle: FloatArray, way: Vector) -> bool:
    """Whether a way crosses a triangle from behind."""
    u, v = (triangle[3], triangle[4], triangle[5]), (triangle[6], triangle[7], triangle[8])
    return dot(cross(u, v), way) > 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def basis(direction: Vector, upwards: FloatArray) -> tuple[Vector, Vector]:
    """(V, H) of `frames.polarisation_basis`; ``upwards`` are the world's z and y, ``(2, xyz)``."""
    h = cross(row(upwards, 0), direction)
    size = math.sqrt(dot(h, h))
    h = row(upwards, 1) if size < 1e-9 else (h[0] / size, h[1] / size, h[2] / size)
    return cross(direction, h), h


@njit(cache=True, nogil=True, error_model="numpy")
def lose(
    veil: Veil,
    media: Media,
    bodies: IntArray,
    plates: IntArray,
    start: Vector,
    end: Vector,
    skin: float,
    upwards: FloatArray,
    wavenumber: float,
    out: ComplexArray,
) -> None:
    """Fill the matrix ``(2, 2)`` of one leg, as `through` gives it."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = math.sqrt(dot(way, way))
    d = (way[0] / length, way[1] / length, way[2] / length)
    v, h = basis(d, upwards)
    out[0, 0] = out[1, 1] = 1.0
    out[0, 1] = out[1, 0] = 0.0
    nearest = skin / length
    for p in plates:
        if _plate_hit(veil, p, start, way, nearest):
            normal = row(veil.plate_normal, p)
            _cross_sheet(media, veil.plate_medium[p], normal, d, (v, h), wavenumber, out)
    for b in bodies:
        place, along = _in_body(veil, b, start, way)
        t, triangle = _pane_hit(veil, b, place, along, (nearest, 1.0), False)
        while t < math.inf:
            normal = _face_normal(veil.pane_triangle[triangle], veil.turn[b])
            _cross_sheet(media, veil.pane_medium[triangle], normal, d, (v, h), wavenumber, out)
            t, triangle = _pane_hit(veil, b, place, along, (t * (1.0 + PAST), 1.0), False)
        if veil.cloud_root[b + 1] - veil.cloud_root[b] > 1:
            share, triangle = _chord(veil, b, place, along, (nearest, 1.0))
            if share > 0.0:
                fade = media.attenuation[veil.cloud_medium[triangle]] * share * length
                out *= math.exp(-0.5 * fade)


@njit(cache=True, nogil=True, error_model="numpy")
def _face_normal(triangle: FloatArray, turn: FloatArray) -> Vector:
    """Unit normal of a triangle of a body, in the frame that ``turn`` takes to the body's."""
    n = cross((triangle[3], triangle[4], triangle[5]), (triangle[6], triangle[7], triangle[8]))
    size = math.sqrt(dot(n, n))
    return (
        (turn[0, 0] * n[0] + turn[1, 0] * n[1] + turn[2, 0] * n[2]) / size,
        (turn[0, 1] * n[0] + turn[1, 1] * n[1] + turn[2, 1] * n[2]) / size,
        (turn[0, 2] * n[0] + turn[1, 2] * n[1] + turn[2, 2] * n[2]) / size,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _cross_sheet(
    media: Media,
    medium: int,
    normal: Vector,
    d: Vector,
    vh: tuple[Vector, Vector],
    wavenumber: float,
    out: ComplexArray,
) -> None:
    """Multiply a matrix from the left by what a sheet lets through."""
    pass_s, pass_p = sheet_transmission(media, medium, abs(dot(normal, d)), wavenumber)
    s = cross(d, normal)
    size = math.sqrt(dot(s, s))
    if size < 1e-9:  # straight through, both pass alike
        out *= pass_s
        return
    along, up = dot(s, vh[0]) / size, dot(s, vh[1]) / size  # s in V and H; p is (up, −along)
    vv = pass_s * along * along + pass_p * up * up
    hh = pass_s * up * up + pass_p * along * along
    vh_ = (pass_s - pass_p) * along * up
    for column in range(2):
        a, b = out[0, column], out[1, column]
        out[0, column], out[1, column] = vv * a + vh_ * b, vh_ * a + hh * b
