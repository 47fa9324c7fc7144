"""Hits of ray tubes on bodies: the currents on the footprints, and the waves that they radiate."""

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, vector
from polychirp.channel.physical_optics.facet_integral import facet_integral, phasor
from polychirp.channel.physical_optics.kernels import ComplexVector, across_plane_of_incidence
from polychirp.channel.ray_tubes.fields import Ray
from polychirp.jit import compiled, inlined, inner
from polychirp.threads import in_ranges

HIT: Final = np.dtype(
    [
        ("point", np.float64, 3),  # m
        ("direction", np.float64, 3),  # of the ray before the point
        ("normal", np.float64, 3),  # towards where the ray came from
        ("side_a", np.float64, 3),  # first side of the footprint, m
        ("side_b", np.float64, 3),  # second side of the footprint, m
        ("departure", np.float64, 3),  # direction in which the tube left the transmitter
        ("first_point", np.float64, 3),  # where the tube met the first body, m
        ("length", np.float64),  # L, of the path up to the point, m
        ("rate", np.float64),  # of change of the length, without this surface's motion, m/s
        ("roughness", np.float64),  # rms height of this surface, m
        ("body", np.int64),
        ("first_body", np.int64),
        ("turns", np.int64),  # number of reflections, this one included
        ("tube", np.int64),  # number of the tube
        ("part", np.int64, 2),  # flat parts of both reflections if there are two and no sheet
        ("current", np.complex64, (2, 2, 3)),  # (polarisation, J or M, xyz), without the factor 1/L
        ("is_triangle", np.bool_),  # the footprint is half of the parallelogram, towards its corner
    ]
)
"""A hit: a point where a tube meets a body after another body."""

Hits = NDArray[np.void]
"""Hits ``(hit,)`` of type `HIT`."""


@inner
def _across_field(a: Vector, field: ComplexVector) -> ComplexVector:
    """The vector product a × E."""
    return (
        a[1] * field[2] - a[2] * field[1],
        a[2] * field[0] - a[0] * field[2],
        a[0] * field[1] - a[1] * field[0],
    )


@inner
def _induce(
    normal: Vector,
    before: Vector,
    after: Vector,
    wave: ComplexVector,
    reflected: ComplexVector,
    current: NDArray[np.complex64],
) -> None:
    """Currents J = n×(d×E + r×E_r), M = −n×(E + E_r) of a wave along d, reflected along r."""
    one, other = _across_field(before, wave), _across_field(after, reflected)
    j = _across_field(normal, (one[0] + other[0], one[1] + other[1], one[2] + other[2]))
    total = (wave[0] + reflected[0], wave[1] + reflected[1], wave[2] + reflected[2])
    m = _across_field(normal, total)
    for x in range(3):
        current[0, x], current[1, x] = j[x], -m[x]


@inlined
def _footprint(edge: Vector, ray: Ray, normal: Vector, cosine: float, length: float) -> Vector:
    """Side of a tube's footprint: L (∂D + g D), g = −(∂D·n)/(D·n), D the ray's direction."""
    g = dot(edge, normal) / cosine
    d = ray.direction
    return (
        length * (edge[0] + g * d[0]),
        length * (edge[1] + g * d[1]),
        length * (edge[2] + g * d[2]),
    )


@inlined
def put(out: FloatArray, a: Vector) -> None:
    """Write a vector into an array ``(xyz,)``."""
    out[0], out[1], out[2] = a


@inner
def record(hit: np.void, ray: Ray, after: Ray, normal: Vector, roughness: float) -> None:
    """Fill a hit from the ray before and after it; the caller sets the bodies and the tube."""
    cosine = -dot(ray.direction, normal)
    put(hit["point"], after.point)
    put(hit["direction"], ray.direction)
    put(hit["normal"], normal)
    put(hit["side_a"], _footprint(ray.edge_a, ray, normal, cosine, after.length))
    put(hit["side_b"], _footprint(ray.edge_b, ray, normal, cosine, after.length))
    put(hit["departure"], ray.departure)
    put(hit["first_point"], ray.first_point)
    hit["length"], hit["rate"], hit["roughness"] = after.length, ray.rate, roughness
    hit["turns"], hit["is_triangle"] = after.turns, False
    current = hit["current"]
    _induce(normal, ray.direction, after.direction, ray.wave_v, after.wave_v, current[0])
    _induce(normal, ray.direction, after.direction, ray.wave_h, after.wave_h, current[1])


@inlined
def _sinc(x: float) -> float:
    return math.sin(x) / x if abs(x) > 1e-6 else 1.0


@inlined
def _envelope(x: float) -> float:
    return 1.0 / math.sqrt(1.0 + x * x)


@inlined
def _square(a: complex) -> float:
    return a.real * a.real + a.imag * a.imag


@inlined
def _received(current: NDArray[np.complex64], back: Vector, field: Vector) -> complex:
    """F = J·w + (M×q)·w for the polarisation ``field`` w and the direction ``back`` q."""
    turned = cross(back, field)
    total = 0j
    for x in range(3):
        total += current[0, x] * field[x] + current[1, x] * turned[x]
    return total


@inner
def _last_leg(hit: np.void, sink: FloatArray) -> tuple[Vector, float]:
    """Direction and length, m, of the leg from a hit to the receiver."""
    c = vector(hit["point"])
    q = (sink[0] - c[0], sink[1] - c[1], sink[2] - c[2])
    r2 = math.sqrt(dot(q, q))
    return (q[0] / r2, q[1] / r2, q[2] / r2), r2


