"""Losses in thin sheets and leaves between a view's radar and the patches that it illuminates.

All facets of a patch have the losses at the patch's middle. So the border of a pane's shadow is
resolved only to the size of a patch, like the shadows in a mirrored view.
"""

from typing import NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, IntArray
from polychirp.channel.geometry.vectors import Vector, row, vector_at
from polychirp.channel.materials.fresnel import Media
from polychirp.channel.physical_optics.kernels import (
    SHADOW_RAY_LIFT,
    Faces,
    LitFacets,
    mirror_point,
)
from polychirp.channel.physical_optics.views import NEAR_PANES, NEAR_VEILED, ViewTable, near_view
from polychirp.channel.scene.blockers import PLATE_CENTRE, PLATE_NORMAL, Blockers, in_frame_of
from polychirp.channel.scene.transmission import (
    Leg,
    Wave,
    is_attenuated,
    transmission_matrix,
)
from polychirp.channel.scene.world import POLARISATION_AXES, RADAR_CLEARANCE, World
from polychirp.jit import compiled, inner
from polychirp.threads import in_ranges


class Losses(NamedTuple):
    """Loss matrices of the ways from views to patches.

    ``patch`` ``(face,)`` is the patch of each facet. ``number`` ``(view, patch)`` is the number of
    the way's matrices; number 0 are unit matrices, for ways without a loss. ``matrix``
    ``(number, leg, 2, 2)`` are as `transmission.transmission_matrices` gives them, of the leg from
    the radar to the mirror and of the leg from there to the patch. Without a mirror the second leg
    loses nothing.
    """

    patch: IntArray
    number: IntArray
    matrix: ComplexArray


def view_losses(
    world: World, body: int, table: ViewTable, patches: Faces, lit: LitFacets
) -> Losses:
    """Losses of all views of a body on the ways to the patches that have lit facets.

    ``patches`` holds, for every patch of the body, the facet in its middle.
    """
    surface = world.surfaces[body]
    number = np.zeros((len(table.image), len(surface.patch_face)), dtype=np.int64)
    if not table.has_sheets:
        return Losses(surface.patch, number, identities(1))
    rotation = world.rotation[body]
    blockers = in_frame_of(world, rotation, world.position[body])
    is_lit = _lit_patches(lit, surface.patch, len(surface.patch_face))
    is_weakened = np.zeros(is_lit.shape, dtype=np.bool_)
    in_ranges(_find_weakened, is_lit.size, table, blockers, patches, is_lit, is_weakened, least=100)
    view, patch = np.nonzero(is_weakened)
    number[view, patch] = np.arange(1, len(view) + 1)
    matrix = identities(len(view) + 1)
    wave = Wave(np.ascontiguousarray(POLARISATION_AXES @ rotation), world.wavenumber)
    way, out = (view, patch), matrix[1:]
    in_ranges(
        _fill_matrices, len(out), table, blockers, world.media, wave, patches, way, out, least=20
    )
    return Losses(surface.patch, number, matrix)


def identities(count: int) -> ComplexArray:
    """Matrices ``(number, leg, 2, 2)`` of ways without a loss."""
    matrix = np.zeros((count, 2, 2, 2), dtype=np.complex128)
    matrix[..., 0, 0] = matrix[..., 1, 1] = 1.0
    return matrix


@compiled
def _lit_patches(lit: LitFacets, patch: IntArray, num_patches: int) -> BoolArray:
    """Mask of the patches with at least one illuminated facet, ``(view, patch)``."""
    out = np.zeros((lit.start.size - 1, num_patches), dtype=np.bool_)
    for view in range(lit.start.size - 1):
        for i in range(lit.start[view], lit.start[view + 1]):
            out[view, patch[lit.face[i]]] = True
    return out


@inner
def _stations(
    table: ViewTable, blockers: Blockers, view: int, patches: Faces, patch: int
) -> tuple[Vector, Vector, Vector]:
    """Positions of radar, mirror point and patch; without a mirror the last two are the same."""
    c, n = patches.centroid[patch], patches.normal[patch]
    end = (
        c[0] + SHADOW_RAY_LIFT * n[0],
        c[1] + SHADOW_RAY_LIFT * n[1],
        c[2] + SHADOW_RAY_LIFT * n[2],
    )
    start = row(table.source, view)
    if not table.is_mirrored[view]:
        return start, end, end
    p = table.plate[view]
    centre, normal = (
        vector_at(blockers.plate, p, PLATE_CENTRE),
        vector_at(blockers.plate, p, PLATE_NORMAL),
    )
    meet = mirror_point(centre, normal, row(table.image, view), end)
    return start, meet, end


@compiled
def _find_weakened(
    begin: int,
    end: int,
    table: ViewTable,
    blockers: Blockers,
    patches: Faces,
    is_lit: BoolArray,
    out: BoolArray,
) -> None:
    """Mark in ``out`` ``(view, patch)`` the lit patches with a pane or leaves on the way."""
    num_patches = is_lit.shape[1]
    for number in range(begin, end):
        view, patch = number // num_patches, number % num_patches
        if not is_lit[view, patch]:
            continue
        bodies = near_view(table, view, NEAR_VEILED)
        panes = near_view(table, view, NEAR_PANES)
        start, meet, lifted = _stations(table, blockers, view, patches, patch)
        found = is_attenuated(blockers, bodies, panes, start, meet, RADAR_CLEARANCE)
        if not found and table.is_mirrored[view]:
            found = is_attenuated(blockers, bodies, panes, lifted, meet, 0.0)
        out[view, patch] = found


@compiled
def _fill_matrices(
    begin: int,
    end: int,
    table: ViewTable,
    blockers: Blockers,
    media: Media,
    wave: Wave,
    patches: Faces,
    way: tuple[IntArray, IntArray],
    matrix: ComplexArray,
) -> None:
    """Fill ``matrix`` ``(way, leg, 2, 2)``; ``way`` holds the view and the patch of each."""
    views, patch = way
    for number in range(begin, end):
        view, out = views[number], matrix[number]
        bodies = near_view(table, view, NEAR_VEILED)
        panes = near_view(table, view, NEAR_PANES)
        start, meet, lifted = _stations(table, blockers, view, patches, patch[number])
        leg = Leg(start, meet)
        transmission_matrix(blockers, media, wave, bodies, panes, leg, RADAR_CLEARANCE, out[0])
        if table.is_mirrored[view]:
            leg = Leg(meet, lifted)
            transmission_matrix(blockers, media, wave, bodies, panes, leg, 0.0, out[1])
