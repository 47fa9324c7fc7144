"""Tests of places for vehicles on lanes: apart from each other, and visible from one."""

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

from polychirp.traffic.shapes import Body
from polychirp.traffic.vehicle import vehicle_size

RANDOM_BODIES: Final[tuple[Body, ...]] = ("sedan", "hatchback", "van")
"""Bodies of random vehicles, drawn with equal probability."""

MAX_AZIMUTH: Final = math.radians(70.0)
"""Greatest azimuth of a vehicle to either side, rad; chosen: within a beam of ±80° (3 dB)."""

MIN_DISTANCE: Final = 3.0
"""Least distance from the viewer to the nearest point of a vehicle, m; chosen."""

SIGHT_MARGIN: Final = 0.15
"""Least distance of a line of sight from other vehicles, along x or y, m; chosen."""

Rectangle = tuple[float, float, float, float]
"""Least and greatest x, least and greatest y, m."""

Eye = tuple[float, float]
"""x and y, m, of the viewer, which is directed along +x, or of another point."""


class Place(NamedTuple):
    """A place for a vehicle of type ``body``: its middle (m), direction, and speed (m/s).

    The direction is along x, or along y if ``is_crossing``; ``oncoming`` reverses it.
    """

    body: Body
    x: float
    y: float
    oncoming: bool
    speed: float
    is_crossing: bool = False

    @property
    def heading(self) -> float:
        """Direction, rad."""
        if self.is_crossing:
            return -0.5 * math.pi if self.oncoming else 0.5 * math.pi
        return math.pi if self.oncoming else 0.0

    @property
    def rectangle(self) -> Rectangle:
        """Rectangle that the vehicle covers without its side mirrors, m."""
        along, across = vehicle_size(self.body)
        length, width = (across, along) if self.is_crossing else (along, across)
        return (self.x - length / 2, self.x + length / 2, self.y - width / 2, self.y + width / 2)


def nearest_point(eye: Eye, box: Rectangle) -> Eye:
    """Nearest point of a rectangle to ``eye``.

    >>> nearest_point((0.0, 0.0), (5.0, 9.0, -1.0, 2.0))
    (5.0, 0.0)
    """
    return min(max(eye[0], box[0]), box[1]), min(max(eye[1], box[2]), box[3])


def is_clear(eye: Eye, point: Eye, box: Rectangle, margin: float = SIGHT_MARGIN) -> bool:
    """True if the line from ``eye`` to ``point`` misses ``box`` widened by ``margin`` (m).

    >>> is_clear((0.0, 0.0), (9.0, 0.0), (4.0, 5.0, -1.0, 1.0))
    False
    >>> is_clear((0.0, 0.0), (9.0, 0.0), (4.0, 5.0, 1.0, 2.0))
    True
    """
    enter, leave = 0.0, 1.0
    for start, end, low, high in (
        (eye[0], point[0], box[0] - margin, box[1] + margin),
        (eye[1], point[1], box[2] - margin, box[3] + margin),
    ):
        if start == end:
            if not low < start < high:
                return True
            continue
        first, second = sorted(((low - start) / (end - start), (high - start) / (end - start)))
        enter, leave = max(enter, first), min(leave, second)
    return enter >= leave


def is_ahead(eye: Eye, point: Eye, reach: float) -> bool:
    """True if a point is at `MIN_DISTANCE` to ``reach`` (m), and within ±`MAX_AZIMUTH` of +x."""
    distance = math.dist(eye, point)
    azimuth = math.atan2(point[1] - eye[1], point[0] - eye[0])
    return MIN_DISTANCE < distance < reach and abs(azimuth) < MAX_AZIMUTH


def are_apart(first: Rectangle, second: Rectangle, gap: float) -> bool:
    """True if two rectangles are ``gap`` (m) apart along x, or share no y."""
    return (
        first[1] + gap <= second[0]
        or second[1] + gap <= first[0]
        or first[3] <= second[2]
        or second[3] <= first[2]
    )


def are_apart_across(first: Rectangle, second: Rectangle, gap: float) -> bool:
    """True if two rectangles are ``gap`` (m) apart along y, or share no x.

    >>> are_apart_across((0.0, 2.0, 0.0, 4.0), (1.0, 3.0, 5.0, 9.0), 1.5)
    False
    """
    return are_apart((*first[2:], *first[:2]), (*second[2:], *second[:2]), gap)


def hides_none(eye: Eye, box: Rectangle, points: Sequence[Eye]) -> bool:
    """True if the rectangle ``box`` hides none of ``points`` from ``eye``."""
    return all(is_clear(eye, point, box) for point in points)


def is_seen(eye: Eye, box: Rectangle, others: Sequence[Rectangle]) -> bool:
    """True if none of the ``others`` hides the nearest point of ``box`` from ``eye``."""
    point = nearest_point(eye, box)
    return all(is_clear(eye, point, other) for other in others)
