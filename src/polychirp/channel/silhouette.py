"""Kernels of diffraction: where half-planes about a line of sight are blocked, and edge waves.

`diffraction` says what they compute and why. All lengths are in the frame of the pair: origin at
the transmitter, first axis towards the receiver. In the half-plane at an azimuth, a point has a
depth z along the axis and a height ρ above it; its excess is r₁ + r₂ − d.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.caster import Vector
from polychirp.channel.world import SKIN

NUM_AZIMUTHS = 360
"""Half-planes about a line of sight; straight edges between two of them are exact."""

CELL = 0.02
"""m of excess length: width of the smooth cells in which edge waves are gathered."""

CAPACITY = 48
"""Separate blocked intervals kept in a half-plane; of more, those closest together are fused."""

NUM_MOMENTS = 8
"""Of a cell: field (1), field-weighted excess (1) and two directions (3 + 3)."""

NUM_SPREADS = 6
"""Of a cell, weighted by magnitude: weight (1), edge point (3), rate and its square (2)."""

TOUCH = 1e-5
"""rad of phase between two blocked intervals that are one, or between one and the axis."""


class Obstacles(NamedTuple):
    """What may stand in one pair's way.

    ``box`` … ``triangle`` as in `Tree`; ``nodes`` ``(body, 2)``, ``turn``, ``shift`` ``(body, …)``
    from a body's frame to the pair's; ``sheet`` m ``(sheet, 9)`` triangles in the pair's frame.
    """

    box: FloatArray
    skip: IntArray
    first: IntArray
    size: IntArray
    triangle: FloatArray
    nodes: IntArray
    turn: FloatArray
    shift: FloatArray
    sheet: FloatArray


class Pair(NamedTuple):
    """A transmitter at the origin and a receiver ``length`` m away along the first axis.

    ``farthest`` m, the excess to which edges are sought; ``wavenumber`` 1/m; ``there``, ``home``
    m/s ``(slot, xyz)``: velocity of an actor in the way, from either end.
    """

    length: float
    farthest: float
    wavenumber: float
    there: FloatArray
    home: FloatArray


class Blocked(NamedTuple):
    """Blocked intervals of excess in every half-plane, in rising order.

    ``filled`` ``(azimuth,)`` how many; ``edge`` ``(azimuth, interval, side, 3)`` excess, depth and
    height of the near and the far side in m; ``owner`` ``(azimuth, interval, side)`` the obstacle.
    """

    filled: IntArray
    edge: FloatArray
    owner: IntArray


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _excess(depth: float, height: float, length: float) -> float:
    beyond = length - depth
    near = math.sqrt(depth * depth + height * height)
    return near + math.sqrt(beyond * beyond + height * height) - length


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _height(p: Vector) -> float:
    return math.sqrt(p[1] * p[1] + p[2] * p[2])


@njit(cache=True, nogil=True, error_model="numpy")
def _copy(blocked: Blocked, azimuth: int, source: int, target: int) -> None:
    for side in range(2):
        for a in range(3):
            blocked.edge[azimuth, target, side, a] = blocked.edge[azimuth, source, side, a]
        blocked.owner[azimuth, target, side] = blocked.owner[azimuth, source, side]


@njit(cache=True, nogil=True, error_model="numpy")
def _remove(blocked: Blocked, azimuth: int, place: int) -> None:
    last = blocked.filled[azimuth] - 1
    for i in range(place, last):
        _copy(blocked, azimuth, i + 1, i)
    blocked.filled[azimuth] = last


@njit(cache=True, nogil=True, error_model="numpy")
def _fuse_closest(blocked: Blocked, azimuth: int) -> None:
    """Close the narrowest gap between two intervals."""
    edge, best, least = blocked.edge[azimuth], 0, np.inf
    for i in range(blocked.filled[azimuth] - 1):
        gap = edge[i + 1, 0, 0] - edge[i, 1, 0]
        if gap < least:
            best, least = i, gap
    edge[best, 1] = edge[best + 1, 1]
    blocked.owner[azimuth, best, 1] = blocked.owner[azimuth, best + 1, 1]
    _remove(blocked, azimuth, best + 1)


@njit(cache=True, nogil=True, error_model="numpy")
def _block(
    blocked: Blocked, azimuth: int, near: Vector, far: Vector, owner: int, touch: float
) -> None:
    """Add an interval of excess to those of a half-plane, and unite what overlaps."""
    edge, owners = blocked.edge[azimuth], blocked.owner[azimuth]
    count = blocked.filled[azimuth]
    place = 0
    while place < count and edge[place, 1, 0] < near[0] - touch:
        place += 1
    if place < count and edge[place, 0, 0] <= far[0] + touch:
        if near[0] < edge[place, 0, 0]:
            edge[place, 0, 0], edge[place, 0, 1], edge[place, 0, 2] = near
            owners[place, 0] = owner
        if far[0] > edge[place, 1, 0]:
            edge[place, 1, 0], edge[place, 1, 1], edge[place, 1, 2] = far
            owners[place, 1] = owner
            while place + 1 < blocked.filled[azimuth] and edge[place + 1, 0, 0] <= far[0] + touch:
                if edge[place + 1, 1, 0] > far[0]:
                    edge[place, 1] = edge[place + 1, 1]
                    owners[place, 1] = owners[place + 1, 1]
                _remove(blocked, azimuth, place + 1)
        return
    if count == CAPACITY:
        _fuse_closest(blocked, azimuth)
        _block(blocked, azimuth, near, far, owner, touch)
        return
    for i in range(count, place, -1):
        _copy(blocked, azimuth, i - 1, i)
    edge[place, 0, 0], edge[place, 0, 1], edge[place, 0, 2] = near
    edge[place, 1, 0], edge[place, 1, 1], edge[place, 1, 2] = far
    owners[place, 0] = owners[place, 1] = owner
    blocked.filled[azimuth] = count + 1


@njit(cache=True, nogil=True, error_model="numpy")
def _nearest(az: float, ah: float, bz: float, bh: float, length: float) -> Vector:
    """Least excess along a straight line in a half-plane: where a mirror there would reflect."""
    wz, wh = bz - az, bh - ah
    square = wz * wz + wh * wh
    t = 0.0
    if square > 0.0:
        # places and distances of both ends' feet on the line
        above, below = abs(ah * wz - az * wh), abs((length - az) * wh + ah * wz)
        foot, other = -(az * wz + ah * wh), (length - az) * wz - ah * wh
        share = above / (above + below) if above + below > 0.0 else 0.5
        t = min(1.0, max(0.0, (foot + (other - foot) * share) / square))
    z, h = az + t * wz, ah + t * wh
    return _excess(z, h, length), z, h


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _reach_from_axis(blocked: Blocked, azimuth: int, touch: float) -> float:
    """Excess up to which all is blocked from the axis on; negative where the axis is free."""
    if blocked.filled[azimuth] == 0 or blocked.edge[azimuth, 0, 0, 0] > touch:
        return -1.0
    return float(blocked.edge[azimuth, 0, 1, 0])


@njit(cache=True, nogil=True, error_model="numpy")
def _block_line(
    blocked: Blocked,
    azimuth: int,
    line: tuple[float, float, float, float],
    length: float,
    owner: int,
    touch: float,
) -> None:
    """Block what a straight line in the full plane at an azimuth covers of its upper half."""
    az, ah, bz, bh = line
    if ah < 0.0 and bh < 0.0:
        return
    if ah < 0.0:
        az, ah = az + (bz - az) * ah / (ah - bh), 0.0
    elif bh < 0.0:
        bz, bh = bz + (az - bz) * bh / (bh - ah), 0.0
    if az > bz:
        az, ah, bz, bh = bz, bh, az, ah
    low, high = SKIN, length - SKIN
    if bz <= low or az >= high:
        return
    if az < low:
        az, ah = low, ah + (bh - ah) * (low - az) / (bz - az)
    if bz > high:
        bz, bh = high, bh + (ah - bh) * (bz - high) / (bz - az)
    # the sum of two distances is convex: greatest at an end
    a, b = _excess(az, ah, length), _excess(bz, bh, length)
    if max(a, b) <= max(touch, _reach_from_axis(blocked, azimuth, touch)):
        return
    near = _nearest(az, ah, bz, bh, length)
    _block(blocked, azimuth, near, (a, az, ah) if a > b else (b, bz, bh), owner, touch)


@njit(cache=True, nogil=True, error_model="numpy")
def _azimuths(p: Vector, q: Vector, r: Vector) -> tuple[int, int]:
    """First and last of the half-planes that a triangle meets; last < first for none."""
    a = p[1] * q[2] - p[2] * q[1]
    b = q[1] * r[2] - q[2] * r[1]
    c = r[1] * p[2] - r[2] * p[1]
    if (a >= 0.0 and b >= 0.0 and c >= 0.0) or (a <= 0.0 and b <= 0.0 and c <= 0.0):
        return 0, NUM_AZIMUTHS - 1
    # off the axis a triangle spans less than π, on either side of its middle
    my, mx = p[2] + q[2] + r[2], p[1] + q[1] + r[1]
    low = high = 0.0
    for v in (p, q, r):
        off = math.atan2(mx * v[2] - my * v[1], mx * v[1] + my * v[2])
        low, high = min(low, off), max(high, off)
    step = 2 * math.pi / NUM_AZIMUTHS
    middle = math.atan2(my, mx)
    # half a step off, so that no edge along the vertical or the horizontal falls on a half-plane
    return (
        math.ceil((middle + low) / step - 0.5),
        math.floor((middle + high) / step - 0.5),
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _cut(p: Vector, q: Vector, cosine: float, sine: float) -> tuple[float, float]:
    """Depth and height at which the side of a triangle crosses the plane at an azimuth."""
    a, b = cosine * p[2] - sine * p[1], cosine * q[2] - sine * q[1]
    t = a / (a - b)
    low, high = cosine * p[1] + sine * p[2], cosine * q[1] + sine * q[2]
    return p[0] + t * (q[0] - p[0]), low + t * (high - low)


@njit(cache=True, nogil=True, error_model="numpy")
def _block_triangle(
    blocked: Blocked,
    corners: tuple[Vector, Vector, Vector],
    length: float,
    owner: int,
    touch: float,
    way: FloatArray,
) -> None:
    """Block what a triangle covers in every half-plane. ``way``: their cosines and sines."""
    p, q, r = corners
    begin, end = _azimuths(p, q, r)
    for number in range(begin, end + 1):
        i = number % NUM_AZIMUTHS
        c, s = way[i, 0], way[i, 1]
        a, b, d = c * p[2] - s * p[1] > 0, c * q[2] - s * q[1] > 0, c * r[2] - s * r[1] > 0
        if a == b == d:
            continue
        # the corner that is alone on its side
        if a == b:
            one, other = _cut(r, p, c, s), _cut(r, q, c, s)
        elif a == d:
            one, other = _cut(q, p, c, s), _cut(q, r, c, s)
        else:
            one, other = _cut(p, q, c, s), _cut(p, r, c, s)
        line = (one[0], one[1], other[0], other[1])
        _block_line(blocked, i, line, length, owner, touch)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _faces(triangle: FloatArray, start: Vector, end: Vector) -> int:
    """How many of both ends are in front of a triangle: 0, 1 or 2."""
    ux, uy, uz = triangle[3], triangle[4], triangle[5]
    vx, vy, vz = triangle[6], triangle[7], triangle[8]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    foot = nx * triangle[0] + ny * triangle[1] + nz * triangle[2]
    one = nx * start[0] + ny * start[1] + nz * start[2] > foot
    other = nx * end[0] + ny * end[1] + nz * end[2] > foot
    return (1 if one else 0) + (1 if other else 0)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _to_box(box: FloatArray, point: Vector) -> float:
    """Distance from a point to a box."""
    total = 0.0
    for a in range(3):
        off = max(box[a] - point[a], 0.0, point[a] - box[3 + a])
        total += off * off
    return math.sqrt(total)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _turned(m: FloatArray, x: float, y: float, z: float) -> Vector:
    return (
        m[0, 0] * x + m[0, 1] * y + m[0, 2] * z,
        m[1, 0] * x + m[1, 1] * y + m[1, 2] * z,
        m[2, 0] * x + m[2, 1] * y + m[2, 2] * z,
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@njit(cache=True, nogil=True, error_model="numpy")
def _is_hidden(
    blocked: Blocked, box: FloatArray, m: FloatArray, origin: Vector, length: float, touch: float
) -> bool:
    """Whether a box is inside what is blocked from the axis on, so that it changes nothing."""
    c = _sum(
        _turned(m, 0.5 * (box[0] + box[3]), 0.5 * (box[1] + box[4]), 0.5 * (box[2] + box[5])),
        origin,
    )
    step = 2 * math.pi / NUM_AZIMUTHS
    middle = math.atan2(c[2], c[1])
    nearest = math.floor(middle / step) % NUM_AZIMUTHS
    far = _height(c)
    if _reach_from_axis(blocked, nearest, touch) < _excess(c[0], far, length):
        return False
    most, square = 0.0, 0.0
    for corner in range(8):
        x = box[3 if corner & 1 else 0]
        y = box[4 if corner & 2 else 1]
        z = box[5 if corner & 4 else 2]
        p = _sum(_turned(m, x, y, z), origin)
        most = max(most, _excess(p[0], _height(p), length))
        square = max(square, (p[1] - c[1]) ** 2 + (p[2] - c[2]) ** 2)
    size = math.sqrt(square)
    half = math.asin(size / far) if size < far else math.pi
    begin = math.floor((middle - half) / step - 0.5)
    for number in range(begin, math.ceil((middle + half) / step - 0.5) + 1):
        if _reach_from_axis(blocked, number % NUM_AZIMUTHS, touch) < most:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _block_body(
    blocked: Blocked,
    obstacles: Obstacles,
    body: int,
    between: bool,
    reach: tuple[float, float],
    touch: float,
    way: FloatArray,
) -> None:
    """Block what a body's triangles cover that are ``between`` both ends, or behind for both.

    ``reach``: m, length and greatest excess.
    """
    length, farthest = reach
    m, s = obstacles.turn[body], obstacles.shift[body]
    origin = (s[0], s[1], s[2])
    start = _turned(m.T, -s[0], -s[1], -s[2])
    end = _turned(m.T, length - s[0], -s[1], -s[2])
    node, stop = obstacles.nodes[body]
    while node < stop:
        box = obstacles.box[node]
        is_far = _to_box(box, start) + _to_box(box, end) > length + farthest
        if is_far or _is_hidden(blocked, box, m, origin, length, touch):
            node = obstacles.skip[node]
            continue
        begin = obstacles.first[node]
        for number in range(begin, begin + obstacles.size[node]):
            t = obstacles.triangle[number]
            if _faces(t, start, end) != (1 if between else 0):
                continue
            p = _sum(_turned(m, t[0], t[1], t[2]), origin)
            u, v = _turned(m, t[3], t[4], t[5]), _turned(m, t[6], t[7], t[8])
            q, r = _sum(p, u), _sum(p, v)
            low, high = min(p[0], q[0], r[0]), max(p[0], q[0], r[0])
            if high > SKIN and low < length - SKIN:
                _block_triangle(blocked, (p, q, r), length, body, touch, way)
        node += 1


@njit(cache=True, nogil=True, error_model="numpy")
def blocked_intervals(
    obstacles: Obstacles, length: float, farthest: float, touch: float
) -> Blocked:
    """Which excesses up to ``farthest`` (m) obstacles block, in every half-plane.

    What is between both ends comes first: it hides most of the rest.
    """
    blocked = Blocked(
        np.zeros(NUM_AZIMUTHS, dtype=np.int64),
        np.empty((NUM_AZIMUTHS, CAPACITY + 1, 2, 3)),
        np.empty((NUM_AZIMUTHS, CAPACITY + 1, 2), dtype=np.int64),
    )
    angle = (np.arange(NUM_AZIMUTHS) + 0.5) * (2 * math.pi / NUM_AZIMUTHS)
    way = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    num_bodies = obstacles.nodes.shape[0]
    for number in range(obstacles.sheet.shape[0]):
        t = obstacles.sheet[number]
        corners = ((t[0], t[1], t[2]), (t[3], t[4], t[5]), (t[6], t[7], t[8]))
        _block_triangle(blocked, corners, length, num_bodies + number, touch, way)
    for between in (True, False):
        for body in range(num_bodies):
            _block_body(blocked, obstacles, body, between, (length, farthest), touch, way)
    return blocked


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _smooth(x: float) -> float:
    """0 below 0, 1 above 1, without a kink."""
    x = min(1.0, max(0.0, x))
    return x * x * (3.0 - 2.0 * x)


@njit(cache=True, nogil=True, error_model="numpy")
def _weight(depth: float, height: float, excess: float, length: float, farthest: float) -> float:
    """½(1 + cos θ) of an edge's wave, and what the cut-offs leave of it."""
    beyond, square = length - depth, height * height
    legs = math.sqrt((depth * depth + square) * (beyond * beyond + square))
    oblique = 0.5 * (1.0 + (depth * beyond - square) / legs)
    ends = _smooth(depth / SKIN - 1.0) * _smooth(beyond / SKIN - 1.0)
    return oblique * ends * (1.0 - _smooth(2.0 * excess / farthest - 1.0))


