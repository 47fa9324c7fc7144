"""Parts of vehicles: closed wheels, and sheets between four corners."""

import math
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.traffic.shapes import Wheels
from polychirp.traffic.surface import Fineness, SurfaceBuilder

NUM_SPOKES: Final = 5
"""Number of spokes of an open rim; chosen as of a usual alloy wheel."""

SPOKE_WIDTH: Final = 0.055
"""Width of a spoke, m; chosen."""

SPOKE_DEPTHS: Final = (0.02, 0.045)
"""Depth of the spokes' face behind the tyre's side at the hub and at the rim, m; chosen."""

DISC_DEPTH: Final = 0.11
"""Depth of the brake disc behind the tyre's side, m; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ring:
    """A circle about an axle, m; ``part`` and ``material`` are of the strip before it."""

    radius: float
    y: float
    part: str
    material: str


def wheel_section(wheels: Wheels, outer: float) -> tuple[Ring, ...]:
    """Rings of a wheel from the inner to the outer end of its axle: rim, tyre, dished rim."""
    inner, radius, rim, chamfer = outer - wheels.width, wheels.radius, 0.66 * wheels.radius, 0.025
    metal = partial(Ring, part="rim", material="metal")
    rubber = partial(Ring, part="wheel", material="rubber")
    return (
        metal(radius=0.0, y=inner + 0.03),
        metal(radius=rim, y=inner + 0.03),
        rubber(radius=rim, y=inner),
        rubber(radius=radius - chamfer, y=inner),
        rubber(radius=radius, y=inner + chamfer),
        rubber(radius=radius, y=outer - chamfer),
        rubber(radius=radius - chamfer, y=outer),
        rubber(radius=rim, y=outer - 0.01),
        metal(radius=rim - 0.02, y=outer - 0.05),
        metal(radius=0.35 * rim, y=outer - 0.03),
        metal(radius=0.25 * rim, y=outer - 0.015),
        metal(radius=0.0, y=outer - 0.015),
    )


def open_wheel_section(wheels: Wheels, outer: float) -> tuple[Ring, ...]:
    """Rings of a wheel whose rim is open to the outside, as far as the brake disc and its hub."""
    closed = wheel_section(wheels, outer)
    tyre, lip = closed[:-4], 0.66 * wheels.radius - 0.02
    metal = partial(Ring, part="rim", material="metal")
    floor = outer - min(DISC_DEPTH, wheels.width - 0.05)
    return (
        *tyre,
        metal(radius=lip, y=outer - 0.02),
        metal(radius=lip, y=floor),
        metal(radius=0.0, y=floor),
    )


def spokes(
    builder: SurfaceBuilder, fine: Fineness, wheels: Wheels, x: float, outer: float, axle: str
) -> None:
    """Add the hub's cap and flat spokes, which lean in towards the rim, before an open rim."""
    part, height = f"rim-{axle}-left", wheels.radius
    hub, end = 0.06, 0.66 * wheels.radius - 0.02
    cap = partial(Ring, part="rim", material="metal")
    lines = [
        builder.line(_circle(fine, x, height, cap(radius=r, y=outer - SPOKE_DEPTHS[0])))
        for r in (hub, 0.0)
    ]
    builder.strip(lines[1], np.append(lines[0], lines[0][0]), part=part, material="metal")
    for number in range(NUM_SPOKES):
        turn = 2 * math.pi * number / NUM_SPOKES + math.pi / 2
        out = np.array([math.cos(turn), 0.0, math.sin(turn)])
        aside = np.array([-out[2], 0.0, out[0]])
        inner, outer_end = (
            np.array([x, outer - depth, height]) + r * out
            for r, depth in zip((hub, end), SPOKE_DEPTHS, strict=True)
        )
        half = SPOKE_WIDTH / 2 * aside
        corners = np.array([inner - half, inner + half, outer_end + half, outer_end - half])
        if np.cross(corners[1] - corners[0], corners[3] - corners[0])[1] < 0:
            corners = corners[::-1]
        sheet(builder, fine, corners, part=part, material="metal")


def wheel(
    builder: SurfaceBuilder, fine: Fineness, x: float, section: tuple[Ring, ...], axle: str
) -> None:
    """Add a closed wheel on the ground at ``x`` (m)."""
    height = max(ring.radius for ring in section)
    lines = [builder.line(_circle(fine, x, height, section[0]))]
    for before, after in pairwise(section):
        count = fine.steps(math.hypot(after.radius - before.radius, after.y - before.y))
        for t in np.linspace(0, 1, count + 1)[1:]:
            radius = before.radius + t * (after.radius - before.radius)
            ring = replace(after, radius=radius, y=before.y + t * (after.y - before.y))
            points = builder.line(_circle(fine, x, height, ring))
            lines.append(points if radius < 1e-9 else np.append(points, points[0]))
            builder.strip(
                lines[-1], lines[-2], part=f"{after.part}-{axle}-left", material=after.material
            )


def _circle(fine: Fineness, x: float, z: float, ring: Ring) -> FloatArray:
    """Points of a ring, ``(point, xyz)``; a single one on the axle."""
    if ring.radius < 1e-9:
        return np.array([[x, ring.y, z]])
    length = 2 * math.pi * ring.radius
    count = max(12, fine.steps(length, ring.radius))
    turn = np.arange(count) * 2 * math.pi / count - math.pi / 2  # the first one is the lowest
    return np.column_stack(
        [x + ring.radius * np.cos(turn), np.full(count, ring.y), z + ring.radius * np.sin(turn)]
    )


def sheet(
    builder: SurfaceBuilder,
    fine: Fineness,
    corners: FloatArray,
    *,
    part: str,
    material: str,
    bulge: float = 0.0,
    radius: float = math.inf,
) -> None:
    """Add a bilinear sheet, its middle raised outwards by ``bulge`` (m).

    ``corners`` are counter-clockwise seen from outside; ``radius`` (m) limits the edges.
    """
    a, b, c, d = corners
    normal = np.cross(b - a, d - a)
    normal /= np.linalg.norm(normal)
    across = np.linspace(0, 1, fine.steps(float(np.linalg.norm(d - a)), radius) + 1)
    along = np.linspace(0, 1, fine.steps(float(np.linalg.norm(b - a)), radius) + 1)[:, None]
    lines = []
    for v in across:
        flat = (1 - v) * ((1 - along) * a + along * b) + v * ((1 - along) * d + along * c)
        lines.append(builder.line(flat + 16 * bulge * v * (1 - v) * along * (1 - along) * normal))
    builder.net(lines, part=part, material=material)
