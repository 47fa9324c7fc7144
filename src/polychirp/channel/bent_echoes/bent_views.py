"""Views of a body by way of a vehicle's edge, and the facets that such views illuminate."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Final, NamedTuple, Self

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.bent_echoes.edge_waves import (
    Edges,
    EdgeWaves,
    edge_table,
    edge_waves,
)
from polychirp.channel.bent_echoes.lit_facets import (
    MOST_TURNED_AWAY,
    NONE_LIT,
    WEAKEST_WAVE,
    EdgeLit,
    Reach,
    facets_lit,
)
from polychirp.channel.bent_echoes.outlines import edges_between, way_to
from polychirp.channel.geometry.retarded_delay import turning
from polychirp.channel.physical_optics.illumination import (
    Illumination,
    facet_levels,
    mirrors_of,
    view_table_of,
)
from polychirp.channel.physical_optics.incident_waves import incident_waves
from polychirp.channel.physical_optics.kernels import (
    SENT_H,
    SENT_V,
    SHADOW_RAY_LIFT,
    LitFacets,
)
from polychirp.channel.physical_optics.view_losses import Losses, identities
from polychirp.channel.physical_optics.views import Unfolded, View, radars_of
from polychirp.channel.scene.occlusion import blocked
from polychirp.channel.scene.transmission import transmission_matrices
from polychirp.channel.scene.world import Surface, World, bodies_near, plates_near
from polychirp.frames import turned_at_rate

WEAKEST_EDGE: Final = 0.02
"""Least amplitude of an edge's wave, over that without the vehicle, for which the edge is followed:
that at the body's strongest patch. Chosen: −34 dB one way and −68 dB both ways, about as for direct
paths (`diffraction.paths`)."""

PATCH_REACH: Final = 0.15
"""Greatest distance, m, of a facet's corner from the middle facet of its patch: the diagonal of
`world.PATCH_SIZE` and a little more."""

LEAST_LENGTH_BEHIND: Final = 0.5
"""Least length, m, of paths from the edge to the body, for second derivatives. Chosen: as near as
two vehicles come to each other; the share of that leg is inversely proportional to it."""

EDGE_CLEARANCE: Final = 0.02
"""Distance, m, by which shadow rays begin outside of the vehicle's edge. Chosen: twice the step of
the grid on which edges are found."""


class Patches(NamedTuple):
    """Patches of a body as a radar sees them, in the frame of the world.

    ``place`` m ``(patch, xyz)`` is above their middle facets, from the radar, and ``normal``
    ``(patch, xyz)`` theirs. ``may_face`` ``(patch,)`` is false if all facets of a patch are turned
    away from the radar by more than `MOST_TURNED_AWAY` allows.
    """

    place: FloatArray
    normal: FloatArray
    may_face: BoolArray


@dataclass(frozen=True, kw_only=True, eq=False)
class BentView(View):
    """Radar ``radar`` as body ``body`` sees it over edge ``edge`` of the body ``blocker``.

    ``straight`` is the view without the blocker. ``patches`` are the body's, and ``at_patches`` the
    waves over all edges above those that may face the radar. ``least_length`` m is a bound below
    the length of all paths, and ``greatest_wave`` the greatest amplitude over that without the
    blocker.
    """

    straight: View
    blocker: int
    edges: Edges
    edge: int
    patches: Patches
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
    def most_gain(self) -> float:
        """Greatest power gain of the radar's antenna element towards the body's sphere."""
        return self.straight.most_gain

    @cached_property
    def bending_actor(self) -> int:
        """Number of the blocker's actor."""
        return int(self.world.body[self.blocker])

    @cached_property
    def image_velocity(self) -> FloatArray:
        """Velocity of the image that the middle of the body sees, m/s ``(xyz,)``.

        `cell_paths.velocity_in_views` subtracts it from the velocity that a turning body has at the
        radar, but lengths change with that at the image. The difference of both is added here.
        """
        seen, yaw_rate = self._from_middle, self.world.yaw_rate[self.body]
        return np.asarray(seen.velocity[0] + turned_at_rate(yaw_rate, self.source - seen.image[0]))

    @cached_property
    def image_acceleration(self) -> FloatArray:
        """Acceleration of the image that the middle of the body sees, m/s² ``(xyz,)``."""
        return np.asarray(self._from_middle.acceleration[0])

    @cached_property
    def _from_middle(self) -> Unfolded:
        """Image that the middle of the body sees."""
        way = self.world.centre[self.body] - self.source
        found = edge_waves(self.edges, way[None], self.world.wavenumber)
        return self.unfolded(found.direction[self.edge])

    def unfolded(self, direction: FloatArray) -> Unfolded:
        r"""Images of the radar for waves that arrive along ``direction`` ``(path, xyz)``.

        By Keller's law of diffraction (Keller 1962), the wave makes the same angle with the edge
        before and behind it, so that the direction of arrival determines where it met the edge. The
        path's rate is

        .. math:: \dot L = u_1\cdot(v_B - v_S) + u_2\cdot(v_C - v_B)

        with the directions u₁ and u₂ before and behind the blocker, and the velocities of radar
        (S), blocker (B, at its edge) and body (C). Accelerations follow the same law.
        """
        e = self.edge
        onwards, outwards = self.edges.onwards[e], self.edges.outwards[e]
        along = self.edges.along[e]
        x, y, sine = direction @ onwards, direction @ outwards, direction @ along
        cosine = np.maximum(np.hypot(x, y), 1e-9)
        first, last = self._corners_met(direction)
        start, middle = (np.hypot(*step.T) for step in (first, last - first))
        across = start + middle
        place = (
            self.source
            + last @ np.stack([onwards, outwards])
            + (across * sine / cosine)[:, None] * along
        )
        leaving = first / start[:, None]
        departure = cosine[:, None] * (leaving @ np.stack([onwards, outwards]))
        departure += sine[:, None] * along
        world = self.world
        own, swerve = (
            column[self.radar]
            for column in (radars_of(world).velocity, radars_of(world).acceleration)
        )
        moving = world.velocity_at(self.blocker, place)
        moved = world.acceleration_at(self.blocker, place)
        # the blocker's matter has the same velocity along the ray at the radar as at the edge
        rate = departure @ (world.velocity_at(self.blocker, self.source) - own)
        # the departure turns with the edge across it, and with the body along it
        side = np.sum((world.velocity_at(self.body, world.centre[self.body]) - own) * along)
        side /= self.least_length
        drift = (moving - own) - along * np.sum((moving - own) * along, axis=-1, keepdims=True)
        turn = turning(departure, start, drift + side * start[:, None] * along)
        swerving = np.sum(departure * (moved - swerve), axis=-1)
        bending = self._bending(moving - own, place, (leaving, start, across), direction)
        return Unfolded(
            image=place - (across / cosine)[:, None] * direction,
            velocity=moving - rate[:, None] * direction,
            acceleration=moved - (swerving + bending)[:, None] * direction,
            departure=departure,
            departure_rate=turn,
            bend=place,
        )

    def _bending(
        self,
        passing: FloatArray,
        place: FloatArray,
        before: tuple[FloatArray, FloatArray, FloatArray],
        direction: FloatArray,
    ) -> FloatArray:
        r"""Second derivative of lengths, m/s² ``(path,)``, beyond that of the leg from the image.

        In the plane across the edge, the legs before and behind it have the lengths
        :math:`\ell_1, \ell_2` and the velocities :math:`q_1, q_2` across them. With the angle φ
        from that plane, and the rates of the unfolded path's extent ℓ across the edge and w along
        it,

        .. math:: \ddot L = \cos\varphi\left(\frac{q_1^2}{\ell_1} + \frac{q_2^2}{\ell_2}\right)
                  + \frac{(\dot\ell\sin\varphi - \dot w\cos\varphi)^2}{L}

        The leg from the image is taken to have :math:`|v_\perp|^2/L`, with the velocity v of the
        body past the edge. The body's middle gives the length behind the edge.

        Parameters
        ----------
        passing : velocity of the edge past the radar, m/s ``(path, xyz)``
        place : last place on the edge, m ``(path, xyz)``
        before : of the way to that place across the edge: direction at the radar ``(path, 2)``,
            length to the first corner and to the last, m ``(path,)``
        direction : behind the edge, ``(path, xyz)``
        """
        leaving, start, across = before
        axes = np.stack([self.edges.onwards[self.edge], self.edges.outwards[self.edge]])
        along = self.edges.along[self.edge]
        sine = direction @ along
        cosine = np.maximum(np.linalg.norm(direction @ axes.T, axis=-1), 1e-9)
        behind = np.sum((self.world.centre[self.body] - place) * direction, axis=-1)
        behind = np.maximum(behind, LEAST_LENGTH_BEHIND)
        facet = place + behind[:, None] * direction
        beyond = self.world.velocity_at(self.body, facet) - self.world.velocity_at(
            self.blocker, place
        )
        length = across / cosine + behind
        widening, curving = np.zeros(len(place)), np.zeros(len(place))
        for ray, velocity, reach in (
            (leaving, passing, start),
            (direction @ axes.T / cosine[:, None], beyond, behind * cosine),
        ):
            flat = velocity @ axes.T
            widening += np.sum(ray * flat, axis=-1)
            curving += (ray[:, 0] * flat[:, 1] - ray[:, 1] * flat[:, 0]) ** 2 / reach
        sliding = widening * sine - (passing + beyond) @ along * cosine
        known = np.sum(beyond**2, axis=-1) - np.sum(beyond * direction, axis=-1) ** 2
        return np.asarray(cosine * curving + (sliding**2 - known) / length)

    def _corners_met(self, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """First and last corner, m ``(path, 2)``, that waves along ``direction`` meet.

        They are those of the wave at a patch that has the nearest direction: a direction alone does
        not tell over which corner its path goes.
        """
        e = self.edge
        corner = self.edges.corner[e]
        some = np.flatnonzero(self.at_patches.field[e])
        near = np.argmax(direction @ self.at_patches.direction[e, some].T, axis=-1)
        depth = self.at_patches.bend[e, some[near]] @ self.edges.onwards[e]
        is_far = depth > 0.5 * np.sum(corner[:, 0])
        first, last = np.moveaxis(np.where(is_far[..., None], corner[1], corner[0]), 1, 0)
        return first, last


def bent_views(world: World, view: View, blockers: Sequence[int]) -> list[BentView]:
    """Views of ``view``'s body over those edges of ``blockers`` that may matter."""
    way = way_to(world, view.source, view.body) if len(blockers) else None
    if way is None:
        return []
    between = [(blocker, edges_between(world, way, blocker)) for blocker in blockers]
    if all(edges is None for _, edges in between):
        return []
    patches = _patches_of(world, view)
    return [
        over
        for blocker, edges in between
        if edges is not None
        for over in _views_over(world, view, blocker, edges, patches)
    ]


def _views_over(
    world: World, view: View, blocker: int, edges: Edges, patches: Patches
) -> list[BentView]:
    """Views over those edges of one vehicle that may matter."""
    kept = _edges_seen(world, view, blocker, edges, patches)
    if not len(kept):
        return []
    facing = np.flatnonzero(patches.may_face)
    waves = edge_waves(edges, patches.place, world.wavenumber, some=facing)
    found = []
    for edge in kept:
        is_lit = np.abs(waves.field[edge]) > WEAKEST_WAVE
        is_lit &= _dots(patches.normal, waves.direction[edge]) < 0.0
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
                straight=view,
                blocker=blocker,
                edges=edges,
                edge=int(edge),
                patches=patches,
                at_patches=waves,
                least_length=max(float(length.min()) - PATCH_REACH, 0.0),
                greatest_wave=greatest,
            )
        )
    return found


