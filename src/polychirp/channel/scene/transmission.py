r"""Losses of a straight leg of a path in the thin sheets and clouds of leaves that it crosses.

A sheet of glass or plastic changes the field E of a wave that travels along d to

.. math:: E' = T_s (E\cdot s)\,s + T_p (E\cdot p)\,p

where the unit vector s is perpendicular to the plane of incidence and p lies in it, both
perpendicular to d; `fresnel.sheet_transmission` gives T relative to the air that the sheet
displaces. The wave keeps its direction, since a sheet's faces are parallel. Echoes between two
sheets, and the sideways shift of the wave within one (1 mm for a pane), are neglected. A cloud
attenuates the power by
:math:`e^{-\alpha x}` over the length x inside; `clutter.foliage` adds the power that it scatters.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, row, vector_at
from polychirp.channel.materials.fresnel import Media, sheet_transmission
from polychirp.channel.scene.blockers import (
    CLOUD_ROLE,
    PANE_ROLE,
    PLATE_MEDIUM,
    PLATE_NORMAL,
    Blockers,
    crosses_plate,
    face_normal,
    first_hit_in_body,
    hits_body,
    in_world_frame,
    into_body,
    nodes_of,
)
from polychirp.channel.scene.world import POLARISATION_AXES, RADAR_CLEARANCE, World
from polychirp.jit import compiled, inlined, inner
from polychirp.threads import in_ranges

HIT_SEPARATION: Final = 1e-9
"""Distance by which the search for the next hit begins behind the last one, as a share of the
latter's distance. Chosen: a hit on the common edge of two triangles then counts once."""


class Wave(NamedTuple):
    """``axes``: `world.POLARISATION_AXES` in the blockers' frame, ``(2, xyz)``; wavenumber, 1/m."""

    axes: FloatArray
    wavenumber: float


class Leg(NamedTuple):
    """Start and end of a straight part of a path, m.

    It is a named tuple since Numba's parallel loops refuse plain tuples of tuples.
    """

    start: Vector
    end: Vector


def transmission_matrices(
    world: World,
    starts: FloatArray,
    ends: FloatArray,
    *,
    clearance: float = RADAR_CLEARANCE,
    but_body: int | None = None,
) -> ComplexArray:
    """Transmission of the straight legs from ``starts`` to ``ends``, m in the world ``(ray, xyz)``.

    Parameters
    ----------
    clearance : m from the start within which sheets are ignored and clouds do not attenuate
    but_body : number of a body whose sheets and leaves are ignored; None: no body is

    Returns
    -------
    matrix : ``(ray, 2, 2)``, from (V, H) at the start to (V, H) at the end, both of
        `frames.polarisation_basis` for the leg's direction. Opaque surfaces are ignored.

    Notes
    -----
    For a wave that travels from the end to the start the matrix is the transpose: thin sheets and
    clouds are reciprocal.
    """
    start, end = np.broadcast_arrays(starts, ends)
    out = np.zeros((len(start), 2, 2), dtype=np.complex128)
    out[:, 0, 0] = out[:, 1, 1] = 1.0
    bodies, plates = world.translucent_bodies, np.flatnonzero(world.plate_is_pane)
    if len(bodies) or len(plates):
        in_ranges(
            _fill_matrices,
            len(out),
            in_world_frame(world),
            world.media,
            Wave(POLARISATION_AXES, world.wavenumber),
            bodies[bodies != but_body],
            plates,
            np.stack([start, end], axis=1, dtype=np.float64),
            clearance,
            out,
            least=20,
        )
    return out


def with_leg_losses(
    transfer: ComplexArray, first: ComplexArray, last: ComplexArray
) -> ComplexArray:
    """Transfer matrices ``(path, 2, 2)`` times the losses of each path's first and last leg.

    ``first`` and ``last`` are `transmission_matrices` from the radar at that end of the path
    outwards.

    >>> half = 0.5 * np.eye(2, dtype=complex)[None]
    >>> float(with_leg_losses(np.ones((1, 2, 2), dtype=complex), half, half)[0, 0, 0].real)
    0.25
    """
    return np.asarray(np.swapaxes(last, -1, -2) @ transfer @ first)


@compiled
def _fill_matrices(
    begin: int,
    end: int,
    blockers: Blockers,
    media: Media,
    wave: Wave,
    bodies: IntArray,
    plates: IntArray,
    legs: FloatArray,
    clearance: float,
    out: ComplexArray,
) -> None:
    for ray in range(begin, end):
        a, b = legs[ray, 0], legs[ray, 1]
        leg = Leg((a[0], a[1], a[2]), (b[0], b[1], b[2]))
        if is_attenuated(blockers, bodies, plates, leg.start, leg.end, clearance):
            transmission_matrix(blockers, media, wave, bodies, plates, leg, clearance, out[ray])


@inlined
def _has_cloud(blockers: Blockers, b: int) -> bool:
    # the search tree of a body without a cloud has no triangles: it is a single node
    begin, end = nodes_of(blockers, CLOUD_ROLE, b)
    return bool(end - begin > 1)


