"""Illumination of one body: the facets that radars see, directly or mirrored, and their waves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple, Self

import numpy as np

from polychirp.axes import BoolArray
from polychirp.channel.materials.reflection_table import ReflectionTable, reflection_table
from polychirp.channel.physical_optics.flat_faces import Flats, flats_of
from polychirp.channel.physical_optics.horizon import horizons
from polychirp.channel.physical_optics.incident_waves import Mirrors, incident_waves
from polychirp.channel.physical_optics.kernels import (
    ILLUMINATED,
    NUM_ASPECTS,
    SHADOW_RAY_LIFT,
    Faces,
    LitFacets,
    StateArray,
    common_state,
    illumination_states,
    lit_facets,
    refine_shadow_edge,
)
from polychirp.channel.physical_optics.view_losses import view_losses
from polychirp.channel.physical_optics.views import View, ViewTable, view_table
from polychirp.channel.scene.blockers import Blockers, in_frame_of
from polychirp.channel.scene.world import POLARISATION_AXES, Surface, World


class FacetLevels(NamedTuple):
    """Facets of a surface at two levels.

    ``faces`` are all facets; ``patches`` are the middle facets of its patches (groups of facets).
    ``flats`` are flat parts.
    """

    faces: Faces
    patches: Faces
    flats: Flats


@lru_cache(maxsize=64)
def facet_levels(surface: Surface) -> FacetLevels:
    """Facet levels of a surface; the cache keeps them for the next snapshot of the frame."""
    faces = faces_of(surface)
    patches = faces.select(surface.patch_face)
    above = patches.centroid + SHADOW_RAY_LIFT * patches.normal
    horizon = horizons(surface.trees["opaque"], above, patches.normal)
    patches = patches._replace(horizon=horizon)
    flats = flats_of(surface.centroid, surface.normal, surface.corner, surface.medium)
    return FacetLevels(faces, patches, flats)


def faces_of(surface: Surface) -> Faces:
    """A surface's arrays for the kernels; every ``horizon`` is 1, which means unknown."""
    return Faces(
        centroid=surface.centroid,
        normal=surface.normal,
        tangent=surface.tangent,
        corner=surface.corner,
        area=surface.area,
        medium=surface.medium,
        horizon=np.ones(len(surface.area)),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Illumination:
    """Facets of one body that the ``views`` see, a view being a radar or its mirror image.

    The views are either all direct or all mirrored; ``body`` is the number of the body.
    """

    world: World
    body: int
    views: tuple[View, ...]
    lit: LitFacets

    @cached_property
    def number(self) -> dict[View, int]:
        """Index in ``views`` and ``lit.start`` of every view that sees at least one facet."""
        sees = np.diff(self.lit.start) > 0
        return {view: index for index, view in enumerate(self.views) if sees[index]}

    def select(self, is_kept: BoolArray) -> Self:
        """The illumination with only those rows of ``lit`` that the mask ``(row,)`` keeps."""
        return replace(self, lit=self.lit.select(is_kept))

    def with_waves(self) -> Self:
        """The illumination with ``lit.wave``: fields and reflection coefficients of the facets.

        The fields include the losses between the radar and the facet.
        """
        if not len(self.lit.face):
            return self
        world = self.world
        levels = facet_levels(world.surfaces[self.body])
        table = view_table_of(self.views, world, self.body)
        losses = view_losses(world, self.body, table, levels.patches, self.lit)
        wave = incident_waves(levels.faces, *mirrors_of(world, self.body), table, losses, self.lit)
        loss = losses.number[self.lit.view, losses.patch[self.lit.face]]
        return replace(self, lit=self.lit._replace(wave=wave, loss=loss))


def mirrors_of(world: World, body: int) -> tuple[ReflectionTable, Mirrors]:
    """Reflection by a body's materials, and the plates that mirror waves, in the body's frame."""
    rotation = world.rotation[body]
    plate = in_frame_of(world, rotation, world.position[body]).plate
    axes = np.ascontiguousarray(POLARISATION_AXES @ rotation)
    return media_of(world, world.surfaces[body].materials), Mirrors(
        plate, media_of(world, world.materials), axes
    )


def media_of(world: World, materials: tuple[str, ...]) -> ReflectionTable:
    """Reflection coefficients of the named materials of a world at its frequency."""
    return reflection_table(tuple(world.table[name] for name in materials), world.frequency)


def illumination_of(world: World, body: int, views: Sequence[View]) -> Illumination:
    """Facets of a body that ``views`` see, without waves. The views are all direct or all mirrored.

    A view from which no patch's middle facet is visible is left out, as if it saw no facet.
    """
    if not views:
        return Illumination(world=world, body=body, views=(), lit=_no_lit_facets())
    surface, table = world.surfaces[body], view_table_of(views, world, body)
    blockers = in_frame_of(world, world.rotation[body], world.position[body])
    levels = facet_levels(surface)
    found = illumination_states(levels.patches, table, blockers)
    is_seeing = np.any(found == ILLUMINATED, axis=1)
    if not np.any(is_seeing):
        return Illumination(world=world, body=body, views=(), lit=_no_lit_facets())
    seeing = tuple(view for view, sees in zip(views, is_seeing, strict=True) if sees)
    table = table.select(is_seeing)
    is_lit = _is_lit(surface, table, blockers, found[is_seeing])
    lit = lit_facets(levels.faces, table, is_lit)
    return Illumination(world=world, body=body, views=seeing, lit=lit)


def _is_lit(surface: Surface, table: ViewTable, blockers: Blockers, found: StateArray) -> BoolArray:
    """Mask of the facets that views see, directly or in mirrors, ``(view, face)``.

    ``found`` ``(view, patch)`` are the states of the middle facets of all patches, by one shadow
    ray each. Where the states of a patch and of those around it differ, the edge of a shadow is
    near: there a shadow ray goes to every facet. Shadows whose edges follow the patches made echoes
    in mirrors wrong by 6 dB, with facets of any size.
    """
    common = common_state(found, surface.patch_near)
    faces = facet_levels(surface).faces
    state = refine_shadow_edge(faces, table, blockers, surface.patch, common)
    return np.asarray(state == ILLUMINATED)


def view_table_of(views: Sequence[View], world: World, body: int) -> ViewTable:
    """Views as arrays in the frame of the body with number ``body``."""
    return view_table(views, world.rotation[body], world.position[body])


def _no_lit_facets() -> LitFacets:
    none = np.zeros(0, dtype=np.int64)
    wave = np.empty((0, 4, 2), dtype=np.complex64)
    vectors, aspect = np.zeros((0, 3)), np.zeros((0, NUM_ASPECTS))
    return LitFacets(np.zeros(1, dtype=np.int64), none, vectors, np.zeros(0), aspect, wave, none)
