r"""Estimate of the power of echoes by way of road and walls, from scalar sums, without fields.

Most echoes of a body with a reflection by road or wall are below the dynamic range. No quick bound
tells which: bounds from areas are 60 dB too high, because the facets' terms cancel each other. So
the facets' terms are summed with their phases as in `sum_in_cells`, but with one number in place of
the field's components. Let a perfect conductor have the normal n, and let the directions d₁ and d₂,
from transmitter and receiver to it, be at angles θ₁ and θ₂ from −n. If one plane of incidence is
turned by φ from the other, then physical optics gives, between the components in and across them,

.. math::
    F = \begin{pmatrix} a & b \\ -b & a \end{pmatrix}, \quad
    a = (\cos\theta_1 + \cos\theta_2) \cos\varphi, \quad
    b = (1 + \cos\theta_1 \cos\theta_2) \sin\varphi

from J = 2 n×H, averaged over both directions of propagation. F is a rotation times

.. math:: \sqrt{a^2 + b^2} = \sqrt{(\cos\theta_1 + \cos\theta_2)^2 + (n \cdot d_1 \times d_2)^2}

so that this factor is the same for every polarisation. For other media the factor is multiplied by
−Γs in one sum and by Γp in another, at the mean of both cosines: without them, the edge between a
pane and flush metal would have no echo. The sum over a cell is an estimate and no bound: where
facets rotate fields differently, the numbers may cancel although the fields do not. Therefore the
greatest of neighbouring cells is taken, and multiplied by `POWER_MARGIN`.
"""

import math
from typing import Final

import numpy as np
from scipy.ndimage import maximum_filter1d

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.channel.materials.reflection_table import ReflectionTable, tabulated_reflection
from polychirp.channel.physical_optics.corner_terms import (
    CELLS_PER_METRE,
    FacetBatch,
    PairTable,
    RowPair,
    ViewPair,
    common_facet,
    empty_batch,
    expand_terms,
    fill_batch,
    meets_kept_cell,
    two_cells,
    view_pair,
)
from polychirp.channel.physical_optics.facet_integral import facet_terms
from polychirp.channel.physical_optics.kernels import Faces, LitFacets
from polychirp.jit import compiled, inlined, inner
from polychirp.threads import in_ranges

POWER_MARGIN: Final = 10.0
"""Power ratio that multiplies estimates (chosen: from any side of the built-in vehicles, no cell
within 25 dB of the strongest is then underestimated)."""

SUM_ACROSS, SUM_ALONG, NUM_SUMS = 3, 4, 5
"""Numbers of the sums over media that are no conductors, across and in the plane of incidence, and
the number of all sums. Sums 0 to 2 are those over conductors, equal for both components: one for
each corner of the facets, so that the processor need not add them one after another."""


def estimated_power(cells: ComplexArray) -> FloatArray:
    """Greatest power ``(pair, cell)`` of each cell and the two beside it, times `POWER_MARGIN`.

    ``cells`` ``(pair, cell, 2)`` are the amplitudes from `estimated_amplitudes`.
    """
    power = np.max(np.abs(cells) ** 2, axis=-1)
    return np.asarray(POWER_MARGIN * maximum_filter1d(power, 3, axis=1, mode="nearest"))


def estimated_amplitudes(
    faces: Faces,
    media: ReflectionTable,
    first: LitFacets,
    second: LitFacets,
    pairs: PairTable,
    wavenumber: float,
) -> ComplexArray:
    """Estimate of the amplitudes that `sum_in_cells` finds, ``(pair, cell, 2)``.

    The last axis is the field's component, across and in the plane of incidence.
    """
    out = np.empty((*pairs.is_kept.shape, 2), dtype=np.complex128)
    in_ranges(_fill_estimates, len(out), faces, media, first, second, pairs, wavenumber, out)
    return out


@compiled
def _fill_estimates(
    begin: int,
    end: int,
    faces: Faces,
    media: ReflectionTable,
    first: LitFacets,
    second: LitFacets,
    pairs: PairTable,
    wavenumber: float,
    out: ComplexArray,
) -> None:
    num_cells = pairs.is_kept.shape[1]
    is_done = np.zeros(faces.area.size, dtype=np.int8)
    for k in range(begin, end):
        cells = np.zeros((NUM_SUMS, num_cells + 1, 2))
        pair, place = view_pair(first, second, pairs, k)
        batch = empty_batch()
        while place.first < pair.end.first:
            count, place = fill_batch(batch, pair, faces, wavenumber, is_done, place)
            _scale_weights(batch, count)
            expand_terms(batch, count, wavenumber, pair.first_cell)
            _add_batch(batch, count, pair, faces, media, wavenumber, cells)
        for cell in range(num_cells):
            metal = cells[0, cell] + cells[1, cell] + cells[2, cell]
            across, along = metal + cells[SUM_ACROSS, cell], metal + cells[SUM_ALONG, cell]
            out[k, cell, 0] = complex(across[0], across[1])
            out[k, cell, 1] = complex(along[0], along[1])


