"""Views: one radar as one body sees it, directly or mirrored in one plate.

A path that a body scatters joins two views of the body: the transmitter's and the receiver's.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.channel.materials.fresnel import reflection
from polychirp.channel.scene.world import World, bodies_near, plates_near
from polychirp.jit import inlined


class Radars(NamedTuple):
    """Positions, velocities, accelerations and rotations of radars, arrays ``(radar, …)``."""

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    rotation: FloatArray


@lru_cache(maxsize=2)
def radars_of(world: World) -> Radars:
    """Radars of a world; cached because a scene computes these arrays at every access."""
    scene = world.scene
    return Radars(
        scene.radar_position, scene.radar_velocity, scene.radar_acceleration, scene.radar_rotation
    )


class Unfolded(NamedTuple):
    """Images of a radar that paths with bends seem to come from, ``(path, xyz)``.

    ``image`` m, its ``velocity`` m/s and ``acceleration`` m/s²: the path is as long as the straight
    line from there, now and a little later. ``departure`` is the unit vector at the radar, and
    ``departure_rate`` 1/s its rate; ``bend`` m is the last bend of the path, in the world like all
    of them.
    """

    image: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    departure: FloatArray
    departure_rate: FloatArray
    bend: FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """Radar ``radar`` seen by body ``body``, mirrored in plate ``plate`` if there is one."""

    world: World
    radar: int
    body: int
    plate: int | None = None

    @cached_property
    def source(self) -> FloatArray:
        """Position of the radar in the world, m ``(xyz,)``."""
        return np.asarray(radars_of(self.world).position[self.radar])

    @cached_property
    def image(self) -> FloatArray:
        """Position in the world of the radar or of its mirror image in the plate, m ``(xyz,)``."""
        return self.source if self.plate is None else self._mirror(self.source)

    @cached_property
    def image_velocity(self) -> FloatArray:
        """Velocity of the image in the world, m/s ``(xyz,)``, for a moving plate too."""
        own = radars_of(self.world).velocity[self.radar]
        if self.plate is None:
            return np.asarray(own)
        plates = self.world.plates
        normal = plates.normal[self.plate]
        carried = np.array(self.world.scene.actors[plates.actor[self.plate]].velocity)
        return np.asarray(own - 2 * normal * (normal @ (own - carried)))

    @cached_property
    def image_acceleration(self) -> FloatArray:
        """Acceleration of the image in the world, m/s² ``(xyz,)``; plates have none."""
        own = radars_of(self.world).acceleration[self.radar]
        if self.plate is None:
            return np.asarray(own)
        normal = self.world.plates.normal[self.plate]
        return np.asarray(own - 2 * normal * (normal @ own))

    def unfolded(self, direction: FloatArray) -> Unfolded | None:  # noqa: ARG002
        """Images for paths that arrive along ``direction``; None if all of them are ``image``."""
        return None

    def _mirror(self, point: FloatArray) -> FloatArray:
        normal = self.world.plates.normal[self.plate]
        return np.asarray(
            point - 2 * normal * (normal @ (point - self.world.plates.centre[self.plate]))
        )

    @cached_property
    def distance(self) -> float:
        """Least distance from the image to the body's sphere, m; 0 if the image is inside it."""
        away = np.linalg.norm(self.world.centre[self.body] - self.image)
        return max(0.0, float(away - self.world.radius[self.body]))

    @property
    def slack(self) -> float:
        """Greatest length, m, by which ``distance`` is below that of the shortest path."""
        return 0.0

    @cached_property
    def most_gain(self) -> float:
        """Greatest power gain of the radar's antenna element towards the body's sphere."""
        pattern = self.world.scene.radars[self.radar].array.pattern
        centre, radius = self.world.centre[self.body], float(self.world.radius[self.body])
        if self.plate is not None:
            centre = self._mirror(centre)
        way = (centre - self.source) @ radars_of(self.world).rotation[self.radar]
        length = float(np.linalg.norm(way))
        if length <= radius or way[0] / length >= np.sqrt(1 - (radius / length) ** 2):
            return pattern.peak_gain  # the sphere holds the radar or its boresight
        cube = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
        return float(np.max(pattern.gain(way + radius * cube)))

    @cached_property
    def most_reflection(self) -> float:
        """Greatest magnitude of the plate's reflection over the angles to the body's sphere."""
        if self.plate is None:
            return 1.0
        world, plates = self.world, self.world.plates
        normal = plates.normal[self.plate]
        away = world.centre[self.body] - self.image
        length, radius = float(np.linalg.norm(away)), float(world.radius[self.body])
        least = max(0.0, (away @ normal - radius) / (length + radius))
        most = min(1.0, (away @ normal + radius) / max(length - radius, 1e-9))
        material = world.table[world.materials[plates.medium[self.plate]]]
        both = reflection(material, np.linspace(least, max(least, most), 9), world.frequency)
        return float(np.max(np.abs(both)))

    @property
    def mirrors(self) -> IntArray:
        """Plates with the radar and the body in front of them and, possibly, a mirror point."""
        plates = self.world.plates
        radius = float(self.world.radius[self.body])
        start = self.source - plates.centre
        end = self.world.centre[self.body] - plates.centre
        height, body_height = (np.sum(way * plates.normal, axis=-1) for way in (start, end))
        found = (height > 0) & (body_height + radius > 0)
        # mirror points lie between the projections of radar and body on the plate
        for axis, half in (
            (plates.across, plates.half_across),
            (plates.along, plates.half_along),
        ):
            first, last = (np.sum(way * axis, axis=-1) for way in (start, end))
            found &= np.maximum(first, last + radius) >= -half
            found &= np.minimum(first, last - radius) <= half
        return np.flatnonzero(found)

    @property
    def bending_actor(self) -> int:
        """Number of the actor at whose edge the wave bends; only of views that have one."""
        raise NotImplementedError

    @cached_property
    def between(self) -> tuple[IntArray, IntArray]:
        """Bodies and plates that may hide the body from the view.

        Bodies near the radar come first, because they hide most; the body itself is the last.
        """
        centre, radius = self.world.centre[self.body], float(self.world.radius[self.body])
        ways = [np.array([self.image, centre])]
        if self.plate is not None:  # this way holds the leg before the plate, the first that after
            ways.append(np.array([self.source, self._mirror(centre)]))
        is_between = np.zeros(len(self.world.surfaces), dtype=np.bool_)
        crosses = np.zeros(len(self.world.plates.actor), dtype=np.bool_)
        for way in ways:
            is_between[bodies_near(self.world, way, radius)] = True
            crosses[plates_near(self.world, way, radius)] = True
        if self.plate is not None:
            crosses[self.plate] = False
        bodies = np.flatnonzero(is_between)
        away = np.sum((self.world.centre[bodies] - self.source) ** 2, axis=-1)
        away[bodies == self.body] = np.inf
        return bodies[np.argsort(away, kind="stable")], np.flatnonzero(crosses)

    @cached_property
    def near(self) -> tuple[IntArray, ...]:
        """Numbers of the four kinds of obstacles that `ViewTable.near` distinguishes."""
        bodies, plates = self.between
        is_pane = self.world.plate_is_pane[plates]
        is_veiled = np.zeros(len(self.world.surfaces), dtype=np.bool_)
        is_veiled[self.world.translucent_bodies] = True
        return bodies, plates[~is_pane], plates[is_pane], bodies[is_veiled[bodies]]


