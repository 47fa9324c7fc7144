"""Views of a body by way of a vehicle's edge, and the facets that such views illuminate."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.bent_echoes.edge_waves import NUM_EDGES, Edges, EdgeWaves, edge_waves
from polychirp.channel.bent_echoes.outlines import edges_between
from polychirp.channel.geometry.retarded_delay import turning
from polychirp.channel.physical_optics.illumination import (
    Illumination,
    facet_levels,
    mirrors_of,
    view_table_of,
)
from polychirp.channel.physical_optics.incident_waves import incident_waves
from polychirp.channel.physical_optics.kernels import (
    ALONG_FIRST,
    ALONG_SECOND,
    FACING,
    INVERSE_LENGTH,
    NUM_ASPECTS,
    SENT_H,
    SENT_V,
    SHADOW_RAY_LIFT,
    LitFacets,
)
from polychirp.channel.physical_optics.view_losses import Losses, identities
from polychirp.channel.physical_optics.views import Unfolded, View
from polychirp.channel.scene.occlusion import blocked
from polychirp.channel.scene.transmission import transmission_matrices
from polychirp.channel.scene.world import World

WEAKEST_EDGE: Final = 0.02
"""Least amplitude of an edge's wave, over that without the vehicle, for which the edge is followed:
that at the body's strongest patch. Chosen: −34 dB one way and −68 dB both ways, about as for direct
paths (`diffraction.paths`)."""

WEAKEST_WAVE: Final = 1e-3
"""The same for a facet to count. Chosen: −60 dB one way, 26 dB below the least edge."""

PATCH_REACH: Final = 0.15
"""Greatest distance, m, of a facet's corner from the middle facet of its patch: the diagonal of
`world.PATCH_SIZE` and a little more."""

EDGE_CLEARANCE: Final = 0.02
"""Distance, m, by which shadow rays begin outside of the vehicle's edge. Chosen: twice the step of
the grid on which edges are found."""


@dataclass(frozen=True, kw_only=True, eq=False)
class BentView(View):
    """Radar ``radar`` as body ``body`` sees it over edge ``edge`` of the body ``blocker``.

    ``places`` ``(patch, xyz)``, m from the radar, are above the middle facets of the body's
    patches, and ``at_patches`` are the waves over all edges there. ``least_length`` m is a bound
    below the length of all paths, and ``greatest_wave`` the greatest amplitude over that without
    the blocker.
    """

    blocker: int
    edges: Edges
    edge: int
    places: FloatArray
    at_patches: EdgeWaves
    least_length: float
    greatest_wave: float

    @property
    def distance(self) -> float:
        """Length of the shortest path from the radar to the body, m."""
        return self.least_length

    @property
    def slack(self) -> float:
        """Greatest length, m, by which ``distance`` is below that of the shortest path."""
        return 2 * PATCH_REACH

    @property
    def most_reflection(self) -> float:
        """Greatest amplitude of the wave, over that without the blocker."""
        return self.greatest_wave

    @cached_property
    def bending_actor(self) -> int:
        """Number of the blocker's actor."""
        return int(self.world.body[self.blocker])

    @cached_property
    def image_velocity(self) -> FloatArray:
        """Velocity of the image that the middle of the body sees, m/s ``(xyz,)``."""
        way = self.world.centre[self.body] - self.source
        found = edge_waves(self.edges, way[None], self.world.wavenumber)
        return np.asarray(self.unfolded(found.direction[self.edge]).velocity[0])

    def unfolded(self, direction: FloatArray) -> Unfolded:
        r"""Images of the radar for waves that arrive along ``direction`` ``(path, xyz)``.

        By Keller's law of diffraction (Keller 1962), the wave makes the same angle with the edge
        before and behind it, so that the direction of arrival determines where it met the edge. The
        path's rate is

        .. math:: \dot L = u_1\cdot(v_B - v_S) + u_2\cdot(v_C - v_B)

        with the directions u₁ and u₂ before and behind the blocker, and the velocities of radar
        (S), blocker (B) and body (C).
        """
        e = self.edge
        onwards, outwards = self.edges.onwards[e], self.edges.outwards[e]
        along, corner = self.edges.along[e], self.edges.corner[e]
        x, y, sine = direction @ onwards, direction @ outwards, direction @ along
        cosine = np.maximum(np.hypot(x, y), 1e-9)
        # the path meets the second corner if it falls more steeply than from the first to it
        step = corner[1] - corner[0]
        is_both = step[0] * y < step[1] * x
        start, middle = float(np.hypot(*corner[0])), float(np.hypot(*step))
        across = start + np.where(is_both, middle, 0.0)
        last = np.where(is_both[:, None], corner[1], corner[0])
        place = (
            self.source
            + last @ np.stack([onwards, outwards])
            + (across * sine / cosine)[:, None] * along
        )
        leaving = (corner[0] / start) @ np.stack([onwards, outwards])
        departure = cosine[:, None] * leaving + sine[:, None] * along
        world = self.world
        own = np.asarray(world.scene.radar_velocity[self.radar])
        moving = world.velocity[self.blocker]
        rate = departure @ (moving - own)
        # the departure turns with the edge across it, and with the body along it
        side = np.sum((world.velocity[self.body] - own) * along) / self.least_length
        drift = (moving - own) - along * np.sum((moving - own) * along)
        turn = turning(departure, np.full(len(departure), start), drift + side * start * along)
        return Unfolded(
            image=place - (across / cosine)[:, None] * direction,
            velocity=moving - rate[:, None] * direction,
            departure=departure,
            departure_rate=turn,
            bend=place,
        )


