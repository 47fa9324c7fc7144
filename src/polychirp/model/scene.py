"""`Scene`: bodies and radars at one time, with their velocities."""

from dataclasses import dataclass, field, replace
from typing import Literal, Self

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.mesh import EMPTY_MESH, Mesh, Plate
from polychirp.model.moving_parts import Movement
from polychirp.model.radar import Radar

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
    that ``movement`` moves in its frame. ``velocity`` is in m/s, ``(x, y, z)`` in the world. The
    frame of a body does not rotate within a radar's frame of ramps; moving parts may.

    A `Scene` has a tuple of them.
    """

    name: str
    kind: ActorKind
    pose: Pose = field(default_factory=Pose)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mesh: Mesh = EMPTY_MESH
    plates: tuple[Plate, ...] = ()
    points: tuple[PointScatterer, ...] = ()
    movement: Movement | None = None

    def at(self, elapsed: float) -> Self:
        """The actor after it has moved along its velocity for ``elapsed`` seconds."""
        vx, vy, vz = self.velocity
        return replace(
            self,
            pose=replace(
                self.pose,
                x=self.pose.x + vx * elapsed,
                y=self.pose.y + vy * elapsed,
                z=self.pose.z + vz * elapsed,
            ),
        )


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

    def at(self, time: float) -> Self:
        """The same scene at another time, with every body moved along its velocity."""
        elapsed = time - self.time
        return replace(self, time=time, actors=tuple(a.at(elapsed) for a in self.actors))

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
        return np.array([self.actors[c].velocity for c in self.carriers]).reshape(-1, 3)

    @property
    def radar_rotation(self) -> FloatArray:
        """Matrices that turn each radar's frame into the world's, ``(radar, xyz, xyz)``."""
        turns = [
            self.actors[carrier].pose.rotation @ radar.mount.rotation
            for radar, carrier in zip(self.radars, self.carriers, strict=True)
        ]
        return np.array(turns).reshape(-1, 3, 3)