class Waves(NamedTuple):
    """Edge waves gathered in cells of excess, for every actor in the way.

    ``moments`` ``(slot, cell, NUM_MOMENTS)``, ``spreads`` ``(slot, cell, NUM_SPREADS)``.
    """

    moments: ComplexArray
    spreads: FloatArray


@njit(cache=True, nogil=True, error_model="numpy")
def _add_wave(
    waves: Waves, slot: int, point: Vector, excess: float, wave: complex, pair: Pair
) -> None:
    """Add one edge wave to the two cells beside its excess."""
    x, y, z = point
    beyond = x - pair.length
    near, far = math.sqrt(x * x + y * y + z * z), math.sqrt(beyond * beyond + y * y + z * z)
    out = (x / near, y / near, z / near)
    back = (beyond / far, y / far, z / far)
    rate = 0.0
    for a in range(3):
        rate += out[a] * pair.there[slot, a] + back[a] * pair.home[slot, a]
    cell = int(excess / CELL)
    share = _smooth(excess / CELL - cell)
    for side in range(2):
        part = share if side == 1 else 1.0 - share
        into, c = waves.moments[slot, cell + side], wave * part
        into[0] += c
        into[1] += c * excess
        for a in range(3):
            into[2 + a] += c * out[a]
            into[5 + a] += c * back[a]
        real, size = waves.spreads[slot, cell + side], abs(c)
        real[0] += size
        real[1] += size * x
        real[2] += size * y
        real[3] += size * z
        real[4] += size * rate
        real[5] += size * rate * rate


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _on(a: Vector, b: Vector, t: float) -> Vector:
    return a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])


