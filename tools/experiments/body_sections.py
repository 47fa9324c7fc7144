"""Cross sections of every body of the road over aspect, as a radar at 10 m reads them.

Vehicles and street furniture are meshes, whose echo is physical optics of one bounce; road users
are moving parts, of which the mean over a cycle of their movement counts. The radar is at 79 GHz
and sees the bodies with V polarisation from a bumper's height, in free space.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.point_vehicles.scattering_points import lobe_points
from polychirp.channel.rcs import cross_sections
from polychirp.channel.tracers.composite import Composite
from polychirp.model.mesh import Mesh
from polychirp.traffic.fittings import Fittings
from polychirp.traffic.furniture import Bollard, TrafficSign
from polychirp.traffic.road_users import Bicycle, Motorcycle, Pedestrian, RoadUser
from polychirp.traffic.vehicle import vehicle_mesh
from tools.figures.road_users import cross_sections as sections_of_parts

DISTANCE: Final = 10.0
"""Range of the radar from the middle of a body, m."""

TRUCK_DISTANCE: Final = 30.0
"""The same of the articulated truck, which is 16.5 m long, m."""

HEIGHT: Final = 0.5
"""Height of the radar above the road, m."""

STEP: Final = 1.0
"""Step of the aspects, degrees."""

INSTANTS: Final = 8
"""Instants of a cycle over which road users are averaged."""

SECTORS: Final = {"front": (0.0, 10.0), "side": (90.0, 10.0), "rear": (180.0, 10.0)}
"""Middle and half width of the sectors, degrees."""

CARS: Final = "a car of 3GPP TR 38.901, below"
STANDARD: Final = "3GPP TR 38.901, clause 7.9.2.1, at the horizon"
PEOPLE: Final = "−8 to 0 dBsm (JRC EUR 25762, 2013)"
CHILDREN: Final = "lower than adults (JRC EUR 25762, 2013)"
BICYCLES: Final = "−3 to 5 dBsm at 77 to 79 GHz"
MOTORCYCLES: Final = "0 to 10 dBsm at 77 to 79 GHz"
UNKNOWN: Final = "none that we could read"
"""Publications that the values are compared with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyRow:
    """Cross sections of one body.

    ``level`` ``(aspect,)`` is dBsm at every `STEP` from ahead to ahead, left side first;
    ``sectors`` holds medians of the `SECTORS`, dBsm; ``mean`` that of powers over all aspects, and
    ``median``, dBsm. ``source`` says what is published.
    """

    name: str
    group: str
    distance: float
    mean: float
    median: float
    sectors: dict[str, float]
    source: str
    level: tuple[float, ...]


def bodies() -> Iterator[BodyRow]:
    """Every body in turn; some minutes of one core."""
    for shape in ("sedan", "hatchback", "van", "truck"):
        source = CARS if shape in ("sedan", "hatchback") else UNKNOWN
        yield _of_mesh(shape, "vehicles", vehicle_mesh(shape), source)
        fitted = vehicle_mesh(shape, fittings=Fittings())
        yield _of_mesh(f"{shape} with fittings", "vehicles", fitted, source)
    truck = vehicle_mesh("articulated-truck")
    yield _of_mesh("articulated truck", "vehicles", truck, UNKNOWN, distance=TRUCK_DISTANCE)
    yield _row("TR 38.901, a car", "vehicles", DISTANCE, _of_the_standard(), STANDARD)
    for name, (moments, source) in _road_users().items():
        found = [sections_of_parts(one, _aspects(), distance=DISTANCE) for one in moments]
        rcs = np.asarray(np.mean(found, axis=0), dtype=np.float64)
        yield _row(name, "road users", DISTANCE, rcs, source)
    bollard = Bollard(name="f", x=0.0, y=0.0).actor().mesh
    yield _of_mesh("bollard", "street furniture", bollard, UNKNOWN)
    sign = TrafficSign(name="f", x=0.0, y=0.0).actor().mesh
    yield _of_mesh("traffic sign", "street furniture", sign, UNKNOWN)


def _road_users() -> dict[str, tuple[list[RoadUser], str]]:
    """Road users at `INSTANTS` of a cycle, and what is published about them."""
    phases = [number / INSTANTS for number in range(INSTANTS)]
    return {
        "adult who walks": (
            [Pedestrian(name="u", x=0.0, y=0.0, speed=1.4, phase=phase) for phase in phases],
            PEOPLE,
        ),
        "child who walks": (
            [
                Pedestrian(name="u", x=0.0, y=0.0, speed=1.2, height=1.15, phase=phase)
                for phase in phases
            ],
            CHILDREN,
        ),
        "bicycle with rider": (
            [Bicycle(name="u", x=0.0, y=0.0, speed=5.0, phase=phase) for phase in phases],
            BICYCLES,
        ),
        "motorcycle with rider": (
            [Motorcycle(name="u", x=0.0, y=0.0, speed=14.0, phase=phase) for phase in phases],
            MOTORCYCLES,
        ),
    }


def _aspects() -> FloatArray:
    return np.asarray(np.radians(np.arange(0.0, 360.0, STEP)))


def _of_mesh(
    name: str, group: str, mesh: Mesh, source: str, *, distance: float = DISTANCE
) -> BodyRow:
    corners = mesh.corners.reshape(-1, 3)
    middle = 0.5 * float(corners[:, 2].min() + corners[:, 2].max())
    found = cross_sections(
        mesh,
        _aspects(),
        tracer=Composite(max_bounces=1),
        distance=distance,
        elevation=math.asin((HEIGHT - middle) / distance),
    )
    return _row(name, group, distance, found.rcs[:, 0, 0], source)


def _of_the_standard() -> FloatArray:
    aspect = _aspects()
    towards = np.stack([np.cos(aspect), np.sin(aspect), np.zeros_like(aspect)], axis=-1)
    point = np.zeros(aspect.size, dtype=np.int64)
    return np.asarray(lobe_points("one").cross_section(point, towards, towards))


def _row(name: str, group: str, distance: float, rcs: FloatArray, source: str) -> BodyRow:
    degrees = np.degrees(_aspects())
    degrees = np.where(degrees > 180.0, degrees - 360.0, degrees)
    level = 10.0 * np.log10(np.maximum(rcs, 1e-9))

    def median(at: float, half: float) -> float:
        return float(np.median(level[np.abs(np.abs(degrees) - at) <= half + 1e-9]))

    return BodyRow(
        name=name,
        group=group,
        distance=distance,
        mean=float(10.0 * np.log10(np.mean(rcs))),
        median=float(np.median(level)),
        sectors={sector: median(*place) for sector, place in SECTORS.items()},
        source=source,
        level=tuple(float(value) for value in level),
    )
