"""Echoes of what moves into the shadow of a car: over its side, and below it by way of the road.

``python -m tools.figures.shadow FOLDER`` writes ``shadow.png``.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.base import all_pairs, gather
from polychirp.channel.bent_echoes.paths import bent_echoes
from polychirp.channel.physical_optics.paths import facet_echoes, mirrored_echoes
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Actor, Scene
from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)
from polychirp.testing.shapes import around, box, mesh_of, sphere, transfer_at
from polychirp.traffic.vehicle import vehicle_mesh
from polychirp.units import to_db
from tests.support.references.two_screens import over_two_screens

FREQUENCY: Final = 79e9
"""Frequency of the echoes, Hz."""

TRACER: Final = Composite(dynamic_range=1e14)
"""Tracer that leaves out nothing weak."""

SIDE: Final = (8.0, 12.6, 0.9)
"""Distances of both ends of the car from the radar and half its width, m."""

BALL_AT: Final = 20.0
"""Distance of the ball, m."""

PLACES: Final = np.arange(0.8, 2.61, 0.025)
"""Places of the ball across the road, m."""

OFFSETS: Final = np.arange(0.0, 4.1, 0.125)
"""Places of the farther car across the road, m."""


def over_the_side() -> dict[str, FloatArray]:
    """Echo of a ball over that without the car beside which it appears, dB, by ``PLACES``."""
    first, last, half = SIDE
    car = Actor(
        name="car",
        kind="vehicle",
        mesh=mesh_of(box((last - first, 2 * half, 4.0), 0.25)),
        pose=Pose(x=0.5 * (first + last)),
    )
    mesh = mesh_of(sphere(0.03, 0.0015))
    straight, bent, expected = [], [], []
    for y in PLACES:
        # turned, so that no lines of its mesh run along the edge of the shadow and add up
        pose = Pose(x=BALL_AT, y=float(y), yaw=0.3, pitch=0.2)
        ball = Actor(name="ball", kind="object", mesh=mesh, pose=pose)
        free = _echoes(around([ball], [(0, 0, 0)]))[0]
        found = _echoes(around([car, ball], [(0, 0, 0)]))
        straight.append(_amplitude(found[0]) / _amplitude(free))
        bent.append(_amplitude(gather(list(found[:2]))) / _amplitude(free))
        edges = (first, half), (last, half)
        expected.append(over_two_screens((0.0, 0.0), edges, (BALL_AT, float(y)), FREQUENCY) ** 2)
    names = "straight paths only", "with bent waves", "two apertures, by sums"
    return {
        name: to_db(np.maximum(np.abs(np.array(values)) ** 2, 1e-12))
        for name, values in zip(names, (straight, bent, expected), strict=True)
    }


def behind_a_car() -> dict[str, FloatArray]:
    """Power of a car's echo behind another car over that without the latter, dB, by ``OFFSETS``."""
    mesh = vehicle_mesh("sedan", max_edge=0.05)
    road = Actor(
        name="road",
        kind="building",
        plates=(
            Plate(
                centre=(30, 0, 0), half_u=(60, 0, 0), half_v=(0, 9, 0), material="asphalt",
                part="road",
            ),
        ),
    )  # fmt: skip
    near = Actor(name="near", kind="vehicle", mesh=mesh, pose=Pose(x=10.3))
    powers = []
    for y in OFFSETS:
        far = Actor(name="far", kind="vehicle", mesh=mesh, pose=Pose(x=22.9, y=float(y)))
        free = _echoes(around([road, far], [(0, 0, 0.5)]))
        whole = sum(_power(paths) for paths in (free[0], free[2]))
        found = _echoes(around([road, near, far], [(0, 0, 0.5)]))
        powers.append([_power(paths) / whole for paths in found])
    names = "straight", "over an edge", "by way of the road"
    values = to_db(np.maximum(np.array(powers).T, 1e-12))
    return dict(zip(names, values, strict=True))


def _echoes(scene: Scene) -> tuple[PropagationPaths, PropagationPaths, PropagationPaths]:
    """Straight, bent and mirrored echoes of the scene's last body."""
    world, pairs = TRACER.prepare(scene), all_pairs(scene)
    nothing, body = np.zeros((1, 1)), len(world.body) - 1
    return (
        facet_echoes(world, pairs, body=body),
        bent_echoes(world, pairs, nothing, body=body),
        mirrored_echoes(world, pairs, nothing, body=body),
    )


def _amplitude(paths: PropagationPaths) -> complex:
    return complex(transfer_at(paths, FREQUENCY)[0, 0])


def _power(paths: PropagationPaths) -> float:
    """Power of paths at the centre frequency, as the sum of their powers."""
    return float(np.sum(np.abs(paths.transfer[:, 0, 0]) ** 2))


@styled
def drawing() -> Drawing:
    """Both figures."""
    figure = new_figure(9.0, 3.6)
    left, right = figure.subplots(1, 2)
    data: dict[str, list[float]] = {"y": PLACES.tolist(), "offset": OFFSETS.tolist()}
    for (name, values), (colour, line) in zip(
        over_the_side().items(), ((GREY, "-"), (BLUE, "-"), (VERMILION, ":")), strict=True
    ):
        left.plot(PLACES, values, color=colour, linestyle=line, label=name)
        data[name] = values.tolist()
    edge = SIDE[2] * BALL_AT / SIDE[0]
    left.axvline(edge, color=GREY, linewidth=0.6, linestyle="--")
    left.set(
        xlabel="Ball across the road, m",
        ylabel="Echo over that without the car, dB",
        ylim=(-85, 8),
        title="Ball at 20 m, box from 8 m to 12.6 m",
    )
    left.legend(fontsize=7)
    for (name, values), colour in zip(behind_a_car().items(), (GREY, BLUE, GREEN), strict=True):
        right.plot(OFFSETS, values, color=colour, label=name)
        data[name] = values.tolist()
    right.set(
        xlabel="Farther sedan across the road, m",
        ylabel="Power over that without the car, dB",
        ylim=(-85, 8),
        title="Sedan at 20.6 m behind a sedan at 8 m",
    )
    right.legend(fontsize=7)
    for axes in (left, right):
        axes.title.set_fontsize(9)
    return Drawing(figure=figure, data=data)


def main() -> None:
    """Write the figure into the folder that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    (parser.parse_args().folder / "shadow.png").write_bytes(drawing().png())


if __name__ == "__main__":
    main()