def _edges_seen(world: World, view: View, blocker: int, edges: Edges, patches: Patches) -> IntArray:
    """Numbers of the edges that the radar sees, and whose waves may matter, by a few patches.

    Most vehicles are far off the way to the body, or hidden from the radar by others. One ray to
    an edge tells, since all rays to it are near each other.
    """
    surface = world.surfaces[view.body]
    places = patches.place[surface.patch[surface.panel_face]]
    waves = edge_waves(edges, places, world.wavenumber)
    size = np.abs(waves.field)
    kept = np.flatnonzero(np.max(size, axis=1, initial=0.0) > 0.5 * WEAKEST_EDGE)
    towards = np.empty((len(kept), 3))
    for number, edge in enumerate(kept):
        some = np.flatnonzero(size[edge] > WEAKEST_WAVE)
        off = places[some] - places[some].mean(axis=0)
        middle = some[np.argmin(_dots(off, off))]
        lift = EDGE_CLEARANCE * edges.outwards[edge]
        towards[number] = view.source + waves.bend[edge, middle, 0] + lift
    start = np.broadcast_to(view.source, towards.shape)
    return kept[~blocked(world, start, towards, but_body=blocker)]


@dataclass(frozen=True, kw_only=True, eq=False)
class BentIllumination(Illumination):
    """Facets of one body that waves over edges illuminate, each view a `BentView`.

    ``field`` ``(row,)`` is the wave on each facet over that without the vehicle.
    """

    field: ComplexArray

    def select(self, is_kept: BoolArray) -> Self:
        """The illumination with only those rows of ``lit`` that the mask ``(row,)`` keeps."""
        return replace(self, lit=self.lit.select(is_kept), field=self.field[is_kept])

    def with_waves(self) -> Self:
        """The illumination with ``lit.wave``, losses in sheets behind the edges included."""
        world, body, lit = self.world, self.body, self.lit
        views = [view for view in self.views if isinstance(view, BentView)]
        if not len(lit.face):
            return self
        losses = _losses(world, body, views, lit)
        faces, table = facet_levels(world.surfaces[body]).faces, view_table_of(views, world, body)
        wave = incident_waves(faces, *mirrors_of(world, body), table, losses, lit)
        wave[:, (SENT_V, SENT_H)] *= self.field[:, None, None].astype(np.complex64)
        return replace(
            self, lit=lit._replace(wave=wave, loss=np.zeros(len(lit.face), dtype=np.int64))
        )


