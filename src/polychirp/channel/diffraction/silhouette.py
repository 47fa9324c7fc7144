"""Silhouettes of bodies and plates about a line of sight: what they block in its half-planes.

`paths` states the equations; `half_planes` defines depth, height and excess. Vectors are in the
frame of the pair of radars, unless a body's frame is named. The pair's frame has its origin at the
transmitter, and its first axis points to the receiver.
"""

import math
from typing import NamedTuple

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.diffraction.half_planes import (
    MAX_INTERVALS,
    NUM_AZIMUTHS,
    Blocked,
    EdgePoint,
    block,
    excess_of,
    half_plane_near,
    height_of,
    reach_from,
    reach_from_axis,
)
from polychirp.channel.geometry.vectors import Vector, cross, dot, row, vector_at
from polychirp.channel.scene.world import RADAR_CLEARANCE
from polychirp.jit import compiled, inlined, inner


class Obstacles(NamedTuple):
    """Bodies and plates that may stand between one pair of radars.

    ``box`` to ``triangle`` are those of a `Tree` of all bodies; ``nodes`` ``(body, 2)`` are each
    body's first node and the one after its last. The rotation ``turn`` ``(body, 3, 3)`` and then
    ``shift`` m ``(body, 3)`` lead from a body's frame to the pair's. ``sheet`` m ``(sheet, 9)`` are
    the corners of the plates' triangles in the pair's frame.
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


@inlined
def _nearest(az: float, ah: float, bz: float, bh: float, length: float) -> EdgePoint:
    """Point of least excess on a segment from a to b in a half-plane: where a mirror reflects."""
    wz, wh = bz - az, bh - ah
    square = wz * wz + wh * wh
    t = 0.0
    if square > 0.0:
        # perpendiculars from both radars: lengths, and feet on the line, times the line's length
        above, below = abs(ah * wz - az * wh), abs((length - az) * wh + ah * wz)
        foot, other = -(az * wz + ah * wh), (length - az) * wz - ah * wh
        share = above / (above + below) if above + below > 0.0 else 0.5
        t = min(1.0, max(0.0, (foot + (other - foot) * share) / square))
    z, h = az + t * wz, ah + t * wh
    return EdgePoint(excess_of(z, h, length), z, h)


@inlined
def _block_line(
    blocked: Blocked,
    azimuth: int,
    line: tuple[float, float, float, float],
    length: float,
    owner: int,
    touch: float,
) -> None:
    """Block what a segment, ``line`` (m, depth and height of both ends), covers above height 0."""
    az, ah, bz, bh = line
    # the part in the upper half, and not within RADAR_CLEARANCE of the radars
    if ah < 0.0 and bh < 0.0:
        return
    if ah < 0.0:
        az, ah = az + (bz - az) * ah / (ah - bh), 0.0
    elif bh < 0.0:
        bz, bh = bz + (az - bz) * bh / (bh - ah), 0.0
    if az > bz:
        az, ah, bz, bh = bz, bh, az, ah
    low, high = RADAR_CLEARANCE, length - RADAR_CLEARANCE
    if bz <= low or az >= high:
        return
    if az < low:
        az, ah = low, ah + (bh - ah) * (low - az) / (bz - az)
    if bz > high:
        bz, bh = high, bh + (ah - bh) * (bz - high) / (bz - az)
    # the sum of two distances is convex along the segment, and so greatest at an end
    a, b = excess_of(az, ah, length), excess_of(bz, bh, length)
    if max(a, b) <= max(touch, reach_from_axis(blocked, azimuth, touch)):
        return
    near = _nearest(az, ah, bz, bh, length)
    far = EdgePoint(a, az, ah) if a > b else EdgePoint(b, bz, bh)
    block(blocked, azimuth, near, far, owner, touch)


@inner
def _azimuths(p: Vector, q: Vector, r: Vector) -> tuple[int, int]:
    """First and last half-plane that a triangle may meet; if it meets none, last < first."""
    a = p[1] * q[2] - p[2] * q[1]
    b = q[1] * r[2] - q[2] * r[1]
    c = r[1] * p[2] - r[2] * p[1]
    if (a >= 0.0 and b >= 0.0 and c >= 0.0) or (a <= 0.0 and b <= 0.0 and c <= 0.0):
        return 0, NUM_AZIMUTHS - 1
    # a triangle that the line of sight does not pass spans less than π, about its middle
    my, mx = p[2] + q[2] + r[2], p[1] + q[1] + r[1]
    low = high = 0.0
    for v in (p, q, r):
        across, along = mx * v[2] - my * v[1], mx * v[1] + my * v[2]
        # a tangent is no less than its angle, and quicker to compute
        is_narrow = abs(across) < 0.2 * along
        off = across / along if is_narrow else math.atan2(across, along)
        low, high = min(low, off), max(high, off)
    step = 2 * math.pi / NUM_AZIMUTHS
    middle = math.atan2(my, mx)
    # half-planes are half a step off the vertical and the horizontal, where many edges are
    return (
        math.ceil((middle + low) / step - 0.5),
        math.floor((middle + high) / step - 0.5),
    )


@inlined
def _cut(p: Vector, q: Vector, cosine: float, sine: float) -> tuple[float, float]:
    """Depth and height at which a triangle's side from p to q crosses the plane at an azimuth."""
    a, b = cosine * p[2] - sine * p[1], cosine * q[2] - sine * q[1]
    t = a / (a - b)
    low, high = cosine * p[1] + sine * p[2], cosine * q[1] + sine * q[2]
    return p[0] + t * (q[0] - p[0]), low + t * (high - low)


