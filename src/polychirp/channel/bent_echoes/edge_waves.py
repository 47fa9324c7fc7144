r"""Waves over the edges of a vehicle in front of points: amplitude, length and direction.

Seen from a radar, the vehicle is a box with a top edge and two upright side edges; each edge is a
prism whose cross-section has a first and a second corner (`outlines`). Let :math:`D_t, D_l, D_r` be
the fields of `two_edges` behind the top, the left and the right edge alone. Since the aperture is
what the box leaves free, and Fresnel integrals over a rectangle are products, Babinet's principle
gives

.. math:: \frac{U}{U_0} = 1 - (1 - D_t)(1 - D_l - D_r)

With :math:`D = H + w`, H being 1 or 0, this is the straight wave, one wave for every edge,

.. math::
    w_t\left(1 - H_l - H_r\right), \quad w_l\,(1 - H_t), \quad w_r\,(1 - H_t)

and products :math:`-w_t w_l` and :math:`-w_t w_r`, the waves of the corners. Such a product is
divided between its two edges, mostly to the one whose path is longer, since the phase of the other
one changes slowly there.

The path over parallel edges is straight if the prism's planes are unfolded: with the length ℓ in
the plane across the edges and the offset w along them, it is :math:`\sqrt{\ell^2 + w^2}` long.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.bent_echoes.two_edges import (
    OVER_FIRST,
    OVER_SECOND,
    two_edge_field,
)
from polychirp.channel.geometry.vectors import Vector, dot, row, vector_at
from polychirp.channel.physical_optics.facet_integral import phasor
from polychirp.jit import compiled, inlined, inner
from polychirp.threads import in_ranges

TOP, LEFT, RIGHT, NUM_EDGES = 0, 1, 2, 3
"""Rows of `Edges`, and their number."""

WEAKENED_FROM, WEAKENED_TO = 5.0, 10.0
"""Fresnel parameters of an illuminated point between which an edge's wave falls to zero. Chosen: a
straight edge makes 0.045 of the field without it at the first, and 0.023 at the second (−33 dB)."""

ONWARDS, OUTWARDS, ALONG, FIRST, SECOND, TABLE_WIDTH = 0, 3, 6, 9, 11, 13
"""Columns of the table of `edge_table`: three vectors, two corners; and their number."""


class _Heights(NamedTuple):
    """Arguments of `two_edge_field` for one edge of the vehicle and one point.

    ``is_far_off`` is true if the edge is not between the radar and the point, or so far below the
    straight line that no edge of the vehicle matters.
    """

    is_far_off: bool
    first: float
    second: float
    correlation: float


FAR_OFF: Final = _Heights(True, 0.0, 0.0, 0.0)
"""Heights of an edge far off the straight line."""


class Edges(NamedTuple):
    """Three edges of a vehicle as seen by one radar, ``(edge, …)``, lengths from the radar in m.

    ``onwards``, ``outwards`` and ``along`` ``(edge, xyz)`` are unit vectors: horizontal from the
    radar towards the illuminated body, away from the vehicle, and along the edge. ``corner``
    ``(edge, 2, 2)`` holds the components onwards and outwards of the first and the second corner.
    """

    onwards: FloatArray
    outwards: FloatArray
    along: FloatArray
    corner: FloatArray


class EdgeWaves(NamedTuple):
    """Waves over every edge at some points, ``(edge, point, …)``.

    ``field`` is the wave over the field without the vehicle at that point, times e^{jk(L − r)}
    with the wave's ``length`` L and the point's distance r, m. ``direction`` ``(…, xyz)`` is that
    of arrival. ``bend`` ``(…, 2, xyz)`` are the first and the last point of the path on the
    vehicle, m from the radar. ``is_clear`` ``(point,)`` is 1 where the straight line passes the
    box.
    """

    field: ComplexArray
    length: FloatArray
    direction: FloatArray
    bend: FloatArray
    is_clear: FloatArray


def edge_waves(
    edges: Edges, points: FloatArray, wavenumber: float, *, some: IntArray | None = None
) -> EdgeWaves:
    """Waves at ``points``, m from the radar ``(point, xyz)``.

    If numbers of ``some`` points are given, there are no waves at the others.
    """
    count = len(points)
    some = np.arange(count) if some is None else some
    out = EdgeWaves(
        np.zeros((NUM_EDGES, count), dtype=np.complex128),
        np.ones((NUM_EDGES, count)),
        np.zeros((NUM_EDGES, count, 3)),
        np.zeros((NUM_EDGES, count, 2, 3)),
        np.ones(count),
    )
    in_ranges(_fill_waves, len(some), edge_table(edges), points, some, wavenumber, out, least=500)
    return out


def edge_table(edges: Edges) -> FloatArray:
    """Edges as one table ``(edge, TABLE_WIDTH)``: kernels copy every array at every call."""
    corner = edges.corner.reshape(NUM_EDGES, 4)
    return np.concatenate([edges.onwards, edges.outwards, edges.along, corner], axis=1)


@compiled
def _fill_waves(
    begin: int,
    end: int,
    table: FloatArray,
    points: FloatArray,
    some: IntArray,
    wavenumber: float,
    out: EdgeWaves,
) -> None:
    """Fill the columns of ``out`` at some of the points, from ``begin`` to ``end`` of them."""
    field, length, direction, bend = out.field, out.length, out.direction, out.bend
    for i in some[begin:end]:
        point = row(points, i)
        waves = waves_at(table, point, wavenumber)
        out.is_clear[i] = waves.is_clear
        for edge in range(NUM_EDGES):
            field[edge, i] = waves.field[edge]
            if field[edge, i] == 0.0:
                continue
            path = path_over(table, edge, point, waves.over[edge])
            length[edge, i] = path.length
            for a in range(3):
                direction[edge, i, a] = path.direction[a]
                bend[edge, i, 0, a] = path.first[a]
                bend[edge, i, 1, a] = path.last[a]


class WavesAt(NamedTuple):
    """Waves over the three edges at one point: ``is_clear`` and ``field`` as in `EdgeWaves`.

    ``over`` are the corners of each edge that the path meets, as in `EdgeField`.
    """

    is_clear: float
    field: tuple[complex, complex, complex]
    over: tuple[int, int, int]


@inner
def waves_at(table: FloatArray, point: Vector, wavenumber: float) -> WavesAt:
    """Waves at a point, m from the radar; ``table`` is by `edge_table`."""
    over, left_of = _heights(table, TOP, point, wavenumber), FAR_OFF
    if not over.is_far_off:
        left_of = _heights(table, LEFT, point, wavenumber)
    if left_of.is_far_off:
        return WavesAt(1.0, (0j, 0j, 0j), (0, 0, 0))
    right_of = _heights(table, RIGHT, point, wavenumber)
    if right_of.is_far_off:
        return WavesAt(1.0, (0j, 0j, 0j), (0, 0, 0))
    top = two_edge_field(over.first, over.second, over.correlation)
    left = two_edge_field(left_of.first, left_of.second, left_of.correlation)
    right = two_edge_field(right_of.first, right_of.second, right_of.correlation)
    below, between = 1.0 - top.clear, 1.0 - left.clear - right.clear
    is_clear = 1.0 - below * between
    at_left, at_right = top.wave * left.wave, top.wave * right.wave
    left_share = _share_of_top(top.square, left.square)
    right_share = _share_of_top(top.square, right.square)
    over_top = top.wave * between - left_share * at_left - right_share * at_right
    over_left = left.wave * below - (1.0 - left_share) * at_left
    over_right = right.wave * below - (1.0 - right_share) * at_right
    field = (
        over_top * _phased(top.square, is_clear),
        over_left * _phased(left.square, is_clear),
        over_right * _phased(right.square, is_clear),
    )
    return WavesAt(is_clear, field, (top.over, left.over, right.over))


@inlined
def _phased(square: float, is_clear: float) -> complex:
    """Factor that refers a wave's phase to its path, and weakens it beside the vehicle."""
    turned = phasor(-0.5 * math.pi * square)
    return _weight(math.sqrt(square)) * turned if is_clear > 0.0 else turned


