"""Waves from the edges of silhouettes, summed in cells of excess path length.

`paths` states the equations; `silhouette` finds the edges.
"""

import math
from typing import NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.diffraction.half_planes import (
    DEPTH,
    EXCESS,
    FAR_SIDE,
    HEIGHT,
    MAX_INTERVALS,
    NEAR_SIDE,
    NUM_AZIMUTHS,
    Blocked,
    excess_of,
    height_of,
)
from polychirp.channel.diffraction.silhouette import Obstacles, blocked_intervals
from polychirp.channel.geometry.vectors import Vector
from polychirp.channel.scene.world import RADAR_CLEARANCE
from polychirp.jit import compiled, inlined, inner

EXCESS_CELL_LENGTH = 0.02
"""Width of the smooth cells of excess path length in which edge waves are summed, m. Chosen."""

FIELD, MEAN_EXCESS, OUTWARD, RETURN, NUM_MOMENTS = 0, 1, 2, 5, 8
"""Columns of `EdgeWaves.moments`: sums of the waves' fields, and of the fields times the excess and
times the directions from the transmitter (3 columns) and from the receiver (3)."""

WEIGHT, PLACE, RATE, SQUARED_RATE, NUM_SPREADS = 0, 1, 4, 5, 6
"""Columns of `EdgeWaves.spreads`: sums of the fields' magnitudes, and of the magnitudes times the
edge point (3 columns), times the rate of the path length and times the square of the rate."""

TOUCHING_PHASE = 1e-5
"""Greatest gap between blocked intervals that count as one, rad of phase. An interval with a gap of
at most this to the line of sight begins on it. Chosen: above the rounding of lengths."""

NO_PARTNER = -1
"""Number in place of an edge's partner if the edge has none."""


class LinkFrame(NamedTuple):
    """A transmitter at the origin and a receiver ``length`` m away along the first axis.

    ``farthest`` m is the excess up to which edges are sought; ``wavenumber`` rad/m. ``from_sender``
    and ``from_receiver`` m/s ``(actor, xyz)`` are the velocities of the actors in the way, as if
    they reached to the transmitter and to the receiver, and relative to these; see
    `World.velocity_at`.
    """

    length: float
    farthest: float
    wavenumber: float
    from_sender: FloatArray
    from_receiver: FloatArray


@inlined
def _smooth(x: float) -> float:
    """A smooth step from 0 at x = 0 to 1 at x = 1."""
    x = min(1.0, max(0.0, x))
    return x * x * (3.0 - 2.0 * x)


@inner
def _weight(depth: float, height: float, excess: float, length: float, farthest: float) -> float:
    """½(1 + cos θ) of an edge's wave, times smooth cut-offs near both radars and ``farthest``."""
    beyond, square = length - depth, height * height
    legs = math.sqrt((depth * depth + square) * (beyond * beyond + square))
    oblique = 0.5 * (1.0 + (depth * beyond - square) / legs)
    ends = _smooth(depth / RADAR_CLEARANCE - 1.0) * _smooth(beyond / RADAR_CLEARANCE - 1.0)
    return oblique * ends * (1.0 - _smooth(2.0 * excess / farthest - 1.0))


class EdgeWaves(NamedTuple):
    """Sums of edge waves in cells of excess, for every actor in the way.

    ``moments`` ``(actor, cell, NUM_MOMENTS)``, ``spreads`` ``(actor, cell, NUM_SPREADS)``.
    """

    moments: ComplexArray
    spreads: FloatArray


@inner
def _add_wave(
    waves: EdgeWaves, slot: int, point: Vector, excess: float, wave: complex, link: LinkFrame
) -> None:
    """Add one edge wave to the two cells beside its excess."""
    x, y, z = point
    beyond = x - link.length
    near, far = math.sqrt(x * x + y * y + z * z), math.sqrt(beyond * beyond + y * y + z * z)
    out = (x / near, y / near, z / near)
    back = (beyond / far, y / far, z / far)
    rate = 0.0
    for a in range(3):
        rate += out[a] * link.from_sender[slot, a] + back[a] * link.from_receiver[slot, a]
    cell = int(excess / EXCESS_CELL_LENGTH)
    share = _smooth(excess / EXCESS_CELL_LENGTH - cell)
    for side in range(2):
        part = share if side == 1 else 1.0 - share
        into, c = waves.moments[slot, cell + side], wave * part
        into[FIELD] += c
        into[MEAN_EXCESS] += c * excess
        for a in range(3):
            into[OUTWARD + a] += c * out[a]
            into[RETURN + a] += c * back[a]
        real, size = waves.spreads[slot, cell + side], abs(c)
        real[WEIGHT] += size
        for a in range(3):
            real[PLACE + a] += size * point[a]
        real[RATE] += size * rate
        real[SQUARED_RATE] += size * rate * rate


