"""Road users whose parts move: `Pedestrian`."""

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated

import numpy as np

from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.moving_parts import MovingParts
from polychirp.model.scene import Actor
from polychirp.spec import Spec
from polychirp.traffic.gait import GREATEST_RELATIVE_SPEED, STANDING, Gait
from polychirp.traffic.person import leg_length, person
from polychirp.units import Between, Metres, MetresPerSecond, Radians, Unit

BodyHeight = Annotated[float, Unit("m", least="0.7 m", greatest="2.3 m")]
"""Height of a person, m."""

Phase = Annotated[float, Between(least=0.0, greatest=1.0)]
"""Share of a cycle that has passed at time 0."""


@dataclass(frozen=True, kw_only=True)
class Walk:
    """Movement of a walking or standing person; see `Pedestrian`."""

    height: float
    speed: float
    phase: float

    def parts_at(self, time: float) -> MovingParts:
        """Ellipsoids of the person at a time, s; the lowest point of a cycle is on the ground."""
        if self.speed == 0:
            return MovingParts(ellipsoids=person(STANDING, height=self.height))
        gait = self._gait()
        joints = gait.joints(self.phase + time / gait.period)
        solids = person(joints, height=self.height)
        centre = solids.centre + np.array([0.0, 0.0, _lift(self.height, self.speed)])
        return MovingParts(ellipsoids=replace(solids, centre=centre))

    def _gait(self) -> Gait:
        leg = leg_length(self.height)
        return Gait(relative_speed=self.speed / leg, leg=leg)


@cache
def _lift(height: float, speed: float) -> float:
    """Height by which a walker of the model is raised to have no foot in the ground, m."""
    gait = Walk(height=height, speed=speed, phase=0.0)._gait()
    cycle = [person(gait.joints(phase), height=height) for phase in np.linspace(0.0, 1.0, 64)]
    lowest = [one.centre[:, 2] - np.linalg.norm(one.axes[:, :, 2], axis=1) for one in cycle]
    return -float(np.min(lowest))


@dataclass(frozen=True, slots=True, kw_only=True)
class Pedestrian(Spec):
    """A person who walks straight along ``heading``, or stands; the middle is at (x, y).

    Trunk, head and limbs are ellipsoids of skin that move as in the walking model of Boulic
    and the Thalmanns (`traffic.gait`), so that the echo has micro-Doppler lines.

    Parameters
    ----------
    height : m; 1.75 m is an adult, 1.15 m a child of six years, with an adult's proportions
    phase : share of the cycle of two steps at time 0; at 0 the right heel strikes

    Examples
    --------
    >>> walker = Pedestrian(name="walker", x=12.0, y=2.0, heading=math.pi, speed=1.4)
    >>> parts = walker.actor().movement.parts_at(0.0)
    >>> len(parts.ellipsoids.centre)
    13
    """

    name: str
    x: Metres
    y: Metres
    heading: Radians = 0.0
    speed: MetresPerSecond = 0.0
    height: BodyHeight = 1.75
    phase: Phase = 0.0

    def __post_init__(self) -> None:
        fastest = GREATEST_RELATIVE_SPEED * leg_length(self.height)
        if not 0 <= self.speed <= fastest:
            raise InputError(
                f"pedestrian '{self.name}' walks at {self.speed:.3g} m/s; use 0 m/s to "
                f"{fastest:.2g} m/s for a height of {self.height:.3g} m, since nobody runs here"
            )

    @property
    def velocity(self) -> tuple[float, float, float]:
        """Mean velocity in the world, m/s, ``(x, y, z)``."""
        along, across = math.cos(self.heading), math.sin(self.heading)
        return self.speed * along, self.speed * across, 0.0

    def actor(self) -> Actor:
        """The person with the movement of the limbs."""
        return Actor(
            name=self.name,
            kind="object",
            pose=Pose(x=self.x, y=self.y, yaw=self.heading),
            velocity=self.velocity,
            movement=Walk(height=self.height, speed=self.speed, phase=self.phase),
        )
