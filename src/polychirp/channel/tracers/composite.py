"""`Composite` — the default tracer: every mechanism answers for its own kind of path."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from polychirp.channel.base import (
    Capability,
    Part,
    all_pairs,
    gather,
    no_paths,
    strength,
    strongest_of_pair,
    without_weak,
)
from polychirp.channel.geometry.caster_names import CasterName
from polychirp.channel.materials.library import material_table
from polychirp.errors import InputError
from polychirp.model.material import Material
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene
from polychirp.spec import Spec
from polychirp.units import Hertz, Metres, Ratio, from_db

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from polychirp.axes import FloatArray, IntArray
    from polychirp.channel.scene.world import World

    Mechanism = Callable[[World, IntArray], PropagationPaths]


MOST_BOUNCES: Final = 8
"""Of one path. Each takes as long as the one before, and adds less."""

WIDEST_TUBE: Final = 0.02
"""m: with it the echo of a street is right, with narrower ones that of its weakest pairs too."""

LEAST_TUBE: Final = 5e-4
"""m: below this a body of a few metres takes more tubes than anyone waits for."""


@dataclass(frozen=True, kw_only=True)
class NamedMaterial(Material):
    """A study's own material, or its own value of a known one."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Composite(Spec):
    """Every mechanism of the package, each where it is right.

    Line of sight, bent round what stands in the way; point scatterers; mirror images in road and
    walls and in their corners; facets of vehicles, seen directly and in mirrors; bounces between
    bodies; on request, rough planes and leaves with random phases. Surfaces block; thin sheets,
    such as panes and bumpers, let part through.

    A snapshot of one scene after another is cheap: meshes are prepared once, and kept.

    Parameters
    ----------
    frequency : Hz, at which amplitudes and materials are evaluated
    dynamic_range : ratio by which a path may be weaker than the strongest of its transmitter and
        receiver, as their antennas' elements see it
    reflecting_planes : whether road and walls mirror; they block in any case
    max_bounces : surfaces that a path between bodies may meet; 1 leaves these paths out
    narrowest_tube : m, to which the tubes that look for these paths are cut where it matters; 2 cm
        cuts none. At 2.5 mm the power of weak pairs is right to 1 dB in the median, at 2.4 times
        the cost
    diffraction : whether direct paths bend round edges
    transmission : whether thin sheets let waves through; otherwise they block
    diffuse : whether rough planes and leaves scatter: hundreds of weak paths more for every radar,
        most of them from the road within 5 m, which receivers take for that many objects
    diffuse_range : like ``dynamic_range``, of a single such path
    max_length : m, of the longest path that is followed; a few hundred save time in long streets
    caster : what finds out whether single rays are blocked: "numba" is always there, "embree" needs
        the extra of that name, "auto" takes Embree where it is installed. Both find the same, but
        for rays past an edge within some micrometres
    seed : of the random places and phases of diffuse scattering
    materials : added to the known ones, or in their place

    Examples
    --------
    >>> from polychirp.frames import Pose
    >>> from polychirp.model.radar import Radar
    >>> from polychirp.model.scene import Actor, Scene
    >>> cars = (Actor(name="a", kind="vehicle"), Actor(name="b", kind="vehicle", pose=Pose(x=9.0)))
    >>> scene = Scene(time=0.0, actors=cars, carriers=(0, 1),
    ...     radars=(Radar(name="front"), Radar(name="rear", mount=Pose(yaw=3.14))))
    >>> Composite().trace(scene).num_paths  # there, and back
    2
    """

    frequency: Hertz = 79e9
    dynamic_range: Ratio = from_db(60.0)
    reflecting_planes: bool = True
    max_bounces: int = 3
    narrowest_tube: Metres = WIDEST_TUBE
    diffraction: bool = True
    transmission: bool = True
    diffuse: bool = False
    diffuse_range: Ratio = from_db(40.0)
    max_length: Metres = 1e6
    caster: CasterName = "numba"
    seed: int = 1
    materials: tuple[NamedMaterial, ...] = ()
    kind: Literal["composite"] = "composite"

    def __post_init__(self) -> None:
        if not self.frequency > 0:
            raise InputError("a tracer needs a positive frequency")
        if not min(self.dynamic_range, self.diffuse_range) >= 1:
            raise InputError("a tracer's dynamic ranges must be at least 0 dB")
        if not 1 <= self.max_bounces <= MOST_BOUNCES:
            raise InputError(f"a tracer follows 1 to {MOST_BOUNCES} bounces")
        if not LEAST_TUBE <= self.narrowest_tube <= WIDEST_TUBE:
            raise InputError(
                f"a tracer's narrowest tubes are {LEAST_TUBE * 1e3:g} to {WIDEST_TUBE * 1e3:g} mm "
                "wide"
            )
        if not self.max_length > 0:
            raise InputError("a tracer's longest path must be longer than 0 m")
        if self.seed < 0:
            raise InputError("a tracer's seed must be 0 or more")

    @property
    def capabilities(self) -> frozenset[Capability]:
        """Which mechanisms the tracer has."""
        found: set[Capability] = {"line-of-sight", "occlusion", "points", "facets"}
        switched: dict[Capability, bool] = {
            "planes": self.reflecting_planes,
            "tubes": self.max_bounces > 1,
            "diffraction": self.diffraction,
            "transmission": self.transmission,
            "diffuse": self.diffuse,
        }
        return frozenset(found.union(name for name, is_on in switched.items() if is_on))

    def prepare(self, scene: Scene) -> World:
        """The scene made ready, as `trace` makes it; meshes met before are not prepared again.

        Raises
        ------
        InputError
            A surface is of an unknown material, or Embree is asked for and not installed.
        """
        from polychirp.channel.scene.embree import caster_name
        from polychirp.channel.scene.world import world_of

        return world_of(
            scene,
            frequency=self.frequency,
            dynamic_range=self.dynamic_range,
            table=material_table({row.name: row for row in self.materials}),
            transmission=self.transmission,
            max_length=self.max_length,
            caster=caster_name(self.caster),
        )

    def parts(self, world: World) -> tuple[Part, ...]:
        """What the tracer traces, from the surest to the least: one entry for every mechanism.

        Bodies have one each, so that what passes by closely can be renewed more often than the
        rest. A new mechanism is one more part.
        """
        parts = [*self._direct_parts(), *self._mirror_parts(), *self._body_parts(world)]
        if self.max_bounces > 1:
            parts += self._bounce_parts(world)
        if self.diffuse:
            from polychirp.channel.clutter.foliage import foliage_paths
            from polychirp.channel.clutter.rough_plates import diffuse_paths

            parts.append(self._clutter("rough planes", partial(diffuse_paths, seed=self.seed)))
            parts.append(self._clutter("leaves", partial(foliage_paths, seed=self.seed)))
        return tuple(parts)

    def _clutter(self, name: str, mechanism: Mechanism) -> Part:
        """A part of many weak paths, kept within ``diffuse_range`` of what their pairs have."""

        def trace(world: World, pairs: IntArray, strongest: FloatArray) -> PropagationPaths:
            found = mechanism(world, pairs)
            limit = strongest[found.transmitter, found.receiver] / self.diffuse_range
            return found.select(strength(found, world.scene) >= limit)

        return Part(name, trace)

    def _direct_parts(self) -> Iterator[Part]:
        from polychirp.channel.direct.occluded import visible_line_of_sight, visible_point_echoes

        yield _part("line of sight", visible_line_of_sight)
        if self.diffraction:
            from polychirp.channel.diffraction.paths import diffracted_paths

            yield _part("diffraction", diffracted_paths)
        yield _part("points", visible_point_echoes)

    def _mirror_parts(self) -> Iterator[Part]:
        if self.reflecting_planes:
            from polychirp.channel.specular.double_plates import corner_paths
            from polychirp.channel.specular.plates import mirror_paths

            yield _part("mirrors", mirror_paths)
            yield _part("corners", corner_paths)

    def _body_parts(self, world: World) -> Iterator[Part]:
        from polychirp.channel.physical_optics.paths import (
            facet_echoes,
            mirrored_echoes,
            scattering_bodies,
        )

        for body in scattering_bodies(world):
            name = world.scene.actors[world.body[body]].name
            yield _part(f"facets of {name}", partial(facet_echoes, body=body), name)
            if self.reflecting_planes:
                mirrored = partial(mirrored_echoes, body=body)
                yield Part(f"mirrored facets of {name}", mirrored, name)

    def _bounce_parts(self, world: World) -> Iterator[Part]:
        from polychirp.channel.physical_optics.paths import scattering_bodies
        from polychirp.channel.ray_tubes.paths import tube_paths

        for body in scattering_bodies(world):
            name = world.scene.actors[world.body[body]].name
            trace = partial(
                tube_paths,
                tube=self.narrowest_tube,
                coarsest=WIDEST_TUBE,
                max_bounces=self.max_bounces,
                first=body,
            )
            yield Part(f"bounces from {name}", trace)

    def trace(self, scene: Scene) -> PropagationPaths:
        """Every path between the radars of ``scene``, at its time.

        Raises
        ------
        InputError
            A surface is of an unknown material.
        """
        world, pairs = self.prepare(scene), all_pairs(scene, max_length=self.max_length)
        num_radars = len(scene.radars)
        strongest = np.zeros((num_radars, num_radars))
        tables = [no_paths(scene, self.frequency)]
        for part in self.parts(world):
            found = part.trace(world, pairs, strongest)
            strongest = np.maximum(
                strongest, strongest_of_pair(found, strength(found, scene), num_radars)
            )
            tables.append(found)
        return without_weak(gather(tables), scene, self.dynamic_range)


def _part(name: str, mechanism: Mechanism, whole: str = "") -> Part:
    """A part that is traced whatever else there is."""
    return Part(name, lambda world, pairs, _: mechanism(world, pairs), whole)
