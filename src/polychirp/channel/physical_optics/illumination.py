"""One body's facets as views see them: which are lit, and what waves induce on them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from polychirp.axes import BoolArray
from polychirp.channel.materials.reflection_table import ReflectionTable, reflection_table
from polychirp.channel.physical_optics.horizon import horizons
from polychirp.channel.physical_optics.kernels import (
    LIFT,
    LIT,
    NUM_ASPECTS,
    Faces,
    Rows,
    agree,
    fields,
    look,
    look_closer,
    rows_of,
    sees_any,
    spread,
)
from polychirp.channel.physical_optics.view_losses import losses_of
from polychirp.channel.physical_optics.views import View, ViewTable, view_table
from polychirp.channel.scene.blockers import Blockers, in_frame_of
from polychirp.channel.scene.world import POLARISATION_AXES, Surface, World


class Parts(NamedTuple):
    """A surface's facets, and those in the middles of its patches and of its panels."""

    faces: Faces
    patches: Faces
    panels: Faces


@lru_cache(maxsize=64)
def parts_of(surface: Surface) -> Parts:
    """A surface's parts, kept for the next snapshot."""
    faces = faces_of(surface)
    patches = faces.of(surface.patch_face)
    above = patches.centroid + LIFT * patches.normal
    horizon = horizons(surface.trees["opaque"], above, patches.normal)
    patches = patches._replace(horizon=horizon)
    return Parts(faces, patches, patches.of(surface.patch[surface.panel_face]))


def faces_of(surface: Surface) -> Faces:
    """A surface's arrays for the kernels."""
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
class Lighting:
    """What views of one kind, all direct or all mirrored, see of one body: ``rows``."""

    world: World
    body: int
    views: tuple[View, ...]
    rows: Rows

    @cached_property
    def number(self) -> dict[View, int]:
        """Of every view that sees something, where its rows are."""
        sees = np.diff(self.rows.start) > 0
        return {view: index for index, view in enumerate(self.views) if sees[index]}

    def only(self, kept: BoolArray) -> Lighting:
        """With some of the rows, ``kept`` ``(row,)``."""
        return replace(self, rows=self.rows.only(kept))

    def with_waves(self) -> Lighting:
        """With fields and currents on the facets, losses on the way included."""
        if not len(self.rows.face):
            return self
        world, rotation = self.world, self.world.rotation[self.body]
        surface, rows = world.surfaces[self.body], self.rows
        parts = parts_of(surface)
        table = _table(self.views, world, self.body)
        losses = losses_of(world, self.body, table, parts.patches, rows)
        wave = fields(
            parts.faces,
            media_of(world, surface.materials),
            in_frame_of(world, rotation, world.position[self.body]).plate,
            media_of(world, world.materials),
            np.ascontiguousarray(POLARISATION_AXES @ rotation),
            table.plate,
            surface.patch,
            losses,
            rows,
            rows.view,
        )
        return replace(self, rows=rows._replace(wave=wave))


def media_of(world: World, materials: tuple[str, ...]) -> ReflectionTable:
    """Reflection of some of a world's materials."""
    return reflection_table(tuple(world.table[name] for name in materials), world.frequency)


def lighting_of(world: World, body: int, views: list[View]) -> Lighting:
    """What views, all direct or all mirrored, see of a body, as yet without waves.

    A view that sees no panel's middle sees nothing, and is left out.
    """
    blockers = in_frame_of(world, world.rotation[body], world.position[body])
    parts = parts_of(world.surfaces[body])
    if not views:
        return Lighting(world=world, body=body, views=(), rows=_no_rows())
    is_open = sees_any(parts.panels, _table(views, world, body), blockers)
    seeing = tuple(view for view, sees in zip(views, is_open, strict=True) if sees)
    if not seeing:
        return Lighting(world=world, body=body, views=(), rows=_no_rows())
    table = _table(seeing, world, body)
    if seeing[0].plate is None:
        seen = _seen_directly(world.surfaces[body], table, blockers)
    else:
        seen = _seen_in_mirrors(world.surfaces[body], table, blockers)
    return Lighting(world=world, body=body, views=seeing, rows=rows_of(parts.faces, table, seen))


def _seen_directly(surface: Surface, table: ViewTable, blockers: Blockers) -> BoolArray:
    """Which facets direct views see, ``(view, face)``.

    Shadow rays go to the middle of every patch, and to the facets of patches that do not agree
    with those around them.
    """
    parts = parts_of(surface)
    found = look(parts.patches, table, blockers)
    agreed = agree(found, surface.patch_near)
    closer = look_closer(parts.faces, table, blockers, surface.patch, agreed)
    return np.asarray(closer == LIT)


def _seen_in_mirrors(surface: Surface, table: ViewTable, blockers: Blockers) -> BoolArray:
    """Which facets mirrored views see, ``(view, face)``.

    Shadow rays go to the middle of every patch only: the shadow's edge is as coarse as a patch.
    """
    parts = parts_of(surface)
    lit = look(parts.patches, table, blockers) == LIT
    return spread(parts.faces, table, surface.patch, lit)


def _table(views: tuple[View, ...] | list[View], world: World, body: int) -> ViewTable:
    """Views in the body's frame."""
    return view_table(list(views), world.rotation[body], world.position[body])


def _no_rows() -> Rows:
    none = np.zeros(0, dtype=np.int64)
    wave = np.empty((0, 4, 2), dtype=np.complex64)
    vectors, aspect = np.zeros((0, 3)), np.zeros((0, NUM_ASPECTS))
    return Rows(np.zeros(1, dtype=np.int64), none, vectors, np.zeros(0), aspect, wave)