@njit(cache=True, nogil=True, error_model="numpy")
def _add_chord(
    waves: Waves, slot: int, ends: tuple[Vector, Vector], sign: float, pair: Pair
) -> None:
    """Add a straight piece of edge, in parts over which the phase is all but linear."""
    p, q = ends
    before = _excess(p[0], _height(p), pair.length)
    last = _excess(q[0], _height(q), pair.length)
    if min(before, last) >= pair.farthest:
        return
    turns = 0.5 * pair.wavenumber * abs(last - before)
    parts = 1 + int(min(turns, 31.0))
    start = p
    for number in range(parts):
        end, middle = _on(p, q, (number + 1) / parts), _on(p, q, (number + 0.5) / parts)
        after = _excess(end[0], _height(end), pair.length)
        height = _height(middle)
        half_way = _excess(middle[0], height, pair.length)
        mean = (before + 4.0 * half_way + after) / 6.0
        if mean < pair.farthest:
            angle = math.atan2(
                start[1] * end[2] - start[2] * end[1], start[1] * end[1] + start[2] * end[2]
            )
            half = 0.5 * pair.wavenumber * (after - before)
            size = sign * angle / (2 * math.pi) * (math.sin(half) / half if half != 0.0 else 1.0)
            size *= _weight(middle[0], height, mean, pair.length, pair.farthest)
            _add_wave(waves, slot, middle, mean, size * _phasor(pair.wavenumber * mean), pair)
        start, before = end, after


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _phasor(phase: float) -> complex:
    return complex(math.cos(phase), -math.sin(phase))