@inlined
def _point_between(a: Vector, b: Vector, t: float) -> Vector:
    return a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])


@inner
def _add_chord(
    waves: EdgeWaves, slot: int, ends: tuple[Vector, Vector], sign: float, link: LinkFrame
) -> None:
    """Add a straight piece of edge, in at most 32 parts of about 2 rad of phase each."""
    p, q = ends
    before = excess_of(p[0], height_of(p), link.length)
    last = excess_of(q[0], height_of(q), link.length)
    if min(before, last) >= link.farthest:
        return
    turns = 0.5 * link.wavenumber * abs(last - before)
    parts = 1 + int(min(turns, 31.0))
    start = p
    for number in range(parts):
        end, middle = (
            _point_between(p, q, (number + 1) / parts),
            _point_between(p, q, (number + 0.5) / parts),
        )
        after = excess_of(end[0], height_of(end), link.length)
        height = height_of(middle)
        half_way = excess_of(middle[0], height, link.length)
        mean = (before + 4.0 * half_way + after) / 6.0
        if mean < link.farthest:
            angle = math.atan2(
                start[1] * end[2] - start[2] * end[1], start[1] * end[1] + start[2] * end[2]
            )
            half = 0.5 * link.wavenumber * (after - before)
            size = sign * angle / (2 * math.pi) * (math.sin(half) / half if half != 0.0 else 1.0)
            size *= _weight(middle[0], height, mean, link.length, link.farthest)
            _add_wave(waves, slot, middle, mean, size * _phasor(link.wavenumber * mean), link)
        start, before = end, after


@inlined
def _phasor(phase: float) -> complex:
    return complex(math.cos(phase), -math.sin(phase))


@inner
def _add_half(
    waves: EdgeWaves, slot: int, edge: FloatArray, azimuth: int, sign: float, link: LinkFrame
) -> None:
    """Add half a step of azimuth for an edge that begins or ends at this half-plane."""
    excess = edge[EXCESS]
    if excess >= link.farthest:
        return
    size = (
        0.5
        * sign
        / NUM_AZIMUTHS
        * _weight(edge[DEPTH], edge[HEIGHT], excess, link.length, link.farthest)
    )
    point = _point(edge, azimuth)
    _add_wave(waves, slot, point, excess, size * _phasor(link.wavenumber * excess), link)


@inlined
def _point(edge: FloatArray, azimuth: int) -> Vector:
    angle = (azimuth + 0.5) * (2 * math.pi / NUM_AZIMUTHS)
    height = edge[HEIGHT]
    return edge[DEPTH], height * math.cos(angle), height * math.sin(angle)


@inlined
def _first_edge(blocked: Blocked, azimuth: int, side: int, touch: float) -> int:
    """Number of a half-plane's first edge; an interval that begins on the line has no near one."""
    edge = blocked.edge
    if side == NEAR_SIDE and blocked.filled[azimuth] > 0:
        return 1 if edge[azimuth, 0, NEAR_SIDE, EXCESS] <= touch else 0
    return 0


@inner
def _find_partners(
    blocked: Blocked, i: int, j: int, side: int, touch: float, partner: IntArray
) -> None:
    """Write, for every edge of half-plane i, the edge of half-plane j that continues it.

    An edge that ends at half-plane i has `NO_PARTNER`. Edges do not cross: all edges of the
    half-plane that has fewer are continued, in their order, so that the sum of the steps of excess
    is least. That is the same from i to j and from j to i.
    """
    partner[:] = NO_PARTNER
    begin, other = (
        _first_edge(blocked, i, side, touch),
        _first_edge(blocked, j, side, touch),
    )
    size, count = blocked.filled[i] - begin, blocked.filled[j] - other
    is_turned = size > count
    if is_turned:
        i, j, begin, other, size, count = j, i, other, begin, count, size
    if size == 0:
        return
    # least sums of steps for the first a edges of i, and the first b edges of j
    least = np.full((size + 1, count + 1), np.inf)
    least[0] = 0.0
    for a in range(size):
        for b in range(a, count):
            step = abs(
                blocked.edge[i, begin + a, side, EXCESS] - blocked.edge[j, other + b, side, EXCESS]
            )
            least[a + 1, b + 1] = min(least[a + 1, b], least[a, b] + step)
    b = count
    for a in range(size, 0, -1):
        while b > a and least[a, b] == least[a, b - 1]:
            b -= 1
        b -= 1
        if is_turned:
            partner[other + b] = begin + a - 1
        else:
            partner[begin + a - 1] = other + b


