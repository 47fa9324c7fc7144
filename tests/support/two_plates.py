"""Drawn pairs of plates that turn a wave from one radar to another by two bounces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.channel.ray_tubes.paths import tube_paths
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, plate, transfer_at
from tests.support.references.two_steps import Rectangle

TRACER = Composite(dynamic_range=1e20)
"""Tracer that leaves out no path."""

WAVELENGTH = SPEED_OF_LIGHT / 79e9
MOST_ZONES = 8.0
"""Greatest product of both plates' sides over their distance and the wavelength."""


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

    def traced(self, frequency: float, others: Sequence[Actor] = ()) -> ComplexArray:
        """Transfer ``(receiving, transmitting)`` over the first plate, then the last.

        ``others`` are bodies around the plates.
        """
        actors = [
            Actor(name=name, kind="object", mesh=mesh_of(plate(side, 0.05)), pose=pose)
            for name, side, pose in zip(("first", "last"), self.side, self.pose, strict=True)
        ]
        world = TRACER.prepare(around([*actors, *others], [self.transmitter, self.receiver]))
        found = tube_paths(world, np.array([[0, 1], [1, 0]]), max_bounces=2)
        mine = found.select((found.transmitter == 0) & (found.receiver == 1))
        start = mine.bounce_start[:-1]
        first, last = mine.bounce_actor[start], mine.bounce_actor[start + 1]
        return transfer_at(mine.select((first == 2) & (last == 3)), frequency, 0, 1)


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


def any_plates(count: int, *, seed: int) -> Iterator[tuple[float, TwoPlates]]:
    """Plates of 0.1 to 0.5 m and 0.5 to 6 m apart, and the angle (rad) that one of them is off.

    The radars are 5 to 60 m away, in drawn directions at 10° to 60° to the plates' normals. The
    path over the middles is specular before the first or the last plate is turned by 0° to 5°
    about a drawn axis in its plane. Sizes and distances are log-uniform. Plates are drawn again if
    their sides' product is above `MOST_ZONES`, since the quadrature would take long.
    """
    rng = np.random.default_rng(seed)
    while count > 0:
        one, other = (float(x) for x in np.exp(rng.uniform(*np.log([0.1, 0.5]), 2)))
        gap = float(np.exp(rng.uniform(*np.log([0.5, 6.0]))))
        far = np.exp(rng.uniform(*np.log([5.0, 60.0]), 2))
        way = _unit(rng.normal(size=3) * [1.0, 1.0, 0.3])
        first = np.array([0.0, 0.0, 0.6])
        last = first + gap * way
        normals, ends = [], []
        for place, onward, distance in ((first, way, far[0]), (last, -way, far[1])):
            slant, aside = rng.uniform(*np.radians([10, 60])), rng.normal(size=3)
            aside = _unit(np.cross(onward, aside))
            normal = np.cos(slant) * onward + np.sin(slant) * aside
            normals.append(normal)
            ends.append(place + distance * (2 * (normal @ onward) * normal - onward))
        off, which = rng.uniform(0, np.radians(5)), rng.integers(2)
        aside = _unit(np.cross(normals[which], rng.normal(size=3)))
        normals[which] = _unit(normals[which] + np.tan(off) * aside)
        if one * other / gap > MOST_ZONES * WAVELENGTH:
            continue
        count -= 1
        poses = _facing(first, normals[0]), _facing(last, normals[1])
        yield off, TwoPlates(*ends, (one, other), poses)


def _facing(place: FloatArray, normal: FloatArray) -> Pose:
    """Pose at a place, m, whose x axis is a unit vector."""
    x, y, z = (float(value) for value in place)
    yaw, pitch = float(np.arctan2(normal[1], normal[0])), float(np.arcsin(normal[2]))
    return Pose(x=x, y=y, z=z, yaw=yaw, pitch=pitch)


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector))