@njit(cache=True, nogil=True, error_model="numpy")
def _add_half(
    waves: Waves, slot: int, edge: FloatArray, azimuth: int, sign: float, pair: Pair
) -> None:
    """Add half a step of azimuth of an edge that ends there."""
    excess = edge[0]
    if excess >= pair.farthest:
        return
    size = 0.5 * sign / NUM_AZIMUTHS * _weight(edge[1], edge[2], excess, pair.length, pair.farthest)
    point = _point(edge, azimuth)
    _add_wave(waves, slot, point, excess, size * _phasor(pair.wavenumber * excess), pair)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _point(edge: FloatArray, azimuth: int) -> Vector:
    angle = (azimuth + 0.5) * (2 * math.pi / NUM_AZIMUTHS)
    return edge[1], edge[2] * math.cos(angle), edge[2] * math.sin(angle)


@njit(cache=True, nogil=True, error_model="numpy")
def _partners(blocked: Blocked, i: int, j: int, side: int, touch: float, out: IntArray) -> None:
    """For every edge of half-plane i the one of half-plane j that goes on from it, or −1."""
    out[:] = -1
    taken = np.zeros(CAPACITY + 1, dtype=np.bool_)
    for a in range(blocked.filled[i]):
        excess = blocked.edge[i, a, side, 0]
        best, least = -1, np.inf
        for b in range(blocked.filled[j]):
            other = blocked.edge[j, b, side, 0]
            is_edge = side == 1 or min(excess, other) > touch
            if is_edge and not taken[b] and abs(excess - other) < least:
                best, least = b, abs(excess - other)
        out[a] = best
        if best >= 0:
            taken[best] = True


