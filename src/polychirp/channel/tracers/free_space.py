"""`FreeSpace` — the exact reference: line of sight and point scatterers in an empty world."""

from dataclasses import dataclass
from typing import Literal

from polychirp.channel.base import Capability, all_pairs, gather
from polychirp.channel.direct.line_of_sight import line_of_sight
from polychirp.channel.direct.point_scatterers import point_echoes
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene
from polychirp.spec import Spec
from polychirp.units import Hertz


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeSpace(Spec):
    """A world without surfaces, in which radars see each other and every point scatterer.

    Powers are those of Friis and of the radar equation; delays are exact for bodies in linear
    motion. Every other tracer must agree with this one if there are no obstacles.

    Parameters
    ----------
    frequency : Hz, at which amplitudes are evaluated

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

    frequency: Hertz = 79e9
    kind: Literal["free-space"] = "free-space"

    @property
    def capabilities(self) -> frozenset[Capability]:
        """Mechanisms that the tracer has."""
        return frozenset({"line-of-sight", "points"})

    def trace(self, scene: Scene) -> PropagationPaths:
        """Every path between the radars of ``scene``, at its time."""
        pairs = all_pairs(scene)
        return gather(
            [
                line_of_sight(scene, frequency=self.frequency, pairs=pairs),
                point_echoes(scene, frequency=self.frequency, pairs=pairs),
            ]
        )
