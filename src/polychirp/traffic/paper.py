"""The paper's street: eight vehicles, four of them with a radar, between brick buildings.

Vehicles drive along +x in lane 1 (y = −1.75 m), along −x in lane 2 (y = +1.75 m). Their places
were found by a root search, so that the nearest visible metal is at the paper's ranges (m):

======== ========= ======== =======================================
radar    target    m        surface
======== ========= ======== =======================================
1        target-4   6.50    front of the car that follows in lane 1
1        target-3   9.15    rear of a car in lane 2
2        target-2  12.60    rear of the van ahead in lane 1
2        vehicle-4 13.65    nose of the oncoming car, 0.45 m behind its plastic
2        radar 4   13.20    one way, as a synchronous ghost at 6.60 m
======== ========= ======== =======================================

Radars 1 and 3 are directed along −x, and radar 3, in lane 2, is 3 m further along −x. Its waves
reach radar 1 by way of targets 4 and 3, as ghosts at half the length of their path, 5.6 and 7.4 m.
"""

import math
from typing import Final

from polychirp.frames import Pose
from polychirp.traffic.mounting import bumper_mount
from polychirp.traffic.shapes import Body
from polychirp.traffic.street import Building, Road, Street, Tree, Vehicle

LANE_1: Final = -1.75
"""y of the middle of the lane with traffic along +x, m (chosen)."""

LANE_2: Final = 1.75
"""y of the middle of the lane with traffic along −x, m (chosen)."""

_VEHICLES: Final[tuple[tuple[str, Body, int, float, float], ...]] = (
    # name, body, lane, x of the middle in m, speed in m/s
    ("vehicle-1", "sedan", 1, 0.0, 9.0),
    ("vehicle-2", "hatchback", 1, 22.0, 11.2),
    ("vehicle-3", "van", 2, -2.7, 11.8),
    ("vehicle-4", "sedan", 2, 39.17489, 8.4),
    ("target-1", "truck", 2, 14.0, 8.7),
    ("target-2", "van", 1, 39.11348, 11.5),
    ("target-3", "hatchback", 2, -12.83107, 9.2),
    ("target-4", "sedan", 1, -10.66493, 10.1),
)

_BUILDINGS: Final = (
    # x and y of the middle, length along x, width, height in m (chosen)
    (-12.0, -11.0, 18.0, 8.0, 9.0),
    (10.0, -13.5, 16.0, 10.0, 12.0),
    (35.0, -12.0, 24.0, 9.0, 8.0),
    (-8.0, 13.0, 22.0, 10.0, 10.0),
    (18.0, 10.5, 14.0, 8.0, 7.0),
    (40.0, 13.5, 20.0, 12.0, 14.0),
)

_TREES: Final = (
    # x, y, height, crown radius in m (chosen)
    (-24.0, -5.6, 6.5, 1.4),
    (-0.5, -5.5, 5.5, 1.2),
    (20.5, -5.6, 7.0, 1.4),
    (-14.0, 5.6, 6.0, 1.3),
    (7.0, 5.5, 5.0, 1.1),
    (28.0, 5.5, 6.5, 1.3),
)


def paper_street(*, max_edge: float = 0.05, coarseness: float = 1.0) -> Street:
    """The street of the paper's figures 8 to 11 at time 0.

    ``max_edge`` and ``coarseness`` are the fineness of the vehicles' meshes, see `vehicle_mesh`.

    >>> street = paper_street()
    >>> len(street.vehicles), street.vehicles[0].name
    (8, 'vehicle-1')
    """
    return Street(
        road=Road(length=80.0, width=8.0, x=13.0),
        vehicles=tuple(
            Vehicle(
                name=name,
                body=body,
                x=x,
                y=LANE_1 if lane == 1 else LANE_2,
                heading=0.0 if lane == 1 else math.pi,
                speed=speed,
                max_edge=max_edge,
                coarseness=coarseness,
            )
            for name, body, lane, x, speed in _VEHICLES
        ),
        buildings=tuple(
            Building(name=f"building-{k}", x=x, y=y, length=length, width=width, height=height)
            for k, (x, y, length, width, height) in enumerate(_BUILDINGS, start=1)
        ),
        trees=tuple(
            Tree(name=f"tree-{k}", x=x, y=y, height=height, crown_radius=radius)
            for k, (x, y, height, radius) in enumerate(_TREES, start=1)
        ),
    )


def paper_mounts() -> dict[str, tuple[str, Pose]]:
    """Carrier and mount of the four radars, by the radars' names.

    Radar 4 is 0.42 m left of its vehicle's middle. There, its own distance from radar 2 and the
    distance of the metal behind it are both those of the paper.

    >>> {name: round(mount.x, 1) for name, (_, mount) in paper_mounts().items()}
    {'vehicle-1': -2.3, 'vehicle-2': 2.1, 'vehicle-3': 2.6, 'vehicle-4': 2.3}
    """
    return {
        "vehicle-1": ("vehicle-1", bumper_mount("sedan", "rear")),
        "vehicle-2": ("vehicle-2", bumper_mount("hatchback", "front")),
        "vehicle-3": ("vehicle-3", bumper_mount("van", "front")),
        "vehicle-4": ("vehicle-4", bumper_mount("sedan", "front", offset=0.42142)),
    }
