"""What thin sheets and leaves take away between a view's radar and the patches that it sees.

A patch of neighbouring facets has the losses at its middle: like a mirrored view's shadows, the
rim of a pane is as coarse as a patch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.caster import Vector
from polychirp.channel.fresnel import Media
from polychirp.channel.legs import Veil, is_veiled, lose, veil_of
from polychirp.channel.optics import LIFT, Faces, Rows, meet_mirror
from polychirp.channel.vectors import row
from polychirp.channel.views import ViewTable
from polychirp.channel.world import SKIN, UPWARDS, World


class Losses(NamedTuple):
    """Which of the matrices a view's patch has.

    ``number`` ``(view, patch)``, 0 without losses; ``matrix`` ``(number, leg, 2, 2)`` as
    `legs.through` gives them, of the way to the mirror and of the way behind it. Without a mirror
    the second leg loses nothing.
    """

    number: IntArray
    matrix: ComplexArray


def losses_of(world: World, body: int, table: ViewTable, faces: Faces, rows: Rows) -> Losses:
    """Losses of all views of a body on the ways to the patches of ``rows``.

    ``faces`` are those in the middles of the body's patches.
    """
    surface = world.surfaces[body]
    number = np.zeros((len(table.image), len(surface.patch_face)), dtype=np.int64)
    if not (len(table.veiled) or len(table.panes)):
        return Losses(number, _identities(1))
    rotation = world.rotation[body]
    veil = veil_of(world, rotation, world.position[body])
    is_lit = np.zeros(number.shape, dtype=np.bool_)
    is_lit[rows.view, surface.patch[rows.face]] = True
    views, patches = np.nonzero(_weakened(table, veil, faces, is_lit))
    number[views, patches] = np.arange(1, len(views) + 1)
    matrix = _identities(len(views) + 1)
    upwards = np.ascontiguousarray(UPWARDS @ rotation)
    _fill(table, veil, world.media, faces, views, patches, upwards, world.wavenumber, matrix[1:])
    return Losses(number, matrix)


def _identities(count: int) -> ComplexArray:
    matrix = np.zeros((count, 2, 2, 2), dtype=np.complex128)
    matrix[..., 0, 0] = matrix[..., 1, 1] = 1.0
    return matrix


@njit(cache=True, nogil=True, error_model="numpy")
def _stations(
    table: ViewTable, veil: Veil, view: int, faces: Faces, patch: int
) -> tuple[Vector, Vector, Vector]:
    """The radar, the mirror point, and the patch; without a mirror the last two are the same."""
    c, n = faces.centroid[patch], faces.normal[patch]
    end = (c[0] + LIFT * n[0], c[1] + LIFT * n[1], c[2] + LIFT * n[2])
    start = row(table.source, view)
    if not table.is_mirrored[view]:
        return start, end, end
    p = table.plate[view]
    meet = meet_mirror(
        row(veil.plate_centre, p), row(veil.plate_normal, p), row(table.image, view), end
    )
    return start, meet, end


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def _weakened(table: ViewTable, veil: Veil, faces: Faces, is_lit: BoolArray) -> BoolArray:
    """Where a pane or a cloud is on the way to a lit patch, ``(view, patch)``."""
    num_views, num_patches = is_lit.shape
    out = np.zeros((num_views, num_patches), dtype=np.bool_)
    for number in prange(num_views * num_patches):
        view, patch = number // num_patches, number % num_patches
        if not is_lit[view, patch]:
            continue
        bodies = table.veiled[table.veiled_start[view] : table.veiled_start[view + 1]]
        panes = table.panes[table.pane_start[view] : table.pane_start[view + 1]]
        start, meet, end = _stations(table, veil, view, faces, patch)
        found = is_veiled(veil, bodies, panes, start, meet, SKIN)
        if not found and table.is_mirrored[view]:
            found = is_veiled(veil, bodies, panes, end, meet, 0.0)
        out[view, patch] = found
    return out


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def _fill(
    table: ViewTable,
    veil: Veil,
    media: Media,
    faces: Faces,
    views: IntArray,
    patches: IntArray,
    upwards: FloatArray,
    wavenumber: float,
    matrix: ComplexArray,
) -> None:
    for number in prange(len(views)):
        view, out = views[number], matrix[number]
        bodies = table.veiled[table.veiled_start[view] : table.veiled_start[view + 1]]
        panes = table.panes[table.pane_start[view] : table.pane_start[view + 1]]
        start, meet, end = _stations(table, veil, view, faces, patches[number])
        lose(veil, media, bodies, panes, start, meet, SKIN, upwards, wavenumber, out[0])
        if table.is_mirrored[view]:
            lose(veil, media, bodies, panes, meet, end, 0.0, upwards, wavenumber, out[1])
