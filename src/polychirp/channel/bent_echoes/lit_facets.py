"""Facets of a body that the waves over a vehicle's edges reach, with the waves' geometry."""

import math
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.bent_echoes.edge_waves import path_over, waves_at
from polychirp.channel.geometry.vectors import Vector, cross, dot, row
from polychirp.channel.physical_optics.kernels import (
    ALONG_FIRST,
    ALONG_SECOND,
    FACING,
    INVERSE_LENGTH,
    NUM_ASPECTS,
    Faces,
)
from polychirp.jit import compiled, inlined
from polychirp.threads import in_ranges

WEAKEST_WAVE: Final = 1e-3
"""Least amplitude of an edge's wave on a facet or patch, over that without the vehicle, for it to
count. Chosen: −60 dB one way, 26 dB below the least edge (`bent_views.WEAKEST_EDGE`)."""

MOST_TURNED_AWAY: Final = 0.34
"""Greatest cosine between the normal of a facet that a bent wave may reach and the straight line
from the radar: sin 20°, as far as Kirchhoff's integral holds."""


class Reach(NamedTuple):
    """Views over edges of one vehicle, and what their waves may reach of a body.

    ``edge`` ``(view,)`` is the number of each view's edge. ``is_reached`` ``(view, patch)`` marks
    the patches that a wave may reach, ``patch`` ``(face,)`` is the patch of a facet, and
    ``is_seen`` ``(face,)`` marks the facets that the straight wave of the radar illuminates.
    ``pose`` ``(4, xyz)``: the rows of the body's rotation matrix, and its place, m from the radar.
    """

    edge: IntArray
    is_reached: BoolArray
    patch: IntArray
    is_seen: BoolArray
    pose: FloatArray


class EdgeLit(NamedTuple):
    """Facets that the wave over one edge lights, ``(row, …)``, in the body's frame.

    ``face`` is the facet's number, ``field`` the wave as `EdgeWaves` has it; ``length`` m,
    ``direction`` ``(row, xyz)`` and ``aspect`` ``(row, NUM_ASPECTS)`` are as in `LitFacets`.
    """

    face: IntArray
    field: ComplexArray
    length: FloatArray
    direction: FloatArray
    aspect: FloatArray


NONE_LIT: Final = EdgeLit(
    np.zeros(0, dtype=np.int64),
    np.zeros(0, dtype=np.complex128),
    np.zeros(0),
    np.zeros((0, 3)),
    np.zeros((0, NUM_ASPECTS)),
)
"""No lit facets."""


def facets_lit(table: FloatArray, faces: Faces, reach: Reach, wavenumber: float) -> list[EdgeLit]:
    """Facets of a body that each view of ``reach`` lights; ``table`` is by `edge_table`.

    Where the straight line to a facet is not what the box of the vehicle's edges says, an edge's
    wave changes its sign: the field of a single edge is then the right one.
    """
    face = np.flatnonzero(np.any(reach.is_reached, axis=0)[reach.patch])
    shape = len(reach.edge), len(face)
    is_lit = np.zeros(shape, dtype=np.bool_)
    columns = (
        np.empty(shape, dtype=np.complex128),
        np.empty(shape),
        np.empty((*shape, 3)),
        np.empty((*shape, NUM_ASPECTS)),
    )
    in_ranges(
        _fill_lit, len(face), table, faces, reach, wavenumber, face, is_lit, columns, least=500
    )
    rows = [np.flatnonzero(mask) for mask in is_lit]
    return [
        EdgeLit(face[some], *[np.take(column[view], some, axis=0) for column in columns])
        for view, some in enumerate(rows)
    ]


@compiled
def _fill_lit(
    begin: int,
    end: int,
    table: FloatArray,
    faces: Faces,
    reach: Reach,
    wavenumber: float,
    face: IntArray,
    is_lit: BoolArray,
    columns: tuple[ComplexArray, FloatArray, FloatArray, FloatArray],
) -> None:
    field, length, direction, aspect = columns
    edges, is_reached, patches, is_seen = reach.edge, reach.is_reached, reach.patch, reach.is_seen
    x, y, z, shift = row(reach.pose, 0), row(reach.pose, 1), row(reach.pose, 2), row(reach.pose, 3)
    for i in range(begin, end):
        f = face[i]
        c, n = row(faces.centroid, f), row(faces.normal, f)
        point = dot(x, c) + shift[0], dot(y, c) + shift[1], dot(z, c) + shift[2]
        away = math.sqrt(dot(point, point))
        # a wave that bends by less than 20° does not reach facets that are turned away by more
        if dot(point, (dot(x, n), dot(y, n), dot(z, n))) >= MOST_TURNED_AWAY * away:
            continue
        waves = waves_at(table, point, wavenumber)
        sign = 1.0 if is_seen[f] == (waves.is_clear > 0.5) else -1.0
        for view in range(edges.size):
            edge = edges[view]
            wave = waves.field[edge]
            square = wave.real * wave.real + wave.imag * wave.imag
            if square <= WEAKEST_WAVE**2 or not is_reached[view, patches[f]]:
                continue
            path = path_over(table, edge, point, waves.over[edge])
            d = _turned_back(x, y, z, path.direction)
            if dot(d, n) >= 0.0:
                continue
            is_lit[view, i] = True
            field[view, i], length[view, i] = sign * wave, path.length
            for corner in range(3):
                direction[view, i, corner] = d[corner]
                offset = row(faces.corner[f], corner)
                aspect[view, i, corner] = path.length + dot(d, offset)
            t = row(faces.tangent, f)
            aspect[view, i, FACING] = -dot(n, d)
            aspect[view, i, ALONG_FIRST] = dot(d, t)
            aspect[view, i, ALONG_SECOND] = dot(d, cross(n, t))
            # the field is relative to that at the straight distance, without the vehicle
            aspect[view, i, INVERSE_LENGTH] = 1.0 / away


@inlined
def _turned_back(x: Vector, y: Vector, z: Vector, d: Vector) -> Vector:
    """A direction of the world in the frame of a body, whose rotation matrix has these rows."""
    return (
        x[0] * d[0] + y[0] * d[1] + z[0] * d[2],
        x[1] * d[0] + y[1] * d[1] + z[1] * d[2],
        x[2] * d[0] + y[2] * d[1] + z[2] * d[2],
    )
