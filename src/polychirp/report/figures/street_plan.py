"""Figure 8 from above: places and speeds of the vehicles, and beams of the radars."""

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Rectangle, Wedge
from matplotlib.ticker import MultipleLocator

from polychirp.axes import FloatArray
from polychirp.model.scene import Actor, Scene
from polychirp.report.figures.drawing import INK, Column, Drawing, new_figure, styled
from polychirp.report.figures.surfaces import Surfaces, extent, radar_paint, surfaces

BEAM_LENGTHS: Final = (9.0, 7.8, 6.6, 5.4, 4.2, 3.0, 1.8)
"""Radii of the sectors that show a radar's beam, m, which lie on each other, so that the beam fades
away. Chosen for the drawing: they say nothing of how far a radar detects."""

LABEL_BAND: Final = 3.4
"""Width of the white bands with the names of the vehicles, m; chosen: they hold three lines."""

LANE_WIDTH: Final = 3.5
"""Width of each of the two lanes, m; the lanes meet at y = 0, and the middles of the lanes of
`traffic.paper` are at y = ±1.75 m."""

ROADSIDE_WIDTH: Final = 8.0
"""Width that is drawn beyond the lanes on either side, m. Chosen: it shows the pavement and the
fronts of the houses."""


@styled
def street_plan(scene: Scene) -> Drawing:
    """The street from above; its data are places and velocities of the actors.

    Sectors show every radar's 3-dB beam in azimuth.
    """
    figure = new_figure(13.0, 6.0)
    axes = figure.add_subplot()
    axes.grid(visible=False)
    _draw_surfaces(axes, surfaces(scene))
    left, right = _lanes(axes, scene)
    for number in range(len(scene.radars)):
        _draw_beam(axes, scene, number)
    for actor in scene.actors:
        if actor.points:
            world = actor.pose.to_outer(np.array([point.position for point in actor.points]))
            axes.plot(world[:, 0], world[:, 1], ".", color=INK, markersize=2)
        if actor.movement is not None:
            solids = actor.movement.parts_at(scene.time).ellipsoids
            world = actor.pose.to_outer(solids.centre)
            axes.plot(world[:, 0], world[:, 1], ".", color=INK, markersize=4)
        if actor.kind == "vehicle" and not actor.part_of:
            _draw_name(axes, actor, scene)
    reach = LANE_WIDTH + ROADSIDE_WIDTH
    ends = (-reach - LABEL_BAND, reach + LABEL_BAND)
    axes.axhspan(reach, ends[1], color="white", zorder=5)
    axes.axhspan(ends[0], -reach, color="white", zorder=5)
    axes.set(xlim=(left, right), ylim=ends, aspect="equal")
    axes.set(title="The street from above", xlabel="x (m)", ylabel="y (m)")
    axes.xaxis.set_major_locator(MultipleLocator(5.0))
    axes.xaxis.set_minor_locator(MultipleLocator(1.0))
    axes.set_yticks((-10.0, -5.0, 0.0, 5.0, 10.0))
    _draw_scale(axes, left + 1.5, -reach + 1.0)
    return Drawing(figure=figure, data=_table(scene))


def _draw_surfaces(axes: Axes, street: Surfaces) -> None:
    """Draw triangles, the highest last, so that they cover the lower ones.

    Level faces are brighter than steep ones, and leaves are half transparent. Upright triangles
    have no area from above (1e-4 m² or less): those longer than 2 m, as walls are, become lines.
    """
    flat = street.corners[:, :, :2]
    (x1, y1), (x2, y2) = (flat[:, 1] - flat[:, 0]).T, (flat[:, 2] - flat[:, 0]).T
    area = 0.5 * np.abs(x1 * y2 - x2 * y1)
    light = 0.72 + 0.28 * np.abs(street.normal[:, 2])
    colour = np.concatenate([street.colour * light[:, None], np.ones((light.size, 1))], axis=1)
    leaf = np.array([material == "leaf" for material in street.material], dtype=bool)
    colour[leaf, 3] = 0.35
    order = np.argsort(street.corners[:, :, 2].max(axis=1), kind="stable")
    lying = order[area[order] > 1e-4]
    axes.add_collection(
        PolyCollection(
            flat[lying],
            facecolors=colour[lying],
            edgecolors="face",  # without edges, thin gaps show between neighbours
            linewidths=np.where(leaf[lying], 0.0, 0.8),
            zorder=1,
            rasterized=True,  # drawn as triangles, a street of meshed cars has 60 MB as SVG
        )
    )
    walls = order[(area[order] <= 1e-4) & (np.ptp(flat[order], axis=1).max(axis=1) > 2.0)]
    axes.add_collection(
        LineCollection(list(flat[walls]), colors=colour[walls], linewidths=2.0, zorder=2)
    )