@inner
def _block_triangle(
    blocked: Blocked,
    corners: tuple[Vector, Vector, Vector],
    length: float,
    owner: int,
    touch: float,
    way: FloatArray,
) -> None:
    """Block what a triangle covers in every half-plane.

    ``way`` ``(azimuth, 2)`` holds cosine and sine of every half-plane's azimuth.
    """
    p, q, r = corners
    begin, end = _azimuths(p, q, r)
    for number in range(begin, end + 1):
        i = number % NUM_AZIMUTHS
        c, s = way[i, 0], way[i, 1]
        a, b, d = c * p[2] - s * p[1] > 0, c * q[2] - s * q[1] > 0, c * r[2] - s * r[1] > 0
        if a == b == d:
            continue
        # both cuts start at the corner that is alone on its side of the plane
        if a == b:
            one, other = _cut(r, p, c, s), _cut(r, q, c, s)
        elif a == d:
            one, other = _cut(q, p, c, s), _cut(q, r, c, s)
        else:
            one, other = _cut(p, q, c, s), _cut(p, r, c, s)
        line = (one[0], one[1], other[0], other[1])
        _block_line(blocked, i, line, length, owner, touch)


@inlined
def _is_in_front(triangle: FloatArray, t: int, point: Vector) -> bool:
    """True if a point is in front of triangle ``t``, all in the body's frame."""
    n = cross(vector_at(triangle, t, 3), vector_at(triangle, t, 6))
    return bool(dot(n, point) > dot(n, vector_at(triangle, t, 0)))


@inlined
def _distance_to_box(box: FloatArray, node: int, point: Vector) -> float:
    """Distance from a point to the box of a node, m, in the body's frame."""
    total = 0.0
    for a in range(3):
        off = max(box[node, a] - point[a], 0.0, point[a] - box[node, 3 + a])
        total += off * off
    return math.sqrt(total)


@inlined
def _turned(m: FloatArray, v: Vector) -> Vector:
    return dot(row(m, 0), v), dot(row(m, 1), v), dot(row(m, 2), v)


@inlined
def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def _is_hidden(
    blocked: Blocked,
    low: Vector,
    high: Vector,
    m: FloatArray,
    origin: Vector,
    length: float,
    least: float,
) -> bool:
    """True if all that a box covers is blocked already.

    ``m`` and ``origin`` lead from the box's frame to the pair's; its excess is ``least`` m or more.
    """
    # a quick test first: of the box's middle, in one half-plane
    c = _sum(
        _turned(m, (0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2]))),
        origin,
    )
    far = height_of(c)
    if reach_from(blocked, half_plane_near(c), least) < excess_of(c[0], far, length):
        return False
    step, middle = 2 * math.pi / NUM_AZIMUTHS, math.atan2(c[2], c[1])
    most, square = 0.0, 0.0
    for corner in range(8):
        x = high[0] if corner & 1 else low[0]
        y = high[1] if corner & 2 else low[1]
        z = high[2] if corner & 4 else low[2]
        p = _sum(_turned(m, (x, y, z)), origin)
        most = max(most, excess_of(p[0], height_of(p), length))
        square = max(square, (p[1] - c[1]) ** 2 + (p[2] - c[2]) ** 2)
    size = math.sqrt(square)
    half = math.asin(size / far) if size < far else math.pi
    begin = math.floor((middle - half) / step - 0.5)
    for number in range(begin, math.ceil((middle + half) / step - 0.5) + 1):
        if reach_from(blocked, number % NUM_AZIMUTHS, least) < most:
            return False
    return True


