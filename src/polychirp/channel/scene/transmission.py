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

import numpy as np
from numba import njit, prange

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.geometry.bvh import Vector
from polychirp.channel.geometry.vectors import cross, dot, row, vector_at
from polychirp.channel.materials.fresnel import Media, sheet_transmission
from polychirp.channel.scene.blockers import (
    CLOUDS,
    MEDIUM,
    NORMAL,
    PANES,
    Blockers,
    crosses_plate,
    face_normal,
    hit_body,
    in_frame_of,
    into_body,
    nodes_of,
)
from polychirp.channel.scene.world import SKIN, UPWARDS, World

PAST = 1e-9
"""Share of a leg by which the search goes on behind a hit: two triangles share an edge."""


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
            in_frame_of(world, np.eye(3), np.zeros(3)),
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
    blockers: Blockers,
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
        if is_veiled(blockers, bodies, plates, start, end, skin):
            lose(blockers, media, bodies, plates, start, end, skin, upwards, wavenumber, out[ray])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def has_cloud(blockers: Blockers, b: int) -> bool:
    """Whether a body has a cloud of leaves; a tree without triangles has one node."""
    begin, end = nodes_of(blockers, CLOUDS, b)
    return bool(end - begin > 1)


@njit(cache=True, nogil=True, error_model="numpy")
def is_veiled(
    blockers: Blockers, bodies: IntArray, plates: IntArray, start: Vector, end: Vector, skin: float
) -> bool:
    """Whether a pane or a cloud of ``bodies`` or ``plates`` is on the way between two points."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = math.sqrt(dot(way, way))
    if length <= skin:
        return False
    span = (skin / length, 1.0)
    for p in plates:
        if crosses_plate(blockers.plate, p, start, way, span[0]):
            return True
    for b in bodies:
        place, along = into_body(blockers, b, start, way)
        panes = nodes_of(blockers, PANES, b)
        if hit_body(blockers, panes, place, along, span, True)[0] < math.inf:
            return True
        # from inside a cloud to inside it no border is met
        if has_cloud(blockers, b) and chord(blockers, b, place, along, span)[0] > 0.0:
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def chord(
    blockers: Blockers, b: int, start: Vector, way: Vector, span: tuple[float, float]
) -> tuple[float, int]:
    """Share of a leg inside a body's closed cloud, and a triangle of its border.

    A way out that was not preceded by a way in says that the leg begins inside; the first border
    behind its end says whether it ends there.
    """
    inside, entered, stop = 0.0, span[0], span[1]
    border = nodes_of(blockers, CLOUDS, b)
    t, triangle = hit_body(blockers, border, start, way, (span[0], math.inf), False)
    first = triangle
    while t < math.inf:
        if _leaves(blockers.triangle[triangle], way):
            inside += max(0.0, min(t, stop) - min(entered, stop))
        else:
            entered = t
        if t >= stop:
            break
        behind = (t * (1.0 + PAST), math.inf)
        t, triangle = hit_body(blockers, border, start, way, behind, False)
    return inside, first


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
    blockers: Blockers,
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
        if crosses_plate(blockers.plate, p, start, way, nearest):
            normal, medium = vector_at(blockers.plate, p, NORMAL), int(blockers.plate[p, MEDIUM])
            _cross_sheet(media, medium, normal, d, (v, h), wavenumber, out)
    for b in bodies:
        place, along = into_body(blockers, b, start, way)
        panes = nodes_of(blockers, PANES, b)
        t, triangle = hit_body(blockers, panes, place, along, (nearest, 1.0), False)
        while t < math.inf:
            normal, medium = face_normal(blockers, b, triangle), blockers.medium[triangle]
            _cross_sheet(media, medium, normal, d, (v, h), wavenumber, out)
            behind = (t * (1.0 + PAST), 1.0)
            t, triangle = hit_body(blockers, panes, place, along, behind, False)
        if has_cloud(blockers, b):
            share, triangle = chord(blockers, b, place, along, (nearest, 1.0))
            if share > 0.0:
                fade = media.attenuation[blockers.medium[triangle]] * share * length
                out *= math.exp(-0.5 * fade)


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
