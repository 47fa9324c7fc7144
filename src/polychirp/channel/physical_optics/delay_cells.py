"""Sums of the waves that facets scatter from one view to another, in cells of path length.

Cells overlap: each term is shared between two neighbouring cells with smooth weights.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, dot, row
from polychirp.channel.materials.reflection_table import ReflectionTable
from polychirp.channel.physical_optics.corner_terms import (
    CELLS_PER_METRE,
    FacetBatch,
    PairTable,
    ViewPair,
    empty_batch,
    expand_terms,
    fill_batch,
    two_cells,
    view_pair,
)
from polychirp.channel.physical_optics.facet_integral import facet_terms
from polychirp.channel.physical_optics.kernels import (
    CELL_LENGTH,
    INCIDENCE,
    REFLECTION,
    Faces,
    LitFacets,
)
from polychirp.jit import compiled, inlined, inner
from polychirp.threads import in_ranges

TRANSFER, EXCESS, OUTWARD, RETURN, SQUARED_RATE = slice(0, 4), 4, slice(5, 8), slice(8, 11), 11
"""Columns of the moments of a cell. `TRANSFER` is the sum of the transfer matrices, four entries.
The other moments are sums of V–V transfers, each multiplied by a quantity of its path: `EXCESS` by
the length beyond the cell's centre, m; `OUTWARD` and `RETURN` by the unit vectors from the first
and from the second view; `SQUARED_RATE` by the squared rate of the length, m²/s²."""

NUM_MOMENTS: Final = 12

TERM_WIDTH: Final = 2 * NUM_MOMENTS
"""Real numbers of a term, and of a cell while terms are added: real parts (4) and imaginary parts
(4) of `TRANSFER`, then real parts (8) and imaginary parts (8) of the other moments."""

QUEUE_LENGTH: Final = 32
"""Number of terms that wait before they are added to their cells. Chosen: a processor is slow to
read several numbers at once right after they were written one by one."""


class FacetLegs(NamedTuple):
    """Two legs of a path over one facet, one from each view.

    ``directions`` are unit vectors from the views to the facet's centroid, ``lengths`` m are their
    distances from it, ``velocities`` m/s are those of the facet's body relative to the views.
    """

    directions: tuple[Vector, Vector]
    lengths: tuple[float, float]
    velocities: tuple[Vector, Vector]


@inlined
def _scattering_matrix(
    first: NDArray[np.complex64],
    a: int,
    second: NDArray[np.complex64],
    b: int,
    scale: float,
    out: ComplexArray,
) -> None:
    r"""F ``(receiving, transmitting)`` of a facet, times ``scale``.

    ``first`` and ``second`` are two views' `LitFacets.wave`, a and b the facet's rows in them.
    F is the mean over both directions of propagation, which makes it reciprocal. If one plane of
    incidence is turned by φ from the other, F relates the fields' components normal to (s) and in
    (p) the planes of incidence by

    .. math::
        F = \frac12 \begin{pmatrix}
            -a\,(\Gamma_{s1} + \Gamma_{s2}) & b\,(\Gamma_{p2} - \Gamma_{s1}) \\
            b\,(\Gamma_{s2} - \Gamma_{p1}) & a\,(\Gamma_{p1} + \Gamma_{p2})
        \end{pmatrix}, \quad
        a = (\cos\theta_1 + \cos\theta_2) \cos\varphi, \quad
        b = (1 + \cos\theta_1 \cos\theta_2) \sin\varphi

    which are J and M of `paths` written out.
    """
    cosine1, cosine2 = first[a, INCIDENCE, 0].real, second[b, INCIDENCE, 0].real
    turn = first[a, INCIDENCE, 1].conjugate() * second[b, INCIDENCE, 1]
    alike = 0.5 * scale * (cosine1 + cosine2) * turn.real
    unlike = 0.5 * scale * (1.0 + cosine1 * cosine2) * turn.imag
    s1, p1 = first[a, REFLECTION, 0], first[a, REFLECTION, 1]
    s2, p2 = second[b, REFLECTION, 0], second[b, REFLECTION, 1]
    ss, pp = -alike * (s1 + s2), alike * (p1 + p2)
    sp, ps = unlike * (p2 - s1), unlike * (s2 - p1)
    for t in range(2):
        s = first[a, t, 0] * ss + first[a, t, 1] * ps
        p = first[a, t, 0] * sp + first[a, t, 1] * pp
        for r in range(2):
            out[2 * r + t] = s * second[b, r, 0] + p * second[b, r, 1]


def sum_in_cells(
    faces: Faces,
    media: ReflectionTable,
    first: LitFacets,
    second: LitFacets,
    pairs: PairTable,
    velocity: FloatArray,
    wavenumber: float,
) -> ComplexArray:
    """Moments ``(pair, cell, moment)`` of all facets that both views of a pair illuminate.

    ``velocity`` ``(pair, view, xyz)`` m/s is that of the facets' body relative to each view.
    """
    out = np.zeros((*pairs.is_kept.shape, NUM_MOMENTS), dtype=np.complex128)
    bodies = faces, media, first, second
    in_ranges(_fill_moments, len(out), *bodies, pairs, velocity, wavenumber, out)
    return out


@compiled
def _fill_moments(
    begin: int,
    end: int,
    faces: Faces,
    media: ReflectionTable,
    first: LitFacets,
    second: LitFacets,
    pairs: PairTable,
    velocity: FloatArray,
    wavenumber: float,
    out: ComplexArray,
) -> None:
    num_cells = pairs.is_kept.shape[1]
    for k in range(begin, end):
        # a term adds to its cell and to the next: one more cell is needed after the last
        cells = np.zeros((num_cells + 1) * TERM_WIDTH)
        pair, place = view_pair(first, second, pairs, k)
        batch = empty_batch()
        while place.first < pair.end.first:
            count, place = fill_batch(batch, pair, faces.area, place)
            expand_terms(batch, count, wavenumber, pair.first_cell)
            _add_batch(batch, count, pair, faces, media, velocity[k], wavenumber, cells)
        _take_moments(cells, pairs.is_kept[k], out[k])


@inner
def _add_batch(
    batch: FacetBatch,
    count: int,
    pair: ViewPair,
    faces: Faces,
    media: ReflectionTable,
    velocity: FloatArray,
    wavenumber: float,
    cells: FloatArray,
) -> None:
    """Add the terms of a batch of facets to ``cells``, of `TERM_WIDTH` numbers each."""
    weight, place = np.empty(3, dtype=np.complex128), np.empty((3, 3))
    matrix = np.empty(4, dtype=np.complex128)
    into, share = np.empty(QUEUE_LENGTH + 3, dtype=np.int64), np.empty(QUEUE_LENGTH + 3)
    queue = np.empty((QUEUE_LENGTH + 3) * TERM_WIDTH)
    first, second, next_kept = pair.first, pair.second, pair.next_kept
    velocities = row(velocity, 0), row(velocity, 1)
    waiting, nearest = 0, pair.first_cell * CELL_LENGTH
    for i in range(count):
        a, b, is_plain = batch.row[0, i], batch.row[1, i], batch.is_plain[i]
        f = first.face[a]
        phase = media.roughness[faces.medium[f]] * batch.facing[i]
        scale = math.exp(-0.5 * phase * phase) if phase != 0.0 else 1.0
        _scattering_matrix(first.wave, a, second.wave, b, scale, matrix)
        legs = FacetLegs(
            (row(first.direction, a), row(second.direction, b)),
            (first.length[a], second.length[b]),
            velocities,
        )
        p, q, r = batch.length[0, i], batch.length[1, i], batch.length[2, i]
        phases, terms = (wavenumber * p, wavenumber * q, wavenumber * r), 3
        if not is_plain:
            terms = facet_terms(phases, weight, place)
        for c in range(terms):
            if is_plain:
                offset = faces.corner[f, c, 0], faces.corner[f, c, 1], faces.corner[f, c, 2]
                excess = batch.length[c, i] - nearest
                term = complex(batch.term[0, c, i], batch.term[1, c, i])
            else:
                offset = _point_of_triangle(place[c], faces.corner[f])
                excess = place[c, 0] * p + place[c, 1] * q + place[c, 2] * r - nearest
                term = batch.weight[i] * weight[c]
            cell, later = two_cells(excess * CELLS_PER_METRE)
            if next_kept[cell] > cell + 1:
                continue
            into[waiting], share[waiting] = cell * TERM_WIDTH, later
            amplitude = complex(term.imag, -term.real)
            _queue_term(queue, waiting, amplitude, matrix, excess, legs, offset)
            waiting += 1
        if waiting >= QUEUE_LENGTH:
            _add_queue(waiting, into, share, queue, TERM_WIDTH, cells)
            waiting = 0
    _add_queue(waiting, into, share, queue, TERM_WIDTH, cells)


@inlined
def _queue_term(
    queue: FloatArray,
    number: int,
    amplitude: complex,
    matrix: ComplexArray,
    excess: float,
    legs: FacetLegs,
    offset: Vector,
) -> None:
    """Write one term's numbers to row ``number`` of a queue; ``offset`` m: from the centroid."""
    out = _direction_to(legs.directions[0], legs.lengths[0], offset)
    back = _direction_to(legs.directions[1], legs.lengths[1], offset)
    rate = dot(out, legs.velocities[0]) + dot(back, legs.velocities[1])
    o = number * TERM_WIDTH
    for j in range(4):
        part = amplitude * matrix[j]
        queue[o + j], queue[o + 4 + j] = part.real, part.imag
    weighed = excess, out[0], out[1], out[2], back[0], back[1], back[2], rate * rate
    real, imaginary = queue[o], queue[o + 4]
    for j in range(8):
        queue[o + 8 + j], queue[o + 16 + j] = real * weighed[j], imaginary * weighed[j]


