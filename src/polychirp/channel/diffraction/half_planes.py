"""What is blocked in half-planes about a line of sight: united intervals of excess.

In the half-plane at an azimuth, a point has a depth z along the line of sight and a height ρ above
it; its excess is r₁ + r₂ − d.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.geometry.vectors import Vector

NUM_AZIMUTHS = 360
"""Half-planes about a line of sight; straight edges between two of them are exact."""

CAPACITY = 48
"""Separate blocked intervals kept in a half-plane; of more, those closest together are fused."""


class Blocked(NamedTuple):
    """Blocked intervals of excess in every half-plane, in rising order.

    ``filled`` ``(azimuth,)`` how many; ``edge`` ``(azimuth, interval, side, 3)`` excess, depth and
    height of the near and the far side in m; ``owner`` ``(azimuth, interval, side)`` the obstacle.
    """

    filled: IntArray
    edge: FloatArray
    owner: IntArray


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def excess_of(depth: float, height: float, length: float) -> float:
    """Excess (m) of a point of a half-plane about a line of sight of some length."""
    beyond = length - depth
    near = math.sqrt(depth * depth + height * height)
    return near + math.sqrt(beyond * beyond + height * height) - length


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def height_of(p: Vector) -> float:
    """Distance of a point from the line of sight, m."""
    return math.sqrt(p[1] * p[1] + p[2] * p[2])


@njit(cache=True, nogil=True, error_model="numpy")
def _copy_side(blocked: Blocked, azimuth: int, source: int, target: int, side: int) -> None:
    for a in range(3):
        blocked.edge[azimuth, target, side, a] = blocked.edge[azimuth, source, side, a]
    blocked.owner[azimuth, target, side] = blocked.owner[azimuth, source, side]


@njit(cache=True, nogil=True, error_model="numpy")
def _copy(blocked: Blocked, azimuth: int, source: int, target: int) -> None:
    for side in range(2):
        _copy_side(blocked, azimuth, source, target, side)


@njit(cache=True, nogil=True, error_model="numpy")
def _remove(blocked: Blocked, azimuth: int, place: int) -> None:
    last = blocked.filled[azimuth] - 1
    for i in range(place, last):
        _copy(blocked, azimuth, i + 1, i)
    blocked.filled[azimuth] = last


@njit(cache=True, nogil=True, error_model="numpy")
def _fuse_closest(blocked: Blocked, azimuth: int) -> None:
    """Close the narrowest gap between two intervals."""
    edge, best, least = blocked.edge, 0, np.inf
    for i in range(blocked.filled[azimuth] - 1):
        gap = edge[azimuth, i + 1, 0, 0] - edge[azimuth, i, 1, 0]
        if gap < least:
            best, least = i, gap
    _copy_side(blocked, azimuth, best + 1, best, 1)
    _remove(blocked, azimuth, best + 1)


@njit(cache=True, nogil=True, error_model="numpy")
def block(
    blocked: Blocked, azimuth: int, near: Vector, far: Vector, owner: int, touch: float
) -> None:
    """Add an interval of excess to those of a half-plane, and unite what overlaps."""
    # by whole indices: a view of a row costs an atomic count of its owners
    edge, owners = blocked.edge, blocked.owner
    count = blocked.filled[azimuth]
    place = 0
    while place < count and edge[azimuth, place, 1, 0] < near[0] - touch:
        place += 1
    if place < count and edge[azimuth, place, 0, 0] <= far[0] + touch:
        if near[0] < edge[azimuth, place, 0, 0]:
            edge[azimuth, place, 0, 0], edge[azimuth, place, 0, 1], edge[azimuth, place, 0, 2] = (
                near
            )
            owners[azimuth, place, 0] = owner
        if far[0] > edge[azimuth, place, 1, 0]:
            edge[azimuth, place, 1, 0], edge[azimuth, place, 1, 1], edge[azimuth, place, 1, 2] = far
            owners[azimuth, place, 1] = owner
            while (
                place + 1 < blocked.filled[azimuth]
                and edge[azimuth, place + 1, 0, 0] <= far[0] + touch
            ):
                if edge[azimuth, place + 1, 1, 0] > far[0]:
                    _copy_side(blocked, azimuth, place + 1, place, 1)
                _remove(blocked, azimuth, place + 1)
        return
    if count == CAPACITY:
        _fuse_closest(blocked, azimuth)
        block(blocked, azimuth, near, far, owner, touch)
        return
    for i in range(count, place, -1):
        _copy(blocked, azimuth, i - 1, i)
    edge[azimuth, place, 0, 0], edge[azimuth, place, 0, 1], edge[azimuth, place, 0, 2] = near
    edge[azimuth, place, 1, 0], edge[azimuth, place, 1, 1], edge[azimuth, place, 1, 2] = far
    owners[azimuth, place, 0] = owners[azimuth, place, 1] = owner
    blocked.filled[azimuth] = count + 1


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def reach_from_axis(blocked: Blocked, azimuth: int, touch: float) -> float:
    """Excess up to which all is blocked from the axis on; negative where the axis is free."""
    if blocked.filled[azimuth] == 0 or blocked.edge[azimuth, 0, 0, 0] > touch:
        return -1.0
    return float(blocked.edge[azimuth, 0, 1, 0])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def reach_from(blocked: Blocked, azimuth: int, excess: float) -> float:
    """Excess up to which all is blocked from some excess on; negative where that is free."""
    edge = blocked.edge
    for i in range(blocked.filled[azimuth]):
        if edge[azimuth, i, 1, 0] >= excess:
            return float(edge[azimuth, i, 1, 0]) if edge[azimuth, i, 0, 0] <= excess else -1.0
    return -1.0


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def half_plane_near(p: Vector) -> int:
    """The half-plane of a point, or one beside it: quicker than an arctangent."""
    y, z = abs(p[1]), abs(p[2])
    ratio = min(y, z) / max(y, z, 1e-12)
    angle = ratio * (0.9724 - 0.1919 * ratio * ratio)  # wrong by 0.005 rad at most
    angle = 0.5 * math.pi - angle if z > y else angle
    angle = math.pi - angle if p[1] < 0.0 else angle
    number = int(angle * (NUM_AZIMUTHS / (2 * math.pi)))
    return NUM_AZIMUTHS - 1 - number if p[2] < 0.0 else number
