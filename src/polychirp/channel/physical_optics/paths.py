r"""Near-field physical optics of facets: what vehicles scatter.

A wave from T meets a triangle of centroid C, normal n and area A along d, over r1, and goes on to
X along q, over r2. With the incident field E, the Fresnel-reflected one :math:`E_r` along r, and
the field w that X would make at C,

.. math::
    J = n\times(d\times E + r\times E_r),\quad M = -n\times(E + E_r),\quad
    F = J\cdot w + (M\times q)\cdot w

    a = -\frac{j}{8\pi}\,\frac{F A}{r_1 r_2}\,e^{-jk(r_1+r_2)}\,I

where I is the mean of :math:`e^{-jp}` over the triangle, p the phase of the path, linear about C.
(Gordon 1975, near field by facet.) F is averaged over both ways round, as physical optics by
itself is reciprocal only where it is right.

**Mirrored views.** Road and walls show transmitter and receiver a second time: the image radiates
to the facet, its field turned by the plate's Fresnel coefficients at the mirrored leg's angle,
both parts of the leg free, and the mirror point on the plate. A path has at most one plate, on
either leg or on both; two different plates are left out.

**From facets to paths.** Every integral is split into terms at the triangle's corners, each with
its own path length L. Terms are gathered per body in cells of total path length with smooth
weights (a partition of unity), as complex moments Σc, ΣcL, Σcd, Σcq; the ratios of moments are
the path's length and directions. That is exact to first order in frequency, in the receiver's
aperture and in time, where hard range bins or delays at centroids are wrong by −7 dB.

Left out: edges' own currents (decision 6), creeping waves, second bounces (`tubes`), and the
bodies' motion during the flight (it moves a delay by v·τ, below 3 µm).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.base import gather, no_paths
from polychirp.channel.physical_optics.cell_paths import cell_paths, slide_of
from polychirp.channel.physical_optics.delay_cells import gather_cells
from polychirp.channel.physical_optics.illumination import Lighting, lighting_of, media_of, parts_of
from polychirp.channel.physical_optics.kernels import CELL
from polychirp.channel.physical_optics.power_estimate import (
    estimated_power,
    mark_needed,
    scalar_cells,
)
from polychirp.channel.physical_optics.views import View
from polychirp.channel.scene.world import World
from polychirp.errors import ModelWarning
from polychirp.model.paths import PropagationPaths

OVERSHOOT: Final = 2.0
"""By how much a body's echo may exceed that of a mirror at its place: Fresnel zones of a body
that is no plane. A rectangle's greatest is 1.37² (both Fresnel integrals at their maximum)."""

SCATTERERS: Final = ("vehicle", "object")
"""Kinds of actors whose facets scatter. Trees only block: a crown is no surface."""


def scattering_bodies(world: World) -> tuple[int, ...]:
    """Numbers of the bodies whose facets scatter, the nearest to another's radar first."""
    chosen = [body for body in range(len(world.body)) if scatters(world, body)]
    return tuple(sorted(chosen, key=lambda body: _nearest(world, body)))


def scatters(world: World, body: int) -> bool:
    """Whether a body has facets that scatter: clouds of leaves have none, trees do not."""
    kind = world.scene.actors[world.body[body]].kind
    return kind in SCATTERERS and bool(world.surfaces[body].area.size)


def facet_echoes(world: World, pairs: IntArray, *, body: int) -> PropagationPaths:
    """Paths of ``pairs`` ``(pair, 2)`` over the facets of one body, given by its number."""
    direct = _direct_views(world, body, _radars(pairs))
    seen = _seen_directly(world, body, direct)
    _check_facets(seen)
    tasks = _Tasks(seen, seen, _combinations(direct, direct, _wanted(pairs)))
    return _only(pairs, tasks.paths(seen, seen))


