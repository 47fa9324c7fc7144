"""`Placement`: where a radar and the boxes around its targets are in the world."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import Axes, FloatArray, Sealed, Vector
from polychirp.frames import rotation, rotation_angles
from polychirp.model.scene import Actor, Scene

Angles = Annotated[FloatArray, Axes("angle")]
"""Yaw, pitch and roll, rad, as in `Pose`: positive to the left, nose up, right side down."""

PerBodyVector = Annotated[FloatArray, Axes("body", "3")]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placement(Sealed):
    """Poses of a radar, of its vehicle and of its targets at one instant, in the world.

    Boxes are parallel to the axes of their bodies. The box of a vehicle begins at the ground and
    leaves out mirrors. A tractor and its trailer have one box, along the axes of the tractor.

    A `VictimResult` has it.

    Parameters
    ----------
    time : instant of all values, s
    name : names of the bodies, ``(body,)``: the targets in their order, then the radar's vehicle
        unless it is a target
    carrier : number of the radar's vehicle among the bodies
    radar_position : of the phase centre, m, ``(xyz,)``
    radar_orientation : yaw, pitch and roll of the radar's frame, rad, ``(angle,)``
    rear_axle : middle of the rear axle of the radar's vehicle, m, ``(xyz,)``
    box_centre : m, ``(body, xyz)``
    box_size : length, width and height, m, ``(body, xyz)``
    box_orientation : yaw, pitch and roll, rad, ``(body, angle)``
    velocity : of the bodies at the centres of their boxes, m/s, ``(body, xyz)``
    """

    time: float
    name: tuple[str, ...]
    carrier: int
    radar_position: Vector
    radar_orientation: Angles
    rear_axle: Vector
    box_centre: PerBodyVector
    box_size: PerBodyVector
    box_orientation: Annotated[FloatArray, Axes("body", "angle")]
    velocity: PerBodyVector

    @property
    def mount_position(self) -> FloatArray:
        """Place of the radar from the middle of its vehicle's rear axle, along the vehicle's axes.

        m, ``(xyz,)``: forward, left and up.
        """
        offset = self.radar_position - self.rear_axle
        return np.asarray(offset @ self._vehicle_rotation)

    @property
    def mount_orientation(self) -> FloatArray:
        """Yaw, pitch and roll of the radar's frame in its vehicle's, rad, ``(angle,)``."""
        turned = self._vehicle_rotation.T @ rotation(*self.radar_orientation.tolist())
        return rotation_angles(turned)

    @property
    def centre_to_rear_axle(self) -> FloatArray:
        """Way from the centre of the vehicle's box to its rear axle, along the vehicle's axes.

        m, ``(xyz,)``.
        """
        return np.asarray((self.rear_axle - self.box_centre[self.carrier]) @ self._vehicle_rotation)

    @property
    def _vehicle_rotation(self) -> FloatArray:
        return rotation(*self.box_orientation[self.carrier].tolist())


def placement(scene: Scene, receiver: int, targets: Sequence[str]) -> Placement:
    """Placement of a radar, by its number, and of targets, by name, at the time of the scene."""
    vehicle = scene.actors[scene.carriers[receiver]].whole
    names = tuple(dict.fromkeys((*targets, vehicle)))
    whole = [next(actor for actor in scene.actors if actor.name == name) for name in names]
    low, high = np.moveaxis(np.array([_box(scene, actor) for actor in whole]), 1, 0)
    middle = 0.5 * (low + high)
    centre = np.array([one.pose.to_outer(at) for one, at in zip(whole, middle, strict=True)])
    carrier = names.index(vehicle)
    return Placement(
        time=scene.time,
        name=names,
        carrier=carrier,
        radar_position=scene.radar_position[receiver],
        radar_orientation=rotation_angles(scene.radar_rotation[receiver]),
        rear_axle=whole[carrier].pose.to_outer(np.array(whole[carrier].rear_axle)),
        box_centre=centre,
        box_size=high - low,
        box_orientation=np.array([rotation_angles(one.pose.rotation) for one in whole]),
        velocity=np.array([one.velocity_at(at) for one, at in zip(whole, centre, strict=True)]),
    )


def _box(scene: Scene, whole: Actor) -> tuple[FloatArray, FloatArray]:
    """Least and greatest coordinates of a body and of its parts in its frame, m, ``(xyz,)``."""
    points = np.concatenate(
        [
            whole.pose.to_inner(part.pose.to_outer(_extremes(part, scene.time)))
            for part in scene.parts_of(whole.name)
        ]
    )
    if not len(points):  # a carrier may be a frame alone
        return np.zeros(3), np.zeros(3)
    low, high = points.min(axis=0), points.max(axis=0)
    if whole.kind == "vehicle":
        low[2] = min(low[2], 0.0)
    return low, high


def _extremes(actor: Actor, time: float) -> FloatArray:
    """Points of a body, among them its outermost ones, in its frame, m, ``(point, xyz)``."""
    mesh = actor.mesh
    is_mirror = np.array(["mirror" in part for part in mesh.parts], dtype=np.bool_)
    is_counted = ~is_mirror[mesh.part] if actor.kind == "vehicle" else np.full(mesh.num_faces, True)
    is_corner = np.zeros(len(mesh.vertex), dtype=np.bool_)
    is_corner[mesh.face[is_counted]] = True
    points = [
        mesh.vertex[is_corner],
        *(plate.triangles.reshape(-1, 3) for plate in actor.plates),
        *(np.array([point.position]) for point in actor.points),
    ]
    if actor.movement is not None:
        parts = actor.movement.parts_at(time)
        for centre, reach in (
            (parts.ellipsoids.centre, np.linalg.norm(parts.ellipsoids.axes, axis=1)),
            (parts.rods.centre, np.abs(parts.rods.reach) + parts.rods.radius[:, None]),
        ):
            points += [centre - reach, centre + reach]
    return np.concatenate(points)