def bent_illumination(
    world: World, body: int, views: Sequence[BentView], seen: Illumination
) -> BentIllumination:
    """Facets of a body that views over edges illuminate, without waves.

    ``seen`` is the illumination by direct views, which tells for every facet whether the straight
    line from the radar is free.
    """
    groups: dict[int, list[BentView]] = {}
    for view in views:
        groups.setdefault(id(view.edges), []).append(view)
    found = [
        (view, lit)
        for group in groups.values()
        for view, lit in zip(group, _lit_over(world, group, seen), strict=True)
        if len(lit.face)
    ]
    rows = [lit for _, lit in found] or [NONE_LIT]
    both = EdgeLit(*[np.concatenate(column) for column in zip(*rows, strict=True)])
    counts = [len(lit.face) for _, lit in found]
    start = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
    no_waves = np.empty((0, 4, 2), dtype=np.complex64)
    none = np.empty(0, dtype=np.int64)
    lit = LitFacets(start, both.face, both.direction, both.length, both.aspect, no_waves, none)
    return BentIllumination(
        world=world, body=body, views=tuple(view for view, _ in found), lit=lit, field=both.field
    )


def _patches_of(world: World, view: View) -> Patches:
    """Patches of a view's body."""
    surface, rotation = world.surfaces[view.body], world.rotation[view.body]
    patch = surface.patch_face
    lifted = surface.centroid[patch] + SHADOW_RAY_LIFT * surface.normal[patch]
    place = lifted @ rotation.T + (world.position[view.body] - view.source)
    normal = surface.normal[patch] @ rotation.T
    away = np.maximum(np.sqrt(_dots(place, place)), 1e-9)
    # facets are turned from the middle one of their patch, and seen from a little aside
    most = np.arcsin(MOST_TURNED_AWAY) + _spread_of(surface)
    most += np.arcsin(np.minimum(PATCH_REACH / away, 1.0))
    facing = _dots(place, normal) / away
    return Patches(place, normal, (most >= 0.5 * np.pi) | (facing < np.sin(most)))


