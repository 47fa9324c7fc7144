"""A scene as coloured triangles in the world, for both pictures of the street."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.model.scene import Actor, Scene

Colour = tuple[float, float, float]
"""Red, green and blue screen values, 0 to 1."""

MATERIAL_COLOUR: Final[dict[str, Colour]] = {
    "asphalt": (0.36, 0.37, 0.39),
    "brick": (0.66, 0.36, 0.27),
    "concrete": (0.70, 0.69, 0.66),
    "glass": (0.16, 0.23, 0.30),
    "leaf": (0.30, 0.50, 0.22),
    "metal": (0.72, 0.74, 0.77),
    "plastic": (0.20, 0.21, 0.23),
    "rubber": (0.10, 0.10, 0.11),
    "wood": (0.42, 0.30, 0.20),
}
OTHER_COLOUR: Final[Colour] = (0.6, 0.6, 0.6)
"""Colour of a material that `MATERIAL_COLOUR` lacks; all are chosen by eye."""

RADAR_PAINT: Final[tuple[Colour, ...]] = (
    (0.00, 0.45, 0.70),
    (0.84, 0.37, 0.00),
    (0.00, 0.62, 0.45),
    (0.80, 0.47, 0.65),
    (0.90, 0.62, 0.00),
    (0.34, 0.71, 0.91),
)
"""Colours of the metal of bodies that carry a radar, in the order of the radars."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surfaces:
    """Triangles of all actors.

    Parameters
    ----------
    corners : m, ``(face, corner, xyz)`` in the world
    colour : ``(face, rgb)``
    actor : number of the actor, ``(face,)``
    material : name of the material of every face
    """

    corners: FloatArray
    colour: FloatArray
    actor: IntArray
    material: tuple[str, ...]

    @property
    def normal(self) -> FloatArray:
        """Unit normals ``(face, xyz)``; zero for a triangle without area."""
        first, second, third = np.moveaxis(self.corners, 1, 0)
        cross = np.cross(second - first, third - first)
        length = np.linalg.norm(cross, axis=1, keepdims=True)
        return np.asarray(cross / np.maximum(length, 1e-30))


def surfaces(scene: Scene) -> Surfaces:
    """Triangles of a scene; every plate becomes two."""
    corners: list[FloatArray] = [np.zeros((0, 3, 3))]
    actor: list[IntArray] = [np.zeros(0, dtype=np.int64)]
    material: list[str] = []
    for number, body in enumerate(scene.actors):
        mesh = body.mesh
        parts = [mesh.corners, *(plate.triangles for plate in body.plates)]
        material += [mesh.materials[index] for index in mesh.material]
        material += [plate.material for plate in body.plates for _ in range(2)]
        local = np.concatenate(parts)
        corners.append(body.pose.to_outer(local))
        actor.append(np.full(local.shape[0], number, dtype=np.int64))
    owner = np.concatenate(actor)
    return Surfaces(
        corners=np.concatenate(corners),
        colour=np.array(
            [_paint(scene, int(a), m) for a, m in zip(owner, material, strict=True)]
        ).reshape(-1, 3),
        actor=owner,
        material=tuple(material),
    )


def radar_paint(radar: int) -> Colour:
    """Colour that stands for a radar and for the body that carries it."""
    return RADAR_PAINT[radar % len(RADAR_PAINT)]


def extent(actor: Actor) -> tuple[FloatArray, FloatArray]:
    """Corners of an actor's bounding box in the world, m ``(xyz,)``; its position if empty."""
    points = [actor.mesh.vertex, *(plate.triangles.reshape(-1, 3) for plate in actor.plates)]
    points += [np.array([scatterer.position]) for scatterer in actor.points]
    world = actor.pose.to_outer(np.concatenate(points))
    if world.shape[0] == 0:
        world = actor.pose.position[None, :]
    return world.min(axis=0), world.max(axis=0)


def _paint(scene: Scene, actor: int, material: str) -> Colour:
    if material == "metal" and actor in scene.carriers:
        return radar_paint(scene.carriers.index(actor))
    return MATERIAL_COLOUR.get(material, OTHER_COLOUR)
