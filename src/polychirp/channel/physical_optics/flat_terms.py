r"""Terms of a body's flat parts: waves from their borders, exact for spherical waves.

Facet by facet, neighbours of one plane approximate the same phase about different points. What is
left at their common edges is a grating, 40 to 60 dB below a mirror's echo, that hides what a flat
side returns off its normal. But an integral over a flat region is one along its border. With unit
vectors :math:`\hat s_1` from a point of the border to the image of the transmitter in the plane
and :math:`\hat s_2` to the receiver, the distances :math:`r_1, r_2`, and a region without a
specular point,

.. math::
    -\frac{j}{8\pi} \iint (\cos\theta_1 + \cos\theta_2) \frac{e^{-jk(r_1+r_2)}}{r_1 r_2}\,
    \mathrm dA = \frac{1}{8\pi k} \oint \frac{e^{-jk(r_1+r_2)}}{r_1 r_2}\,
    \frac{(\hat s_1 \times \hat s_2) \cdot \mathrm d\mathbf l}{1 + \hat s_1 \cdot \hat s_2}

(Maggi 1888, Rubinowicz 1917; exact but for terms of 1/kr). Physical optics has F in place of the
sum of cosines; their ratio changes slowly and is taken at the facet beside the border.

**Near the specular point** the integrand of the border has a pole. Facets over which the path is
less than `NEAR_PHASE` longer than the specular one are therefore integrated as facets, cut into
parts with phases that are right at the corners, which the parts share, and in their mean. The
border is that of the remaining region.

**Along an edge** the phase is quadratic, with its exact values and slopes at both ends. Its
integral is the sum of a term at each end and, if it lies between them, one at the point where the
phase is stationary. Each has the path length of its own point. The terms of two edges in line
cancel at their common corner.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, row
from polychirp.channel.materials.reflection_table import ReflectionTable
from polychirp.channel.physical_optics.corner_terms import (
    CELLS_PER_METRE,
    RowPair,
    ViewPair,
    common_facet,
    two_cells,
)
from polychirp.channel.physical_optics.facet_integral import ONE_TERM_SPAN, facet_terms, phasor
from polychirp.channel.physical_optics.flat_faces import Flats
from polychirp.channel.physical_optics.kernels import CELL_LENGTH, Faces
from polychirp.channel.physical_optics.term_sums import (
    TERM_WIDTH,
    FacetLegs,
    add_queue,
    coherent_share,
    queue_term,
    scattering_matrix,
)
from polychirp.jit import inlined, inner

NEAR_PHASE: Final = 30.0
"""Phase, rad, by which a path over a facet exceeds the specular one, below which the facet is
integrated as such: nine Fresnel zones. Chosen: with half, echoes down to 40 dB below a mirror's are
wrong by up to 0.2 dB, not 0.03; with twice, plates that face a radar take up to twice as long."""

LARGEST_BEND: Final = 0.05
"""Phase, rad, by which the wave front may deviate from a plane over a part of a near facet. Chosen:
with twice as much, echoes down to 40 dB below a mirror's are wrong by up to 0.3 dB."""

MOST_PARTS: Final = 32
"""Greatest number of parts along an edge of a near facet. Chosen: it limits the time very near."""

LONGEST_PIECE: Final = 0.03
"""Length of an edge's pieces, m, at 1 m from the nearer radar; at r it is r^⅔ times that. Chosen:
the third-order term of the phase, k h³/r², is then below 0.05 rad at 79 GHz."""

LARGEST_CHANGE: Final = 0.05
"""Change of the weight along a piece of an edge, over the sum of its values at both ends, that may
be taken as linear (chosen)."""

NOT_FLAT, BY_BORDER, BY_PARTS = 0, 1, 2
"""State of a facet in a pair of views: not of a flat part that both see; of one, and far from the
specular point, so that the border of such facets is integrated; or near it, and cut into parts."""