def _dots(one: FloatArray, other: FloatArray) -> FloatArray:
    """Scalar products of vectors ``(row, xyz)``; NumPy's sums along short rows take longer."""
    return np.asarray(np.einsum("rx,rx->r", one, other))


@lru_cache(maxsize=64)
def _spread_of(surface: Surface) -> FloatArray:
    """Greatest angle, rad, of a patch's facets to the facet in its middle, ``(patch,)``."""
    least = np.ones(len(surface.patch_face))
    middle = surface.normal[surface.patch_face[surface.patch]]
    np.minimum.at(least, surface.patch, np.sum(surface.normal * middle, axis=-1))
    return np.asarray(np.arccos(np.clip(least, -1.0, 1.0)))


def _lit_over(world: World, views: Sequence[BentView], seen: Illumination) -> list[EdgeLit]:
    """Facets that the waves over the edges of one vehicle reach, for every edge's view."""
    view = views[0]
    surface, rotation = world.surfaces[view.body], world.rotation[view.body]
    is_seen = np.zeros(len(surface.area), dtype=np.bool_)
    for number, other in enumerate(seen.views):
        if other.radar == view.radar:
            is_seen[seen.lit.face[seen.lit.start[number] : seen.lit.start[number + 1]]] = True
    reach = Reach(
        np.array([one.edge for one in views], dtype=np.int64),
        np.array([_reached_patches(world, one) for one in views]),
        surface.patch,
        is_seen,
        np.concatenate([rotation, [world.position[view.body] - view.source]]),
    )
    faces = facet_levels(surface).faces
    return facets_lit(edge_table(view.edges), faces, reach, world.wavenumber)