@inlined
def _share_of_top(top: float, side: float) -> float:
    """Share of the top edge in the wave of its corner with a side, by the squares of both ν."""
    both = top * top + side * side
    return top * top / both if both > 0.0 else 0.5


@inlined
def _weight(nu: float) -> float:
    """Smooth step from 1 at `WEAKENED_FROM` to 0 at `WEAKENED_TO`."""
    x = min(1.0, max(0.0, (WEAKENED_TO - nu) / (WEAKENED_TO - WEAKENED_FROM)))
    return x * x * (3.0 - 2.0 * x)


@inlined
def _heights(table: FloatArray, edge: int, point: Vector, wavenumber: float) -> _Heights:
    """Heights of an edge above the straight line to a point."""
    x, y = dot(point, vector_at(table, edge, ONWARDS)), dot(point, vector_at(table, edge, OUTWARDS))
    offset = dot(point, vector_at(table, edge, ALONG))
    first, last = table[edge, FIRST], table[edge, SECOND]
    if last >= x or first <= 0.0:
        return FAR_OFF
    one = _fresnel_parameter(first, table[edge, FIRST + 1], x, y, offset, wavenumber)
    other = _fresnel_parameter(last, table[edge, SECOND + 1], x, y, offset, wavenumber)
    if max(one, other) < -WEAKENED_TO:
        return FAR_OFF
    correlation = math.sqrt(first * (x - last) / (last * (x - first)))
    return _Heights(False, one, other, min(correlation, 1.0))


