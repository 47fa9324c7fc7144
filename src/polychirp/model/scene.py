"""`Scene`: bodies and radars at one time, with their velocities."""

from dataclasses import dataclass, field, replace
from typing import Literal, Self

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.errors import InputError
from polychirp.frames import Pose, steady_turn, turned_at_rate
from polychirp.model.mesh import EMPTY_MESH, Mesh, Plate
from polychirp.model.moving_parts import Movement
from polychirp.model.radar import Radar
from polychirp.model.towing import Motion, Towing

ActorKind = Literal["vehicle", "road", "building", "tree", "furniture", "object"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PointScatterer:
    """Isotropic point with radar cross section ``rcs`` (m²) at ``position`` (m, actor's frame)."""

    position: tuple[float, float, float]
    rcs: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Actor:
    """One body: what it consists of in its own frame, its pose and its velocity.

    It consists of ``mesh``, ``plates`` and ``points``, each of which may be empty, and of parts
    that ``movement`` moves in its frame. ``velocity`` is that of the frame's origin in m/s,
    ``(x, y, z)`` in the world. The body turns to the left with ``yaw_rate``, rad/s, and its
    velocity with it: the origin goes round a circle at constant speed. A trailer, which has
    ``towing``, follows its pin instead; it is ``part_of`` the actor of that name, so that both are
    one target. ``rear_axle`` is the middle of a vehicle's rear axle, m, in its frame.
    ``fluctuation`` is the drawn cross section of a fluctuating body, which its points have, over
    its mean.

    A `Scene` has a tuple of them.

    Raises
    ------
    InputError
        A body with plates turns.

    Examples
    --------
    After a quarter of a turn to the left at 10 m/s and π/2 rad/s, a body has gone by the radius,
    10/(π/2) m, along both axes:

    >>> body = Actor(name="car", kind="vehicle", velocity=(10.0, 0.0, 0.0), yaw_rate=np.pi / 2)
    >>> body.at(1.0).pose.position.round(3).tolist()
    [6.366, 6.366, 0.0]
    """

    name: str
    kind: ActorKind
    pose: Pose = field(default_factory=Pose)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_rate: float = 0.0
    mesh: Mesh = EMPTY_MESH
    plates: tuple[Plate, ...] = ()
    points: tuple[PointScatterer, ...] = ()
    movement: Movement | None = None
    towing: Towing | None = None
    part_of: str = ""
    rear_axle: tuple[float, float, float] = (0.0, 0.0, 0.0)
    fluctuation: float = 1.0

    def __post_init__(self) -> None:
        if self.yaw_rate and self.plates:
            raise InputError(
                f"'{self.name}' turns and has plates, which stay as they are; make it of faces, or "
                "leave its yaw_rate at 0"
            )

    @property
    def whole(self) -> str:
        """Name of the actor that this one belongs to: its own, unless it is a part of another."""
        return self.part_of or self.name

    def at(self, elapsed: float) -> Self:
        """The actor after it has moved for ``elapsed`` seconds."""
        if self.towing is not None:
            pose, moving, yaw_rate = self.towing.after(elapsed, self._motion)
        else:
            way, moving = steady_turn(np.array(self.velocity), self.yaw_rate, elapsed)
            yaw_rate = self.yaw_rate
            x, y, z = (self.pose.position + way).tolist()
            pose = replace(self.pose, x=x, y=y, z=z, yaw=self.pose.yaw + yaw_rate * elapsed)
        vx, vy, vz = moving.tolist()
        return replace(self, pose=pose, velocity=(vx, vy, vz), yaw_rate=yaw_rate)

    @property
    def _motion(self) -> Motion:
        return Motion(self.pose, np.array(self.velocity), self.yaw_rate)

    def velocity_at(self, point: FloatArray) -> FloatArray:
        """Velocity of the body's matter at places in the world, m/s and m ``(…, xyz)``."""
        return self.velocity + turned_at_rate(self.yaw_rate, point - self.pose.position)

    def acceleration_at(self, point: FloatArray) -> FloatArray:
        """Acceleration of the body's matter at places in the world, m/s² and m ``(…, xyz)``."""
        steady = turned_at_rate(self.yaw_rate, self.velocity_at(point))
        if self.towing is None:
            return steady
        return steady + self.towing.extra_acceleration(self._motion, point)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scene:
    """Actors and radars at ``time`` (s); ``radars[i]`` is mounted on ``actors[carriers[i]]``.

    World frame: x along the road, y left, z up.

    `Street.scene` makes it, and a `RayTracer` reads it.
    """

    time: float
    actors: tuple[Actor, ...]
    radars: tuple[Radar, ...] = ()
    carriers: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if len(self.carriers) != len(self.radars):
            raise InputError("a scene needs one carrier for every radar")
        for what, names in (
            ("actor", [a.name for a in self.actors]),
            ("radar", [r.name for r in self.radars]),
        ):
            twice = sorted({n for n in names if names.count(n) > 1})
            if twice:
                raise InputError(f"two {what}s are called '{twice[0]}'; give each its own name")
        known = {actor.name for actor in self.actors}
        for actor in self.actors:
            if actor.whole not in known:
                raise InputError(
                    f"'{actor.name}' is a part of '{actor.part_of}', which is not in the scene; "
                    "add it, or leave part_of empty"
                )

    def at(self, time: float) -> Self:
        """The same scene at another time, with every body moved along its velocity."""
        elapsed = time - self.time
        return replace(self, time=time, actors=tuple(a.at(elapsed) for a in self.actors))

    def motion_at(self, actor: IntArray, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Velocities, m/s, and accelerations, m/s², of actors' matter at places in the world.

        Parameters
        ----------
        actor : number of the actor at each place, ``(place,)``
        point : m, ``(place, xyz)``
        """
        origin = np.array([one.pose.position for one in self.actors]).reshape(-1, 3)[actor]
        yaw_rate = np.array([one.yaw_rate for one in self.actors])[actor]
        velocity = np.array([one.velocity for one in self.actors]).reshape(-1, 3)[actor]
        velocity = velocity + turned_at_rate(yaw_rate, point - origin)
        acceleration = turned_at_rate(yaw_rate, velocity)
        for number in self.towed:
            mine = actor == number
            acceleration[mine] = self.actors[number].acceleration_at(point[mine])
        return velocity, acceleration

    @property
    def towed(self) -> tuple[int, ...]:
        """Numbers of the actors that follow another by a pin."""
        return tuple(n for n, actor in enumerate(self.actors) if actor.towing is not None)

    def parts_of(self, name: str) -> tuple[Actor, ...]:
        """The actor called ``name`` and those that are parts of it."""
        return tuple(actor for actor in self.actors if actor.whole == name)

    def radar_index(self, name: str) -> int:
        """Index in ``radars`` of the radar called ``name``."""
        return [r.name for r in self.radars].index(name)

    @property
    def radar_position(self) -> FloatArray:
        """Positions of the radars in the world, m, ``(radar, xyz)``."""
        points = [
            self.actors[carrier].pose.to_outer(radar.mount.position)
            for radar, carrier in zip(self.radars, self.carriers, strict=True)
        ]
        return np.array(points).reshape(-1, 3)

    @property
    def radar_velocity(self) -> FloatArray:
        """Velocities of the radars in the world, m/s, ``(radar, xyz)``."""
        speeds = [
            self.actors[carrier].velocity_at(place)
            for place, carrier in zip(self.radar_position, self.carriers, strict=True)
        ]
        return np.array(speeds).reshape(-1, 3)

    @property
    def radar_acceleration(self) -> FloatArray:
        """Accelerations of the radars, whose vehicles may turn, m/s², ``(radar, xyz)``."""
        return self.motion_at(np.array(self.carriers, dtype=np.int64), self.radar_position)[1]

    @property
    def radar_yaw_rate(self) -> FloatArray:
        """Yaw rates of the radars, rad/s, ``(radar,)``."""
        return np.array([self.actors[c].yaw_rate for c in self.carriers], dtype=np.float64)

    @property
    def radar_rotation(self) -> FloatArray:
        """Matrices that turn each radar's frame into the world's, ``(radar, xyz, xyz)``."""
        turns = [
            self.actors[carrier].pose.rotation @ radar.mount.rotation
            for radar, carrier in zip(self.radars, self.carriers, strict=True)
        ]
        return np.array(turns).reshape(-1, 3, 3)