MOST_TURNED_AWAY: Final = 0.34
"""Greatest cosine between the normal of a facet that a bent wave may reach and the straight line
from the radar: sin 20°, as far as Kirchhoff's integral holds."""


class _Lit(NamedTuple):
    """Facets lit over one edge, ``(row, …)``: numbers, and columns of their `EdgeWaves`."""

    face: IntArray
    field: ComplexArray
    length: FloatArray
    direction: FloatArray


def bent_views(world: World, view: View, blockers: Sequence[int]) -> list[BentView]:
    """Views of ``view``'s body over those edges of ``blockers`` that may matter."""
    between = [
        (blocker, edges_between(world, view.source, blocker, view.body)) for blocker in blockers
    ]
    if all(edges is None for _, edges in between):
        return []
    places = _above_patches(world, view)
    return [
        over
        for blocker, edges in between
        if edges is not None
        for over in _views_over(world, view, blocker, edges, places)
    ]


def _views_over(
    world: World, view: View, blocker: int, edges: Edges, places: FloatArray
) -> list[BentView]:
    """Views over those edges of one vehicle that may matter."""
    surface = world.surfaces[view.body]
    # most vehicles are far off the way to the body, which few of its patches tell
    some = edge_waves(edges, places[surface.patch[surface.panel_face]], world.wavenumber)
    if np.max(np.abs(some.field), initial=0.0) < 0.5 * WEAKEST_EDGE:
        return []
    normal = surface.normal[surface.patch_face] @ world.rotation[view.body].T
    waves = edge_waves(edges, places, world.wavenumber)
    found = []
    for edge in range(NUM_EDGES):
        is_lit = np.abs(waves.field[edge]) > WEAKEST_WAVE
        is_lit &= np.sum(normal * waves.direction[edge], axis=-1) < 0.0
        if not np.any(is_lit):
            continue
        greatest = float(np.max(np.abs(waves.field[edge, is_lit])))
        if greatest < WEAKEST_EDGE:
            continue
        length = waves.length[edge, is_lit]
        found.append(
            BentView(
                world=world,
                radar=view.radar,
                body=view.body,
                blocker=blocker,
                edges=edges,
                edge=edge,
                places=places,
                at_patches=waves,
                least_length=max(float(length.min()) - PATCH_REACH, 0.0),
                greatest_wave=greatest,
            )
        )
    return found


