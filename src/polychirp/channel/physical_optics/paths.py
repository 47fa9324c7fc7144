r"""Echoes of vehicles: near-field physical optics of facets.

A wave from the transmitter T travels along d over the distance r1 to a triangle of centroid C,
normal n and area A, and from there along q over r2 to the receiver X. With the incident field E,
the Fresnel-reflected field :math:`E_r`, which travels along r, the field w that X would make at C
if it transmitted, and the wavenumber k, the path's amplitude a is

.. math::
    J = n\times(d\times E + r\times E_r),\quad M = -n\times(E + E_r),\quad
    F = J\cdot w + (M\times q)\cdot w

    a = -\frac{j}{8\pi}\,\frac{F A}{r_1 r_2}\,e^{-jk(r_1+r_2)}\,I

where I is the mean of :math:`e^{-jp}` over the triangle and p the phase of the path, linear about
C (Gordon 1975, applied facet by facet in the near field). F is averaged over both directions of
propagation, because physical optics alone is not reciprocal where it is inaccurate.

**Mirrored views.** A plate (road, wall) gives transmitter and receiver an image behind it, which
radiates to the facet. Its field is multiplied by the plate's Fresnel coefficients at the angle of
the mirrored leg. Both parts of the leg must be free, and the mirror point must be on the plate. A
path has at most one plate, on one leg or on both; paths over two different plates are left out.

**Flat parts** of a body, of many coplanar facets, are integrated along their borders instead
(`flat_terms`).

**From facets to paths.** Every integral is split into terms at the triangle's corners, each with
its own path length L. The terms of a body are summed in cells of total path length with smooth
weights (a partition of unity), as complex moments Σc, ΣcL, Σcd, Σcq. Here c is a term's
amplitude; ratios of moments to Σc are the path's length and directions. That is exact to first
order in frequency, in the receiver's aperture and in time. Cells without overlap, or delays at
centroids, have an error of −7 dB of the echo.

Left out are the fringe currents at edges (decision 6), creeping waves, second bounces (`ray_tubes`
computes them), and the motion of bodies during the flight (which changes a path by v·τ, less than
3 µm).
"""

import warnings
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.base import gather, no_paths
from polychirp.channel.physical_optics.cell_paths import cell_paths, velocity_in_views
from polychirp.channel.physical_optics.corner_terms import PairTable
from polychirp.channel.physical_optics.delay_cells import sum_in_cells
from polychirp.channel.physical_optics.flat_faces import Flats
from polychirp.channel.physical_optics.illumination import (
    Illumination,
    facet_levels,
    illumination_of,
    media_of,
)
from polychirp.channel.physical_optics.kernels import CELL_LENGTH
from polychirp.channel.physical_optics.power_estimate import (
    estimated_amplitudes,
    estimated_power,
    mark_needed_rows,
)
from polychirp.channel.physical_optics.views import View
from polychirp.channel.scene.world import World
from polychirp.errors import ModelWarning
from polychirp.model.paths import PropagationPaths

MAX_ECHO_OVER_MIRROR: Final = 2.0
r"""Greatest amplitude ratio of a body's echo to that of a mirror in the body's place. It exceeds 1
where the Fresnel zones of the body add up; a rectangle has at most 1.342² = 1.80, each side
with the greatest :math:`\sqrt2\,|C(w) + jS(w)|` of the Fresnel integrals."""

SCATTERING_KINDS: Final = ("vehicle", "furniture", "object")
"""Kinds of actors whose facets scatter. Trees only block, because a crown has no clear surface."""


def scattering_bodies(world: World) -> tuple[int, ...]:
    """Numbers of scattering bodies, sorted by distance to the nearest radar not on the body."""
    chosen = [body for body in range(len(world.body)) if scatters(world, body)]
    return tuple(sorted(chosen, key=lambda body: _nearest(world, body)))


def scatters(world: World, body: int) -> bool:
    """True if a body has facets that scatter. Clouds have no facets; trees' facets only block."""
    kind = world.scene.actors[world.body[body]].kind
    return kind in SCATTERING_KINDS and bool(world.surfaces[body].area.size)


def facet_echoes(world: World, pairs: IntArray, *, body: int) -> PropagationPaths:
    """Paths of ``pairs`` ``(pair, 2)`` over the facets of one body, given by its number."""
    direct = direct_views(world, body, radars_of(world, pairs, body))
    seen = direct_illumination(world, body, direct)
    _check_facets(seen)
    sums = PairSums(seen, seen, combinations_of(direct, direct, wanted_pairs(pairs)))
    return only_pairs(pairs, sums.paths(seen, seen))