def _reached_patches(world: World, view: BentView) -> BoolArray:
    """Mask of the patches that the wave over one edge reaches, ``(patch,)``."""
    waves, place = view.at_patches, view.patches.place
    is_lit: BoolArray = np.abs(waves.field[view.edge]) > WEAKEST_WAVE
    some = np.flatnonzero(is_lit)
    if not len(some):
        return is_lit
    lift = EDGE_CLEARANCE * view.edges.outwards[view.edge]
    bend = view.source + waves.bend[view.edge, some, 1] + lift
    end = view.source + place[some]
    near = _obstacles(world, bend, end)
    is_lit[some] = ~blocked(world, bend, end, clearance=0.0, but_body=view.blocker, among=near)
    return is_lit


def _obstacles(world: World, starts: FloatArray, ends: FloatArray) -> tuple[IntArray, IntArray]:
    """Opaque bodies and plates that may block rays between points, m ``(ray, xyz)``."""
    middle = np.array([np.mean(np.atleast_2d(points), axis=0) for points in (starts, ends)])
    first, last = (
        float(np.max(np.linalg.norm(points - centre, axis=-1), initial=0.0))
        for points, centre in zip((starts, ends), middle, strict=True)
    )
    plates = plates_near(world, middle, last, margin=first)
    bodies = bodies_near(world, middle, last, margin=first)
    return bodies, plates[~world.plate_is_pane[plates]]


def _losses(world: World, body: int, views: Sequence[BentView], lit: LitFacets) -> Losses:
    """Losses in sheets before the edges and behind them, as `view_losses` gives them.

    An edge bends a wave by a few degrees, so that its polarisations keep their names there.
    """
    surface = world.surfaces[body]
    number = np.zeros((len(views), len(surface.patch_face)), dtype=np.int64)
    matrices = [identities(1)]
    count = 1
    for index, view in enumerate(views):
        face = lit.face[lit.start[index] : lit.start[index + 1]]
        patch = np.unique(surface.patch[face])
        place = view.source + view.patches.place[patch]
        lift = EDGE_CLEARANCE * view.edges.outwards[view.edge]
        bend = view.source + view.at_patches.bend[view.edge, patch] + lift
        before, behind = (
            transmission_matrices(world, *leg, but_body=view.blocker)
            for leg in ((view.source, bend[:, 0]), (bend[:, 1], place))
        )
        matrix = identities(len(patch))
        matrix[:, 0] = behind @ before
        matrices.append(matrix)
        number[index, patch] = count + np.arange(len(patch))
        count += len(patch)
    return Losses(surface.patch, number, np.concatenate(matrices))