def bent_illumination(
    world: World, body: int, views: Sequence[BentView], seen: Illumination
) -> Illumination:
    """Facets of a body that views over edges illuminate, with waves.

    ``seen`` is the illumination by direct views, which tells for every facet whether the straight
    line from the radar is free. Where it is not what the box of the vehicle's edges says, an edge's
    wave changes its sign: the field of a single edge is then the right one.
    """
    groups: dict[int, list[BentView]] = {}
    for view in views:
        groups.setdefault(id(view.edges), []).append(view)
    views = [view for group in groups.values() for view in group]
    rows = [lit for group in groups.values() for lit in _lit_over(world, group, seen)]
    kept = [number for number, lit in enumerate(rows) if len(lit.face)]
    views, rows = tuple(views[number] for number in kept), [rows[number] for number in kept]
    if not views:
        return Illumination(world=world, body=body, views=(), lit=seen.lit.select(_none(seen)))
    surface = world.surfaces[body]
    lit = _facets(world, body, views, rows)
    losses = _losses(world, body, views, lit)
    table = view_table_of(views, world, body)
    wave = incident_waves(facet_levels(surface).faces, *mirrors_of(world, body), table, losses, lit)
    field = np.concatenate([lit.field for lit in rows])
    wave[:, (SENT_V, SENT_H)] *= field[:, None, None].astype(np.complex64)
    return Illumination(
        world=world,
        body=body,
        views=views,
        lit=lit._replace(wave=wave, loss=np.zeros(len(lit.face), dtype=np.int64)),
    )


def _none(seen: Illumination) -> BoolArray:
    return np.zeros(len(seen.lit.face), dtype=np.bool_)


def _above_patches(world: World, view: View) -> FloatArray:
    """Places above the middles of a body's patches, m from the view's radar ``(patch, xyz)``."""
    surface = world.surfaces[view.body]
    patch = surface.patch_face
    lifted = surface.centroid[patch] + SHADOW_RAY_LIFT * surface.normal[patch]
    turned = lifted @ world.rotation[view.body].T
    return np.asarray(turned + (world.position[view.body] - view.source))


def _lit_over(world: World, views: Sequence[BentView], seen: Illumination) -> list[_Lit]:
    """Facets that the waves over the edges of one vehicle reach, for every edge's view."""
    view = views[0]
    surface, rotation = world.surfaces[view.body], world.rotation[view.body]
    is_reached = [_reached_patches(world, one) for one in views]
    face = np.flatnonzero(np.any(is_reached, axis=0)[surface.patch])
    place = surface.centroid[face] @ rotation.T + (world.position[view.body] - view.source)
    # a wave that bends by less than 20° does not reach facets that are turned away by more
    facing = np.sum(place * (surface.normal[face] @ rotation.T), axis=-1)
    some = np.flatnonzero(facing < MOST_TURNED_AWAY * np.linalg.norm(place, axis=-1))
    face, place = face[some], place[some]
    waves = edge_waves(view.edges, place, world.wavenumber)
    is_seen = np.zeros(len(surface.area), dtype=np.bool_)
    for number, other in enumerate(seen.views):
        if other.radar == view.radar:
            is_seen[seen.lit.face[seen.lit.start[number] : seen.lit.start[number + 1]]] = True
    sign = np.where(is_seen[face] == (waves.is_clear > 0.5), 1.0, -1.0)
    found = []
    for one, reached in zip(views, is_reached, strict=True):
        field, local = sign * waves.field[one.edge], waves.direction[one.edge] @ rotation
        is_lit = (np.abs(field) > WEAKEST_WAVE) & reached[surface.patch[face]]
        is_lit &= np.sum(local * surface.normal[face], axis=-1) < 0.0
        found.append(
            _Lit(face[is_lit], field[is_lit], waves.length[one.edge, is_lit], local[is_lit])
        )
    return found


