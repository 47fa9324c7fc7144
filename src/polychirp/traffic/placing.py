"""Places for vehicles on lanes along x: apart from each other, and in sight of one that looks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

from polychirp.traffic.shapes import Body
from polychirp.traffic.vehicle import vehicle_size

BODIES: Final[tuple[Body, ...]] = ("sedan", "hatchback", "van")
"""Drawn alike."""

GREATEST_BEARING: Final = math.radians(70.0)
"""Either way, of what is in sight: a beam of 160° has lost 3 dB at 80°."""

NEAREST: Final = 3.0
"""m, to the nearest point of any vehicle."""

MARGIN: Final = 0.15
"""m, by which a line of sight passes other vehicles."""

Rectangle = tuple[float, float, float, float]
"""m: least and greatest x, least and greatest y."""

Eye = tuple[float, float]
"""m: x and y of what looks along +x."""


class Place(NamedTuple):
    """A vehicle that is to be: its middle, m, where it heads, and its speed, m/s."""

    body: Body
    x: float
    y: float
    oncoming: bool
    speed: float

    @property
    def rectangle(self) -> Rectangle:
        """That it covers, without mirrors."""
        length, width = vehicle_size(self.body)
        return (
            self.x - length / 2,
            self.x + length / 2,
            self.y - width / 2,
            self.y + width / 2,
        )


def nearest_point(eye: Eye, box: Rectangle) -> Eye:
    """Of a rectangle, to ``eye``.

    >>> nearest_point((0.0, 0.0), (5.0, 9.0, -1.0, 2.0))
    (5.0, 0.0)
    """
    return min(max(eye[0], box[0]), box[1]), min(max(eye[1], box[2]), box[3])


def is_clear(eye: Eye, point: Eye, box: Rectangle, margin: float = MARGIN) -> bool:
    """Whether the straight line from ``eye`` to ``point`` misses a rectangle by ``margin``, m.

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
    """Whether a point lies within ``reach``, m, and not too far to the side."""
    distance = math.dist(eye, point)
    bearing = math.atan2(point[1] - eye[1], point[0] - eye[0])
    return NEAREST < distance < reach and abs(bearing) < GREATEST_BEARING


def are_apart(first: Rectangle, second: Rectangle, gap: float) -> bool:
    """Whether two rectangles keep ``gap``, m, along x, or share no y at all."""
    return (
        first[1] + gap <= second[0]
        or second[1] + gap <= first[0]
        or first[3] <= second[2]
        or second[3] <= first[2]
    )


def hides_none(eye: Eye, box: Rectangle, points: Sequence[Eye]) -> bool:
    """Whether a rectangle leaves all of ``points`` in sight."""
    return all(is_clear(eye, point, box) for point in points)


def is_seen(eye: Eye, box: Rectangle, others: Sequence[Rectangle]) -> bool:
    """Whether no other rectangle hides the nearest point of ``box``."""
    point = nearest_point(eye, box)
    return all(is_clear(eye, point, other) for other in others)