@inlined
def _fresnel_parameter(
    depth: float, height: float, x: float, y: float, offset: float, wavenumber: float
) -> float:
    """ν of one corner, for a point at (x, y) across the edge and ``offset`` along it, m."""
    over = _size(depth, height) + _size(x - depth, y - height)
    straight = x * x + y * y
    square = over * over - straight
    bound = _size(over, offset) + math.sqrt(straight + offset * offset)
    nu = math.sqrt(2.0 * wavenumber * max(square, 0.0) / (math.pi * bound))
    return math.copysign(nu, height * x - y * depth)


@inlined
def _size(x: float, y: float) -> float:
    return math.sqrt(x * x + y * y)


class EdgePath(NamedTuple):
    """Path over an edge to a point: ``length`` m, unit vector ``direction`` of arrival.

    ``first`` and ``last`` are its first and last point on the vehicle, m from the radar.
    """

    length: float
    direction: Vector
    first: Vector
    last: Vector


@inlined
def path_over(table: FloatArray, edge: int, point: Vector, over: int) -> EdgePath:
    """Path over one corner of an edge, or over both."""
    onwards, outwards = vector_at(table, edge, ONWARDS), vector_at(table, edge, OUTWARDS)
    along = vector_at(table, edge, ALONG)
    x, y, offset = dot(point, onwards), dot(point, outwards), dot(point, along)
    first = SECOND if over == OVER_SECOND else FIRST
    last = FIRST if over == OVER_FIRST else SECOND
    fx, fy = table[edge, first], table[edge, first + 1]
    lx, ly = table[edge, last], table[edge, last + 1]
    start, middle, rest = _size(fx, fy), _size(lx - fx, ly - fy), _size(x - lx, y - ly)
    across = start + middle + rest
    length = _size(across, offset)
    before, behind = offset * start / across, offset * (start + middle) / across
    scale, aside = across / (rest * length), offset / length
    return EdgePath(
        length,
        _combined(onwards, outwards, along, scale * (x - lx), scale * (y - ly), aside),
        _combined(onwards, outwards, along, fx, fy, before),
        _combined(onwards, outwards, along, lx, ly, behind),
    )


@inlined
def _combined(u: Vector, v: Vector, w: Vector, x: float, y: float, z: float) -> Vector:
    """Sum of three vectors, multiplied by x, y and z."""
    return (
        x * u[0] + y * v[0] + z * w[0],
        x * u[1] + y * v[1] + z * w[1],
        x * u[2] + y * v[2] + z * w[2],
    )