@inner
def _scale_weights(batch: FacetBatch, count: int) -> None:
    """Multiply the weights of a batch's facets by √(a² + b²), see the module's docstring."""
    for i in range(count):
        facing, aside = batch.facing[i], batch.aside[i]
        batch.weight[i] *= math.sqrt(facing * facing + aside * aside)


@inner
def _add_batch(
    batch: FacetBatch,
    count: int,
    pair: ViewPair,
    faces: Faces,
    media: ReflectionTable,
    wavenumber: float,
    cells: FloatArray,
) -> None:
    """Add a batch's terms to sums ``(sum, cell, part)``, with real and imaginary part."""
    face, first_cell = pair.first.face, pair.first_cell
    for i in range(count):
        medium = faces.medium[face[batch.row[0, i]]]
        if media.is_conductor[medium]:
            for c in range(3):
                cell, share = batch.cell[c, i], batch.share[c, i]
                _add(cells, c, cell, share, batch.term[0, c, i], batch.term[1, c, i])
        else:
            gamma_s, gamma_p = tabulated_reflection(media, medium, 0.5 * batch.facing[i])
            for c in range(3):
                term = complex(batch.term[0, c, i], batch.term[1, c, i])
                cell, share = batch.cell[c, i], batch.share[c, i]
                _add_both(cells, cell, share, -gamma_s * term, gamma_p * term)
    # facets with corners of nearly equal phase, where the plain terms lose their accuracy
    weight, place = np.empty(3, dtype=np.complex128), np.empty((3, 3))
    for i in range(count):
        if batch.is_plain[i]:
            continue
        p, q, r = batch.length[0, i], batch.length[1, i], batch.length[2, i]
        terms = facet_terms((wavenumber * p, wavenumber * q, wavenumber * r), weight, place)
        medium = faces.medium[face[batch.row[0, i]]]
        gamma_s, gamma_p = tabulated_reflection(media, medium, 0.5 * batch.facing[i])
        for c in range(terms):
            length = place[c, 0] * p + place[c, 1] * q + place[c, 2] * r
            cell, share = two_cells(length * CELLS_PER_METRE - first_cell)
            term = batch.weight[i] * weight[c]
            _add_both(cells, cell, share, -gamma_s * term, gamma_p * term)


@inlined
def _add_both(cells: FloatArray, cell: int, share: float, across: complex, along: complex) -> None:
    _add(cells, SUM_ACROSS, cell, share, across.real, across.imag)
    _add(cells, SUM_ALONG, cell, share, along.real, along.imag)


@inlined
def _add(
    cells: FloatArray, number: int, cell: int, share: float, real: float, imaginary: float
) -> None:
    """Add one term to sum ``number``, shared between ``cell`` and the next cell."""
    cells[number, cell, 0] += (1.0 - share) * real
    cells[number, cell, 1] += (1.0 - share) * imaginary
    cells[number, cell + 1, 0] += share * real
    cells[number, cell + 1, 1] += share * imaginary


@compiled
def mark_needed_rows(
    reach: FloatArray,
    first: LitFacets,
    second: LitFacets,
    pairs: PairTable,
    is_needed: tuple[BoolArray, BoolArray],
) -> None:
    """Set ``is_needed`` for rows of ``first`` and ``second`` whose facets may meet kept cells.

    ``reach`` m, ``(face,)``, is the distance from a facet's centroid to its farthest corner.
    """
    lengths, other_lengths = first.length, second.length
    faces, other_faces = first.face, second.face
    first_needed, second_needed = is_needed
    for k in range(pairs.is_kept.shape[0]):
        pair, place = view_pair(first, second, pairs, k)
        end, next_kept, first_cell = pair.end, pair.next_kept, pair.first_cell
        while place.first < end.first:
            a, b = place.first, place.second
            length, spread = lengths[a] + other_lengths[b], 2.0 * reach[faces[a]]
            if meets_kept_cell(next_kept, first_cell, length - spread, length + spread):
                first_needed[a] = second_needed[b] = True
            place = common_facet(faces, other_faces, RowPair(a + 1, b + 1), end)
