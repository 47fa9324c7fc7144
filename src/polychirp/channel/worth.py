r"""What echoes in mirrors are worth: a first sum of scalars, before any field is computed.

Most of the echoes that a body has in road and walls end below the dynamic range, but no bound
that is quick tells which: those over areas are 60 dB too high, because facets cancel each other.
So their phases are summed as `optics.gather_cells` sums them, with one number for all components.
Physical optics of a perfect conductor of normal n, with directions d₁ and d₂ towards it and θ₁ and
θ₂ from −n, has in the planes of incidence, of which one is turned by φ from the other, and across

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
from polychirp.channel.optics import CELL, Faces, Rows, facet_terms, is_worth, next_shared
from polychirp.channel.reflection_table import ReflectionTable, looked_up
from polychirp.channel.vectors import cross, dot, row

MARGIN: Final = 10.0
"""Power ratio by which an estimate may be too low."""


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
    """What `optics.gather_cells` finds, estimated across and in the plane of incidence.

    Returns ``(task, cell, 2)``.
    """
    out = np.zeros((task.shape[0], num_cells, 2), dtype=np.complex128)
    for k in prange(task.shape[0]):
        spans = first.start[task[k, 0] :][:2], second.start[task[k, 1] :][:2]
        _add_scalars(faces, media, first, second, spans, first_cell[k], wavenumber, out[k])
    return out


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _add_scalars(
    faces: Faces,
    media: ReflectionTable,
    first: Rows,
    second: Rows,
    spans: tuple[IntArray, IntArray],
    first_cell: int,
    wavenumber: float,
    cells: ComplexArray,
) -> None:
    weight, place = np.empty(3, dtype=np.complex128), np.empty((3, 3))
    ends = spans[0][1], spans[1][1]
    a, b = next_shared(first.face, second.face, spans[0][0], spans[1][0], ends)
    while a < ends[0]:
        f = first.face[a]
        corner = faces.corner[f]
        d1, d2 = row(first.direction, a), row(second.direction, b)
        r1, r2 = first.length[a], second.length[b]
        g = (d1[0] + d2[0], d1[1] + d2[1], d1[2] + d2[2])
        e0, e1, e2 = dot(g, row(corner, 0)), dot(g, row(corner, 1)), dot(g, row(corner, 2))
        total = r1 + r2
        phases = wavenumber * (total + e0), wavenumber * (total + e1), wavenumber * (total + e2)
        count = facet_terms(phases, weight, place)
        n = row(faces.normal, f)
        facing, aside = dot(g, n), dot(n, cross(d1, d2))
        scale = (
            math.sqrt(facing * facing + aside * aside) * faces.area[f] / (8.0 * math.pi * r1 * r2)
        )
        gamma_s, gamma_p = looked_up(media, faces.medium[f], -0.5 * facing)
        for i in range(count):
            offset = place[i, 0] * e0 + place[i, 1] * e1 + place[i, 2] * e2
            position = (total + offset) / CELL - first_cell
            cell = int(position)
            x = position - cell
            share, term = x * x * (3.0 - 2.0 * x), scale * weight[i]
            across, along = -gamma_s * term, gamma_p * term
            cells[cell, 0] += (1.0 - share) * across
            cells[cell, 1] += (1.0 - share) * along
            cells[cell + 1, 0] += share * across
            cells[cell + 1, 1] += share * along
        a, b = next_shared(first.face, second.face, a + 1, b + 1, ends)


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
        ends = first.start[task[k, 0] + 1], second.start[task[k, 1] + 1]
        a, b = next_shared(
            first.face, second.face, first.start[task[k, 0]], second.start[task[k, 1]], ends
        )
        while a < ends[0]:
            length, spread = first.length[a] + second.length[b], 2.0 * reach[first.face[a]]
            if is_worth(worth[k], length - spread, length + spread, first_cell[k]):
                needed[0][a] = needed[1][b] = True
            a, b = next_shared(first.face, second.face, a + 1, b + 1, ends)
