"""Scattering points of every body, from our own physical optics, as a TOML file.

Run ``python -m tools.point_tables > FILE``, the ``vehicle_points.toml`` of the channel, after a
change of the bodies or of the physical optics; it takes some minutes.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Final, get_args

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.mesh import Mesh
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.traffic.shapes import Body
from polychirp.traffic.vehicle import vehicle_mesh
from polychirp.units import to_db

DISTANCE: Final = 20.0
"""Distance of the radar from the middle of the body, m; chosen between those of the nearest and the
farthest cars of a street."""

HEIGHT: Final = 0.5
"""Height of the radar above the ground, m, that of a bumper."""

NUM_AZIMUTHS: Final = 72
"""Number of columns of a table: one every 5°, with the mean power over ±2.5°."""

SWEEP: Final = 1e9
"""Band over which the power is averaged, Hz, that of a chirp with a fine range resolution."""

PLACES: Final[Mapping[str, tuple[float, float]]] = {
    "front": (0.97, 0.5),
    "front left": (0.92, 0.9),
    "front wheel left": (0.79, 0.96),
    "left": (0.5, 0.97),
    "rear wheel left": (0.21, 0.96),
    "rear left": (0.08, 0.9),
    "rear": (0.03, 0.5),
    "rear right": (0.08, 0.1),
    "rear wheel right": (0.21, 0.04),
    "right": (0.5, 0.03),
    "front wheel right": (0.79, 0.04),
    "front right": (0.92, 0.1),
}
"""Positions of the points, as shares of a body's length (from its rear) and width (from right)."""

MIRRORED: Final = np.array([0, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1])
"""Index of the point on the other side, since every built-in body is its own mirror image."""


def corners_of(mesh: Mesh) -> tuple[FloatArray, FloatArray]:
    """Low and high corner of a mesh's bounding box, m ``(xyz,)``."""
    return mesh.vertex.min(axis=0), mesh.vertex.max(axis=0)


def echo_paths(
    mesh: Mesh, azimuth: float, *, distance: float = DISTANCE, height: float = HEIGHT
) -> tuple[PropagationPaths, FloatArray]:
    """Own echo of a body at the origin, without road, and position of the radar, m ``(xyz,)``."""
    pose = Pose(x=distance * np.cos(azimuth), y=distance * np.sin(azimuth), z=height)
    scene = Scene(
        time=0.0,
        actors=(
            Actor(name="body", kind="vehicle", mesh=mesh),
            Actor(name="carrier", kind="vehicle", pose=pose),
        ),
        radars=(Radar(name="radar", mount=Pose(yaw=azimuth + np.pi)),),
        carriers=(1,),
    )
    return Composite(reflecting_planes=False, max_bounces=1).trace(scene), pose.position


def mean_power(paths: PropagationPaths) -> float:
    """Mean of |Σ H|² over V and H and over `SWEEP` about the paths' frequency."""
    if not paths.num_paths:
        return 0.0
    frequency = paths.frequency + SWEEP * (np.arange(16) / 16 - 0.5)
    turn = np.exp(-2j * np.pi * frequency[:, None] * paths.delay)
    own = np.diagonal(paths.transfer, axis1=1, axis2=2)
    return float(np.mean(np.abs(turn @ own) ** 2))


def cross_section(
    power: FloatArray | float, distance: FloatArray | float, frequency: float
) -> FloatArray | float:
    r"""Cross section from the radar equation, m²: :math:`\sigma = |A|^2 (4\pi)^3 R^4/\lambda^2`."""
    return power * (4 * np.pi) ** 3 * distance**4 * (frequency / SPEED_OF_LIGHT) ** 2


def split_echo(paths: PropagationPaths, places: FloatArray, radar: FloatArray) -> FloatArray:
    """Cross section of the paths nearest to each point, seen from above, m² ``(point,)``.

    A path of a delay cell is at the mean of its parts, so that echoes of two sides with the same
    delay count at the middle between them. Shares are in proportion to the power of each group
    alone, and their sum is the power of all paths: the echo of points with random phases then has
    the mean power of the body.
    """
    if not paths.num_paths:
        return np.zeros(len(places))
    where = paths.bounce_point[:, None, :2] - places[None, :, :2]
    nearest: IntArray = np.argmin(np.sum(where**2, axis=-1), axis=1)
    power = np.array([mean_power(paths.select(nearest == k)) for k in range(len(places))])
    power *= mean_power(paths) / np.sum(power)
    distance = np.linalg.norm(places - radar, axis=-1)
    return np.asarray(cross_section(power, distance, paths.frequency))


def point_table(
    body: Body, *, step: float = np.radians(0.25), distance: float = DISTANCE
) -> tuple[FloatArray, FloatArray]:
    """Places ``(point, xyz)``, as shares of the bounding box, and echoes, m² ``(point, azimuth)``.

    The azimuth is that of the radar as seen from the point, in the body's frame.
    """
    mesh = vehicle_mesh(body)
    low, high = corners_of(mesh)
    ground = np.array([(*place, HEIGHT / high[2]) for place in PLACES.values()])
    places = low + ground * (high - low)
    total, count = np.zeros((2, len(PLACES), NUM_AZIMUTHS))
    for azimuth in np.arange(0.0, np.pi + 1e-9, step):
        paths, radar = echo_paths(mesh, float(azimuth), distance=distance)
        echo = split_echo(paths, places, radar)
        seen = np.arctan2(*(radar - places).T[1::-1])
        for points, angle in ((np.arange(len(PLACES)), seen), (MIRRORED, -seen)):
            column = np.round(angle / (2 * np.pi) * NUM_AZIMUTHS).astype(np.int64) % NUM_AZIMUTHS
            np.add.at(total, (points, column), echo)
            np.add.at(count, (points, column), 1.0)
    return ground, total / np.maximum(count, 1.0)


HEADER: Final = f"""\
# Echo of the built-in bodies, split among points; made by tools.point_tables.
# place: shares of the bounding box along x, y, z. size: that box, m.
# echo: radar cross section in units of 0.1 dBsm, mean over V and H, 1 GHz and one column,
# for {NUM_AZIMUTHS} azimuths of the radar seen from the point: 0°, {360 // NUM_AZIMUTHS}°, …,
# counter-clockwise from straight ahead. Traced at 79 GHz from {DISTANCE:g} m, {HEIGHT:g} m above \
the ground.
"""


def as_text(body: Body) -> str:
    """The table of one body, as TOML."""
    mesh = vehicle_mesh(body)
    low, high = corners_of(mesh)
    places, echo = point_table(body)
    rows = [f"[{body}]", f"size = {np.round(high - low, 3).tolist()}"]
    for name, place, line in zip(PLACES, places, echo, strict=True):
        level = np.maximum(np.round(10 * to_db(line)), -600).astype(np.int64)
        rows += [
            f'\n[[{body}.point]]\nname = "{name}"',
            f"place = {np.round(place, 3).tolist()}",
            f"echo = {level.tolist()}",
        ]
    return "\n".join(rows) + "\n"


def main() -> None:
    """Write the whole file to the standard output."""
    sys.stdout.write(HEADER)
    for body in get_args(Body):
        sys.stdout.write("\n" + as_text(body))


if __name__ == "__main__":
    main()