class Border(NamedTuple):
    """Data of the terms of one pair of views, and the cells into which they are summed.

    ``velocity`` ``(view, xyz)`` m/s is that of the body relative to each view; ``nearest`` m is the
    path length at the first cell; ``cells`` are the sums, of `TERM_WIDTH` numbers each; ``queue``,
    ``into`` and ``share`` are memory for one term.
    """

    faces: Faces
    media: ReflectionTable
    wavenumber: float
    velocity: FloatArray
    next_kept: IntArray
    nearest: float
    cells: FloatArray
    queue: FloatArray
    into: IntArray
    share: FloatArray


@inner
def border_of(
    faces: Faces,
    media: ReflectionTable,
    wavenumber: float,
    velocity: FloatArray,
    pair: ViewPair,
    cells: FloatArray,
) -> Border:
    """The `Border` of a pair of views, with room for one term."""
    return Border(
        faces,
        media,
        wavenumber,
        velocity,
        pair.next_kept,
        pair.first_cell * CELL_LENGTH,
        cells,
        np.empty(TERM_WIDTH),
        np.empty(1, dtype=np.int64),
        np.empty(1),
    )


class FlatFacet(NamedTuple):
    """A facet of a flat part, as a pair of views sees it.

    ``ways`` m are those from both views to its centroid, ``legs`` the same as directions and
    lengths; ``matrix`` is its scattering matrix over the sum of both cosines of incidence.
    """

    number: int
    normal: Vector
    ways: tuple[Vector, Vector]
    legs: FacetLegs
    matrix: ComplexArray