def mirrored_echoes(
    world: World, pairs: IntArray, strongest: FloatArray, *, body: int
) -> PropagationPaths:
    r"""Paths of ``pairs`` over the facets of one body that an end sees in a plate, or both.

    A plate is tried for a body where it has both before it and may hold a mirror point. A
    combination of views is left out unseen if its bound

    .. math:: |a| \le 2\,\frac{\lambda}{4\pi L}\,|\Gamma_1\Gamma_2|

    (a mirror in the body's place, doubled; L and Γ at their most favourable over the body's
    sphere, and the antennas' gains likewise) is below the dynamic range of the pair.

    Parameters
    ----------
    pairs : ``(pair, 2)``
    strongest : what is known of the strongest path of every pair, ``(transmitter, receiver)``
    body : number of the body
    """
    direct = _direct_views(world, body, _radars(pairs))
    mirrored = [
        View(world=world, radar=view.radar, body=body, plate=int(plate))
        for view in direct
        for plate in view.mirrors
    ]
    once = _worthy(world, _combinations(direct, mirrored, _wanted(pairs)), strongest)
    twice = _worthy(world, _combinations(mirrored, mirrored, _wanted(pairs)), strongest)
    if not once and not twice:
        return no_paths(world.scene, world.frequency)
    views = dict.fromkeys([b for _, b in once + twice] + [a for a, _ in twice])
    seen, reflected = _seen_directly(world, body, direct), lighting_of(world, body, list(views))
    tasks = [
        _Tasks(seen, reflected, once, strongest),
        _Tasks(reflected, reflected, twice, strongest),
    ]
    needed = np.zeros(reflected.rows.face.shape, dtype=np.bool_)
    tasks[0].mark((np.zeros(seen.rows.face.shape, dtype=np.bool_), needed))
    tasks[1].mark((needed, needed))
    reflected = reflected.only(needed).with_waves()
    found = [tasks[0].paths(seen, reflected), tasks[1].paths(reflected, reflected)]
    return _only(pairs, gather(found))


def _radars(pairs: IntArray) -> tuple[int, ...]:
    return tuple(int(radar) for radar in np.unique(pairs))


def _wanted(pairs: IntArray) -> set[tuple[int, int]]:
    return {(int(i), int(j)) for i, j in pairs}


@lru_cache(maxsize=4)
def _direct_views(world: World, body: int, radars: tuple[int, ...]) -> tuple[View, ...]:
    """Radars that a body may see.

    A radar's own vehicle is within centimetres of the antenna, where neither incident wave nor
    facets are what physical optics takes them for: that is part of the installation.
    """
    others = [radar for radar in radars if world.scene.carriers[radar] != world.body[body]]
    views = [View(world=world, radar=radar, body=body) for radar in others]
    return tuple(view for view in views if view.distance <= world.max_length)


@lru_cache(maxsize=2)
def _seen_directly(world: World, body: int, views: tuple[View, ...]) -> Lighting:
    """What direct views see of a body, kept as its mirrored views are joined with them next."""
    return lighting_of(world, body, list(views)).with_waves()


def _only(pairs: IntArray, paths: PropagationPaths) -> PropagationPaths:
    """Paths of the pairs asked for: those over two views go both ways round."""
    num_radars = 1 + int(np.max(pairs, initial=0))
    asked = np.unique(pairs @ (num_radars, 1))
    return paths.select(np.isin(paths.transmitter * num_radars + paths.receiver, asked))


def _worthy(
    world: World, combinations: list[tuple[View, View]], known: FloatArray
) -> list[tuple[View, View]]:
    """Combinations whose bound is within the dynamic range."""
    return [
        (a, b)
        for a, b in combinations
        if _bound(world, a, b) * world.dynamic_range >= known[a.radar, b.radar]
    ]


def _nearest(world: World, body: int) -> float:
    is_own = np.array(world.scene.carriers) == world.body[body]
    away = (world.scene.radar_position - world.centre[body])[~is_own]
    return float(np.min(np.linalg.norm(away, axis=-1), initial=np.inf))


def _bound(world: World, a: View, b: View) -> float:
    """Greatest power that a path over two views can carry, the elements' gains included."""
    length = max(a.distance + b.distance, 1e-3)
    amplitude = OVERSHOOT * a.most_reflection * b.most_reflection / (2 * world.wavenumber * length)
    return float(amplitude**2 * a.most_gain * b.most_gain)


def _combinations(
    first: Sequence[View], second: Sequence[View], wanted: set[tuple[int, int]]
) -> list[tuple[View, View]]:
    """Unordered pairs of views that may make a path: at most one plate, and a wanted pair.

    None that would be too long.
    """
    found: dict[frozenset[int], tuple[View, View]] = {}
    for a in first:
        for b in second:
            legal = a.plate is None or b.plate is None or a.plate == b.plate
            legal &= a.distance + b.distance <= a.world.max_length
            if legal and {(a.radar, b.radar), (b.radar, a.radar)} & wanted:
                found.setdefault(frozenset((id(a), id(b))), (a, b))
    return list(found.values())


