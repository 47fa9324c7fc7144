"""`Composite` — the default tracer: every mechanism answers for its own kind of path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from polychirp.channel.base import Capability, all_pairs, gather, without_weak
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

    Mechanism = Callable[[World, IntArray], PropagationPaths]


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

    @property
    def mechanisms(self) -> tuple[Mechanism, ...]:
        """Functions from a world and its (transmitter, receiver) pairs to a table of paths.

        Whatever comes later (tubes, diffraction, transmission, diffuse) is one more of them.
        """
        from polychirp.channel.facets import facet_echoes, mirrored_facet_echoes
        from polychirp.channel.planes import mirror_paths
        from polychirp.channel.sight import visible_line_of_sight, visible_point_echoes

        if self.reflecting_planes:
            return (
                visible_line_of_sight,
                visible_point_echoes,
                mirror_paths,
                mirrored_facet_echoes,
            )
        return visible_line_of_sight, visible_point_echoes, facet_echoes

    def trace(self, scene: Scene) -> PropagationPaths:
        """Every path between the radars of ``scene``, at its time.

        Raises
        ------
        InputError
            A surface is of an unknown material.
        """
        world, pairs = self.prepare(scene), all_pairs(scene)
        tables = [mechanism(world, pairs) for mechanism in self.mechanisms]
        return without_weak(gather(tables), scene, self.dynamic_range)