@inlined
def _plus(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def _times(factor: float, a: Vector) -> Vector:
    return factor * a[0], factor * a[1], factor * a[2]


@inlined
def _unit(a: Vector) -> tuple[Vector, float]:
    """Unit vector along a, and its length."""
    size = math.sqrt(dot(a, a))
    return (a[0] / size, a[1] / size, a[2] / size), size


@inlined
def _in_plane(a: Vector, normal: Vector) -> Vector:
    """Part of a vector in the plane across a normal."""
    return _plus(a, _times(-dot(a, normal), normal))


@inner
def fill_states(
    pair: ViewPair,
    place: RowPair,
    faces: Faces,
    flats: Flats,
    wavenumber: float,
    state: NDArray[np.int8],
) -> None:
    """Set ``state`` ``(face,)`` for the facets of flat parts that both views see without loss."""
    first, second = pair.first, pair.second
    while place.first < pair.end.first:
        a, b = place.first, place.second
        f = first.face[a]
        if flats.is_flat[f] and first.loss[a] == 0 and second.loss[b] == 0:
            turn = _plus(row(first.direction, a), row(second.direction, b))
            slope = _in_plane(turn, row(faces.normal, f))
            bend = 1.0 / first.length[a] + 1.0 / second.length[b]
            excess = 0.5 * wavenumber * dot(slope, slope) / bend
            state[f] = BY_PARTS if excess < NEAR_PHASE else BY_BORDER
        place = common_facet(first.face, second.face, RowPair(a + 1, b + 1), pair.end)


@inner
def add_flat_terms(
    pair: ViewPair, place: RowPair, flats: Flats, state: NDArray[np.int8], border: Border
) -> None:
    """Add the terms of all facets of which ``state`` is `BY_BORDER` or `BY_PARTS` to the cells."""
    first, second, faces = pair.first, pair.second, border.faces
    matrix = np.empty(4, dtype=np.complex128)
    weight, where = np.empty(3, dtype=np.complex128), np.empty((3, 3))
    velocities = row(border.velocity, 0), row(border.velocity, 1)
    while place.first < pair.end.first:
        a, b = place.first, place.second
        place = common_facet(first.face, second.face, RowPair(a + 1, b + 1), pair.end)
        f = first.face[a]
        if state[f] == NOT_FLAT:
            continue
        is_near = state[f] == BY_PARTS
        num_edges = 0
        for e in range(3):
            n = flats.neighbour[f, e]
            if not is_near and (n < 0 or state[n] != BY_BORDER):
                num_edges += 1
        if not is_near and num_edges == 0:
            continue
        d1, d2, normal = row(first.direction, a), row(second.direction, b), row(faces.normal, f)
        facing = -dot(normal, _plus(d1, d2))
        share = coherent_share(border.media.roughness[faces.medium[f]], facing)
        scale = share / max(facing, 1e-6)
        scattering_matrix(first.wave, a, second.wave, b, scale, matrix)
        lengths = first.length[a], second.length[b]
        legs = FacetLegs((d1, d2), lengths, velocities)
        ways = _times(lengths[0], d1), _times(lengths[1], d2)
        facet = FlatFacet(f, normal, ways, legs, matrix)
        if is_near:
            _add_near(facet, border, weight, where)
            continue
        for e in range(3):
            n = flats.neighbour[f, e]
            if n < 0 or state[n] != BY_BORDER:
                _add_edge(facet, row(faces.corner[f], e), row(faces.corner[f], (e + 1) % 3), border)


@inner
def _add_term(facet: FlatFacet, border: Border, term: complex, length: float, at: Vector) -> None:
    """Add −j times a term; its path has a ``length`` m and passes ``at``, m from the centroid."""
    excess = length - border.nearest
    cell, later = two_cells(excess * CELLS_PER_METRE)
    if border.next_kept[cell] > cell + 1:
        return
    border.into[0], border.share[0] = cell * TERM_WIDTH, later
    amplitude = complex(term.imag, -term.real)
    queue_term(border.queue, 0, amplitude, facet.matrix, excess, facet.legs, at)
    add_queue(1, border.into, border.share, border.queue, TERM_WIDTH, border.cells)


@inner
def _border_weight(normal: Vector, edge: Vector, first: Vector, second: Vector) -> float:
    """Weight of an edge's element, from the ways of both views to it (m).

    It is (ŝ₁ × ŝ₂)·e/(r₁ r₂ (1 + ŝ₁·ŝ₂)), with directions in parts along and across the normal.
    """
    d1, r1 = _unit(first)
    d2, r2 = _unit(second)
    cosine1, cosine2 = -dot(d1, normal), -dot(d2, normal)
    t1, t2 = _in_plane(d1, normal), _in_plane(d2, normal)
    aside = dot(cross(normal, edge), _plus(_times(cosine1, t2), _times(cosine2, t1)))
    return aside / (r1 * r2 * (1.0 + dot(t1, t2) - cosine1 * cosine2))


GAUSS_POINTS: Final = (
    (0.06943184420297371, 0.17392742256872692),
    (0.33000947820757187, 0.32607257743127307),
    (0.6699905217924281, 0.32607257743127307),
    (0.9305681557970262, 0.17392742256872692),
)
"""Points and weights of Gauss's quadrature of four points from 0 to 1."""

TAIL_REAL: Final = (
    -1.976499695e-06, 0.0007336037788, 0.009215328317, 1.221387493, -12.44913146, 89.80722219,
    -385.2699651, 1064.190634, -1868.270792, 2058.907365, -1382.824253, 519.0063096, -83.70206871,
)  # fmt: skip
TAIL_IMAGINARY: Final = (
    -0.3000037752, -0.2987973272, -0.3624833241, 0.9426413587, -12.64380058, 69.35991624,
    -231.5538356, 458.8916857, -504.9660261, 261.7255466, -2.001316052, -56.93409603, 17.51391531,
)  # fmt: skip
"""Coefficients of the polynomials of `fresnel_tail`, fitted to Fresnel's integrals."""


@inner
def fresnel_tail(slope: float, bend: float) -> complex:
    r""":math:`\int_0^\infty e^{-j(bs + \kappa s^2/2)}\,\mathrm ds`, slope b ≥ 0, bend κ > 0.

    The function is :math:`\sqrt{2/\kappa}\,e^{jx^2}\int_x^\infty e^{-ju^2}\mathrm du` of x =
    b/√(2κ): a polynomial in t = 1/(1 + 0.6x) times t, with errors up to 1e-5 of its value.
    """
    scale = math.sqrt(2.0 / bend)
    t = 1.0 / (1.0 + 0.3 * slope * scale)
    real, imaginary = 0.0, 0.0
    for number in range(13):
        real = real * t + TAIL_REAL[12 - number]
        imaginary = imaginary * t + TAIL_IMAGINARY[12 - number]
    return complex(scale * t * real, scale * t * imaginary)


@inner
def _weight_at(facet: FlatFacet, edge: Vector, at: Vector) -> float:
    """`_border_weight` at a point, m from the facet's centroid."""
    first, second = _plus(facet.ways[0], at), _plus(facet.ways[1], at)
    return _border_weight(facet.normal, edge, first, second)


@inner
def _add_edge(facet: FlatFacet, start: Vector, end: Vector, border: Border) -> None:
    """Add the terms of an edge between two corners, m from the centroid, in pieces."""
    way = _plus(end, _times(-1.0, start))
    edge, size = _unit(way)
    near = min(facet.legs.lengths[0], facet.legs.lengths[1])
    count = int(size / (LONGEST_PIECE * max(near, 1e-3) ** (2.0 / 3.0))) + 1
    # near the pole the weight changes along the edge
    weight0 = _weight_at(facet, edge, start)
    weight1 = _weight_at(facet, edge, end)
    change = abs(weight1 - weight0) / max(abs(weight0) + abs(weight1), 1e-300)
    count = max(count, int(change / LARGEST_CHANGE) + 1)
    for piece in range(count):
        at = _plus(start, _times(piece / count, way))
        _add_piece(facet, at, edge, size / count, border)


@inner
def _tail_of(weight: float, change: float, slope: float, bend: float) -> complex:
    """Integral from 0 to ∞ as in `fresnel_tail`, with the factor ``weight`` + ``change``·s.

    With T the plain integral, that with the factor s is −(j + bT)/κ, and −1/b² for large b²/κ.
    """
    whole = fresnel_tail(slope, bend)
    if slope * slope > 200.0 * bend:
        return weight * whole - change / (slope * slope)
    return weight * whole - change * (1j + slope * whole) / bend


@inner
def _add_piece(facet: FlatFacet, start: Vector, edge: Vector, size: float, border: Border) -> None:
    """Add the terms of a piece of an edge; ``edge`` is its direction, ``size`` m its length."""
    k, end = border.wavenumber, _plus(start, _times(size, edge))
    (d1, r1), (d2, r2) = _unit(_plus(facet.ways[0], start)), _unit(_plus(facet.ways[1], start))
    length0, slope0 = r1 + r2, k * dot(edge, _plus(d1, d2))
    (d1, r1), (d2, r2) = _unit(_plus(facet.ways[0], end)), _unit(_plus(facet.ways[1], end))
    length1, slope1 = r1 + r2, k * dot(edge, _plus(d1, d2))
    bend = max((slope1 - slope0) / size, 1e-12)
    weight0, weight1 = _weight_at(facet, edge, start), _weight_at(facet, edge, end)
    change = (weight1 - weight0) / size
    # the factor −j, as `_add_term` multiplies by −j
    scale = complex(0.0, -1.0 / (8.0 * math.pi * k))
    if max(abs(slope0), abs(slope1)) * size < ONE_TERM_SPAN:
        total = 0j
        for share, part in GAUSS_POINTS:
            s = share * size
            phase = k * length0 + s * (slope0 + 0.5 * bend * s)
            total += part * (weight0 + change * s) * phasor(phase)
        length = length0 + 0.5 * size * (slope0 + 0.25 * bend * size) / k
        middle = _plus(start, _times(0.5 * size, edge))
        _add_term(facet, border, scale * size * total, length, middle)
        return
    # a tail points away from the point of stationary phase, which is before or behind the end
    side0, side1 = math.copysign(1.0, slope0), math.copysign(1.0, slope1)
    tail0 = _tail_of(weight0, side0 * change, abs(slope0), bend) * phasor(k * length0)
    tail1 = _tail_of(weight1, side1 * change, abs(slope1), bend) * phasor(k * length1)
    _add_term(facet, border, side0 * scale * tail0, length0, start)
    _add_term(facet, border, -side1 * scale * tail1, length1, end)
    # by the sides of the tails: a slope of zero, with a stationary phase at an end, has one too
    if side0 < 0.0 < side1:
        s = -slope0 / bend
        length = length0 + 0.5 * slope0 * s / k
        whole = 2.0 * (weight0 + change * s) * fresnel_tail(0.0, bend) * phasor(k * length)
        _add_term(facet, border, scale * whole, length, _plus(start, _times(s, edge)))


@inner
def _add_near(facet: FlatFacet, border: Border, weight: ComplexArray, where: FloatArray) -> None:
    """Add the terms of a facet near the specular point, cut into small triangles."""
    f, k, lengths = facet.number, border.wavenumber, facet.legs.lengths
    corner = border.faces.corner[f]
    c0, c1, c2 = row(corner, 0), row(corner, 1), row(corner, 2)
    square = max(dot(c0, c0), dot(c1, c1), dot(c2, c2))
    bend = 0.5 * k * square * (1.0 / lengths[0] + 1.0 / lengths[1])
    count = min(int(math.sqrt(bend / LARGEST_BEND)) + 1, MOST_PARTS)
    back = _times(-1.0, c0)
    u, v = _times(1.0 / count, _plus(c1, back)), _times(1.0 / count, _plus(c2, back))
    area = border.faces.area[f] / (count * count)
    for i in range(count):
        for j in range(count - i):
            at = _plus(c0, _plus(_times(float(i), u), _times(float(j), v)))
            _add_triangle(facet, border, at, u, v, area, weight, where)
            if i + j < count - 1:
                across = _plus(at, _plus(u, v))
                _add_triangle(
                    facet, border, across, _times(-1.0, u), _times(-1.0, v), area, weight, where
                )


@inner
def _sagitta(legs: tuple[tuple[Vector, float], tuple[Vector, float]], at: Vector) -> float:
    """Excess of the path over a point, m from a centroid, over that of plane waves, m.

    ``legs`` are the directions of both views to the centroid, and their distances.
    """
    (d1, r1), (d2, r2) = legs
    square, along1, along2 = dot(at, at), dot(d1, at), dot(d2, at)
    return 0.5 * ((square - along1 * along1) / r1 + (square - along2 * along2) / r2)


@inner
def _add_triangle(
    facet: FlatFacet,
    border: Border,
    start: Vector,
    u: Vector,
    v: Vector,
    area: float,
    weight: ComplexArray,
    where: FloatArray,
) -> None:
    """Add the terms of a triangle from ``start``, m from the centroid, with the sides u and v."""
    k, normal = border.wavenumber, facet.normal
    third = _times(1.0 / 3.0, _plus(u, v))
    middle, back = _plus(start, third), _times(-1.0, third)
    legs = _unit(_plus(facet.ways[0], middle)), _unit(_plus(facet.ways[1], middle))
    (d1, r1), (d2, r2) = legs
    turn, at_u, at_v = _plus(d1, d2), _plus(u, back), _plus(v, back)
    x, y, z = _sagitta(legs, back), _sagitta(legs, at_u), _sagitta(legs, at_v)
    # the phase is right at the corners, which triangles share, and in its mean, which is a twelfth
    # of the sum over the corners where a linear phase has a third
    length = r1 + r2 - 0.25 * (x + y + z)
    p, q, r = (
        length + dot(turn, back) + x,
        length + dot(turn, at_u) + y,
        length + dot(turn, at_v) + z,
    )
    scale = -dot(normal, turn) * area / (8.0 * math.pi * r1 * r2)
    for c in range(facet_terms((k * p, k * q, k * r), weight, where)):
        at = _plus(start, _plus(_times(where[c, 1], u), _times(where[c, 2], v)))
        length = where[c, 0] * p + where[c, 1] * q + where[c, 2] * r
        _add_term(facet, border, scale * weight[c], length, at)
