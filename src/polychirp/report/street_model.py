"""The street as boxes, balls and beams, for the scene that a reader of the page can turn."""

import math
from collections import Counter
from typing import Any, Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.scene import Actor, Scene
from polychirp.report.figures.surfaces import MATERIAL_COLOUR, OTHER_COLOUR, Colour, radar_paint
from polychirp.report.figures.surfaces import surfaces as surfaces_of
from polychirp.report.words import decimal

PAINT: Final[Colour] = (0.72, 0.74, 0.77)
"""Colour of vehicles without a radar: that of metal."""

POINT_SIZE: Final = 0.5
"""Edge of the box of a point that scatters, m; chosen: it can be seen across a street."""


def street_model(scene: Scene) -> dict[str, Any]:
    """The street as values for JSON: lengths in m, angles in rad, colours as #rrggbb.

    Every body is a box in its own frame, which a script places by its position and yaw. Trees are a
    trunk and a ball, and points are small boxes; what a body is made of gives its colour, and
    radars give that of vehicles.
    """
    materials = _commonest_materials(scene)
    return {
        "bodies": [
            _body(scene, number, materials[number])
            for number, actor in enumerate(scene.actors)
            if _corners(actor).size
        ],
        "beams": [_beam(scene, number) for number in range(len(scene.radars))],
    }


def _commonest_materials(scene: Scene) -> list[str]:
    """Material of most faces of every actor; an empty text for an actor without faces."""
    surfaces = surfaces_of(scene)
    counts = [Counter[str]() for _ in scene.actors]
    for number, material in zip(surfaces.actor.tolist(), surfaces.material, strict=True):
        counts[number][material] += 1
    return [count.most_common(1)[0][0] if count else "" for count in counts]


def _body(scene: Scene, number: int, material: str) -> dict[str, Any]:
    actor = scene.actors[number]
    low, high = _corners(actor).min(axis=0), _corners(actor).max(axis=0)
    speed = math.hypot(*actor.velocity[:2]) * 3.6
    return {
        "name": actor.name,
        "kind": actor.kind,
        "low": _metres(low),
        "high": _metres(high),
        "place": _metres([actor.pose.x, actor.pose.y, actor.pose.z]),
        "yaw": round(actor.pose.yaw, 4),
        "speed": decimal(speed, 0),
        "colour": _hex(_colour(scene, number, material)),
    }


def _corners(actor: Actor) -> FloatArray:
    """All corners of an actor and of boxes around its points, in its own frame, m: ``(n, xyz)``."""
    plates = [plate.triangles.reshape(-1, 3) for plate in actor.plates]
    ends = 0.5 * POINT_SIZE * np.array([[-1.0], [1.0]])
    points = [np.array(point.position) + ends for point in actor.points]
    return np.concatenate([actor.mesh.vertex.reshape(-1, 3), *plates, *points])


def _colour(scene: Scene, number: int, material: str) -> Colour:
    if number in scene.carriers:
        return radar_paint(scene.carriers.index(number))
    if scene.actors[number].kind == "vehicle":
        return PAINT
    return MATERIAL_COLOUR.get(material, OTHER_COLOUR)


def _beam(scene: Scene, number: int) -> dict[str, Any]:
    radar, forward = scene.radars[number], scene.radar_rotation[number][:, 0]
    return {
        "name": radar.name,
        "place": _metres(scene.radar_position[number]),
        "azimuth": round(math.atan2(forward[1], forward[0]), 4),
        "half_width": round(0.5 * min(radar.array.pattern.azimuth_beamwidth, 2.0 * math.pi), 4),
        "colour": _hex(radar_paint(number)),
    }


def _metres(values: Any) -> list[float]:
    return [round(float(value), 2) for value in values]


def _hex(colour: Colour) -> str:
    return "#" + "".join(f"{round(255 * part):02x}" for part in colour)