@inner
def is_attenuated(
    blockers: Blockers,
    bodies: IntArray,
    plates: IntArray,
    start: Vector,
    end: Vector,
    clearance: float,
) -> bool:
    """True if one of ``plates``, or a sheet or cloud of ``bodies``, lies between two points."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = math.sqrt(dot(way, way))
    if length <= clearance:
        return False
    span = (clearance / length, 1.0)
    for p in plates:
        if crosses_plate(blockers.plate, p, start, way, span[0]):
            return True
    for b in bodies:
        place, along = into_body(blockers, b, start, way)
        if hits_body(blockers, nodes_of(blockers, PANE_ROLE, b), place, along, span):
            return True
        # a leg that begins and ends inside a cloud meets no border
        if _has_cloud(blockers, b) and chord(blockers, b, place, along, span)[0] > 0.0:
            return True
    return False


@inner
def chord(
    blockers: Blockers, b: int, start: Vector, way: Vector, span: tuple[float, float]
) -> tuple[float, int]:
    """Share of a leg inside a body's closed cloud, and the first triangle of its border on the way.

    ``span`` holds the shares of the leg between which it counts. If the first crossing leaves the
    cloud, the leg began inside. The search goes on up to the first crossing beyond the leg's end:
    if that one leaves the cloud, the leg ends inside.
    """
    inside, entered, stop = 0.0, span[0], span[1]
    border = nodes_of(blockers, CLOUD_ROLE, b)
    t, triangle = first_hit_in_body(blockers, border, start, way, (span[0], math.inf))
    first = triangle
    while t < math.inf:
        if _leaves(blockers.triangle[triangle], way):
            inside += max(0.0, min(t, stop) - min(entered, stop))
        else:
            entered = t
        if t >= stop:
            break
        behind = (t * (1.0 + HIT_SEPARATION), math.inf)
        t, triangle = first_hit_in_body(blockers, border, start, way, behind)
    return inside, first


@inner
def _leaves(triangle: FloatArray, way: Vector) -> bool:
    """True if a ray along ``way`` crosses a triangle from behind, along its normal."""
    u, v = (triangle[3], triangle[4], triangle[5]), (triangle[6], triangle[7], triangle[8])
    return dot(cross(u, v), way) > 0.0


@inner
def _polarisation_basis(direction: Vector, axes: FloatArray) -> tuple[Vector, Vector]:
    """(V, H) of `frames.polarisation_basis` for a direction, with `Wave.axes`."""
    h = cross(row(axes, 0), direction)
    size = math.sqrt(dot(h, h))
    h = row(axes, 1) if size < 1e-9 else (h[0] / size, h[1] / size, h[2] / size)
    return cross(direction, h), h


@inner
def transmission_matrix(
    blockers: Blockers,
    media: Media,
    wave: Wave,
    bodies: IntArray,
    plates: IntArray,
    leg: Leg,
    clearance: float,
    out: ComplexArray,
) -> None:
    """Fill ``out`` with the matrix ``(2, 2)`` of a leg, as `transmission_matrices` defines it."""
    start, end = leg
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = math.sqrt(dot(way, way))
    d = (way[0] / length, way[1] / length, way[2] / length)
    v, h = _polarisation_basis(d, wave.axes)
    out[0, 0] = out[1, 1] = 1.0
    out[0, 1] = out[1, 0] = 0.0
    nearest = clearance / length
    for p in plates:
        if crosses_plate(blockers.plate, p, start, way, nearest):
            normal = vector_at(blockers.plate, p, PLATE_NORMAL)
            medium = int(blockers.plate[p, PLATE_MEDIUM])
            _cross_sheet(media, medium, normal, d, (v, h), wave.wavenumber, out)
    for b in bodies:
        place, along = into_body(blockers, b, start, way)
        panes = nodes_of(blockers, PANE_ROLE, b)
        t, triangle = first_hit_in_body(blockers, panes, place, along, (nearest, 1.0))
        while t < math.inf:
            normal, medium = face_normal(blockers, b, triangle), blockers.medium[triangle]
            _cross_sheet(media, medium, normal, d, (v, h), wave.wavenumber, out)
            behind = (t * (1.0 + HIT_SEPARATION), 1.0)
            t, triangle = first_hit_in_body(blockers, panes, place, along, behind)
        if _has_cloud(blockers, b):
            share, triangle = chord(blockers, b, place, along, (nearest, 1.0))
            if share > 0.0:
                fade = media.attenuation[blockers.medium[triangle]] * share * length
                out *= math.exp(-0.5 * fade)


@inner
def _cross_sheet(
    media: Media,
    medium: int,
    normal: Vector,
    d: Vector,
    vh: tuple[Vector, Vector],
    wavenumber: float,
    out: ComplexArray,
) -> None:
    """Multiply the matrix ``out`` from the left by a sheet's transmission; ``vh``: V and H."""
    pass_s, pass_p = sheet_transmission(media, medium, abs(dot(normal, d)), wavenumber)
    s = cross(d, normal)
    size = math.sqrt(dot(s, s))
    if size < 1e-9:  # at normal incidence both polarisations pass alike
        out *= pass_s
        return
    along, up = dot(s, vh[0]) / size, dot(s, vh[1]) / size  # s in V and H; p is (up, −along)
    vv = pass_s * along * along + pass_p * up * up
    hh = pass_s * up * up + pass_p * along * along
    vh_ = (pass_s - pass_p) * along * up
    for column in range(2):
        a, b = out[0, column], out[1, column]
        out[0, column], out[1, column] = vv * a + vh_ * b, vh_ * a + hh * b
