"""Shapes beside the road: upright plates of buildings, and trees."""

import math
from functools import cache
from typing import Final

import numpy as np

from polychirp.model.mesh import Mesh, Plate
from polychirp.traffic.surface import Fineness, SurfaceBuilder

WINDOW_SIZE = (1.2, 1.4)
"""Width and height of a building's windows, m; chosen, like the 0.9 m from the ground to them."""

FURNITURE_EDGE: Final = 0.05
"""Longest edge of facets on flats of street furniture, m: as of vehicles."""

LEAF_EDGE = 0.25
"""Longest edge of a tree's facets, m; chosen: leaves scatter, so curvature matters little."""


def upright(
    foot: np.ndarray,
    along: np.ndarray,
    breadth: float,
    low: float,
    high: float,
    material: str,
    part: str,
) -> Plate:
    """A vertical plate above ``foot``, from ``low`` to ``high``, with the normal ``along`` × up."""
    px, py, _ = (float(v) for v in foot)
    ax, ay, _ = (float(v) for v in breadth * along)
    return Plate(
        centre=(px, py, (low + high) / 2),
        half_u=(ax, ay, 0.0),
        half_v=(0.0, 0.0, (high - low) / 2),
        material=material,
        part=part,
    )


@cache
def tree_mesh(height: float, crown_radius: float) -> Mesh:
    """Tree with its foot at the origin, m, of chosen proportions; equal calls share one `Mesh`."""
    builder = SurfaceBuilder()
    fine = Fineness(max_edge=LEAF_EDGE)
    crown_height = min(2.6 * crown_radius, 0.75 * height)
    middle = height - crown_height / 2
    trunk = 0.03 * height
    rings = [(0.0, 0.0), (trunk, 0.0)]
    steps = fine.steps(middle)
    rings += [(trunk * (1 - 0.4 * k / steps), middle * k / steps) for k in range(1, steps + 1)]
    turned(builder, fine, [*rings, (0.0, middle)], part="trunk", material="wood")
    steps = fine.steps(math.pi * max(crown_radius, crown_height / 2))
    around = np.linspace(-math.pi / 2, math.pi / 2, steps + 1)
    crown = [(crown_radius * math.cos(a), middle + crown_height / 2 * math.sin(a)) for a in around]
    turned(builder, fine, crown, part="crown", material="leaf")
    return builder.mesh()


def turned(
    builder: SurfaceBuilder,
    fine: Fineness,
    profile: list[tuple[float, float]],
    *,
    part: str,
    material: str,
    curvature: float = math.inf,
) -> None:
    """Add a closed body of revolution about z; ``profile`` is (radius, z), m, from bottom up.

    Edges around the axis are those on a surface of the radius ``curvature``, m; by default those on
    flats.
    """
    before = None
    for radius, z in profile:
        if radius < 1e-9:
            line = builder.line(np.array([[0.0, 0.0, z]]))
        else:
            count = max(8, fine.steps(2 * math.pi * radius, curvature))
            turn = np.arange(count) * 2 * math.pi / count
            points = [radius * np.cos(turn), radius * np.sin(turn), np.full(count, z)]
            line = builder.line(np.column_stack(points))
            line = np.append(line, line[0])
        if before is not None:
            builder.strip(before, line, part=part, material=material)
        before = line
