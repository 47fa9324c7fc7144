"""Where tubes end: the currents of their footprints, and what these radiate."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.geometry.bvh import Vector
from polychirp.channel.geometry.vectors import cross, dot, vector, vector_at
from polychirp.channel.materials.fresnel import Media
from polychirp.channel.physical_optics.facet_integral import phasor
from polychirp.channel.physical_optics.kernels import (
    SHADOW_RAY_LIFT,
    ComplexVector,
    across_plane_of_incidence,
)
from polychirp.channel.ray_tubes.fields import Ray, ahead
from polychirp.channel.ray_tubes.intersections import Space, find_veils, is_hidden
from polychirp.channel.scene.blockers import Blockers
from polychirp.channel.scene.transmission import lose
from polychirp.channel.scene.world import SKIN

PER_CHUNK: Final = 64
"""Hits that one thread looks at before the next."""

POINT: Final = 0
DIRECTION: Final = 3
NORMAL: Final = 6
SIDE_A: Final = 9
SIDE_B: Final = 12
DEPARTURE: Final = 15
FIRST: Final = 18
LENGTH: Final = 21
RATE: Final = 22
BODY: Final = 23
ROUGHNESS: Final = 24
TURNS: Final = 25
TUBE: Final = 26
"""Columns of `Hits.number`: seven vectors, and six numbers."""


class Hits(NamedTuple):
    """Where tubes meet a body after another one, ``(hit, …)``.

    ``number`` ``(hit, 27)``, columns `POINT` …: the normal is towards where the ray came from; A
    and B are the footprint's sides, m; `FIRST` is a point; `TURNS` counts reflections, this one
    included; `TUBE` is the tube's number. ``current`` ``(hit, polarisation, kind, xyz)``: J and
    M, without 1/L.
    """

    number: FloatArray
    current: NDArray[np.complex64]

    def of(self, which: IntArray) -> Hits:
        """The hits of these numbers."""
        return Hits(self.number[which], self.current[which])

    def vectors(self, column: int) -> FloatArray:
        """One of the vectors, ``(hit, xyz)``."""
        return self.number[:, column : column + 3]

    def whole(self, column: int) -> IntArray:
        """One of the whole numbers, ``(hit,)``."""
        return self.number[:, column].astype(np.int64)


def empty_hits(size: int) -> Hits:
    """Room for hits."""
    return Hits(
        number=np.empty((size, TUBE + 1)), current=np.empty((size, 2, 2, 3), dtype=np.complex64)
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _across_field(a: Vector, field: ComplexVector) -> ComplexVector:
    """The vector product a × E."""
    return (
        a[1] * field[2] - a[2] * field[1],
        a[2] * field[0] - a[0] * field[2],
        a[0] * field[1] - a[1] * field[0],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _induce(
    normal: Vector,
    before: Vector,
    after: Vector,
    wave: ComplexVector,
    reflected: ComplexVector,
    current: NDArray[np.complex64],
) -> None:
    """J = n×(d×E + r×E_r) and M = −n×(E + E_r)."""
    one, other = _across_field(before, wave), _across_field(after, reflected)
    j = _across_field(normal, (one[0] + other[0], one[1] + other[1], one[2] + other[2]))
    total = (wave[0] + reflected[0], wave[1] + reflected[1], wave[2] + reflected[2])
    m = _across_field(normal, total)
    for x in range(3):
        current[0, x], current[1, x] = j[x], -m[x]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _footprint(edge: Vector, ray: Ray, normal: Vector, cosine: float, length: float) -> Vector:
    """Side of a tube's footprint: L (∂D + g D), g = −(∂D·n)/(D·n)."""
    g = dot(edge, normal) / cosine
    d = ray.direction
    return (
        length * (edge[0] + g * d[0]),
        length * (edge[1] + g * d[1]),
        length * (edge[2] + g * d[2]),
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _keep(number: FloatArray, slot: int, column: int, a: Vector) -> None:
    number[slot, column], number[slot, column + 1], number[slot, column + 2] = a


@njit(cache=True, nogil=True, error_model="numpy")
def record(hits: Hits, slot: int, ray: Ray, bounced: Ray, normal: Vector, body: int,
            roughness: float) -> None:  # fmt: skip
    """Keep where a ray meets a body, before and after."""
    cosine, length, number = -dot(ray.direction, normal), bounced.length, hits.number
    _keep(number, slot, POINT, bounced.point)
    _keep(number, slot, DIRECTION, ray.direction)
    _keep(number, slot, NORMAL, normal)
    _keep(number, slot, SIDE_A, _footprint(ray.edge_a, ray, normal, cosine, length))
    _keep(number, slot, SIDE_B, _footprint(ray.edge_b, ray, normal, cosine, length))
    _keep(number, slot, DEPARTURE, ray.departure)
    _keep(number, slot, FIRST, ray.first)
    number[slot, LENGTH], number[slot, RATE] = length, ray.rate
    number[slot, BODY], number[slot, ROUGHNESS] = body, roughness
    number[slot, TURNS] = bounced.turns
    current = hits.current[slot]
    _induce(normal, ray.direction, bounced.direction, ray.wave_v, bounced.wave_v, current[0])
    _induce(normal, ray.direction, bounced.direction, ray.wave_h, bounced.wave_h, current[1])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _sinc(x: float) -> float:
    return math.sin(x) / x if abs(x) > 1e-6 else 1.0


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _heard(current: NDArray[np.complex64], back: Vector, field: Vector) -> complex:
    """F = J·w + (M×q)·w of one wave."""
    turned = cross(back, field)
    total = 0j
    for x in range(3):
        total += current[0, x] * field[x] + current[1, x] * turned[x]
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _radiated(hits: Hits, i: int, back: Vector, r2: float, wavenumber: float) -> complex:
    """What multiplies F: −(j/8π) dS e^{−jk(L+r2)}/(L r2) and the footprint's phases."""
    number = hits.number
    a, b = vector_at(number, i, SIDE_A), vector_at(number, i, SIDE_B)
    d, length = vector_at(number, i, DIRECTION), number[i, LENGTH]
    turn = (d[0] - back[0], d[1] - back[1], d[2] - back[2])
    square = cross(a, b)
    area = math.sqrt(dot(square, square))
    half = 0.5 * wavenumber
    share = _sinc(half * dot(turn, a)) * _sinc(half * dot(turn, b))
    phase = wavenumber * number[i, ROUGHNESS] * dot(turn, vector_at(number, i, NORMAL))
    if phase != 0.0:
        share *= math.exp(-0.5 * phase * phase)
    scale = area * share / (8.0 * math.pi * length * r2)
    return complex(0.0, -scale) * phasor(wavenumber * (length + r2))


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def radiate(
    hits: Hits, sink: FloatArray, not_from: int, wavenumber: float
) -> tuple[ComplexArray, FloatArray, FloatArray, FloatArray]:
    """Transfer ``(hit, receiving·transmitting)``, direction and length of all last legs, and power.

    Zero where the receiver is behind the surface, and from the body ``not_from``. What is in
    between is not looked at. The power is that of the greatest entry.
    """
    number = hits.number
    size = len(number)
    transfer = np.zeros((size, 4), dtype=np.complex128)
    backs, lengths, power = np.zeros((size, 3)), np.zeros(size), np.zeros(size)
    for i in prange(size):
        c = vector_at(number, i, POINT)
        q = (sink[0] - c[0], sink[1] - c[1], sink[2] - c[2])
        r2 = math.sqrt(dot(q, q))
        q = (q[0] / r2, q[1] / r2, q[2] / r2)
        backs[i, 0], backs[i, 1], backs[i, 2] = q
        lengths[i] = r2
        if number[i, BODY] == not_from or dot(q, vector_at(number, i, NORMAL)) <= 0.0:
            continue
        away = (-q[0], -q[1], -q[2])
        h = across_plane_of_incidence((0.0, 0.0, 1.0), away, (0.0, 1.0, 0.0))
        v = cross(away, h)
        weight = _radiated(hits, i, q, r2, wavenumber)
        for t in range(2):
            one = weight * _heard(hits.current[i, t], q, v)
            other = weight * _heard(hits.current[i, t], q, h)
            transfer[i, t], transfer[i, 2 + t] = one, other
            power[i] = max(power[i], _square(one), _square(other))
    return transfer, backs, lengths, power


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _square(a: complex) -> float:
    return a.real * a.real + a.imag * a.imag


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _envelope(x: float) -> float:
    return 1.0 / math.sqrt(1.0 + x * x)


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def promises(
    hits: Hits, sink: FloatArray, not_from: int, wavenumber: float
) -> tuple[FloatArray, FloatArray]:
    """What footprints may radiate at most, roughly ``(hit,)``, and the directions of departure.

    Power, with 1/√(1 + x²) for |sinc x|. Zero as in `radiate`.
    """
    number = hits.number
    size = len(number)
    power, backs = np.zeros(size), np.zeros((size, 3))
    for i in prange(size):
        c = vector_at(number, i, POINT)
        q = (sink[0] - c[0], sink[1] - c[1], sink[2] - c[2])
        r2 = math.sqrt(dot(q, q))
        q = (q[0] / r2, q[1] / r2, q[2] / r2)
        backs[i, 0], backs[i, 1], backs[i, 2] = q
        if number[i, BODY] == not_from or dot(q, vector_at(number, i, NORMAL)) <= 0.0:
            continue
        a, b = vector_at(number, i, SIDE_A), vector_at(number, i, SIDE_B)
        d = vector_at(number, i, DIRECTION)
        turn = (d[0] - q[0], d[1] - q[1], d[2] - q[2])
        square, half = cross(a, b), 0.5 * wavenumber
        scale = _envelope(half * dot(turn, a)) * _envelope(half * dot(turn, b))
        scale *= math.sqrt(dot(square, square)) / (8.0 * math.pi * number[i, LENGTH] * r2)
        h = across_plane_of_incidence((0.0, 0.0, 1.0), (-q[0], -q[1], -q[2]), (0.0, 1.0, 0.0))
        v = cross(h, q)
        most = 0.0
        for t in range(2):
            one, other = _heard(hits.current[i, t], q, v), _heard(hits.current[i, t], q, h)
            most = max(most, _square(one), _square(other))
        power[i] = scale * scale * most
    return power, backs


class Between(NamedTuple):
    """What may come between a receiver and every body: numbers, and where those of each begin.

    Bodies; opaque plates; sheets among plates; bodies with sheets or leaves.
    """

    bodies: IntArray
    body_start: IntArray
    plates: IntArray
    plate_start: IntArray
    panes: IntArray
    pane_start: IntArray
    veiled: IntArray
    veiled_start: IntArray


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def unhidden(
    space: Space, between: Between, hits: Hits, sink: FloatArray, which: IntArray
) -> BoolArray:
    """Whether nothing opaque is between hits ``which`` and a receiver."""
    number, start = hits.number, vector(sink)
    out = np.empty(which.size, dtype=np.bool_)
    for chunk in prange((which.size + PER_CHUNK - 1) // PER_CHUNK):
        notes = np.empty(space.room, dtype=np.float32)
        for row in range(chunk * PER_CHUNK, min((chunk + 1) * PER_CHUNK, which.size)):
            b = int(number[which[row], BODY])
            bodies = between.bodies[between.body_start[b] : between.body_start[b + 1]]
            plates = between.plates[between.plate_start[b] : between.plate_start[b + 1]]
            end = _lifted(number, which[row])
            out[row] = not is_hidden(space, bodies, plates, start, end, notes)
    return out


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _lifted(number: FloatArray, i: int) -> Vector:
    """A point just before the surface that a tube meets."""
    return ahead(vector_at(number, i, POINT), vector_at(number, i, NORMAL), SHADOW_RAY_LIFT)


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def last_legs(
    space: Space,
    faces: Blockers,
    media: Media,
    between: Between,
    hits: Hits,
    sink: FloatArray,
    upwards: FloatArray,
    wavenumber: float,
) -> ComplexArray:
    """What sheets and leaves leave on the way from a receiver to hits, ``(hit, 2, 2)``."""
    number, start = hits.number, vector(sink)
    out = np.zeros((len(number), 2, 2), dtype=np.complex128)
    for chunk in prange((len(number) + PER_CHUNK - 1) // PER_CHUNK):
        notes = np.empty(space.room, dtype=np.float32)
        veils = np.empty(len(space.body), dtype=np.int64)
        for i in range(chunk * PER_CHUNK, min((chunk + 1) * PER_CHUNK, len(number))):
            b, end = int(number[i, BODY]), _lifted(number, i)
            out[i, 0, 0] = out[i, 1, 1] = 1.0
            bodies = between.veiled[between.veiled_start[b] : between.veiled_start[b + 1]]
            plates = between.panes[between.pane_start[b] : between.pane_start[b + 1]]
            there = veils[: find_veils(space, bodies, start, end, notes, veils)]
            if there.size + plates.size > 0:
                lose(faces, media, there, plates, start, end, SKIN, upwards, wavenumber, out[i])
    return out