@inner
def _add_queue(
    count: int, into: IntArray, share: FloatArray, queue: FloatArray, width: int, cells: FloatArray
) -> None:
    """Add each term to the cell that starts at ``into`` and, with weight ``share``, to the next.

    ``width`` is `TERM_WIDTH`. It is an argument because the compiler unrolls a short loop of
    known length into scalar additions, and so does not add several numbers in one instruction.
    """
    for i in range(count):
        more, start = share[i], into[i]
        less = 1.0 - more
        low, high = cells[start : start + width], cells[start + width : start + 2 * width]
        term = queue[i * width : (i + 1) * width]
        for j in range(width):
            low[j] += less * term[j]
            high[j] += more * term[j]


@inner
def _take_moments(cells: FloatArray, is_kept: BoolArray, out: ComplexArray) -> None:
    """Fill ``out`` ``(cell, moment)`` from the sums in kept cells."""
    for cell in range(is_kept.size):
        if not is_kept[cell]:
            continue
        o = cell * TERM_WIDTH
        for j in range(4):
            out[cell, j] = complex(cells[o + j], cells[o + 4 + j])
        for j in range(8):
            out[cell, EXCESS + j] = complex(cells[o + 8 + j], cells[o + 16 + j])
        # refer the excess to this cell's centre in place of the first cell's
        out[cell, EXCESS] -= cell * CELL_LENGTH * out[cell, 0]


@inlined
def _point_of_triangle(place: FloatArray, corner: FloatArray) -> Vector:
    """Point of a triangle, m from the centroid, with the barycentric coordinates ``place``."""
    p, q, r = place[0], place[1], place[2]
    return (
        p * corner[0, 0] + q * corner[1, 0] + r * corner[2, 0],
        p * corner[0, 1] + q * corner[1, 1] + r * corner[2, 1],
        p * corner[0, 2] + q * corner[1, 2] + r * corner[2, 2],
    )


@inlined
def _direction_to(direction: Vector, length: float, offset: Vector) -> Vector:
    """Unit vector, to first order, to a point that is ``offset`` (m) from the end of a leg."""
    scale = 1.0 / (length + dot(direction, offset))
    return (
        scale * (length * direction[0] + offset[0]),
        scale * (length * direction[1] + offset[1]),
        scale * (length * direction[2] + offset[2]),
    )
