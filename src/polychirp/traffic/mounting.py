"""Mounting places of radars on bumpers."""

import math
from functools import cache
from typing import Final, Literal

import numpy as np

from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.traffic.shapes import Body
from polychirp.traffic.vehicle import vehicle_mesh

RADAR_STANDOFF: Final = 0.015
"""Distance from the outermost plastic to the radar, m (chosen): radars must be outside the mesh."""


@cache
def bumper_mount(
    body: Body, end: Literal["front", "rear"], *, offset: float = 0.0, height: float = 0.5
) -> Pose:
    """Pose, in the vehicle's frame, of a radar on the surface of a bumper.

    The radar is directed straight ahead or straight back, `RADAR_STANDOFF` outside the plastic.

    Parameters
    ----------
    body : as for `vehicle_mesh`
    offset : m, left of the vehicle's middle (positive y)
    height : m above the ground

    Raises
    ------
    InputError
        The bumper has no surface at this offset and height.

    Examples
    --------
    >>> mount = bumper_mount("sedan", "rear")
    >>> round(mount.x, 2), mount.z
    (-2.31, 0.5)
    """
    mesh = vehicle_mesh(body)
    part = mesh.parts.index(f"{end}-bumper")
    corners = mesh.corners[mesh.part == part]
    sign = 1.0 if end == "front" else -1.0
    # barycentric coordinates of (offset, height) in every triangle, projected along x
    edges = corners[:, 1:, 1:] - corners[:, :1, 1:]
    point = np.array([offset, height]) - corners[:, 0, 1:]
    area = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    is_flat = np.abs(area) > 1e-12
    area = np.where(is_flat, area, 1.0)
    s = (point[:, 0] * edges[:, 1, 1] - point[:, 1] * edges[:, 1, 0]) / area
    t = (edges[:, 0, 0] * point[:, 1] - edges[:, 0, 1] * point[:, 0]) / area
    inside = is_flat & (s >= -1e-9) & (t >= -1e-9) & (s + t <= 1 + 1e-9)
    if not inside.any():
        low, high = corners[..., 1:].min(axis=(0, 1)), corners[..., 1:].max(axis=(0, 1))
        raise InputError(
            f"the {end} bumper of a {body} does not reach {offset:g} m to the left at a height of "
            f"{height:g} m; keep within {low[0]:.2f}…{high[0]:.2f} m and {low[1]:.2f}…"
            f"{high[1]:.2f} m"
        )
    x = corners[:, 0, 0] + s * (corners[:, 1, 0] - corners[:, 0, 0])
    x = x + t * (corners[:, 2, 0] - corners[:, 0, 0])
    surface = sign * float((sign * x[inside]).max())
    return Pose(
        x=surface + sign * RADAR_STANDOFF,
        y=offset,
        z=height,
        yaw=0.0 if end == "front" else math.pi,
    )
