"""Blocked intervals of excess path length in half-planes about a line of sight.

Each half-plane ends at the line of sight of two radars, which are d apart. A point in it has a
depth z along the line of sight from the transmitter, a height ρ over the line, and distances r₁ and
r₂ from the radars. Its excess is the detour r₁ + r₂ − d. Intervals that overlap are united.
"""

import math
from typing import NamedTuple

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector
from polychirp.jit import inlined, inner

NUM_AZIMUTHS = 720
"""Number of half-planes about a line of sight. Chosen: half of them would save 1 % of a trial, and
be wrong by twice as much; between them, straight edges are exact."""

MAX_INTERVALS = 48
"""Greatest number of blocked intervals in a half-plane. Chosen; of more, the closest two unite."""

NOT_BLOCKED = -1.0
"""Result, m, of a search for a blocked interval that found none; less than every excess."""

EXCESS, DEPTH, HEIGHT = 0, 1, 2
"""Columns of `Blocked.edge`."""

NEAR_SIDE, FAR_SIDE = 0, 1
"""Sides of a blocked interval: its least and its greatest excess."""


class EdgePoint(NamedTuple):
    """A point of a half-plane where an obstacle begins or ceases to block, m."""

    excess: float
    depth: float
    height: float


class Blocked(NamedTuple):
    """Blocked intervals of excess in every half-plane, in rising order.

    ``filled`` ``(azimuth,)`` is their number; ``edge`` ``(azimuth, interval, side, 3)`` are excess,
    depth and height of the near and the far side, m; ``owner`` ``(azimuth, interval, side)`` is the
    number of the obstacle at that side.
    """

    filled: IntArray
    edge: FloatArray
    owner: IntArray


@inlined
def excess_of(depth: float, height: float, length: float) -> float:
    """Excess, m, of a point of a half-plane about a line of sight of ``length`` (m)."""
    beyond = length - depth
    near = math.sqrt(depth * depth + height * height)
    return near + math.sqrt(beyond * beyond + height * height) - length


@inlined
def height_of(p: Vector) -> float:
    """Distance of a point from the line of sight, m."""
    return math.sqrt(p[1] * p[1] + p[2] * p[2])


@inner
def _copy_side(blocked: Blocked, azimuth: int, source: int, target: int, side: int) -> None:
    for column in range(3):
        blocked.edge[azimuth, target, side, column] = blocked.edge[azimuth, source, side, column]
    blocked.owner[azimuth, target, side] = blocked.owner[azimuth, source, side]


@inner
def _copy(blocked: Blocked, azimuth: int, source: int, target: int) -> None:
    for side in range(2):
        _copy_side(blocked, azimuth, source, target, side)


@inner
def _remove(blocked: Blocked, azimuth: int, place: int) -> None:
    last = blocked.filled[azimuth] - 1
    for i in range(place, last):
        _copy(blocked, azimuth, i + 1, i)
    blocked.filled[azimuth] = last


@inner
def _fuse_closest(blocked: Blocked, azimuth: int) -> None:
    """Unite the two intervals with the narrowest gap between them."""
    edge, best, least = blocked.edge, 0, np.inf
    for i in range(blocked.filled[azimuth] - 1):
        gap = edge[azimuth, i + 1, NEAR_SIDE, EXCESS] - edge[azimuth, i, FAR_SIDE, EXCESS]
        if gap < least:
            best, least = i, gap
    _copy_side(blocked, azimuth, best + 1, best, FAR_SIDE)
    _remove(blocked, azimuth, best + 1)


@inlined
def _write_side(
    blocked: Blocked, azimuth: int, place: int, side: int, point: EdgePoint, owner: int
) -> None:
    # element by element, because a view of a row would count references atomically
    blocked.edge[azimuth, place, side, EXCESS] = point.excess
    blocked.edge[azimuth, place, side, DEPTH] = point.depth
    blocked.edge[azimuth, place, side, HEIGHT] = point.height
    blocked.owner[azimuth, place, side] = owner


@inner
def block(
    blocked: Blocked, azimuth: int, near: EdgePoint, far: EdgePoint, owner: int, touch: float
) -> None:
    """Add an interval of excess to those of a half-plane, and unite it with those it overlaps.

    Intervals also count as overlapping if the gap between them is at most ``touch`` (m).
    """
    edge = blocked.edge
    count = blocked.filled[azimuth]
    place = 0
    while place < count and edge[azimuth, place, FAR_SIDE, EXCESS] < near.excess - touch:
        place += 1
    if place < count and edge[azimuth, place, NEAR_SIDE, EXCESS] <= far.excess + touch:
        # widen the interval, and unite it with the later ones that it now reaches
        if near.excess < edge[azimuth, place, NEAR_SIDE, EXCESS]:
            _write_side(blocked, azimuth, place, NEAR_SIDE, near, owner)
        if far.excess > edge[azimuth, place, FAR_SIDE, EXCESS]:
            _write_side(blocked, azimuth, place, FAR_SIDE, far, owner)
            while (
                place + 1 < blocked.filled[azimuth]
                and edge[azimuth, place + 1, NEAR_SIDE, EXCESS] <= far.excess + touch
            ):
                if edge[azimuth, place + 1, FAR_SIDE, EXCESS] > far.excess:
                    _copy_side(blocked, azimuth, place + 1, place, FAR_SIDE)
                _remove(blocked, azimuth, place + 1)
        return
    if count == MAX_INTERVALS:
        _fuse_closest(blocked, azimuth)
        block(blocked, azimuth, near, far, owner, touch)
        return
    for i in range(count, place, -1):
        _copy(blocked, azimuth, i - 1, i)
    _write_side(blocked, azimuth, place, NEAR_SIDE, near, owner)
    _write_side(blocked, azimuth, place, FAR_SIDE, far, owner)
    blocked.filled[azimuth] = count + 1


@inlined
def reach_from_axis(blocked: Blocked, azimuth: int, touch: float) -> float:
    """Excess (m) up to which all is blocked from the line of sight outwards, or `NOT_BLOCKED`."""
    if blocked.filled[azimuth] == 0 or blocked.edge[azimuth, 0, NEAR_SIDE, EXCESS] > touch:
        return NOT_BLOCKED
    return float(blocked.edge[azimuth, 0, FAR_SIDE, EXCESS])


@inlined
def reach_from(blocked: Blocked, azimuth: int, excess: float) -> float:
    """Excess (m) up to which all is blocked from ``excess`` on, or `NOT_BLOCKED`."""
    edge = blocked.edge
    for i in range(blocked.filled[azimuth]):
        far = edge[azimuth, i, FAR_SIDE, EXCESS]
        if far >= excess:
            return float(far) if edge[azimuth, i, NEAR_SIDE, EXCESS] <= excess else NOT_BLOCKED
    return NOT_BLOCKED


@inlined
def half_plane_near(p: Vector) -> int:
    """Number of the half-plane at a point, or of one beside it: quicker than an arctangent."""
    y, z = abs(p[1]), abs(p[2])
    ratio = min(y, z) / max(y, z, 1e-12)
    angle = ratio * (0.9724 - 0.1919 * ratio * ratio)  # arctangent, wrong by 0.005 rad at most
    angle = 0.5 * math.pi - angle if z > y else angle
    angle = math.pi - angle if p[1] < 0.0 else angle
    number = int(angle * (NUM_AZIMUTHS / (2 * math.pi)))
    return NUM_AZIMUTHS - 1 - number if p[2] < 0.0 else number
