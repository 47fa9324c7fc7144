"""`Composite` — the default tracer, which joins the paths of all mechanisms."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.base import (
    AtFrequency,
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
from polychirp.channel.materials.library import NamedMaterial, material_table
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene
from polychirp.spec import Spec
from polychirp.units import Hertz, Metres, Ratio, from_db

if TYPE_CHECKING:
    from polychirp.channel.scene.world import World

Mechanism = Callable[["World", IntArray], PropagationPaths]

MAX_BOUNCES: Final = 8
"""Greatest number of bounces that a study may ask for. Chosen: each bounce costs as much time as
the one before it, and adds less power."""

WIDEST_TUBE: Final = 0.02
"""Width of ray tubes before they are cut, m. Chosen: it gives the right echo power of a street;
only the weakest pairs of radars need narrower tubes."""

NARROWEST_TUBE: Final = 5e-4
"""Least width of ray tubes that a study may ask for, m. Chosen: below it, a body of a few metres
needs too many tubes."""

LEAST_MOTION_ERROR: Final = from_db(-60.0)
"""Least error between two traces that a study may ask for. Chosen: errors below
`part_traces.FAINT_ECHO_ERROR` are tolerated in any case."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Composite(AtFrequency, Spec):
    """Every mechanism of the package, each for its own kind of path.

    The mechanisms are: line of sight, with diffraction at obstacles; point scatterers; moving parts
    of people and bicycles; mirror images in road and walls, with diffraction at obstacles, and in
    their corners; facets of vehicles, seen directly, in mirrors and over the edges of other
    vehicles; bounces between bodies; and, on request, rough planes and leaves with random phases.
    Surfaces block waves; thin sheets, such as panes and bumpers, let a part through.

    Further snapshots of a scene are cheap, because its meshes are prepared only once.

    Parameters
    ----------
    frequency : Hz, at which amplitudes and materials are evaluated; None: at that of
        the study's radars (`study.spec.tracer_of`), and at 79 GHz without a study
    dynamic_range : power ratio by which a path may be weaker than the strongest path of its
        transmitter and receiver, weighted with the gains of their antennas' elements
    reflecting_planes : true if road and walls mirror waves; they block waves in any case
    max_bounces : bounces that a path between bodies may have; 1 leaves out paths between bodies
    narrowest_tube : m, width to which the ray tubes that search these paths are cut where it
        matters; 2 cm cuts none, and saves a third of the tracing
    motion_error : greatest power of the errors of a part of the paths between two traces of it
        within a frame, over that part's power. −20 dB is as good as the meshes are; with −30 dB the
        echoes and the interference of the paper's radars are right to −25 dB or better, at twice
        the cost. Errors 46 dB below all echoes of a radar are tolerated in
        any case
    diffraction : true if direct paths and mirror images are diffracted at edges, and vehicles bend
        waves into their shadows
    transmission : true if thin sheets let waves through; otherwise they block
    diffuse : true if rough planes and leaves scatter. Every radar then has hundreds of weak paths
        more, most of them from the road within 5 m, which receivers take for as many objects
    diffuse_range : like ``dynamic_range``, for each single diffuse path
    max_length : m, of the longest path that is traced, from transmitter to receiver, so that own
        echoes come from half as far; a few hundred save time in long streets
    caster : of the rays that test for obstacles. "numba" is always available, "embree" needs the
        extra of that name, "auto" takes Embree if it is installed. Their results differ only for
        rays that pass an edge within some micrometres
    seed : of the random places and phases of diffuse scattering
    materials : materials added to the known ones; one with a known name replaces that material

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

    frequency: Hertz | None = None
    dynamic_range: Ratio = from_db(60.0)
    reflecting_planes: bool = True
    max_bounces: int = 3
    narrowest_tube: Metres = 0.0025
    motion_error: Ratio = from_db(-20.0)
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
        if not self.carrier > 0:
            raise InputError(f"frequency is {self.carrier:g} Hz; choose more than 0 Hz")
        if not min(self.dynamic_range, self.diffuse_range) >= 1:
            raise InputError(
                f"dynamic_range and diffuse_range are ratios of {self.dynamic_range:g} and "
                f"{self.diffuse_range:g}; choose 1 (0 dB) or more"
            )
        if not 1 <= self.max_bounces <= MAX_BOUNCES:
            raise InputError(f"max_bounces is {self.max_bounces}; choose 1 to {MAX_BOUNCES}")
        if not NARROWEST_TUBE <= self.narrowest_tube <= WIDEST_TUBE:
            raise InputError(
                f"narrowest_tube is {self.narrowest_tube * 1e3:g} mm; choose "
                f"{NARROWEST_TUBE * 1e3:g} to {WIDEST_TUBE * 1e3:g} mm"
            )
        if not LEAST_MOTION_ERROR <= self.motion_error <= 1.0:
            raise InputError(
                f"motion_error is a ratio of {self.motion_error:g}; choose "
                f"{LEAST_MOTION_ERROR:g} to 1 (−60 to 0 dB)"
            )
        if not self.max_length > 0:
            raise InputError(f"max_length is {self.max_length:g} m; choose more than 0 m")
        if self.seed < 0:
            raise InputError(f"seed is {self.seed}; choose 0 or more")

    @property
    def capabilities(self) -> frozenset[Capability]:
        """Mechanisms that are switched on."""
        found: set[Capability] = {"line-of-sight", "occlusion", "points", "facets"}
        switched: dict[Capability, bool] = {
            "planes": self.reflecting_planes,
            "tubes": self.max_bounces > 1,
            "diffraction": self.diffraction,
            "transmission": self.transmission,
            "diffuse": self.diffuse,
        }
        return frozenset(found.union(name for name, is_on in switched.items() if is_on))

    def prepare(self, scene: Scene) -> "World":
        """The prepared scene, as `trace` uses it; meshes already seen are not prepared again.

        `InputError` is raised if a surface is of an unknown material, or Embree is asked for and
        not installed.
        """
        from polychirp.channel.scene.embree import caster_name
        from polychirp.channel.scene.world import world_of

        return world_of(
            scene,
            frequency=self.carrier,
            dynamic_range=self.dynamic_range,
            table=material_table({row.name: row for row in self.materials}),
            transmission=self.transmission,
            max_length=self.max_length,
            caster=caster_name(self.caster),
        )

    def parts(self, world: "World") -> tuple[Part, ...]:
        """Parts of the scene's paths: one for every mechanism, strong mechanisms first.

        Facets and bounces have one part for each body, so that a body near the radars can be traced
        again more often than the rest.
        """
        parts = [*self._direct_parts(), *self._moving_parts(world)]
        parts += [*self._mirror_parts(world), *self._body_parts(world)]
        if self.max_bounces > 1:
            parts += self._bounce_parts(world)
        if self.diffuse:
            from polychirp.channel.clutter.foliage import foliage_paths
            from polychirp.channel.clutter.rough_plates import diffuse_paths

            parts.append(self._clutter("rough planes", partial(diffuse_paths, seed=self.seed)))
            parts.append(self._clutter("leaves", partial(foliage_paths, seed=self.seed)))
        return tuple(self._limited(part) for part in parts)

    def _limited(self, part: Part) -> Part:
        """The part without paths that are longer than ``max_length``."""

        def trace(world: "World", pairs: IntArray, strongest: FloatArray) -> PropagationPaths:
            found = part.trace(world, pairs, strongest)
            is_short = found.delay * SPEED_OF_LIGHT <= self.max_length
            return found if np.all(is_short) else found.select(is_short)

        return part._replace(trace=trace)

    def _clutter(self, name: str, mechanism: Mechanism) -> Part:
        """A part of many weak paths, limited to ``diffuse_range`` below their pair's strongest."""

        def trace(world: "World", pairs: IntArray, strongest: FloatArray) -> PropagationPaths:
            found = mechanism(world, pairs)
            limit = strongest[found.transmitter, found.receiver] / self.diffuse_range
            return found.select(strength(found, world.scene) >= limit)

        return Part(name, trace)

    def _direct_parts(self) -> Iterator[Part]:
        from polychirp.channel.direct.occluded import visible_line_of_sight, visible_point_echoes

        sight = _part("line of sight", visible_line_of_sight, "direct")
        if self.diffraction:
            from polychirp.channel.diffraction.paths import LONGEST_INTERVAL, diffracted_paths

            yield sight._replace(longest=LONGEST_INTERVAL)
            edges = _part("diffraction", diffracted_paths, "direct")
            yield edges._replace(longest=LONGEST_INTERVAL)
        else:
            yield sight
        yield _part("points", visible_point_echoes)

    def _moving_parts(self, world: "World") -> Iterator[Part]:
        from polychirp.channel.direct.moving_parts import articulated_actors, visible_part_echoes

        for actor in articulated_actors(world.scene):
            name = world.scene.actors[actor].name
            yield _part(f"parts of {name}", partial(visible_part_echoes, actor=actor))

    def _mirror_parts(self, world: "World") -> Iterator[Part]:
        if not self.reflecting_planes:
            return
        from polychirp.channel.specular.double_plates import corner_paths
        from polychirp.channel.specular.plates import mirror_paths

        mirrors = _part("mirrors", mirror_paths, "mirrors")
        if self.diffraction:
            from polychirp.channel.diffraction.mirrored_paths import diffracted_mirror_paths
            from polychirp.channel.diffraction.paths import LONGEST_INTERVAL

            yield mirrors._replace(longest=LONGEST_INTERVAL)
            # a part for each actor: edges about the road matter more often than those about walls
            for actor in np.unique(world.plates.actor).tolist():
                trace = partial(diffracted_mirror_paths, actor=actor)
                name = f"edges in mirrors of {world.scene.actors[actor].name}"
                yield Part(name, trace, "mirrors", LONGEST_INTERVAL)
        else:
            yield mirrors
        yield _part("corners", corner_paths)

    def _body_parts(self, world: "World") -> Iterator[Part]:
        from polychirp.channel.bent_echoes.paths import bent_echoes
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
            if self.diffraction:
                bent = partial(bent_echoes, body=body)
                yield Part(f"bent waves at {name}", bent, name)

    def _bounce_parts(self, world: "World") -> Iterator[Part]:
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
            yield Part(f"bounces from {name}", trace, name)

    def trace(self, scene: Scene) -> PropagationPaths:
        """Every path between the radars of ``scene``, at its time.

        `InputError` is raised if a surface is of an unknown material.
        """
        world, pairs = self.prepare(scene), all_pairs(scene, max_length=self.max_length)
        num_radars = len(scene.radars)
        strongest = np.zeros((num_radars, num_radars))
        tables = [no_paths(scene, self.carrier)]
        for part in self.parts(world):
            found = part.trace(world, pairs, strongest)
            strongest = np.maximum(
                strongest, strongest_of_pair(found, strength(found, scene), num_radars)
            )
            tables.append(found)
        return without_weak(gather(tables), scene, self.dynamic_range)


def _part(name: str, mechanism: Mechanism, whole: str = "") -> Part:
    """A part whose paths are traced without regard to the strongest path found so far."""
    return Part(name, lambda world, pairs, _: mechanism(world, pairs), whole)