def mirrored_echoes(
    world: World, pairs: IntArray, strongest: FloatArray, *, body: int
) -> PropagationPaths:
    r"""Paths of ``pairs`` over the facets of one body, with one leg or both mirrored by a plate.

    A plate is tried for a radar and a body if both are in front of it and it may hold a mirror
    point. A combination of views is left out before its facets are tested if its bound

    .. math:: |a| \le 2\,\frac{\lambda}{4\pi L}\,|\Gamma_1\Gamma_2|

    (twice the amplitude of a mirror in the body's place, `MAX_ECHO_OVER_MIRROR`; L, Γ and the
    antennas' gains have their most favourable values over the body's bounding sphere), in power, is
    below ``strongest`` by more than the dynamic range.

    Parameters
    ----------
    pairs : ``(pair, 2)``
    strongest : power of the strongest path found so far, ``(transmitter, receiver)``
    body : number of the body
    """
    direct = direct_views(world, body, radars_of(world, pairs, body))
    mirrored = [
        View(world=world, radar=view.radar, body=body, plate=int(plate))
        for view in direct
        for plate in view.mirrors
    ]
    seen = direct_illumination(world, body, direct)
    once = within_dynamic_range(
        world, combinations_of(list(seen.number), mirrored, wanted_pairs(pairs)), strongest
    )
    twice = within_dynamic_range(
        world, combinations_of(mirrored, mirrored, wanted_pairs(pairs)), strongest
    )
    if not once and not twice:
        return no_paths(world.scene, world.frequency)
    views = dict.fromkeys([b for _, b in once + twice] + [a for a, _ in twice])
    reflected = illumination_of(world, body, list(views))
    sums = [
        PairSums(seen, reflected, once, strongest),
        PairSums(reflected, reflected, twice, strongest),
    ]
    # waves are computed only for facets of mirrored views that meet a kept cell
    is_needed = np.zeros(reflected.lit.face.shape, dtype=np.bool_)
    sums[0].mark((np.zeros(seen.lit.face.shape, dtype=np.bool_), is_needed))
    sums[1].mark((is_needed, is_needed))
    reflected = reflected.select(is_needed).with_waves()
    found = [sums[0].paths(seen, reflected), sums[1].paths(reflected, reflected)]
    return only_pairs(pairs, gather(found))


def radars_of(world: World, pairs: IntArray, body: int) -> tuple[int, ...]:
    """Numbers of the radars of those ``pairs`` of which neither is on the body.

    A radar's own vehicle is within centimetres of the antenna, where physical optics does not hold:
    its echoes count as part of the antenna's installation.
    """
    is_on_body = np.array(world.scene.carriers)[pairs] == world.body[body]
    return tuple(int(radar) for radar in np.unique(pairs[~np.any(is_on_body, axis=1)]))


def wanted_pairs(pairs: IntArray) -> set[tuple[int, int]]:
    """``pairs`` ``(pair, 2)`` as a set."""
    return {(int(i), int(j)) for i, j in pairs}


@lru_cache(maxsize=4)  # for each of two threads, the body that it traces and one to spare
def direct_views(world: World, body: int, radars: tuple[int, ...]) -> tuple[View, ...]:
    """Direct views of the radars within the greatest path length."""
    views = [View(world=world, radar=radar, body=body) for radar in radars]
    return tuple(view for view in views if view.distance <= world.max_length)


@lru_cache(maxsize=4)
def direct_illumination(world: World, body: int, views: tuple[View, ...]) -> Illumination:
    """Illumination of a body by direct views, cached because mirrored and bent echoes need it."""
    return illumination_of(world, body, list(views)).with_waves()


def only_pairs(pairs: IntArray, paths: PropagationPaths) -> PropagationPaths:
    """Paths of the pairs asked for, without the opposite direction of pairs that were not."""
    num_radars = 1 + int(np.max(pairs, initial=0))
    asked = np.unique(pairs @ (num_radars, 1))
    return paths.select(np.isin(paths.transmitter * num_radars + paths.receiver, asked))


def within_dynamic_range(
    world: World, combinations: list[tuple[View, View]], known: FloatArray
) -> list[tuple[View, View]]:
    """Combinations whose bound is within the dynamic range of the strongest ``known`` path."""
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
    """Greatest power that a path over two views can carry, antenna elements included."""
    length = max(a.distance + b.distance, 1e-3)
    amplitude = (
        MAX_ECHO_OVER_MIRROR
        * a.most_reflection
        * b.most_reflection
        / (2 * world.wavenumber * length)
    )
    return float(amplitude**2 * a.most_gain * b.most_gain)


