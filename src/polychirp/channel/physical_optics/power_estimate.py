r"""What echoes in mirrors are worth: a first sum of scalars, before any field is computed.

Most of the echoes that a body has in road and walls end below the dynamic range, but no bound
that is quick tells which: those over areas are 60 dB too high, because facets cancel each other.
So their phases are summed as `gathering.gather_cells` sums them, with one number for all
components. Physical optics of a perfect conductor of normal n, with directions d₁ and d₂ towards it
and θ₁ and θ₂ from −n, has in the planes of incidence, of which one is turned by φ from the other,
and across

.. math::
    F = \begin{pmatrix} a & b \\ -b & a \end{pmatrix}, \quad
    a = (\cos\theta_1 + \cos\theta_2) \cos\varphi, \quad
    b = (1 + \cos\theta_1 \cos\theta_2) \sin\varphi

(from J = 2 n×H, both ways round), which is a turn by some angle times

.. math:: \sqrt{a^2 + b^2} = \sqrt{(\cos\theta_1 + \cos\theta_2)^2 + (n \cdot d_1 \times d_2)^2}

whatever the polarisations. Other media take their parts −Γs and Γp of it, at the mean of both
cosines, in two sums: without them, the rim of a pane set flush in metal would have no echo. The
sums over a cell are an estimate, no bound: where facets turn fields unlike, the numbers may cancel
and the fields not. Neighbouring cells and `MARGIN` make up for that.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numba import njit, prange
from scipy.ndimage import maximum_filter1d

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.materials.reflection_table import ReflectionTable, tabulated_reflection
from polychirp.channel.physical_optics.corner_terms import (
    PER_CELL,
    Batch,
    batch,
    expand,
    fill,
    is_worth,
    next_shared,
    next_worthy,
    two_cells,
)
from polychirp.channel.physical_optics.kernels import Faces, Rows, facet_terms

MARGIN: Final = 10.0
"""Power ratio by which an estimate may be too low."""

ACROSS, ALONG, NUM_SUMS = 3, 4, 5
"""Sums of media that are no conductors, across and in the plane of incidence. Before them are
conductors' for each corner, which are the same for both: three, so that none waits for another."""


def estimated_power(cells: ComplexArray) -> FloatArray:
    """Greatest power ``(task, cell)`` of cells and those beside them, margin included."""
    power = np.max(np.abs(cells) ** 2, axis=-1)
    return np.asarray(MARGIN * maximum_filter1d(power, 3, axis=1, mode="nearest"))


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def scalar_cells(
    faces: Faces,
    media: ReflectionTable,
    first: Rows,
    second: Rows,
    task: IntArray,
    first_cell: IntArray,
    num_cells: int,
    wavenumber: float,
) -> ComplexArray:
    """What `gathering.gather_cells` finds, estimated across and in the plane of incidence.

    Returns ``(task, cell, 2)``.
    """
    out = np.empty((task.shape[0], num_cells, 2), dtype=np.complex128)
    worthy = next_worthy(np.ones(num_cells, dtype=np.bool_))
    for k in prange(task.shape[0]):
        cells = np.zeros((NUM_SUMS, num_cells + 1, 2))
        starts = first.start[task[k, 0]], second.start[task[k, 1]]
        ends = first.start[task[k, 0] + 1], second.start[task[k, 1] + 1]
        room = batch()
        place = next_shared(first.face, second.face, starts[0], starts[1], ends)
        while place[0] < ends[0]:
            count, a, b = fill(room, faces.area, first, second, place, ends, worthy, first_cell[k])
            place = a, b
            _weigh(room, count)
            expand(room, count, wavenumber, first_cell[k])
            _sum_batch(room, count, faces, media, first.face, first_cell[k], wavenumber, cells)
        for cell in range(num_cells):
            metal = cells[0, cell] + cells[1, cell] + cells[2, cell]
            across, along = metal + cells[ACROSS, cell], metal + cells[ALONG, cell]
            out[k, cell, 0] = complex(across[0], across[1])
            out[k, cell, 1] = complex(along[0], along[1])
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _weigh(room: Batch, count: int) -> None:
    """Multiply the weights of a batch by F, as above, of their facets."""
    for i in range(count):
        facing, aside = room.facing[i], room.aside[i]
        room.weight[i] *= math.sqrt(facing * facing + aside * aside)


