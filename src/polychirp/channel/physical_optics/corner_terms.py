r"""Terms at the corners of the facets that two views see, for many facets at a time.

A view is a radar, or its image in a plate, seen from the body. A path from one view over a
facet's corner c to the other has one leg per view. `LitFacets.aspect` holds the legs' lengths
:math:`r + d \cdot c`, so three sums per facet give the paths' lengths. This module computes the
terms of a batch of facets without branches, by vector instructions. Each term is divided by
differences of the corners' phases. A facet with too small a difference (`ONE_TERM_SPAN`,
`TWO_TERMS_GAP`) is left to `facet_terms`, which computes one facet at a time.

**Near facets.** Lengths that are linear in c leave out
:math:`\sum_l [|c|^2 - (d_l \cdot c)^2]/2r_l`, with the legs l. Facets in rows of one size all leave
out the same, which makes grating lobes: the side of a car that passes at 2.2 m, with facets of
5 cm, flickered by 2 dB from one centimetre to the next. So a facet is divided into parts, each with
lengths that are linear about its own middle, if the phase left out exceeds `MOST_BEND`. Facets over
which the phase turns more than `MOST_BENT_SPAN` are far from the mirror point, and add little.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector, dot, row
from polychirp.channel.physical_optics.facet_integral import (
    ONE_TERM_SPAN,
    TWO_TERMS_GAP,
    phasor,
)
from polychirp.channel.physical_optics.kernels import (
    ALONG_FIRST,
    ALONG_SECOND,
    CELL_LENGTH,
    FACING,
    INVERSE_LENGTH,
    Faces,
    LitFacets,
)
from polychirp.jit import compiled, inlined, inner

BATCH_SIZE: Final = 256
"""Number of facets in a batch (chosen: a batch takes 40 KiB, about a level-1 cache)."""

BEYOND_ALL_CELLS: Final = 1 << 40
"""Value of `next_kept_cells` where no kept cell follows (chosen: above every cell number)."""

MOST_BEND: Final = 0.2
"""Greatest phase at a corner, rad, that lengths linear over a facet may leave out. Chosen:
the flicker of gently curved sides is then 30 dB below their echo."""

MOST_BENT_SPAN: Final = 20.0
"""Greatest difference of the phases at the corners of a facet that is divided, rad. Chosen: with
twice as much, the flicker is lower by 1 dB."""

MOST_STRIPS: Final = 8
"""Greatest number of strips, parallel to each of its sides, into which a facet is divided; n strips
make n² parts (chosen: it bounds the memory)."""

CELLS_PER_METRE: Final = 1.0 / CELL_LENGTH
"""Cells per metre of total path length."""


class PairTable(NamedTuple):
    """Pairs of views of one body, and the cells of path length into which their terms are summed.

    ``views`` ``(pair, 2)`` holds the number of a view in the first `LitFacets` and of one in the
    second. Cell j of a pair is centred at a path length of ``(first_cell + j)`` times
    `CELL_LENGTH`; ``first_cell`` has the shape ``(pair,)``. ``is_kept`` ``(pair, cell)`` marks the
    cells that are computed; the others stay empty.
    """

    views: IntArray
    first_cell: IntArray
    is_kept: BoolArray


class RowPair(NamedTuple):
    """Rows of one facet in the `LitFacets` of the first and of the second view."""

    first: int
    second: int


class ViewPair(NamedTuple):
    """Two views whose common facets are summed: one row of a `PairTable`.

    ``end`` is one past the last row of each view. ``next_kept`` ``(cell,)`` is the result of
    `next_kept_cells`, ``first_cell`` that of the `PairTable`.
    """

    first: LitFacets
    second: LitFacets
    end: RowPair
    first_cell: int
    next_kept: IntArray


class FacetBatch(NamedTuple):
    """Memory for facets that both views of a pair see, ``(…, facet)``.

    `fill_batch` writes ``row`` ``(view, facet)``; ``length`` ``(corner, facet)``, m, of the whole
    path over a corner; and ``(facet,)`` the terms' factor ``weight`` = A/(8π r₁r₂), ``facing`` =
    cos θ₁ + cos θ₂ and ``aside`` = n·(d₁×d₂). A is the area, n the normal; each leg has its length
    r, direction d and angle θ to n. `expand_terms` writes ``is_plain`` ``(facet,)``, false if
    the facet is left to `facet_terms`; ``term`` ``(part, corner, facet)``, real and imaginary,
    zero in that case; and, ``(corner, facet)``, ``cell``, the first of the two cells beside a
    path's length, and ``share``, the second cell's share of the term.

    A row may be a part of a facet: its corners are ``shift`` ``(xyz, facet)``, m from the facet's
    centroid, plus ``scale`` ``(facet,)`` times the facet's corners.
    """

    row: IntArray
    shift: FloatArray
    scale: FloatArray
    length: FloatArray
    weight: FloatArray
    facing: FloatArray
    aside: FloatArray
    term: FloatArray
    is_plain: BoolArray
    cell: IntArray
    share: FloatArray


@compiled
def empty_batch() -> FacetBatch:
    """Memory for a batch, not yet filled."""
    size = BATCH_SIZE + MOST_STRIPS * MOST_STRIPS  # the last facet may have so many parts
    return FacetBatch(
        np.empty((2, size), dtype=np.int64),
        np.empty((3, size)),
        np.empty(size),
        np.empty((3, size)),
        np.empty(size),
        np.empty(size),
        np.empty(size),
        np.empty((2, 3, size)),
        np.empty(size, dtype=np.bool_),
        np.empty((3, size), dtype=np.int64),
        np.empty((3, size)),
    )


@compiled
def view_pair(
    first: LitFacets, second: LitFacets, pairs: PairTable, number: int
) -> tuple[ViewPair, RowPair]:
    """Pair ``number`` of a table, and the rows of the first facet that both views see."""
    a, b = pairs.views[number, 0], pairs.views[number, 1]
    pair = ViewPair(
        first,
        second,
        RowPair(first.start[a + 1], second.start[b + 1]),
        pairs.first_cell[number],
        next_kept_cells(pairs.is_kept[number]),
    )
    start = RowPair(first.start[a], second.start[b])
    return pair, common_facet(first.face, second.face, start, pair.end)


@inner
def common_facet(first: IntArray, second: IntArray, place: RowPair, end: RowPair) -> RowPair:
    """Rows of the first facet, from ``place`` on, that both views see; ``end`` if there is none.

    ``first`` and ``second`` ``(row,)`` are the facets' numbers in the views' rows. They are passed
    as arrays, since Numba would count references each time it took them out of a named tuple.
    """
    a, b = place.first, place.second
    while a < end.first and b < end.second:
        if first[a] < second[b]:
            a += 1
        elif second[b] < first[a]:
            b += 1
        else:
            return RowPair(a, b)
    return end


@compiled
def next_kept_cells(is_kept: BoolArray) -> IntArray:
    """For every cell, the first kept cell from there on, or `BEYOND_ALL_CELLS`; ``(cell,)``."""
    out = np.empty(is_kept.size, dtype=np.int64)
    found = BEYOND_ALL_CELLS
    for cell in range(is_kept.size - 1, -1, -1):
        if is_kept[cell]:
            found = cell
        out[cell] = found
    return out


@inlined
def meets_kept_cell(next_kept: IntArray, first_cell: int, shortest: float, longest: float) -> bool:
    """True if a path of a length from ``shortest`` to ``longest`` (m) adds to a kept cell."""
    cell = max(int(shortest * CELLS_PER_METRE) - first_cell, 0)
    last = min(int(longest * CELLS_PER_METRE) - first_cell + 1, next_kept.size - 1)
    return bool(cell <= last and next_kept[cell] <= last)


@compiled
def fill_batch(
    batch: FacetBatch,
    pair: ViewPair,
    faces: Faces,
    wavenumber: float,
    is_done: NDArray[np.int8],
    place: RowPair,
) -> tuple[int, RowPair]:
    """Fill a batch with facets that both views see; return the number of rows and the next place.

    It starts at ``place`` and leaves out facets whose terms add to no kept cell, and those of
    which ``is_done`` ``(face,)`` is not 0.
    """
    one, other = pair.first.aspect, pair.second.aspect
    number, other_number = pair.first.face, pair.second.face
    end, next_kept, first_cell = pair.end, pair.next_kept, pair.first_cell
    area, corner, count = faces.area, faces.corner, 0
    while count < BATCH_SIZE and place.first < end.first:
        a, b = place.first, place.second
        f = number[a]
        p, q, r = one[a, 0] + other[b, 0], one[a, 1] + other[b, 1], one[a, 2] + other[b, 2]
        shortest, longest = min(p, q, r), max(p, q, r)
        if is_done[f] == 0 and meets_kept_cell(next_kept, first_cell, shortest, longest):
            batch.row[0, count], batch.row[1, count] = a, b
            batch.length[0, count], batch.length[1, count], batch.length[2, count] = p, q, r
            batch.shift[0, count], batch.shift[1, count], batch.shift[2, count] = 0.0, 0.0, 0.0
            batch.scale[count] = 1.0
            near, far = one[a, INVERSE_LENGTH], other[b, INVERSE_LENGTH]
            batch.weight[count] = near * far * area[f] * (0.125 / math.pi)
            batch.facing[count] = one[a, FACING] + other[b, FACING]
            batch.aside[count] = (
                one[a, ALONG_FIRST] * other[b, ALONG_SECOND]
                - one[a, ALONG_SECOND] * other[b, ALONG_FIRST]
            )
            strips = 1
            if wavenumber * (longest - shortest) < MOST_BENT_SPAN:
                strips = strips_of(corner, f, 0.5 * wavenumber * (near + far))
            if strips > 1:
                legs = row(pair.first.direction, a), row(pair.second.direction, b)
                divide_row(batch, count, strips, corner, f, legs, (near, far))
            count += strips * strips
        place = common_facet(number, other_number, RowPair(a + 1, b + 1), end)
    return count, place


@inlined
def corner_of(corner: FloatArray, f: int, c: int) -> Vector:
    """Corner c of facet f, m from its centroid."""
    return corner[f, c, 0], corner[f, c, 1], corner[f, c, 2]


@inlined
def strips_of(corner: FloatArray, f: int, curvature: float) -> int:
    """Number of strips into which facet ``f`` is divided, 1 to `MOST_STRIPS`.

    ``curvature`` rad/m²: of the phase, which is left out, over the squared distance.
    """
    reach = 0.0
    for c in range(3):
        offset = corner_of(corner, f, c)
        reach = max(reach, dot(offset, offset))
    strips = math.ceil(math.sqrt(curvature * reach / MOST_BEND))
    return min(max(int(strips), 1), MOST_STRIPS)


@inner
def divide_row(
    batch: FacetBatch,
    first: int,
    strips: int,
    corner: FloatArray,
    f: int,
    legs: tuple[Vector, Vector],
    inverses: tuple[float, float],
) -> None:
    r"""Replace row ``first`` of a batch, a whole facet, by its parts in the rows from there on.

    With the middle s of a part, the legs' directions :math:`d_l` and their inverse lengths
    :math:`w_l`, ``inverses``, its lengths are linear about
    :math:`r_1 + r_2 + \sum_l d_l \cdot s + w_l\,[|s|^2 - (d_l \cdot s)^2]/2`, with the slope
    :math:`\sum_l d_l + w_l\,[s - (d_l \cdot s)\,d_l]`.
    """
    a, b = batch.row[0, first], batch.row[1, first]
    middle = (batch.length[0, first] + batch.length[1, first] + batch.length[2, first]) / 3.0
    weight = batch.weight[first] / (strips * strips)
    facing, aside = batch.facing[first], batch.aside[first]
    corners = corner_of(corner, f, 0), corner_of(corner, f, 1), corner_of(corner, f, 2)
    n = first
    for i in range(strips):
        for j in range(strips - i):
            for half in range(2 if i + j + 1 < strips else 1):
                # barycentric coordinates of the part's middle; the second half is upside down
                v, w = (i + (1 + half) / 3.0) / strips, (j + (1 + half) / 3.0) / strips
                u, scale = 1.0 - v - w, (1.0 - 2.0 * half) / strips
                s = (
                    u * corners[0][0] + v * corners[1][0] + w * corners[2][0],
                    u * corners[0][1] + v * corners[1][1] + w * corners[2][1],
                    u * corners[0][2] + v * corners[1][2] + w * corners[2][2],
                )
                length, slope = middle, (0.0, 0.0, 0.0)
                for leg in range(2):
                    d, inverse = legs[leg], inverses[leg]
                    along = dot(d, s)
                    length += along + 0.5 * inverse * (dot(s, s) - along * along)
                    turned = 1.0 - inverse * along
                    slope = (
                        slope[0] + turned * d[0] + inverse * s[0],
                        slope[1] + turned * d[1] + inverse * s[1],
                        slope[2] + turned * d[2] + inverse * s[2],
                    )
                batch.row[0, n], batch.row[1, n] = a, b
                batch.shift[0, n], batch.shift[1, n], batch.shift[2, n] = s
                batch.scale[n], batch.weight[n] = scale, weight
                batch.facing[n], batch.aside[n] = facing, aside
                for c in range(3):
                    batch.length[c, n] = length + scale * dot(slope, corners[c])
                n += 1


@inlined
def two_cells(position: float) -> tuple[int, float]:
    """The cell at or below a position (in cells), and the share of the cell after it."""
    whole = math.floor(position)
    rest = position - whole
    # the share is a smooth step from 0 to 1; the first cell has the rest
    return int(whole), rest * rest * (3.0 - 2.0 * rest)


@compiled
def expand_terms(batch: FacetBatch, count: int, wavenumber: float, first_cell: int) -> None:
    """Compute the terms of a batch of ``count`` facets, and the cells that they belong to."""
    for corner in range(3):
        own, following = batch.length[corner], batch.length[(corner + 1) % 3]
        last, weight, is_plain = batch.length[(corner + 2) % 3], batch.weight, batch.is_plain
        real, imaginary = batch.term[0, corner], batch.term[1, corner]
        cell, share = batch.cell[corner], batch.share[corner]
        for i in range(count):
            p, q, r = wavenumber * own[i], wavenumber * following[i], wavenumber * last[i]
            x, y, z = abs(p - q), abs(q - r), abs(r - p)
            plain = (min(x, y, z) >= TWO_TERMS_GAP) & (max(x, y, z) >= ONE_TERM_SPAN)
            is_plain[i] = plain
            scale = 2.0 * weight[i] / ((p - q) * (r - p)) if plain else 0.0
            turned = phasor(p)
            real[i], imaginary[i] = scale * turned.real, scale * turned.imag
            cell[i], share[i] = two_cells(own[i] * CELLS_PER_METRE - first_cell)