@inner
def _add_edges(
    waves: EdgeWaves, blocked: Blocked, slots: IntArray, side: int, touch: float, link: LinkFrame
) -> None:
    """Add the waves of all near or all far sides of blocked intervals."""
    sign = -1.0 if side == NEAR_SIDE else 1.0
    partner = np.empty(MAX_INTERVALS + 1, dtype=np.int64)
    for i in range(NUM_AZIMUTHS):
        j = (i + 1) % NUM_AZIMUTHS
        _find_partners(blocked, i, j, side, touch, partner)
        for a in range(blocked.filled[i]):
            edge, slot = blocked.edge[i, a, side], slots[blocked.owner[i, a, side]]
            if partner[a] != NO_PARTNER:
                other = blocked.edge[j, partner[a], side]
                _add_chord(waves, slot, (_point(edge, i), _point(other, j)), sign, link)
            elif side == FAR_SIDE or edge[EXCESS] > touch:
                _add_half(waves, slot, edge, i, sign, link)
        # the edges that begin at half-plane j are those that continue none of half-plane i
        for b in range(blocked.filled[j]):
            edge = blocked.edge[j, b, side]
            is_edge = side == FAR_SIDE or edge[EXCESS] > touch
            if is_edge and not np.any(partner[: blocked.filled[i]] == b):
                _add_half(waves, slots[blocked.owner[j, b, side]], edge, j, sign, link)


@inner
def _add_axis(
    waves: EdgeWaves,
    blocked: Blocked,
    slots: IntArray,
    touch: float,
    is_clear: bool,
    link: LinkFrame,
) -> None:
    """Add a correction for half-planes where the line of sight is not as ``is_clear`` says.

    If an edge is on the line of sight, half of all half-planes are blocked from the line outwards.
    """
    depth, slot, count = 0.0, 0, 0
    for i in range(NUM_AZIMUTHS):
        if blocked.filled[i] > 0 and blocked.edge[i, 0, NEAR_SIDE, EXCESS] <= touch:
            depth = blocked.edge[i, 0, NEAR_SIDE, DEPTH]
            slot = slots[blocked.owner[i, 0, NEAR_SIDE]]
            count += 1
    if count == 0:
        return
    lacking = -float(count) if is_clear else float(NUM_AZIMUTHS - count)
    size = lacking / NUM_AZIMUTHS * _weight(depth, 0.0, 0.0, link.length, link.farthest)
    _add_wave(waves, slot, (depth, 0.0, 0.0), 0.0, complex(size), link)


@compiled
def edge_waves(obstacles: Obstacles, slots: IntArray, is_clear: bool, link: LinkFrame) -> EdgeWaves:
    """Waves of the silhouette's edges, in units of the unobstructed field.

    Parameters
    ----------
    slots : row of the result to which each obstacle adds, bodies first, ``(obstacle,)``
    is_clear : True if the line of sight is free; its own field is not a part of the result
    """
    touch = TOUCHING_PHASE / link.wavenumber
    num_cells = int(link.farthest / EXCESS_CELL_LENGTH) + 2
    waves = EdgeWaves(
        np.zeros((link.from_sender.shape[0], num_cells, NUM_MOMENTS), dtype=np.complex128),
        np.zeros((link.from_sender.shape[0], num_cells, NUM_SPREADS)),
    )
    blocked = blocked_intervals(obstacles, link.length, link.farthest, touch)
    if not np.any(blocked.filled):
        return waves
    _add_axis(waves, blocked, slots, touch, is_clear, link)
    for side in (NEAR_SIDE, FAR_SIDE):
        _add_edges(waves, blocked, slots, side, touch, link)
    return waves