def _reached_patches(world: World, view: BentView) -> BoolArray:
    """Mask of the patches that the wave over one edge reaches, ``(patch,)``."""
    waves, place = view.at_patches, view.places
    is_lit: BoolArray = np.abs(waves.field[view.edge]) > WEAKEST_WAVE
    some = np.flatnonzero(is_lit)
    if not len(some):
        return is_lit
    lift = EDGE_CLEARANCE * view.edges.outwards[view.edge]
    bend, start = waves.bend[view.edge, some] + lift, view.source
    # one ray to the edge suffices: all rays to it are near each other
    middle = np.argmin(np.sum((place[some] - place[some].mean(axis=0)) ** 2, axis=-1))
    if blocked(world, start[None], start + bend[middle, :1], but_body=view.blocker)[0]:
        return np.zeros(len(is_lit), dtype=np.bool_)
    is_lit[some] = ~blocked(
        world, start + bend[:, 1], start + place[some], clearance=0.0, but_body=view.blocker
    )
    return is_lit


def _facets(world: World, body: int, views: Sequence[BentView], rows: Sequence[_Lit]) -> LitFacets:
    """Geometry of facets as `LitFacets` has it, without waves."""
    faces, rotation = facet_levels(world.surfaces[body]).faces, world.rotation[body]
    face = np.concatenate([lit.face for lit in rows])
    direction = np.concatenate([lit.direction for lit in rows])
    length = np.concatenate([lit.length for lit in rows])
    normal, tangent = faces.normal[face], faces.tangent[face]
    aspect = np.empty((len(face), NUM_ASPECTS))
    aspect[:, :3] = length[:, None] + np.einsum("rcx,rx->rc", faces.corner[face], direction)
    aspect[:, FACING] = -np.sum(normal * direction, axis=-1)
    aspect[:, ALONG_FIRST] = np.sum(tangent * direction, axis=-1)
    aspect[:, ALONG_SECOND] = np.sum(np.cross(normal, tangent) * direction, axis=-1)
    # the field is relative to that at the straight distance, without the vehicle
    source = [
        np.tile((view.source - world.position[body]) @ rotation, (len(lit.face), 1))
        for view, lit in zip(views, rows, strict=True)
    ]
    away = np.linalg.norm(faces.centroid[face] - np.concatenate(source), axis=-1)
    aspect[:, INVERSE_LENGTH] = 1.0 / away
    start = np.concatenate([[0], np.cumsum([len(lit.face) for lit in rows])])
    no_waves = np.empty((0, 4, 2), dtype=np.complex64)
    none = np.empty(0, dtype=np.int64)
    return LitFacets(start, face, np.ascontiguousarray(direction), length, aspect, no_waves, none)


def _losses(world: World, body: int, views: Sequence[BentView], lit: LitFacets) -> Losses:
    """Losses in sheets between the edges and the patches, as `view_losses` gives them."""
    surface = world.surfaces[body]
    number = np.zeros((len(views), len(surface.patch_face)), dtype=np.int64)
    matrices = [identities(1)]
    count = 1
    for index, view in enumerate(views):
        face = lit.face[lit.start[index] : lit.start[index + 1]]
        patch = np.unique(surface.patch[face])
        place = view.source + view.places[patch]
        lift = EDGE_CLEARANCE * view.edges.outwards[view.edge]
        bend = view.source + view.at_patches.bend[view.edge, patch, 1] + lift
        matrix = identities(len(patch))
        matrix[:, 0] = transmission_matrices(world, bend, place, but_body=view.blocker)
        matrices.append(matrix)
        number[index, patch] = count + np.arange(len(patch))
        count += len(patch)
    return Losses(surface.patch, number, np.concatenate(matrices))
