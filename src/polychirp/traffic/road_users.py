"""Road users whose parts move: `Pedestrian`, `Bicycle` and `Motorcycle`."""

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.moving_parts import Movement, MovingParts
from polychirp.model.scene import Actor
from polychirp.spec import Spec
from polychirp.traffic.articulated_bodies.gait import GREATEST_RELATIVE_SPEED, STANDING, Gait
from polychirp.traffic.articulated_bodies.person import leg_length, person
from polychirp.traffic.articulated_bodies.two_wheelers import BicycleRide, MotorcycleRide
from polychirp.units import Between, Metres, MetresPerSecond, Radians, RadiansPerSecond, Unit

GREATEST_CYCLING_SPEED: Final = 25.0
"""Greatest speed of a bicycle, m/s; chosen above that of races."""

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
class _RoadUser(Spec):
    """A body that moves along ``heading`` at time 0, with its middle at (x, y)."""

    name: str
    x: Metres
    y: Metres
    heading: Radians = 0.0
    speed: MetresPerSecond = 0.0
    yaw_rate: RadiansPerSecond = 0.0

    @property
    def velocity(self) -> tuple[float, float, float]:
        """Velocity at time 0 in the world, m/s, ``(x, y, z)``; of a walker, its mean."""
        return self.speed * math.cos(self.heading), self.speed * math.sin(self.heading), 0.0

    @property
    def movement(self) -> Movement:
        """The parts of the body as they move in its own frame."""
        raise NotImplementedError

    def footprint(self) -> tuple[str, FloatArray]:
        """Name, and corners ``(4, xy)``, m, of the rectangle around the body at time 0."""
        parts = self.movement.parts_at(0.0)
        solids, rods = parts.ellipsoids, parts.rods
        centre = np.concatenate([solids.centre, rods.centre])
        half = np.concatenate(
            [np.linalg.norm(solids.axes, axis=1), np.abs(rods.reach) + rods.radius[:, None]]
        )
        rear, right, _ = (centre - half).min(axis=0)
        front, left, _ = (centre + half).max(axis=0)
        corners = np.array([[rear, right, 0], [front, right, 0], [front, left, 0], [rear, left, 0]])
        return self.name, Pose(x=self.x, y=self.y, yaw=self.heading).to_outer(corners)[:, :2]

    def actor(self) -> Actor:
        """The body with the movement of its parts."""
        return Actor(
            name=self.name,
            kind="object",
            pose=Pose(x=self.x, y=self.y, yaw=self.heading),
            velocity=self.velocity,
            yaw_rate=self.yaw_rate,
            movement=self.movement,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Pedestrian(_RoadUser):
    """A person who walks along ``heading``, or stands; the middle is at (x, y) at time 0.

    Trunk, head and limbs are ellipsoids of skin that move as in the walking model of Boulic
    and the Thalmanns (`articulated_bodies.gait`), so that the echo has micro-Doppler lines.

    Parameters
    ----------
    yaw_rate : rad/s to the left; at 0 the person walks straight on, else round a circle
    height : m; 1.75 m is an adult, 1.15 m a child of six years, with an adult's proportions
    phase : share of the cycle of two steps at time 0; at 0 the right heel strikes

    Examples
    --------
    >>> walker = Pedestrian(name="walker", x=12.0, y=2.0, heading=math.pi, speed=1.4)
    >>> parts = walker.actor().movement.parts_at(0.0)
    >>> len(parts.ellipsoids.centre)
    13
    """

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
    def movement(self) -> Walk:
        """The limbs as they walk."""
        return Walk(height=self.height, speed=self.speed, phase=self.phase)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bicycle(_RoadUser):
    """A bicycle with its rider, who pedals along ``heading``; its middle is at (x, y) at time 0.

    Frame, rims and spokes are metal; spokes turn with the wheels and flash when they are seen from
    across, so that the echo covers range rates from 0 to twice the speed.

    Parameters
    ----------
    yaw_rate : rad/s to the left; the middle goes round a circle, and the bicycle stays upright
    num_spokes : of each wheel
    development : way for one turn of the cranks, m
    phase : share of a wheel's turn at time 0

    Examples
    --------
    >>> ride = Bicycle(name="bike", x=12.0, y=2.0, heading=math.pi, speed=5.0).actor().movement
    >>> [len(part.centre) for part in (ride.parts_at(0.0).ellipsoids, ride.parts_at(0.0).rods)]
    [13, 1056]
    """

    num_spokes: Annotated[int, Between(least=8, greatest=72)] = 32
    development: Annotated[float, Unit("m", least="1 m", greatest="15 m")] = 5.6
    phase: Phase = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.speed <= GREATEST_CYCLING_SPEED:
            raise InputError(
                f"bicycle '{self.name}' rides at {self.speed:.3g} m/s; use 0 m/s to "
                f"{GREATEST_CYCLING_SPEED:g} m/s"
            )

    @property
    def movement(self) -> BicycleRide:
        """Frame, wheels and rider."""
        return BicycleRide(
            speed=self.speed,
            num_spokes=self.num_spokes,
            development=self.development,
            phase=self.phase,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Motorcycle(_RoadUser):
    """A motorcycle with its rider, who rides along ``heading``; its middle is at (x, y) at time 0.

    Parameters
    ----------
    yaw_rate : rad/s to the left; the middle goes round a circle, and the motorcycle stays upright
    phase : share of a wheel's turn at time 0

    Examples
    --------
    >>> Motorcycle(name="m", x=30.0, y=2.0, heading=math.pi, speed=14.0).velocity[0]
    -14.0
    """

    phase: Phase = 0.0

    def __post_init__(self) -> None:
        if self.speed < 0:
            raise InputError(f"motorcycle '{self.name}' rides backwards; use 0 m/s or more")

    @property
    def movement(self) -> MotorcycleRide:
        """Body, wheels and rider."""
        return MotorcycleRide(speed=self.speed, phase=self.phase)


RoadUser = Pedestrian | Bicycle | Motorcycle
"""A body of a street whose parts move."""
