"""What thin sheets and leaves take away between a view's radar and the patches that it sees.

A patch of neighbouring facets has the losses at its middle: like a mirrored view's shadows, the
rim of a pane is as coarse as a patch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from polychirp.axes import BoolArray, ComplexArray, IntArray
from polychirp.channel.geometry.vectors import Vector, row, vector_at
from polychirp.channel.materials.fresnel import Media
from polychirp.channel.physical_optics.kernels import LIFT, Faces, Rows, meet_mirror
from polychirp.channel.physical_optics.views import NEAR_PANES, NEAR_VEILED, ViewTable, near_view
from polychirp.channel.scene.blockers import PLATE_CENTRE, PLATE_NORMAL, Blockers, in_frame_of
from polychirp.channel.scene.transmission import (
    Leg,
    Wave,
    is_attenuated,
    transmission_matrix,
)
from polychirp.channel.scene.world import POLARISATION_AXES, RADAR_CLEARANCE, World


class Losses(NamedTuple):
    """Which of the matrices a view's patch has.

    ``number`` ``(view, patch)``, 0 without losses; ``matrix`` ``(number, leg, 2, 2)`` as
    `transmission.transmission_matrices` gives them, of the way to the mirror and of the way behind
    it. Without a mirror the second leg loses nothing.
    """

    number: IntArray
    matrix: ComplexArray


def losses_of(world: World, body: int, table: ViewTable, faces: Faces, rows: Rows) -> Losses:
    """Losses of all views of a body on the ways to the patches of ``rows``.

    ``faces`` are those in the middles of the body's patches.
    """
    surface = world.surfaces[body]
    number = np.zeros((len(table.image), len(surface.patch_face)), dtype=np.int64)
    if not table.weakened:
        return Losses(number, _identities(1))
    rotation = world.rotation[body]
    blockers = in_frame_of(world, rotation, world.position[body])
    is_lit = _lit_patches(rows, surface.patch, len(surface.patch_face))
    views, patches = np.nonzero(_weakened(table, blockers, faces, is_lit))
    number[views, patches] = np.arange(1, len(views) + 1)
    matrix = _identities(len(views) + 1)
    wave = Wave(np.ascontiguousarray(POLARISATION_AXES @ rotation), world.wavenumber)
    _fill(table, blockers, world.media, wave, faces, views, patches, matrix[1:])
    return Losses(number, matrix)


def _identities(count: int) -> ComplexArray:
    matrix = np.zeros((count, 2, 2, 2), dtype=np.complex128)
    matrix[..., 0, 0] = matrix[..., 1, 1] = 1.0
    return matrix


@njit(cache=True, nogil=True)
def _lit_patches(rows: Rows, patch: IntArray, num_patches: int) -> BoolArray:
    """Where a view has rows of a patch, ``(view, patch)``."""
    out = np.zeros((rows.start.size - 1, num_patches), dtype=np.bool_)
    for view in range(rows.start.size - 1):
        for i in range(rows.start[view], rows.start[view + 1]):
            out[view, patch[rows.face[i]]] = True
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def _stations(
    table: ViewTable, blockers: Blockers, view: int, faces: Faces, patch: int
) -> tuple[Vector, Vector, Vector]:
    """The radar, the mirror point, and the patch; without a mirror the last two are the same."""
    c, n = faces.centroid[patch], faces.normal[patch]
    end = (c[0] + LIFT * n[0], c[1] + LIFT * n[1], c[2] + LIFT * n[2])
    start = row(table.source, view)
    p = table.plate[view]
    if p < 0:
        return start, end, end
    centre, normal = (
        vector_at(blockers.plate, p, PLATE_CENTRE),
        vector_at(blockers.plate, p, PLATE_NORMAL),
    )
    meet = meet_mirror(centre, normal, row(table.image, view), end)
    return start, meet, end


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def _weakened(table: ViewTable, blockers: Blockers, faces: Faces, is_lit: BoolArray) -> BoolArray:
    """Where a pane or a cloud is on the way to a lit patch, ``(view, patch)``."""
    num_views, num_patches = is_lit.shape
    out = np.zeros((num_views, num_patches), dtype=np.bool_)
    for number in prange(num_views * num_patches):
        view, patch = number // num_patches, number % num_patches
        if not is_lit[view, patch]:
            continue
        bodies = near_view(table, view, NEAR_VEILED)
        panes = near_view(table, view, NEAR_PANES)
        start, meet, end = _stations(table, blockers, view, faces, patch)
        found = is_attenuated(blockers, bodies, panes, start, meet, RADAR_CLEARANCE)
        if not found and table.plate[view] >= 0:
            found = is_attenuated(blockers, bodies, panes, end, meet, 0.0)
        out[view, patch] = found
    return out


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def _fill(
    table: ViewTable,
    blockers: Blockers,
    media: Media,
    wave: Wave,
    faces: Faces,
    views: IntArray,
    patches: IntArray,
    matrix: ComplexArray,
) -> None:
    for number in prange(len(views)):
        view, out = views[number], matrix[number]
        bodies = near_view(table, view, NEAR_VEILED)
        panes = near_view(table, view, NEAR_PANES)
        start, meet, end = _stations(table, blockers, view, faces, patches[number])
        leg = Leg(start, meet)
        transmission_matrix(blockers, media, wave, bodies, panes, leg, RADAR_CLEARANCE, out[0])
        if table.plate[view] >= 0:
            leg = Leg(meet, end)
            transmission_matrix(blockers, media, wave, bodies, panes, leg, 0.0, out[1])
