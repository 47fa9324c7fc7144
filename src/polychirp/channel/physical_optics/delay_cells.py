"""Sums of the waves that facets scatter from one view to another, in cells of path length.

Cells overlap: each term is shared between two neighbouring cells with smooth weights.
"""

from typing import Final

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.channel.geometry.vectors import Vector, row
from polychirp.channel.materials.reflection_table import ReflectionTable
from polychirp.channel.physical_optics.corner_terms import (
    CELLS_PER_METRE,
    FacetBatch,
    PairTable,
    ViewPair,
    corner_of,
    empty_batch,
    expand_terms,
    fill_batch,
    two_cells,
    view_pair,
)
from polychirp.channel.physical_optics.facet_integral import facet_terms
from polychirp.channel.physical_optics.flat_faces import Flats
from polychirp.channel.physical_optics.flat_terms import (
    NOT_FLAT,
    add_flat_terms,
    border_of,
    fill_states,
)
from polychirp.channel.physical_optics.kernels import CELL_LENGTH, Faces, LitFacets
from polychirp.channel.physical_optics.term_sums import (
    EXCESS,
    NUM_MOMENTS,
    TERM_WIDTH,
    FacetLegs,
    add_queue,
    coherent_share,
    queue_term,
    scattering_matrix,
)
from polychirp.jit import compiled, inlined, inner
from polychirp.threads import in_ranges

QUEUE_LENGTH: Final = 32
"""Number of terms that wait before they are added to their cells. Chosen: a processor is slow to
read several numbers at once right after they were written one by one."""


def sum_in_cells(
    faces: Faces,
    flats: Flats,
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
    bodies = faces, flats, media, (first, second)
    in_ranges(_fill_moments, len(out), *bodies, pairs, velocity, wavenumber, out)
    return out


@compiled
def _fill_moments(
    begin: int,
    end: int,
    faces: Faces,
    flats: Flats,
    media: ReflectionTable,
    lit: tuple[LitFacets, LitFacets],
    pairs: PairTable,
    velocity: FloatArray,
    wavenumber: float,
    out: ComplexArray,
) -> None:
    num_cells = pairs.is_kept.shape[1]
    state = np.zeros(faces.area.size, dtype=np.int8)
    for k in range(begin, end):
        # a term adds to its cell and to the next: one more cell is needed after the last
        cells = np.zeros((num_cells + 1) * TERM_WIDTH)
        pair, place = view_pair(lit[0], lit[1], pairs, k)
        if flats.has_any:
            state[:] = NOT_FLAT
            fill_states(pair, place, faces, flats, wavenumber, state)
            border = border_of(faces, media, wavenumber, velocity[k], pair, cells)
            add_flat_terms(pair, place, flats, state, border)
        batch = empty_batch()
        while place.first < pair.end.first:
            count, place = fill_batch(batch, pair, faces, wavenumber, state, place)
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
        scale = coherent_share(media.roughness[faces.medium[f]], batch.facing[i])
        scattering_matrix(first.wave, a, second.wave, b, scale, matrix)
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
                offset = corner_of(faces.corner, f, c)
                excess = batch.length[c, i] - nearest
                term = complex(batch.term[0, c, i], batch.term[1, c, i])
            else:
                offset = _point_of_triangle(place[c], faces.corner[f])
                excess = place[c, 0] * p + place[c, 1] * q + place[c, 2] * r - nearest
                term = batch.weight[i] * weight[c]
            offset = _in_part(offset, batch.shift, batch.scale[i], i)
            cell, later = two_cells(excess * CELLS_PER_METRE)
            if next_kept[cell] > cell + 1:
                continue
            into[waiting], share[waiting] = cell * TERM_WIDTH, later
            amplitude = complex(term.imag, -term.real)
            queue_term(queue, waiting, amplitude, matrix, excess, legs, offset)
            waiting += 1
        if waiting >= QUEUE_LENGTH:
            add_queue(waiting, into, share, queue, TERM_WIDTH, cells)
            waiting = 0
    add_queue(waiting, into, share, queue, TERM_WIDTH, cells)


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
def _in_part(offset: Vector, shift: FloatArray, scale: float, i: int) -> Vector:
    """Point of the part in row i of a batch, given the point of the whole facet, m."""
    return (
        shift[0, i] + scale * offset[0],
        shift[1, i] + scale * offset[1],
        shift[2, i] + scale * offset[2],
    )


@inlined
def _point_of_triangle(place: FloatArray, corner: FloatArray) -> Vector:
    """Point of a triangle, m from the centroid, with the barycentric coordinates ``place``."""
    p, q, r = place[0], place[1], place[2]
    return (
        p * corner[0, 0] + q * corner[1, 0] + r * corner[2, 0],
        p * corner[0, 1] + q * corner[1, 1] + r * corner[2, 1],
        p * corner[0, 2] + q * corner[1, 2] + r * corner[2, 2],
    )
