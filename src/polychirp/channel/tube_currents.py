"""Where tubes end: the currents of their footprints, and what these radiate."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.blockers import Blockers
from polychirp.channel.occlusion import is_blocked
from polychirp.channel.optics import LIFT, ComplexVector, Vector, _across, _phasor
from polychirp.channel.tube_rays import Ray, ahead
from polychirp.channel.vectors import cross, dot, vector
from polychirp.channel.world import SKIN


class Hits(NamedTuple):
    """Where tubes meet a body after another one, ``(hit, …)``.

    ``normal`` towards where the ray came from; ``side_a``, ``side_b``: sides of the footprint, m;
    ``current`` ``(hit, polarisation, kind, xyz)``: J and M, without 1/L; ``turns``:
    reflections, this one included; ``tube``: its number.
    """

    point: FloatArray
    direction: FloatArray
    normal: FloatArray
    side_a: FloatArray
    side_b: FloatArray
    length: FloatArray
    rate: FloatArray
    departure: FloatArray
    first: FloatArray
    body: IntArray
    roughness: FloatArray
    current: NDArray[np.complex64]
    turns: IntArray
    tube: IntArray

    def of(self, which: IntArray) -> Hits:
        """The hits of these numbers."""
        return Hits(
            self.point[which],
            self.direction[which],
            self.normal[which],
            self.side_a[which],
            self.side_b[which],
            self.length[which],
            self.rate[which],
            self.departure[which],
            self.first[which],
            self.body[which],
            self.roughness[which],
            self.current[which],
            self.turns[which],
            self.tube[which],
        )


def empty_hits(size: int) -> Hits:
    """Room for hits."""
    return Hits(
        point=np.empty((size, 3)),
        direction=np.empty((size, 3)),
        normal=np.empty((size, 3)),
        side_a=np.empty((size, 3)),
        side_b=np.empty((size, 3)),
        length=np.empty(size),
        rate=np.empty(size),
        departure=np.empty((size, 3)),
        first=np.empty((size, 3)),
        body=np.empty(size, dtype=np.int64),
        roughness=np.empty(size),
        current=np.empty((size, 2, 2, 3), dtype=np.complex64),
        turns=np.empty(size, dtype=np.int64),
        tube=np.empty(size, dtype=np.int64),
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


@njit(cache=True, nogil=True, error_model="numpy")
def record(hits: Hits, slot: int, ray: Ray, bounced: Ray, normal: Vector, body: int,
            roughness: float) -> None:  # fmt: skip
    """Keep where a ray meets a body, before and after."""
    cosine = -dot(ray.direction, normal)
    hits.point[slot] = bounced.point
    hits.direction[slot] = ray.direction
    hits.normal[slot] = normal
    hits.side_a[slot] = _footprint(ray.edge_a, ray, normal, cosine, bounced.length)
    hits.side_b[slot] = _footprint(ray.edge_b, ray, normal, cosine, bounced.length)
    hits.length[slot] = bounced.length
    hits.rate[slot] = ray.rate
    hits.departure[slot] = ray.departure
    hits.first[slot] = ray.first
    hits.body[slot] = body
    hits.roughness[slot] = roughness
    hits.turns[slot] = bounced.turns
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
    a, b, d = vector(hits.side_a[i]), vector(hits.side_b[i]), vector(hits.direction[i])
    turn = (d[0] - back[0], d[1] - back[1], d[2] - back[2])
    square = cross(a, b)
    area = math.sqrt(dot(square, square))
    half = 0.5 * wavenumber
    share = _sinc(half * dot(turn, a)) * _sinc(half * dot(turn, b))
    phase = wavenumber * hits.roughness[i] * dot(turn, vector(hits.normal[i]))
    if phase != 0.0:
        share *= math.exp(-0.5 * phase * phase)
    scale = area * share / (8.0 * math.pi * hits.length[i] * r2)
    return complex(0.0, -scale) * _phasor(wavenumber * (hits.length[i] + r2))


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def radiate(
    hits: Hits, sink: FloatArray, not_from: int, wavenumber: float
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Transfer ``(hit, receiving·transmitting)``, direction and length of all last legs.

    Zero where the receiver is behind the surface, and from the body ``not_from``. What is in
    between is not looked at.
    """
    size = hits.length.size
    transfer = np.zeros((size, 4), dtype=np.complex128)
    backs, lengths = np.zeros((size, 3)), np.zeros(size)
    for i in prange(size):
        c = hits.point[i]
        q = (sink[0] - c[0], sink[1] - c[1], sink[2] - c[2])
        r2 = math.sqrt(dot(q, q))
        q = (q[0] / r2, q[1] / r2, q[2] / r2)
        backs[i, 0], backs[i, 1], backs[i, 2] = q
        lengths[i] = r2
        if hits.body[i] == not_from or dot(q, vector(hits.normal[i])) <= 0.0:
            continue
        away = (-q[0], -q[1], -q[2])
        h = _across((0.0, 0.0, 1.0), away, (0.0, 1.0, 0.0))
        v = cross(away, h)
        weight = _radiated(hits, i, q, r2, wavenumber)
        for t in range(2):
            transfer[i, t] = weight * _heard(hits.current[i, t], q, v)
            transfer[i, 2 + t] = weight * _heard(hits.current[i, t], q, h)
    return transfer, backs, lengths


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
    size = hits.length.size
    power, backs = np.zeros(size), np.zeros((size, 3))
    for i in prange(size):
        c = hits.point[i]
        q = (sink[0] - c[0], sink[1] - c[1], sink[2] - c[2])
        r2 = math.sqrt(dot(q, q))
        q = (q[0] / r2, q[1] / r2, q[2] / r2)
        backs[i, 0], backs[i, 1], backs[i, 2] = q
        if hits.body[i] == not_from or dot(q, vector(hits.normal[i])) <= 0.0:
            continue
        a, b, d = vector(hits.side_a[i]), vector(hits.side_b[i]), vector(hits.direction[i])
        turn = (d[0] - q[0], d[1] - q[1], d[2] - q[2])
        square, half = cross(a, b), 0.5 * wavenumber
        scale = _envelope(half * dot(turn, a)) * _envelope(half * dot(turn, b))
        scale *= math.sqrt(dot(square, square)) / (8.0 * math.pi * hits.length[i] * r2)
        h = _across((0.0, 0.0, 1.0), (-q[0], -q[1], -q[2]), (0.0, 1.0, 0.0))
        v = cross(h, q)
        most = 0.0
        for t in range(2):
            one, other = _heard(hits.current[i, t], q, v), _heard(hits.current[i, t], q, h)
            most = max(most, one.real * one.real + one.imag * one.imag)
            most = max(most, other.real * other.real + other.imag * other.imag)
        power[i] = scale * scale * most
    return power, backs


@njit(cache=True, nogil=True, error_model="numpy", parallel=True)
def unhidden(
    faces: Blockers,
    near: tuple[IntArray, IntArray, IntArray, IntArray],
    hits: Hits,
    sink: FloatArray,
    which: IntArray,
) -> BoolArray:
    """Whether nothing opaque is between hits ``which`` and a receiver.

    ``near`` are bodies, where those for every last body begin, and plates likewise.
    """
    bodies, body_start, plates, plate_start = near
    out = np.empty(which.size, dtype=np.bool_)
    for row in prange(which.size):
        i = which[row]
        b = hits.body[i]
        lifted = ahead(vector(hits.point[i]), vector(hits.normal[i]), LIFT)
        out[row] = not is_blocked(
            faces,
            bodies[body_start[b] : body_start[b + 1]],
            plates[plate_start[b] : plate_start[b + 1]],
            vector(sink),
            lifted,
            SKIN,
        )
    return out
