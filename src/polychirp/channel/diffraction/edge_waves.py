"""Kernels of diffraction: the waves of the edges of what is blocked about a line of sight.

`diffraction` says what they compute and why; `silhouette` finds the edges.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.diffraction.half_planes import (
    CAPACITY,
    NUM_AZIMUTHS,
    Blocked,
    excess_of,
    height_of,
)
from polychirp.channel.diffraction.silhouette import Obstacles, blocked_intervals
from polychirp.channel.geometry.vectors import Vector
from polychirp.channel.scene.world import RADAR_CLEARANCE

CELL = 0.02
"""m of excess length: width of the smooth cells in which edge waves are gathered."""

NUM_MOMENTS = 8
"""Of a cell: field (1), field-weighted excess (1) and two directions (3 + 3)."""

NUM_SPREADS = 6
"""Of a cell, weighted by magnitude: weight (1), edge point (3), rate and its square (2)."""

TOUCH = 1e-5
"""rad of phase between two blocked intervals that are one, or between one and the axis."""


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
    ends = _smooth(depth / RADAR_CLEARANCE - 1.0) * _smooth(beyond / RADAR_CLEARANCE - 1.0)
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
    before = excess_of(p[0], height_of(p), pair.length)
    last = excess_of(q[0], height_of(q), pair.length)
    if min(before, last) >= pair.farthest:
        return
    turns = 0.5 * pair.wavenumber * abs(last - before)
    parts = 1 + int(min(turns, 31.0))
    start = p
    for number in range(parts):
        end, middle = _on(p, q, (number + 1) / parts), _on(p, q, (number + 0.5) / parts)
        after = excess_of(end[0], height_of(end), pair.length)
        height = height_of(middle)
        half_way = excess_of(middle[0], height, pair.length)
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
