"""The street in three dimensions: cars, beams and the strongest paths."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from polychirp.live.look import Look, strongest_paths
from polychirp.live.settings import OTHER, VICTIM
from polychirp.model.scene import Actor, Scene
from polychirp.report.figures.drawing import BLUE, GREEN, GREY, ORANGE, VERMILION

if TYPE_CHECKING:
    from nicegui.elements.scene.scene import Scene as View

BEAM_REACH: Final = 9.0
"""Radius of the sectors that show where radars look, m; their angle is the beam's width."""

LABEL_STYLE: Final = "background: #fff; color: #222; padding: 0 4px; font-size: 11px"

ROAD_SIZE: Final = (400.0, 12.0)
"""Length and width of the road that is drawn, m."""

PATHS_PER_KIND: Final = 6
"""Number of paths of each kind that are drawn, the strongest ones."""

PATH_COLOURS: Final = {"echo": GREEN, "direct": VERMILION, "indirect": ORANGE}
LEGEND: Final = "green: echoes; vermilion: the other radar, direct; orange: indirect"
"""Colours of paths by their kind, and a legend."""

RADAR_COLOURS: Final = {VICTIM: BLUE, OTHER: VERMILION}


def draw_street(view: View, look: Look) -> None:
    """Replace what the view shows by the street of a look."""
    view.clear()
    scene = look.scene
    carried = {scene.carriers[n]: radar.name for n, radar in enumerate(scene.radars)}
    with view:
        for number, actor in enumerate(scene.actors):
            if actor.kind == "vehicle":
                _draw_car(view, actor, RADAR_COLOURS.get(carried.get(number, ""), GREY))
            elif actor.kind == "road":
                _draw_road(view, actor)
        for number, radar in enumerate(scene.radars):
            _draw_beam(view, scene, number, RADAR_COLOURS[radar.name])
        for kind, points in strongest_paths(look, PATHS_PER_KIND):
            for a, b in zip(points[:-1].tolist(), points[1:].tolist(), strict=True):
                view.line(a, b).material(PATH_COLOURS[kind])


def look_from_behind(view: View, look: Look) -> None:
    """Move the camera behind the victim, so that it looks the way that the radar looks."""
    position = look.scene.radar_position[0]
    ahead = look.scene.radar_rotation[0][:, 0]
    eye = position - 9.0 * ahead
    to = position + 14.0 * ahead
    view.move_camera(
        x=float(eye[0]),
        y=float(eye[1]) - 3.0,
        z=6.0,
        look_at_x=float(to[0]),
        look_at_y=float(to[1]),
        look_at_z=0.0,
        duration=0.0,
    )


def _draw_car(view: View, actor: Actor, colour: str) -> None:
    """A body and a cabin in the bounding box of the car's mesh."""
    low, high = actor.mesh.vertex.min(axis=0), actor.mesh.vertex.max(axis=0)
    length, width, height = (float(size) for size in high - low)
    with view.group().move(actor.pose.x, actor.pose.y, 0.0).rotate(0, 0, actor.pose.yaw):
        view.box(length, width, 0.55 * height).move(0, 0, 0.4 * height).material(colour)
        view.box(0.5 * length, 0.85 * width, 0.35 * height).move(
            -0.06 * length, 0, 0.82 * height
        ).material(colour, opacity=0.6)
        view.text(actor.name, LABEL_STYLE).move(0, 0, height + 0.6)


def _draw_road(view: View, actor: Actor) -> None:
    """A grey strip below the cars."""
    view.box(*ROAD_SIZE, 0.02).move(actor.pose.x, 0, -0.02).material("#9aa0a6")


def _draw_beam(view: View, scene: Scene, number: int, colour: str) -> None:
    """A flat sector at the radar's height."""
    radar = scene.radars[number]
    x, y, z = (float(value) for value in scene.radar_position[number])
    ahead = scene.radar_rotation[number][:, 0]
    middle = math.atan2(float(ahead[1]), float(ahead[0]))
    half = 0.5 * min(radar.array.pattern.azimuth_beamwidth, math.pi)
    steps = [middle - half + half * n / 8.0 for n in range(17)]
    outline: list[list[float]] = [[0.0, 0.0]]
    outline += [[BEAM_REACH * math.cos(a), BEAM_REACH * math.sin(a)] for a in steps]
    shape: Any = view.extrusion(outline, 0.02)
    shape.move(x, y, z).material(colour, opacity=0.18)
