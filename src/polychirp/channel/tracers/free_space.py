"""`FreeSpace`, the reference tracer: lines of sight, points, moving parts, without obstacles."""

from dataclasses import dataclass
from typing import Literal

from polychirp.channel.base import AtFrequency, Capability, all_pairs, gather
from polychirp.channel.direct.line_of_sight import line_of_sight
from polychirp.channel.direct.moving_parts import articulated_actors, part_echoes
from polychirp.channel.direct.point_scatterers import point_echoes
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene
from polychirp.spec import Spec
from polychirp.units import Hertz


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeSpace(AtFrequency, Spec):
    """A world without surfaces, in which radars see each other and every point scatterer.

    They also see moving parts that the same body does not hide.

    The powers follow from the Friis formula and the radar equation. The delays are exact for radars
    and points that move at constant velocity. Other tracers must give the same without obstacles.

    Parameters
    ----------
    frequency : Hz, at which the amplitudes of all paths are evaluated; None: at that of
        the study's radars (`study.spec.tracer_of`), and at 79 GHz without a study

    Examples
    --------
    >>> from polychirp.model.radar import Radar
    >>> from polychirp.model.scene import Actor, PointScatterer, Scene
    >>> car = Actor(name="car", kind="vehicle")
    >>> target = Actor(name="target", kind="object", velocity=(-8.0, 0.0, 0.0),
    ...     points=(PointScatterer(position=(10.0, 0.0, 0.0), rcs=1.0),))
    >>> paths = FreeSpace().trace(
    ...     Scene(time=0.0, actors=(car, target), radars=(Radar(name="r"),), carriers=(0,)))
    >>> round(float(-79e9 * paths.delay_rate[0]), 2)
    4216.25
    """

    frequency: Hertz | None = None
    kind: Literal["free-space"] = "free-space"

    @property
    def capabilities(self) -> frozenset[Capability]:
        """Propagation mechanisms that the tracer computes."""
        return frozenset({"line-of-sight", "points"})

    def trace(self, scene: Scene) -> PropagationPaths:
        """Direct paths between the radars of ``scene``, and echoes of its points, at its time."""
        pairs = all_pairs(scene)
        moving = [
            part_echoes(scene, actor, frequency=self.carrier, pairs=pairs)
            for actor in articulated_actors(scene)
        ]
        return gather(
            [
                line_of_sight(scene, frequency=self.carrier, pairs=pairs),
                point_echoes(scene, frequency=self.carrier, pairs=pairs),
                *moving,
            ]
        )
