"""CUDA kernels of parts of the channel: rays, fields on facets, and sums of their terms.

numba compiles the functions that `polychirp.channel` has for processors for the GPU as well, so
that most kernels here add little more than the number of their thread. Functions that return slices
of arrays, which numba does not compile for a GPU, and the sums of terms, for which a processor
keeps batches of facets in tables, are written anew: each thread has one facet.
"""

import math
from typing import Final, NamedTuple

import numpy as np
from numba import cuda

from polychirp.channel.geometry.bvh import Boxes, first_hit
from polychirp.channel.geometry.vectors import dot, row, vector_at
from polychirp.channel.geometry.wide_bvh import SearchRay, nearest_hit
from polychirp.channel.physical_optics.corner_terms import (
    BEYOND_ALL_CELLS,
    CELLS_PER_METRE,
    MOST_BENT_SPAN,
    corner_of,
    meets_kept_cell,
    strips_of,
    two_cells,
)
from polychirp.channel.physical_optics.facet_integral import facet_terms
from polychirp.channel.physical_optics.incident_waves import _fill_waves
from polychirp.channel.physical_optics.kernels import (
    CELL_LENGTH,
    FACING,
    ILLUMINATED,
    INVERSE_LENGTH,
    SHADOW_RAY_LIFT,
    SHADOWED,
    _is_above_horizon,
    _is_facing,
    mirror_point,
)
from polychirp.channel.physical_optics.term_sums import (
    TERM_WIDTH,
    FacetLegs,
    coherent_share,
    queue_term,
    scattering_matrix,
)
from polychirp.channel.physical_optics.views import NEAR_BODIES, NEAR_PLATES
from polychirp.channel.scene.blockers import (
    OPAQUE_ROLE,
    PLATE_CENTRE,
    PLATE_NORMAL,
    crosses_plate,
    into_body,
    is_beside,
    nodes_of,
)
from polychirp.channel.scene.world import RADAR_CLEARANCE

THREADS: Final = 128
"""Threads of a block (chosen)."""

FARTHEST: Final = 1e3
"""Greatest distance of a closest hit, m (chosen)."""

DEEPEST: Final = 512
"""Single-precision numbers of a thread's working memory for closest hits (chosen: more than the
trees of the paper's street need)."""