def combinations_of(
    first: Sequence[View], second: Sequence[View], wanted: set[tuple[int, int]]
) -> list[tuple[View, View]]:
    """Unordered combinations of views that may make a path of a wanted pair.

    They have at most one plate and are not longer than the longest path.
    """
    found: dict[frozenset[int], tuple[View, View]] = {}
    for a in first:
        for b in second:
            is_possible = a.plate is None or b.plate is None or a.plate == b.plate
            is_possible &= a.distance + b.distance <= a.world.max_length
            if is_possible and {(a.radar, b.radar), (b.radar, a.radar)} & wanted:
                found.setdefault(frozenset((id(a), id(b))), (a, b))
    return list(found.values())


def _check_facets(seen: Illumination) -> None:
    """Warn if the wave front's phase curvature over most illuminated facets exceeds π/2.

    Facets of flat parts do not count: their size does not matter.
    """
    world, lit = seen.world, seen.lit
    surface = world.surfaces[seen.body]
    is_flat = facet_levels(surface).flats.is_flat[lit.face]
    bend = world.wavenumber * surface.reach[lit.face[~is_flat]] ** 2
    if len(bend) and np.median(bend / lit.length[~is_flat]) > np.pi / 2:
        name = world.scene.actors[world.body[seen.body]].name
        warnings.warn(
            f"most facets of '{name}' are too large for a radar this near; their edges should not "
            "exceed √(λR/2), with the wavelength λ and the range R",
            ModelWarning,
            stacklevel=2,
        )


class PairSums:
    """Combinations of two views that both illuminate one body, and the cells of their paths.

    If ``known``, the power of every pair's strongest path, is given, cells are kept only if their
    estimated power is within its dynamic range. ``flats`` are flat parts that are integrated along
    their borders; by default, those of the body.
    """

    def __init__(
        self,
        first: Illumination,
        second: Illumination,
        combinations: list[tuple[View, View]],
        known: FloatArray | None = None,
        *,
        flats: Flats | None = None,
    ) -> None:
        self.first, self.second = first, second
        self.world, self.body = first.world, first.body
        self.surface = self.world.surfaces[self.body]
        self.faces = facet_levels(self.surface).faces
        self.flats = facet_levels(self.surface).flats if flats is None else flats
        self.combinations = [
            (a, b) for a, b in combinations if a in first.number and b in second.number
        ]
        slack = max((a.slack + b.slack for a, b in self.combinations), default=0.0)
        num_cells = int((4 * self.world.radius[self.body] + slack) / CELL_LENGTH) + 5
        self.table = self._table(np.ones((len(self.combinations), num_cells), dtype=np.bool_))
        if known is not None and self.combinations:
            is_kept = self._kept_cells(known)
            kept = np.flatnonzero(np.any(is_kept, axis=1))
            self.combinations = [self.combinations[number] for number in kept]
            self.table = self._table(is_kept[kept])

    def _table(self, is_kept: BoolArray) -> PairTable:
        """The combinations as a table of pairs, with a mask of cells ``(combination, cell)``."""
        first, second = self.first.number, self.second.number
        numbers = [[first[a], second[b]] for a, b in self.combinations]
        least = np.array([a.distance + b.distance for a, b in self.combinations])
        return PairTable(
            views=np.array(numbers, dtype=np.int64).reshape(-1, 2),
            first_cell=np.floor(least / CELL_LENGTH).astype(np.int64) - 1,
            is_kept=is_kept,
        )

    def _kept_cells(self, known: FloatArray) -> BoolArray:
        """Mask of the cells whose estimated power is within the dynamic range of ``known``."""
        world = self.world
        cells = estimated_amplitudes(
            self.faces,
            media_of(world, self.surface.materials),
            self.first.lit,
            self.second.lit,
            self.table,
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

    def mark(self, is_needed: tuple[BoolArray, BoolArray]) -> None:
        """Set ``is_needed`` for the rows (facets) of both illuminations with kept cells."""
        first, second = self.first.lit, self.second.lit
        mark_needed_rows(self.surface.reach, first, second, self.table, is_needed)

    def paths(self, first: Illumination, second: Illumination) -> PropagationPaths:
        """Paths over all combinations in both directions, from illuminations that have waves."""
        world = self.world
        if not self.combinations:
            return no_paths(world.scene, world.frequency)
        sides = [[pair[side] for pair in self.combinations] for side in (0, 1)]
        velocity = np.stack([velocity_in_views(side, world, self.body) for side in sides], axis=1)
        moments = sum_in_cells(
            self.faces,
            self.flats,
            media_of(world, self.surface.materials),
            first.lit,
            second.lit,
            self.table,
            velocity @ world.rotation[self.body],
            world.wavenumber,
        )
        return cell_paths(world, self.body, self.combinations, self.table.first_cell, moments)