NEAR_BODIES, NEAR_PLATES, NEAR_PANES, NEAR_VEILED = 0, 1, 2, 3
"""Columns of `ViewTable.start`: bodies and opaque plates that may hide the body; plates that are
panes, and bodies with panes or clouds, which may weaken the wave."""


class ViewTable(NamedTuple):
    """Views of one body as arrays ``(view, …)`` in the body's frame, for the kernels.

    ``plate`` is a plate's number where ``is_mirrored``, and 0 elsewhere. The obstacles of kind k,
    from `NEAR_BODIES` to `NEAR_VEILED`, that may lie between view i and the body are
    ``near[start[i, k]:start[i, k + 1]]``.
    """

    source: FloatArray
    image: FloatArray
    is_mirrored: BoolArray
    plate: IntArray
    near: IntArray
    start: IntArray

    @property
    def has_sheets(self) -> bool:
        """True if panes or clouds may lie between any view and the body."""
        return bool(np.any(self.start[:, NEAR_PANES] < self.start[:, -1]))

    def select(self, is_kept: BoolArray) -> "ViewTable":
        """Some of the views; mask ``(view,)``."""
        columns = {name: getattr(self, name)[is_kept] for name in self._fields if name != "near"}
        return self._replace(**columns)


def view_table(views: Sequence[View], rotation: FloatArray, position: FloatArray) -> ViewTable:
    """Views of one body in its frame, which is turned by ``rotation`` at ``position`` (m)."""
    near = [numbers for view in views for numbers in view.near]
    start = np.concatenate([[0], np.cumsum([len(numbers) for numbers in near])])
    return ViewTable(
        (np.array([view.source for view in views]) - position) @ rotation,
        (np.array([view.image for view in views]) - position) @ rotation,
        np.array([view.plate is not None for view in views], dtype=np.bool_),
        np.array([view.plate or 0 for view in views], dtype=np.int64),
        np.concatenate(near),
        start[4 * np.arange(len(views))[:, None] + np.arange(5)],
    )


@inlined
def near_view(table: ViewTable, view: int, kind: int) -> IntArray:
    """Numbers of the obstacles of one kind that may lie between a view and its body."""
    return table.near[table.start[view, kind] : table.start[view, kind + 1]]