def blocks(count):
    """Number of blocks for ``count`` threads."""
    return max(1, -(-count // THREADS))


def on_device(what):
    """A named tuple, or a tuple, whose arrays are copied to the GPU."""
    if isinstance(what, np.ndarray):
        return cuda.to_device(np.ascontiguousarray(what))
    if isinstance(what, tuple):
        parts = [on_device(one) for one in what]
        return type(what)._make(parts) if hasattr(what, "_make") else tuple(parts)
    return what


@cuda.jit
def nothing(_one):
    """A kernel that does nothing."""


@cuda.jit
def fill_states(faces, views, blockers, patch, patch_state, out):
    """`kernels.refine_shadow_edge`: one shadow ray, or two in a mirror, per thread."""
    place = cuda.grid(1)
    if place >= out.size:
        return
    num_faces = faces.area.size
    view, f = place // num_faces, place % num_faces
    if not _is_facing(faces, f, row(views.image, view)):
        return
    state = patch_state[view, patch[f]]
    if not SHADOWED <= state <= ILLUMINATED:
        state = ILLUMINATED if is_lit(views, blockers, view, faces, f) else SHADOWED
    out[view, f] = state


@cuda.jit(device=True)
def is_lit(views, blockers, view, faces, f):
    """`kernels._is_lit`, which has slices of arrays as results, as functions of CUDA have not."""
    c, n, source = row(faces.centroid, f), row(faces.normal, f), row(views.source, view)
    lift = SHADOW_RAY_LIFT
    lifted = (c[0] + lift * n[0], c[1] + lift * n[1], c[2] + lift * n[2])
    if not views.is_mirrored[view]:
        is_own = not _is_above_horizon(faces, f, lifted, source)
        return not is_blocked(views, blockers, view, source, lifted, RADAR_CLEARANCE, is_own)
    number, plate = views.plate[view], blockers.plate
    centre, upright = vector_at(plate, number, PLATE_CENTRE), vector_at(plate, number, PLATE_NORMAL)
    above = (lifted[0] - centre[0], lifted[1] - centre[1], lifted[2] - centre[2])
    if dot(above, upright) <= 0.0:
        return False
    meet = mirror_point(centre, upright, row(views.image, view), lifted)
    gap = (meet[0] - centre[0], meet[1] - centre[1], meet[2] - centre[2])
    if is_beside(plate, number, gap):
        return False
    if is_blocked(views, blockers, view, source, meet, RADAR_CLEARANCE, True):
        return False
    is_own = not _is_above_horizon(faces, f, lifted, meet)
    return not is_blocked(views, blockers, view, lifted, meet, 0.0, is_own)


@cuda.jit(device=True)
def is_blocked(views, blockers, view, start, end, clearance, with_own):
    """`occlusion.is_blocked` among a view's obstacles, the last of which is the facet's body."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = math.sqrt(dot(way, way))
    if length <= clearance:
        return False
    nearest = clearance / length
    for n in range(views.start[view, NEAR_PLATES], views.start[view, NEAR_PLATES + 1]):
        if crosses_plate(blockers.plate, views.near[n], start, way, nearest):
            return True
    last = views.start[view, NEAR_BODIES + 1] - (0 if with_own else 1)
    boxes = Boxes(blockers.box, blockers.skip, blockers.first, blockers.size, blockers.triangle)
    for n in range(views.start[view, NEAR_BODIES], last):
        b = views.near[n]
        place, along = into_body(blockers, b, start, way)
        nodes = nodes_of(blockers, OPAQUE_ROLE, b)
        if first_hit(boxes, nodes, place, along, (nearest, 1.0), True)[0] < math.inf:
            return True
    return False


@cuda.jit
def fill_waves(faces, media, mirrors, views, losses, lit, view, wave):
    """`incident_waves.incident_waves`: one facet per thread."""
    i = cuda.grid(1)
    if i < wave.shape[0]:
        _fill_waves(i, i + 1, faces, media, mirrors, views, losses, lit, view, wave)


@cuda.jit
def fill_hits(bundles, origin, direction, distance, triangle):
    """Closest hit of one ray per thread."""
    i = cuda.grid(1)
    if i < distance.size:
        stack = cuda.local.array(DEEPEST, dtype=np.float32)
        ray = SearchRay(row(origin, i), row(direction, i), (0.0, FARTHEST), 0.0)
        distance[i], triangle[i] = nearest_hit(bundles, (0, 0), ray, 0, stack)


@cuda.jit
def note_rows(lit, view, row_of):
    """Number of the row of every facet in every view, ``(view, face)``; −1 elsewhere."""
    i = cuda.grid(1)
    if i < lit.face.size:
        row_of[view[i], lit.face[i]] = i


class Pairs(NamedTuple):
    """The fields of a `PairTable` that a kernel needs, and `next_kept_cells` of every pair."""

    views: object
    first_cell: object
    next_kept: object


class Facet(NamedTuple):
    """A facet in a pair of views: corners, m from its centroid, legs, their inverse lengths 1/m."""

    corners: object
    legs: object
    inverses: object
    matrix: object
    scale: float


class Sums(NamedTuple):
    """Sums to which the terms of a pair of views are added: ``cells`` ``(cell, TERM_WIDTH)``."""

    next_kept: object
    first_cell: int
    wavenumber: float
    cells: object


@cuda.jit
def add_terms(faces, media, first, second, row_of, pairs, velocity, wavenumber, cells):
    """`delay_cells.sum_in_cells` without flat parts: one facet and pair of views per thread."""
    k = cuda.blockIdx.y
    a = first.start[pairs.views[k, 0]] + cuda.grid(1)
    if a >= first.start[pairs.views[k, 0] + 1]:
        return
    f = first.face[a]
    b = row_of[pairs.views[k, 1], f]
    if b < 0:
        return
    one, other = first.aspect, second.aspect
    p, q, r = one[a, 0] + other[b, 0], one[a, 1] + other[b, 1], one[a, 2] + other[b, 2]
    sums = Sums(pairs.next_kept[k], pairs.first_cell[k], wavenumber, cells[k])
    if not meets_kept_cell(sums.next_kept, sums.first_cell, min(p, q, r), max(p, q, r)):
        return
    near, far = one[a, INVERSE_LENGTH], other[b, INVERSE_LENGTH]
    coherent = coherent_share(media.roughness[faces.medium[f]], one[a, FACING] + other[b, FACING])
    matrix = cuda.local.array(4, dtype=np.complex128)
    scattering_matrix(first.wave, a, second.wave, b, coherent, matrix)
    legs = FacetLegs(
        (row(first.direction, a), row(second.direction, b)),
        (first.length[a], second.length[b]),
        (row(velocity[k], 0), row(velocity[k], 1)),
    )
    corner = faces.corner
    corners = corner_of(corner, f, 0), corner_of(corner, f, 1), corner_of(corner, f, 2)
    scale = near * far * faces.area[f] * (0.125 / math.pi)
    facet = Facet(corners, legs, (near, far), matrix, scale)
    strips = 1
    if wavenumber * (max(p, q, r) - min(p, q, r)) < MOST_BENT_SPAN:
        strips = strips_of(corner, f, 0.5 * wavenumber * (near + far))
    if strips == 1:
        add_part(facet, sums, (p, q, r), (0.0, 0.0, 0.0), 1.0, 1.0)
    else:
        add_parts(facet, sums, (p + q + r) / 3.0, strips)


@cuda.jit(device=True)
def add_parts(facet, sums, middle, strips):
    """Add the parts of a facet, as `corner_terms.divide_row` divides it."""
    x, y, z = facet.corners
    directions, inverses = facet.legs.directions, facet.inverses
    for i in range(strips):
        for j in range(strips - i):
            for half in range(2 if i + j + 1 < strips else 1):
                v, w = (i + (1 + half) / 3.0) / strips, (j + (1 + half) / 3.0) / strips
                u, size = 1.0 - v - w, (1.0 - 2.0 * half) / strips
                s = (
                    u * x[0] + v * y[0] + w * z[0],
                    u * x[1] + v * y[1] + w * z[1],
                    u * x[2] + v * y[2] + w * z[2],
                )
                length, slope = middle, (0.0, 0.0, 0.0)
                for leg in range(2):
                    d = directions[0] if leg == 0 else directions[1]
                    inverse = inverses[0] if leg == 0 else inverses[1]
                    along = dot(d, s)
                    length += along + 0.5 * inverse * (dot(s, s) - along * along)
                    turned = 1.0 - inverse * along
                    slope = (
                        slope[0] + turned * d[0] + inverse * s[0],
                        slope[1] + turned * d[1] + inverse * s[1],
                        slope[2] + turned * d[2] + inverse * s[2],
                    )
                lengths = (
                    length + size * dot(slope, x),
                    length + size * dot(slope, y),
                    length + size * dot(slope, z),
                )
                add_part(facet, sums, lengths, s, size, 1.0 / (strips * strips))


@cuda.jit(device=True)
def add_part(facet, sums, lengths, shift, size, share):
    """Add the terms of a part with ``share`` of the area; its corners are shift + size × corner."""
    weight = cuda.local.array(3, dtype=np.complex128)
    place = cuda.local.array((3, 3), dtype=np.float64)
    term = cuda.local.array(TERM_WIDTH, dtype=np.float64)
    (x, y, z), (p, q, r), k = facet.corners, lengths, sums.wavenumber
    for c in range(facet_terms((k * p, k * q, k * r), weight, place)):
        u, v, w = place[c, 0], place[c, 1], place[c, 2]
        offset = (
            shift[0] + size * (u * x[0] + v * y[0] + w * z[0]),
            shift[1] + size * (u * x[1] + v * y[1] + w * z[1]),
            shift[2] + size * (u * x[2] + v * y[2] + w * z[2]),
        )
        excess = u * p + v * q + w * r - sums.first_cell * CELL_LENGTH
        cell, later = two_cells(excess * CELLS_PER_METRE)
        if cell < 0 or cell + 1 >= sums.cells.shape[0] or sums.next_kept[cell] > cell + 1:
            continue
        whole = share * facet.scale * weight[c]
        amplitude = complex(whole.imag, -whole.real)
        queue_term(term, 0, amplitude, facet.matrix, excess, facet.legs, offset)
        for n in range(TERM_WIDTH):
            cuda.atomic.add(sums.cells, (cell, n), (1.0 - later) * term[n])
            cuda.atomic.add(sums.cells, (cell + 1, n), later * term[n])


def next_kept_of(is_kept):
    """`corner_terms.next_kept_cells` of every row, and one cell more that is not kept."""
    out = np.full((is_kept.shape[0], is_kept.shape[1] + 1), BEYOND_ALL_CELLS)
    for cell in range(is_kept.shape[1] - 1, -1, -1):
        out[:, cell] = np.where(is_kept[:, cell], cell, out[:, cell + 1])
    return out
