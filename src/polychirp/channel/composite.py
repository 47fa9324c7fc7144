"""`Composite` — the default tracer: every mechanism answers for its own kind of path."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Literal

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
from polychirp.channel.materials import material_table
from polychirp.errors import InputError
from polychirp.frames import Spec
from polychirp.model.material import Material
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene
from polychirp.units import Hertz, Ratio, from_db

if TYPE_CHECKING:
    from collections.abc import Callable

    from polychirp.axes import IntArray
    from polychirp.channel.world import World


@dataclass(frozen=True, kw_only=True)
class NamedMaterial(Material):
    """A study's own material, or its own value of a known one."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Composite(Spec):
    """Line of sight, point scatterers, mirrors in road and walls, and facets of vehicles.

    Single bounce: what one body scatters, with at most one mirror on each leg. Surfaces block;
    thin sheets that let most of the power through (bumpers) do not. Diffraction, transmission
    loss, multiple bounces between bodies and diffuse scattering are left out.

    A snapshot of one scene after another is cheap: meshes are prepared once, and kept.

    Parameters
    ----------
    frequency : Hz, at which amplitudes and materials are evaluated
    dynamic_range : ratio by which a path may be weaker than the strongest of its transmitter and
        receiver, as their antennas' elements see it
    reflecting_planes : whether road and walls mirror; they block in any case
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
    materials: tuple[NamedMaterial, ...] = ()
    kind: Literal["composite"] = "composite"

    def __post_init__(self) -> None:
        if not self.frequency > 0:
            raise InputError("a tracer needs a positive frequency")
        if not self.dynamic_range >= 1:
            raise InputError("a tracer's dynamic range must be at least 0 dB")

    @property
    def capabilities(self) -> frozenset[Capability]:
        """Which mechanisms the tracer has."""
        found: set[Capability] = {"line-of-sight", "occlusion", "points", "facets"}
        if self.reflecting_planes:
            found.add("planes")
        return frozenset(found)

    def prepare(self, scene: Scene) -> World:
        """The scene made ready, as `trace` makes it; meshes met before are not prepared again.

        Raises
        ------
        InputError
            A surface is of an unknown material.
        """
        from polychirp.channel.world import world_of

        return world_of(
            scene,
            frequency=self.frequency,
            dynamic_range=self.dynamic_range,
            table=material_table({row.name: row for row in self.materials}),
        )

    def parts(self, world: World) -> tuple[Part, ...]:
        """What the tracer traces, from the surest to the least: one entry for every mechanism.

        Bodies have one each, so that what passes by closely can be renewed more often than the
        rest. A new mechanism is one more part.
        """
        from polychirp.channel.facets import facet_echoes, scattering_bodies
        from polychirp.channel.planes import mirror_paths
        from polychirp.channel.sight import visible_line_of_sight, visible_point_echoes

        names = [world.scene.actors[actor].name for actor in world.body]
        return (
            _part("line of sight", visible_line_of_sight),
            _part("points", visible_point_echoes),
            *([_part("mirrors", mirror_paths)] if self.reflecting_planes else []),
            *(
                Part(
                    f"facets of {names[body]}",
                    partial(facet_echoes, body=body, mirrors=self.reflecting_planes),
                )
                for body in scattering_bodies(world)
            ),
        )

    def trace(self, scene: Scene) -> PropagationPaths:
        """Every path between the radars of ``scene``, at its time.

        Raises
        ------
        InputError
            A surface is of an unknown material.
        """
        world, pairs = self.prepare(scene), all_pairs(scene)
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


def _part(name: str, mechanism: Callable[[World, IntArray], PropagationPaths]) -> Part:
    """A part that is traced whatever else there is."""
    return Part(name, lambda world, pairs, _: mechanism(world, pairs))