@njit(cache=True, nogil=True, error_model="numpy")
def _add_edges(
    waves: Waves, blocked: Blocked, slots: IntArray, side: int, touch: float, pair: Pair
) -> None:
    """Add the waves of all near sides (0) or all far sides (1) of what is blocked."""
    sign = -1.0 if side == 0 else 1.0
    onward = np.empty(CAPACITY + 1, dtype=np.int64)
    for i in range(NUM_AZIMUTHS):
        j = (i + 1) % NUM_AZIMUTHS
        _partners(blocked, i, j, side, touch, onward)
        for a in range(blocked.filled[i]):
            edge, slot = blocked.edge[i, a, side], slots[blocked.owner[i, a, side]]
            if onward[a] >= 0:
                other = blocked.edge[j, onward[a], side]
                _add_chord(waves, slot, (_point(edge, i), _point(other, j)), sign, pair)
            elif side == 1 or edge[0] > touch:
                _add_half(waves, slot, edge, i, sign, pair)
        for b in range(blocked.filled[j]):
            edge = blocked.edge[j, b, side]
            if not np.any(onward[: blocked.filled[i]] == b) and (side == 1 or edge[0] > touch):
                _add_half(waves, slots[blocked.owner[j, b, side]], edge, j, sign, pair)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_axis(
    waves: Waves, blocked: Blocked, slots: IntArray, touch: float, is_clear: bool, pair: Pair
) -> None:
    """Add what half-planes lack whose own axis is not as the line of sight is.

    Where an edge is on the line of sight, half of them are blocked from the axis on.
    """
    depth, slot, count = 0.0, 0, 0
    meets = np.zeros(NUM_AZIMUTHS, dtype=np.bool_)
    for i in range(NUM_AZIMUTHS):
        if blocked.filled[i] > 0 and blocked.edge[i, 0, 0, 0] <= touch:
            meets[i] = True
            depth, slot = blocked.edge[i, 0, 0, 1], slots[blocked.owner[i, 0, 0]]
            count += 1
    if count == 0:
        return
    lacking = -float(count) if is_clear else float(NUM_AZIMUTHS - count)
    size = lacking / NUM_AZIMUTHS * _weight(depth, 0.0, 0.0, pair.length, pair.farthest)
    _add_wave(waves, slot, (depth, 0.0, 0.0), 0.0, complex(size), pair)


@njit(cache=True, nogil=True, error_model="numpy")
def edge_waves(obstacles: Obstacles, slots: IntArray, is_clear: bool, pair: Pair) -> Waves:
    """Waves of a pair's silhouette, in units of its unobstructed field.

    Parameters
    ----------
    slots : of the obstacles, bodies first, ``(obstacle,)``: rows of the result
    is_clear : whether the line of sight is counted by itself
    """
    touch = TOUCH / pair.wavenumber
    num_cells = int(pair.farthest / CELL) + 2
    waves = Waves(
        np.zeros((pair.there.shape[0], num_cells, NUM_MOMENTS), dtype=np.complex128),
        np.zeros((pair.there.shape[0], num_cells, NUM_SPREADS)),
    )
    blocked = blocked_intervals(obstacles, pair.length, pair.farthest, touch)
    if not np.any(blocked.filled):
        return waves
    _add_axis(waves, blocked, slots, touch, is_clear, pair)
    for side in range(2):
        _add_edges(waves, blocked, slots, side, touch, pair)
    return waves