@inner
def _basis(q: Vector) -> tuple[Vector, Vector]:
    """(V, H) of `frames.polarisation_basis` for the direction −q, from the receiver to a hit."""
    away = (-q[0], -q[1], -q[2])
    h = across_plane_of_incidence((0.0, 0.0, 1.0), away, (0.0, 1.0, 0.0))
    return cross(away, h), h


@inner
def _triangle_share(p: float, q: float) -> complex:
    """Mean of e^{−jp} over a triangle, about its centroid, with phases of p and q along two sides.

    Both sides begin at the same corner.
    """
    x, y, z = -(p + q) / 3.0, (2.0 * p - q) / 3.0, (2.0 * q - p) / 3.0
    low, high = min(x, y, z), max(x, y, z)
    return facet_integral(low, -low - high, high)


@inner
def _weight(hit: np.void, back: Vector, r2: float, wavenumber: float) -> complex:
    """Factor of F: −(j/8π) dS e^{−jk(L+r2)}/(L r2), phase integral of the footprint, roughness."""
    a, b, d = vector(hit["side_a"]), vector(hit["side_b"]), vector(hit["direction"])
    turn = (d[0] - back[0], d[1] - back[1], d[2] - back[2])
    square, length = cross(a, b), hit["length"]
    p, q = wavenumber * dot(turn, a), wavenumber * dot(turn, b)
    if hit["is_triangle"]:
        share = 0.5 * _triangle_share(p, q)
    else:
        share = complex(_sinc(0.5 * p) * _sinc(0.5 * q))
    phase = wavenumber * hit["roughness"] * dot(turn, vector(hit["normal"]))
    if phase != 0.0:
        share *= math.exp(-0.5 * phase * phase)
    scale = math.sqrt(dot(square, square)) / (8.0 * math.pi * length * r2)
    return complex(0.0, -scale) * share * phasor(wavenumber * (length + r2))


FEWEST_HITS: Final = 1000
"""Least number of hits in a range that `in_ranges` gives to one thread. Chosen."""


class Radiated(NamedTuple):
    """Radiation of hits to a receiver, ``(hit, …)``.

    ``transfer`` ``(hit, receiving·transmitting)``; ``direction`` ``(hit, xyz)`` and ``distance``,
    m, of the receiver from the hit; ``power`` of the greatest entry of the transfer. Transfer and
    power are 0 where the receiver is behind the surface.
    """

    transfer: ComplexArray
    direction: FloatArray
    distance: FloatArray
    power: FloatArray


def radiate(hits: Hits, sink: FloatArray, may_be_last: BoolArray, wavenumber: float) -> Radiated:
    """Radiation of hits to a receiver, from bodies that ``may_be_last`` ``(body,)``.

    Obstacles on the last leg, from the hit to the receiver, are not considered here.
    """
    size = len(hits)
    transfer = np.zeros((size, 4), dtype=np.complex128)
    out = Radiated(transfer, np.zeros((size, 3)), np.zeros(size), np.zeros(size))
    in_ranges(_radiate, size, hits, sink, may_be_last, wavenumber, out, least=FEWEST_HITS)
    return out


@compiled
def _radiate(
    begin: int,
    end: int,
    hits: Hits,
    sink: FloatArray,
    may_be_last: BoolArray,
    wavenumber: float,
    out: Radiated,
) -> None:
    transfer, direction, distance, power = out.transfer, out.direction, out.distance, out.power
    for i in range(begin, end):
        hit = hits[i]
        q, r2 = _last_leg(hit, sink)
        put(direction[i], q)
        distance[i] = r2
        if not may_be_last[hit["body"]] or dot(q, vector(hit["normal"])) <= 0.0:
            continue
        v, h = _basis(q)
        weight = _weight(hit, q, r2, wavenumber)
        for t in range(2):
            one = weight * _received(hit["current"][t], q, v)
            other = weight * _received(hit["current"][t], q, h)
            transfer[i, t], transfer[i, 2 + t] = one, other
            power[i] = max(power[i], _square(one), _square(other))


def estimated_power(
    hits: Hits, sink: FloatArray, may_be_last: BoolArray, wavenumber: float
) -> tuple[FloatArray, FloatArray]:
    """Power that hits may radiate to a receiver ``(hit,)``, and the receiver's direction from them.

    The power is that of `radiate`, with 1/√(1 + x²) in place of |sinc x| and without roughness.
    """
    power, direction = np.zeros(len(hits)), np.zeros((len(hits), 3))
    what = hits, sink, may_be_last, wavenumber
    in_ranges(_estimate_power, len(hits), *what, power, direction, least=FEWEST_HITS)
    return power, direction


@compiled
def _estimate_power(
    begin: int,
    end: int,
    hits: Hits,
    sink: FloatArray,
    may_be_last: BoolArray,
    wavenumber: float,
    power: FloatArray,
    direction: FloatArray,
) -> None:
    for i in range(begin, end):
        hit = hits[i]
        q, r2 = _last_leg(hit, sink)
        put(direction[i], q)
        if not may_be_last[hit["body"]] or dot(q, vector(hit["normal"])) <= 0.0:
            continue
        a, b, d = vector(hit["side_a"]), vector(hit["side_b"]), vector(hit["direction"])
        turn = (d[0] - q[0], d[1] - q[1], d[2] - q[2])
        square, half = cross(a, b), 0.5 * wavenumber
        scale = _envelope(half * dot(turn, a)) * _envelope(half * dot(turn, b))
        scale *= math.sqrt(dot(square, square)) / (8.0 * math.pi * hit["length"] * r2)
        v, h = _basis(q)
        most = 0.0
        for t in range(2):
            current = hit["current"][t]
            most = max(most, _square(_received(current, q, v)), _square(_received(current, q, h)))
        power[i] = scale * scale * most