def _check_facets(lit: Lighting) -> None:
    """Warn where most lit facets are so near that the wave front bends within them."""
    world, rows = lit.world, lit.rows
    bend = world.wavenumber * world.surfaces[lit.body].reach[rows.face] ** 2
    if len(bend) and np.median(bend / rows.length) > np.pi / 2:
        name = world.scene.actors[world.body[lit.body]].name
        warnings.warn(
            f"most facets of '{name}' are too large for a radar this near; "
            "their edges should not exceed √(λR/8)",
            ModelWarning,
            stacklevel=2,
        )


class _Tasks:
    """Combinations of views that both see something of one body, and the cells of their paths."""

    def __init__(
        self,
        first: Lighting,
        second: Lighting,
        combinations: list[tuple[View, View]],
        known: FloatArray | None = None,
    ) -> None:
        self.first, self.second = first, second
        self.world, self.body = first.world, first.body
        self.surface = self.world.surfaces[self.body]
        self.faces = parts_of(self.surface).faces
        pairs = [(a, b) for a, b in combinations if a in first.number and b in second.number]
        self._keep(pairs)
        shape = (len(pairs), int(4 * self.world.radius[self.body] / CELL) + 5)
        self.worth = np.ones(shape, dtype=np.bool_)
        if known is not None and pairs:
            self.worth = self._worth(known)
            kept = np.flatnonzero(np.any(self.worth, axis=1))
            self._keep([pairs[number] for number in kept])
            self.worth = self.worth[kept]

    def _keep(self, pairs: list[tuple[View, View]]) -> None:
        self.combinations = pairs
        least = np.array([a.distance + b.distance for a, b in pairs])
        self.first_cell = np.floor(least / CELL).astype(np.int64) - 1

    @property
    def task(self) -> IntArray:
        """Views of every combination as `first` and `second` number them, ``(task, 2)``."""
        first, second = self.first.number, self.second.number
        numbers = [[first[a], second[b]] for a, b in self.combinations]
        return np.array(numbers, dtype=np.int64).reshape(-1, 2)

    def _worth(self, known: FloatArray) -> BoolArray:
        """Cells whose estimates are within the dynamic range of what is known of their pairs."""
        world = self.world
        cells = scalar_cells(
            self.faces,
            media_of(world, self.surface.materials),
            self.first.rows,
            self.second.rows,
            self.task,
            self.first_cell,
            self.worth.shape[1],
            world.wavenumber,
        )
        factor = np.array(
            [
                (a.most_reflection * b.most_reflection) ** 2 * a.most_gain * b.most_gain
                for a, b in self.combinations
            ]
        )
        least = np.array([known[a.radar, b.radar] for a, b in self.combinations])
        power = factor[:, None] * estimated_power(cells)
        return np.asarray(power * world.dynamic_range >= least[:, None])

    def mark(self, needed: tuple[BoolArray, BoolArray]) -> None:
        """Mark the rows of both ends that the cells worth it are made of."""
        mark_needed(
            self.surface.reach,
            self.first.rows,
            self.second.rows,
            self.task,
            self.first_cell,
            self.worth,
            needed,
        )

    def paths(self, first: Lighting, second: Lighting) -> PropagationPaths:
        """Paths over all combinations, both ways round, of the same views with their waves."""
        world = self.world
        if not self.combinations:
            return no_paths(world.scene, world.frequency)
        moments = gather_cells(
            self.faces,
            media_of(world, self.surface.materials),
            first.rows,
            second.rows,
            self.task,
            self.first_cell,
            self.worth,
            np.stack([slide_of(views, world, self.body) for views in self._sides], axis=1)
            @ world.rotation[self.body],
            world.wavenumber,
        )
        return cell_paths(world, self.body, self.combinations, self.first_cell, moments)

    @property
    def _sides(self) -> list[list[View]]:
        """The first views of all combinations, and the second ones."""
        return [[pair[side] for pair in self.combinations] for side in (0, 1)]
