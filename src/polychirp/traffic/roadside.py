"""The road, and buildings and trees beside it, as actors."""

import math
from functools import cache

import numpy as np

from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.mesh import Mesh, Plate
from polychirp.model.scene import Actor
from polychirp.traffic.surface import Fineness, SurfaceBuilder

WINDOW_SIZE = (1.2, 1.4)
"""Width and height of a building's windows, m; chosen, like the 0.9 m from the ground to them."""

LEAF_EDGE = 0.25
"""Longest edge of a tree's facets, m; chosen: leaves scatter, so curvature matters little."""


def road(
    *, length: float, width: float, material: str = "asphalt", x: float = 0.0, y: float = 0.0
) -> Actor:
    """A level road along x with its middle at (x, y), m, as one `Plate`; all lengths are in m.

    >>> road(length=60.0, width=8.0).plates[0].normal.tolist()
    [0.0, 0.0, 1.0]
    """
    if not (length > 0 and width > 0):
        raise InputError("a road needs a positive length and width")
    plate = Plate(
        centre=(0.0, 0.0, 0.0),
        half_u=(length / 2, 0.0, 0.0),
        half_v=(0.0, width / 2, 0.0),
        material=material,
        part="road",
    )
    return Actor(name="road", kind="road", pose=Pose(x=x, y=y), plates=(plate,))


def building(
    name: str,
    *,
    x: float,
    y: float,
    length: float,
    width: float,
    height: float,
    material: str = "brick",
    heading: float = 0.0,
    num_windows: int = 0,
) -> Actor:
    """A box with four walls and a roof, its middle at (x, y) (m), its length along ``heading``.

    ``num_windows`` panes of glass stand 1 cm before each of the two walls along the length.
    """
    if not (length > 0 and width > 0 and height > 0):
        raise InputError(f"building '{name}' needs a positive length, width and height")
    if num_windows < 0 or num_windows * WINDOW_SIZE[0] > length or (num_windows and height < 3):
        raise InputError(
            f"{num_windows} windows do not fit into building '{name}'; allow {WINDOW_SIZE[0]} m of "
            "length for each and a height of 3 m"
        )
    half = (length / 2, width / 2, height / 2)
    walls = []
    for part, turn in (("front", 0), ("left", 1), ("rear", 2), ("right", 3)):
        outward = np.array([math.cos(turn * math.pi / 2), math.sin(turn * math.pi / 2), 0.0])
        along = np.array([-outward[1], outward[0], 0.0])
        reach, breadth = half[turn % 2], half[1 - turn % 2]
        foot = reach * outward
        walls.append(_upright(foot, along, breadth, 0.0, height, material, f"wall-{part}"))
        if turn % 2 == 1:
            for number in range(num_windows):
                aside = (2 * (number + 0.5) / num_windows - 1) * breadth
                walls.append(
                    _upright(
                        foot + 0.01 * outward + aside * along,
                        along,
                        WINDOW_SIZE[0] / 2,
                        0.9,
                        0.9 + WINDOW_SIZE[1],
                        "glass",
                        f"window-{part}-{number + 1}",
                    )
                )
    roof = Plate(
        centre=(0.0, 0.0, height),
        half_u=(half[0], 0.0, 0.0),
        half_v=(0.0, half[1], 0.0),
        material=material,
        part="roof",
    )
    pose = Pose(x=x, y=y, yaw=heading)
    return Actor(name=name, kind="building", pose=pose, plates=(*walls, roof))


def _upright(
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


def tree(name: str, *, x: float, y: float, height: float, crown_radius: float) -> Actor:
    """A tree at (x, y) (m): a wooden trunk below an ellipsoidal crown of leaves."""
    if not 0 < 2 * crown_radius < height:
        raise InputError(
            f"tree '{name}' needs a positive crown radius, and a crown that is less wide "
            f"({2 * crown_radius:g} m) than the tree is high ({height:g} m)"
        )
    return Actor(name=name, kind="tree", pose=Pose(x=x, y=y), mesh=tree_mesh(height, crown_radius))


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
    _turned(builder, fine, [*rings, (0.0, middle)], part="trunk", material="wood")
    steps = fine.steps(math.pi * max(crown_radius, crown_height / 2))
    around = np.linspace(-math.pi / 2, math.pi / 2, steps + 1)
    crown = [(crown_radius * math.cos(a), middle + crown_height / 2 * math.sin(a)) for a in around]
    _turned(builder, fine, crown, part="crown", material="leaf")
    return builder.mesh()


def _turned(
    builder: SurfaceBuilder,
    fine: Fineness,
    profile: list[tuple[float, float]],
    *,
    part: str,
    material: str,
) -> None:
    """Add a closed body of revolution about z; ``profile`` is (radius, z), m, from bottom up."""
    before = None
    for radius, z in profile:
        if radius < 1e-9:
            line = builder.line(np.array([[0.0, 0.0, z]]))
        else:
            count = max(8, fine.steps(2 * math.pi * radius))
            turn = np.arange(count) * 2 * math.pi / count
            points = [radius * np.cos(turn), radius * np.sin(turn), np.full(count, z)]
            line = builder.line(np.column_stack(points))
            line = np.append(line, line[0])
        if before is not None:
            builder.strip(before, line, part=part, material=material)
        before = line