@inner
def _block_body(
    blocked: Blocked,
    obstacles: Obstacles,
    body: int,
    to_near_end: bool,
    reach: tuple[float, float],
    touch: float,
    way: FloatArray,
) -> None:
    """Block what a body's triangles cover.

    With ``to_near_end`` these are the triangles that face only the radar nearer to the body; else
    those that face only the other radar, or none. Triangles that face both are no obstacle: they
    reflect. ``reach`` m: length of the line of sight, and greatest excess.
    """
    length, farthest = reach
    m, s = obstacles.turn[body], obstacles.shift[body]
    is_at_start = s[0] < 0.5 * length
    origin = (s[0], s[1], s[2])
    start = _turned(m.T, (-s[0], -s[1], -s[2]))
    end = _turned(m.T, (length - s[0], -s[1], -s[2]))
    node, stop, triangle = obstacles.nodes[body, 0], obstacles.nodes[body, 1], obstacles.triangle
    while node < stop:
        size = obstacles.size[node]
        least = (
            _distance_to_box(obstacles.box, node, start)
            + _distance_to_box(obstacles.box, node, end)
            - length
        )
        here, least = node, max(least, touch)
        node = obstacles.skip[here]
        if least > farthest:
            continue
        low, high = vector_at(obstacles.box, here, 0), vector_at(obstacles.box, here, 3)
        if size == 0:
            if not _is_hidden(blocked, low, high, m, origin, length, least):
                node = here + 1
            continue
        is_open = False
        begin = obstacles.first[here]
        for number in range(begin, begin + size):
            one = _is_in_front(triangle, number, start)
            other = _is_in_front(triangle, number, end)
            faces_near_end = one != other and one == is_at_start
            if (one and other) or faces_near_end != to_near_end:
                continue
            # `_is_hidden` costs more than the tests of a few triangles, so it follows them
            is_open = is_open or not _is_hidden(blocked, low, high, m, origin, length, least)
            if not is_open:
                break
            p = _sum(_turned(m, vector_at(triangle, number, 0)), origin)
            q = _sum(p, _turned(m, vector_at(triangle, number, 3)))
            r = _sum(p, _turned(m, vector_at(triangle, number, 6)))
            if (
                max(p[0], q[0], r[0]) > RADAR_CLEARANCE
                and min(p[0], q[0], r[0]) < length - RADAR_CLEARANCE
            ):
                _block_triangle(blocked, (p, q, r), length, body, touch, way)


@compiled
def blocked_intervals(
    obstacles: Obstacles, length: float, farthest: float, touch: float
) -> Blocked:
    """Intervals of excess up to ``farthest`` (m) that obstacles block, in every half-plane.

    The triangles of bodies that face only the nearer radar come first: they are one layer that
    hides most of the rest.
    """
    blocked = Blocked(
        np.zeros(NUM_AZIMUTHS, dtype=np.int64),
        np.empty((NUM_AZIMUTHS, MAX_INTERVALS + 1, 2, 3)),
        np.empty((NUM_AZIMUTHS, MAX_INTERVALS + 1, 2), dtype=np.int64),
    )
    way = np.empty((NUM_AZIMUTHS, 2))
    for i in range(NUM_AZIMUTHS):
        angle = (i + 0.5) * (2 * math.pi / NUM_AZIMUTHS)
        way[i, 0], way[i, 1] = math.cos(angle), math.sin(angle)
    num_bodies = obstacles.nodes.shape[0]
    for number in range(obstacles.sheet.shape[0]):
        t = obstacles.sheet[number]
        corners = ((t[0], t[1], t[2]), (t[3], t[4], t[5]), (t[6], t[7], t[8]))
        _block_triangle(blocked, corners, length, num_bodies + number, touch, way)
    for to_near_end in (True, False):
        for body in range(num_bodies):
            _block_body(blocked, obstacles, body, to_near_end, (length, farthest), touch, way)
    return blocked