@njit(cache=True, nogil=True, error_model="numpy")
def _sum_batch(
    room: Batch,
    count: int,
    faces: Faces,
    media: ReflectionTable,
    face: IntArray,
    first_cell: int,
    wavenumber: float,
    cells: FloatArray,
) -> None:
    """Add a batch's terms to sums ``(sum, cell, part)``."""
    for i in range(count):
        medium = faces.medium[face[room.row[0, i]]]
        if media.is_conductor[medium]:
            for c in range(3):
                cell, share = room.cell[c, i], room.share[c, i]
                _add(cells, c, cell, share, room.term[0, c, i], room.term[1, c, i])
        else:
            gamma_s, gamma_p = tabulated_reflection(media, medium, 0.5 * room.facing[i])
            for c in range(3):
                term = complex(room.term[0, c, i], room.term[1, c, i])
                cell, share = room.cell[c, i], room.share[c, i]
                _add_both(cells, cell, share, -gamma_s * term, gamma_p * term)
    weight, place = np.empty(3, dtype=np.complex128), np.empty((3, 3))
    for i in range(count):
        if room.is_plain[i]:
            continue
        p, q, r = room.length[0, i], room.length[1, i], room.length[2, i]
        terms = facet_terms((wavenumber * p, wavenumber * q, wavenumber * r), weight, place)
        medium = faces.medium[face[room.row[0, i]]]
        gamma_s, gamma_p = tabulated_reflection(media, medium, 0.5 * room.facing[i])
        for c in range(terms):
            length = place[c, 0] * p + place[c, 1] * q + place[c, 2] * r
            cell, share = two_cells(length * PER_CELL - first_cell)
            term = room.weight[i] * weight[c]
            _add_both(cells, cell, share, -gamma_s * term, gamma_p * term)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _add_both(cells: FloatArray, cell: int, share: float, across: complex, along: complex) -> None:
    _add(cells, ACROSS, cell, share, across.real, across.imag)
    _add(cells, ALONG, cell, share, along.real, along.imag)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _add(
    cells: FloatArray, which: int, cell: int, share: float, real: float, imaginary: float
) -> None:
    """Add one term to two cells of one of the sums."""
    cells[which, cell, 0] += (1.0 - share) * real
    cells[which, cell, 1] += (1.0 - share) * imaginary
    cells[which, cell + 1, 0] += share * real
    cells[which, cell + 1, 1] += share * imaginary


@njit(cache=True, nogil=True, error_model="numpy")
def mark_needed(
    reach: FloatArray,
    first: Rows,
    second: Rows,
    task: IntArray,
    first_cell: IntArray,
    worth: BoolArray,
    needed: tuple[BoolArray, BoolArray],
) -> None:
    """Mark rows of ``first`` and ``second`` whose facets fall into cells that are ``worth`` it.

    ``reach`` m, ``(face,)``, from a facet's centroid to its farthest corner.
    """
    for k in range(task.shape[0]):
        starts = first.start[task[k, 0]], second.start[task[k, 1]]
        ends = first.start[task[k, 0] + 1], second.start[task[k, 1] + 1]
        worthy = next_worthy(worth[k])
        a, b = next_shared(first.face, second.face, starts[0], starts[1], ends)
        while a < ends[0]:
            length, spread = first.length[a] + second.length[b], 2.0 * reach[first.face[a]]
            if is_worth(worthy, length - spread, length + spread, first_cell[k]):
                needed[0][a] = needed[1][b] = True
            a, b = next_shared(first.face, second.face, a + 1, b + 1, ends)