def _lanes(axes: Axes, scene: Scene) -> tuple[float, float]:
    """Draw the lanes' borders; return the least and the greatest x of the picture, m.

    The picture ends 5 m beyond the vehicles (chosen), or beyond all actors if there is no vehicle.
    """
    vehicles = [extent(actor) for actor in scene.actors if actor.kind == "vehicle"]
    ends = vehicles or [extent(actor) for actor in scene.actors] or [(np.zeros(3), np.zeros(3))]
    left = min(low[0] for low, _ in ends) - 5.0
    right = max(high[0] for _, high in ends) + 5.0
    if any(actor.kind == "road" for actor in scene.actors):
        axes.plot([left, right], [0.0, 0.0], color="white", dashes=(8, 8), linewidth=1.0)
        for side in (-LANE_WIDTH, LANE_WIDTH):
            axes.plot([left, right], [side, side], color="white", linewidth=0.8)
    return float(left), float(right)


def _draw_beam(axes: Axes, scene: Scene, number: int) -> None:
    radar, colour = scene.radars[number], radar_paint(number)
    place, boresight = scene.radar_position[number], scene.radar_rotation[number][:, 0]
    middle = np.degrees(np.arctan2(boresight[1], boresight[0]))
    half = min(0.5 * np.degrees(radar.array.pattern.azimuth_beamwidth), 180.0)
    for length in BEAM_LENGTHS:
        sector = Wedge(tuple(place[:2]), length, middle - half, middle + half)
        sector.set(facecolor=colour, linewidth=0.0, alpha=0.11, zorder=3)
        axes.add_patch(sector)
    axes.plot(*place[:2], "o", color=colour, markeredgecolor="white", zorder=6)


def _draw_name(axes: Axes, actor: Actor, scene: Scene) -> None:
    """Write a vehicle's name, speed and radars beside the street, and draw its velocity."""
    low, high = extent(actor)
    middle = 0.5 * (low + high)
    side = 1.0 if middle[1] >= 0 else -1.0
    radars = [
        radar.name
        for radar, carrier in zip(scene.radars, scene.carriers, strict=True)
        if scene.actors[carrier] is actor
    ]
    speed = float(np.hypot(*actor.velocity[:2])) * 3.6
    lines = [actor.name, f"{speed:.0f} km/h", *(f"radar: {name}" for name in radars)]
    axes.annotate(
        "\n".join(lines),
        xy=(middle[0], middle[1] + side * 0.5 * (high[1] - low[1])),
        xytext=(middle[0], side * (LANE_WIDTH + ROADSIDE_WIDTH + 0.4)),
        ha="center",
        va="bottom" if side > 0 else "top",
        size=8,
        arrowprops={"arrowstyle": "-", "color": INK, "linewidth": 0.5, "alpha": 0.6},
        zorder=7,
    )
    _draw_velocity(axes, middle, actor)


def _draw_velocity(axes: Axes, middle: FloatArray, actor: Actor) -> None:
    """Draw an arrow as long as the distance that the actor drives in 0.1 s (chosen)."""
    tip = middle[:2] + 0.1 * np.array(actor.velocity[:2])
    if np.any(actor.velocity):
        axes.annotate(
            "",
            xy=tuple(tip),
            xytext=tuple(middle[:2]),
            arrowprops={"arrowstyle": "-|>", "color": "white", "linewidth": 1.6},
            zorder=6,
        )


def _draw_scale(axes: Axes, x: float, y: float) -> None:
    """Draw a scale of 5 m, with its left end at (x, y), on a white patch above everything else."""
    axes.add_patch(Rectangle((x - 0.6, y - 0.3), 6.6, 1.5, color="white", alpha=0.9, zorder=8))
    for cell in range(5):
        axes.add_patch(
            Rectangle(
                (x + cell, y),
                1.0,
                0.3,
                facecolor=INK if cell % 2 else "white",
                edgecolor=INK,
                linewidth=0.7,
                zorder=8,
            )
        )
    for metres in (1, 5):
        axes.text(x + metres, y + 0.45, f"{metres} m", ha="center", size=7.5, zorder=8)


def _table(scene: Scene) -> dict[str, Column]:
    names = [radar.name for radar in scene.radars]
    radars = [
        ", ".join(n for n, c in zip(names, scene.carriers, strict=True) if c == number)
        for number in range(len(scene.actors))
    ]
    poses = [actor.pose for actor in scene.actors]
    return {
        "actor": [actor.name for actor in scene.actors],
        "kind": [actor.kind for actor in scene.actors],
        "x_m": [pose.x for pose in poses],
        "y_m": [pose.y for pose in poses],
        "yaw_deg": [float(np.degrees(pose.yaw)) for pose in poses],
        "velocity_x_mps": [actor.velocity[0] for actor in scene.actors],
        "velocity_y_mps": [actor.velocity[1] for actor in scene.actors],
        "radars": radars,
    }
