"""Drawn pairs of plates that turn a wave from one radar to another by two bounces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.channel.ray_tubes.paths import tube_paths
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, plate, transfer_at
from tests.support.references.two_steps import Rectangle

TRACER = Composite(dynamic_range=1e20)
"""Tracer that leaves out no path."""


class TwoPlates(NamedTuple):
    """Two square plates, their sides (m) and poses, between two radars at places (m)."""

    transmitter: FloatArray
    receiver: FloatArray
    side: tuple[float, float]
    pose: tuple[Pose, Pose]

    @property
    def rectangles(self) -> tuple[Rectangle, Rectangle]:
        """The plates, the first and the last."""
        first, last = (
            Rectangle(
                pose.position,
                pose.rotation @ np.array([0, side / 2, 0]),
                pose.rotation @ np.array([0, 0, side / 2]),
            )
            for side, pose in zip(self.side, self.pose, strict=True)
        )
        return first, last

    @property
    def length(self) -> float:
        """Length of the path over the middles of both plates, m."""
        first, last = (pose.position for pose in self.pose)
        legs = first - self.transmitter, last - first, self.receiver - last
        return float(sum(np.linalg.norm(leg) for leg in legs))

    def traced(self, frequency: float) -> ComplexArray:
        """Transfer ``(receiving, transmitting)`` of tubes over the first plate, then the last."""
        actors = [
            Actor(name=name, kind="object", mesh=mesh_of(plate(side, 0.05)), pose=pose)
            for name, side, pose in zip(("first", "last"), self.side, self.pose, strict=True)
        ]
        world = TRACER.prepare(around(actors, [self.transmitter, self.receiver]))
        found = tube_paths(world, np.array([[0, 1], [1, 0]]), max_bounces=2)
        mine = found.select((found.transmitter == 0) & (found.receiver == 1))
        first = mine.bounce_actor[mine.bounce_start[:-1]]
        return transfer_at(mine.select(first == 2), frequency, 0, 1)


def drawn_plates(count: int, off: float, *, seed: int) -> Iterator[TwoPlates]:
    """Plates of 0.12 to 0.25 m, 1 to 3 m apart, 5 to 12 m ahead of the transmitter.

    Both stand such that the path over their middles is specular; then the last one is turned by
    ``off`` (rad) about a drawn axis in its plane.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        start = np.array([0.0, 0.0, 0.6])
        first = np.array([rng.uniform(5, 12), rng.uniform(1, 4), rng.uniform(0.3, 1.2)])
        way = np.array([rng.uniform(-1, 1), -1, rng.uniform(-0.2, 0.2)])
        last = first + rng.uniform(1, 3) * _unit(way)
        end = np.array([rng.uniform(-3, 3), rng.uniform(-6, -2), 0.7])
        upright = _unit(_unit(start - first) + _unit(last - first))
        turned = _unit(_unit(first - last) + _unit(end - last))
        aside = _unit(np.cross(turned, rng.normal(size=3)))
        side = float(rng.uniform(0.12, 0.25)), float(rng.uniform(0.12, 0.25))
        poses = _facing(first, upright), _facing(last, _unit(turned + np.tan(off) * aside))
        yield TwoPlates(start, end, side, poses)


def _facing(place: FloatArray, normal: FloatArray) -> Pose:
    """Pose at a place, m, whose x axis is a unit vector."""
    x, y, z = (float(value) for value in place)
    yaw, pitch = float(np.arctan2(normal[1], normal[0])), float(np.arcsin(normal[2]))
    return Pose(x=x, y=y, z=z, yaw=yaw, pitch=pitch)


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))
