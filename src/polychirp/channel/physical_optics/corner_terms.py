r"""Corner terms of the facets that two views share, many facets at a time.

A path's length to a facet's corner is the sum of both views' own, :math:`r + d \cdot c`, which
`optics.Rows` has. So what two views make of a facet costs three sums; and its three terms, which
`optics.facet_terms` states one facet at a time, are worked out without branches for a batch of
facets, several in one instruction of the processor. Facets with phases too near each other for
that are left to `optics.facet_terms`.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numba import njit

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.physical_optics.kernels import (
    ALONG_FIRST,
    ALONG_SECOND,
    CELL,
    FACING,
    NEARNESS,
    ONE_TERM,
    TWO_TERMS,
    Rows,
    _phasor,
)

BATCH: Final = 256
"""Facets: few enough to stay in the processor's first cache."""

NEVER: Final = 1 << 40
"""A cell behind all others."""

PER_CELL: Final = 1.0 / CELL


class Batch(NamedTuple):
    """Room for facets that both views of a task see, ``(…, facet)``.

    ``row`` ``(view, facet)`` of both views; ``length`` ``(corner, facet)`` m, of the whole path
    over every corner; ``weight`` ``(facet,)``, of the terms, as `fill` gives it A/(8π r₁r₂);
    ``facing`` cos θ₁ + cos θ₂ and ``aside`` n·(d₁×d₂), ``(facet,)``. From `expand`: ``term``
    ``(part, corner, facet)``, real and imaginary, zero if not ``is_plain`` ``(facet,)``; and
    ``cell`` and ``share``, ``(corner, facet)``: the first of two cells of a path's length, and
    how much of the term is the second's.
    """

    row: IntArray
    length: FloatArray
    weight: FloatArray
    facing: FloatArray
    aside: FloatArray
    term: FloatArray
    is_plain: BoolArray
    cell: IntArray
    share: FloatArray


@njit(cache=True, nogil=True)
def batch() -> Batch:
    """Room for a batch."""
    return Batch(
        np.empty((2, BATCH), dtype=np.int64),
        np.empty((3, BATCH)),
        np.empty(BATCH),
        np.empty(BATCH),
        np.empty(BATCH),
        np.empty((2, 3, BATCH)),
        np.empty(BATCH, dtype=np.bool_),
        np.empty((3, BATCH), dtype=np.int64),
        np.empty((3, BATCH)),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def next_shared(
    first: IntArray, second: IntArray, a: int, b: int, ends: tuple[int, int]
) -> tuple[int, int]:
    """From rows a and b on, the next two of one facet; the first is ``ends[0]`` if there are none.

    ``first`` and ``second`` are the rows' facets ``(row,)``; ``ends`` those of both views' rows.
    """
    while a < ends[0] and b < ends[1]:
        if first[a] < second[b]:
            a += 1
        elif second[b] < first[a]:
            b += 1
        else:
            return a, b
    return ends[0], ends[1]


@njit(cache=True, nogil=True)
def next_worthy(worth: BoolArray) -> IntArray:
    """The first cell from every cell on that is ``worth`` ``(cell,)`` the work, or `NEVER`."""
    out = np.empty(worth.size, dtype=np.int64)
    found = NEVER
    for cell in range(worth.size - 1, -1, -1):
        if worth[cell]:
            found = cell
        out[cell] = found
    return out


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def is_worth(worthy: IntArray, shortest: float, longest: float, first_cell: int) -> bool:
    """Whether one of the cells that lengths of a facet, m, fall into is worth the work.

    ``worthy`` as `next_worthy` gives it.
    """
    cell = max(int(shortest * PER_CELL) - first_cell, 0)
    last = min(int(longest * PER_CELL) - first_cell + 1, worthy.size - 1)
    return bool(cell <= last and worthy[cell] <= last)


@njit(cache=True, nogil=True, error_model="numpy")
def fill(
    room: Batch,
    area: FloatArray,
    first: Rows,
    second: Rows,
    place: tuple[int, int],
    ends: tuple[int, int],
    worthy: IntArray,
    first_cell: int,
) -> tuple[int, int, int]:
    """Fill a batch with facets from two rows on; how many, and the two rows that are next.

    Left out are facets that fall into no cell that is worth it, of those from ``first_cell`` on.
    """
    one, other, faces = first.aspect, second.aspect, first.face
    a, b = place
    count = 0
    while count < BATCH and a < ends[0]:
        p, q, r = one[a, 0] + other[b, 0], one[a, 1] + other[b, 1], one[a, 2] + other[b, 2]
        if is_worth(worthy, min(p, q, r), max(p, q, r), first_cell):
            room.row[0, count], room.row[1, count] = a, b
            room.length[0, count], room.length[1, count], room.length[2, count] = p, q, r
            near = one[a, NEARNESS] * other[b, NEARNESS]
            room.weight[count] = near * area[faces[a]] * (0.125 / math.pi)
            room.facing[count] = one[a, FACING] + other[b, FACING]
            room.aside[count] = (
                one[a, ALONG_FIRST] * other[b, ALONG_SECOND]
                - one[a, ALONG_SECOND] * other[b, ALONG_FIRST]
            )
            count += 1
        a, b = next_shared(faces, second.face, a + 1, b + 1, ends)
    return count, a, b


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def two_cells(position: float) -> tuple[int, float]:
    """The first of the two cells beside a position, in cells, and the second one's share."""
    whole = math.floor(position)
    rest = position - whole
    # smooth, and both shares add to one
    return int(whole), rest * rest * (3.0 - 2.0 * rest)


@njit(cache=True, nogil=True, error_model="numpy")
def expand(room: Batch, count: int, wavenumber: float, first_cell: int) -> None:
    """Work out the terms of a batch of ``count`` facets, and the cells that they belong to."""
    for corner in range(3):
        own, following = room.length[corner], room.length[(corner + 1) % 3]
        last, weight, is_plain = room.length[(corner + 2) % 3], room.weight, room.is_plain
        real, imaginary = room.term[0, corner], room.term[1, corner]
        cell, share = room.cell[corner], room.share[corner]
        for i in range(count):
            p, q, r = wavenumber * own[i], wavenumber * following[i], wavenumber * last[i]
            x, y, z = abs(p - q), abs(q - r), abs(r - p)
            plain = (min(x, y, z) >= TWO_TERMS) & (max(x, y, z) >= ONE_TERM)
            is_plain[i] = plain
            scale = 2.0 * weight[i] / ((p - q) * (r - p)) if plain else 0.0
            turned = _phasor(p)
            real[i], imaginary[i] = scale * turned.real, scale * turned.imag
            cell[i], share[i] = two_cells(own[i] * PER_CELL - first_cell)
