"""Hits of ray tubes on bodies: the currents on the footprints, and the waves that they radiate."""

import cmath
import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, vector
from polychirp.channel.physical_optics.facet_integral import facet_integral, phasor
from polychirp.channel.physical_optics.kernels import ComplexVector, across_plane_of_incidence
from polychirp.channel.ray_tubes.fields import Ray, acceleration_to, foci_within, focused
from polychirp.channel.ray_tubes.intersections import Contact, turn_of_normal
from polychirp.jit import borrowed, compiled, inlined, inner
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
        ("detour", np.int64),  # number of another surface between both bodies, as of `Detour`
        ("detour_point", np.float64, 3),  # where the tube met it, m
        ("length", np.float64),  # L, of the path up to the point, m
        ("spread", np.float64),  # 1/m, of the field: its amplitude there over that at launch
        ("rate", np.float64),  # of change of the length, without this surface's motion, m/s
        ("acceleration", np.float64),  # of the length to a fixed point of this surface, m/s²
        ("roughness", np.float64),  # rms height of this surface, m
        ("body", np.int64),
        ("first_body", np.int64),
        ("turns", np.int64),  # number of reflections, this one included
        ("tube", np.int64),  # number of the tube
        ("part", np.int64, 2),  # flat parts of both reflections if there are two and no sheet
        ("current", np.complex64, (2, 2, 3)),  # (polarisation, J or M, xyz), without the spread
        ("front", np.float64, 3),  # of the ray before, m: the products ∂D·A of aa, ab and bb
        ("curve", np.float64, 3),  # of this surface, m: the products ∂n·A of aa, ab and bb
        ("is_curved", np.bool_),  # some surface that the tube has met is curved, this one included
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
def put(out: FloatArray, a: Vector) -> None:
    """Write a vector into an array ``(xyz,)``."""
    out[0], out[1], out[2] = a


@inner
def record(hit: np.void, ray: Ray, after: Ray, at: Contact, roughness: float) -> None:
    """Fill a hit from the ray before and after it; the caller sets the bodies and the tube."""
    normal, a, b = at.normal, after.side_a, after.side_b
    put(hit["point"], after.point)
    put(hit["direction"], ray.direction)
    put(hit["normal"], normal)
    put(hit["side_a"], a)
    put(hit["side_b"], b)
    put(hit["departure"], ray.departure)
    put(hit["first_point"], ray.first_point)
    hit["detour"] = ray.detour.number
    put(hit["detour_point"], ray.detour.point)
    hit["length"], hit["rate"], hit["roughness"] = after.length, ray.rate, roughness
    hit["acceleration"] = acceleration_to(ray, after, at)
    # at a focal line the footprint has no area, and radiates nothing
    area = abs(dot(cross(a, b), ray.direction))
    hit["spread"] = math.sqrt(ray.solid / area) if area > 0.0 else 0.0
    hit["turns"], hit["is_triangle"], hit["is_curved"] = after.turns, False, after.is_curved
    across = 0.5 * (dot(ray.edge_a, b) + dot(ray.edge_b, a))
    put(hit["front"], (dot(ray.edge_a, a), across, dot(ray.edge_b, b)))
    d = ray.direction
    turn_a, turn_b = turn_of_normal(at, a, d), turn_of_normal(at, b, d)
    across = 0.5 * (dot(turn_a, b) + dot(turn_b, a))
    put(hit["curve"], (dot(turn_a, a), across, dot(turn_b, b)))
    current = hit["current"]
    foci = foci_within(ray, at.distance)
    before, behind = ray.direction, after.direction
    _induce(normal, before, behind, focused(ray.wave_v, foci), after.wave_v, current[0])
    _induce(normal, before, behind, focused(ray.wave_h, foci), after.wave_h, current[1])


BEAM_WIDTH: Final = 0.7
"""Standard deviation of a tube's Gaussian window, in distances of tubes. Chosen: the sum of all
windows is then 1 within 2e-4."""


STATIONARY_SLACK: Final = 1.0
"""Distance, in tubes, by which the stationary point of a curved wave front may be nearer to a wide
tube than this tube's own curvature says. Chosen."""


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
def _beam_share(hit: np.void, back: Vector, r2: float, wavenumber: float, slack: float) -> complex:
    r"""Mean of e^{−jφ} over the Gaussian window of a tube, φ to second order about its middle.

    Along each side, the middle is taken as up to ``slack`` tubes nearer to where φ is stationary.
    """
    a, b, d = vector(hit["side_a"]), vector(hit["side_b"]), vector(hit["direction"])
    front, curve, n = hit["front"], hit["curve"], vector(hit["normal"])
    turn = (d[0] - back[0], d[1] - back[1], d[2] - back[2])
    up, qa, qb = dot(turn, n), dot(back, a), dot(back, b)
    # second derivatives of the phase
    aa = wavenumber * (front[0] - up * curve[0] + (dot(a, a) - qa * qa) / r2)
    ab = wavenumber * (front[1] - up * curve[1] + (dot(a, b) - qa * qb) / r2)
    bb = wavenumber * (front[2] - up * curve[2] + (dot(b, b) - qb * qb) / r2)
    p, q = wavenumber * dot(turn, a), wavenumber * dot(turn, b)
    if slack > 0.0:
        p = math.copysign(max(0.0, abs(p) - slack * (abs(aa) + abs(ab))), p)
        q = math.copysign(max(0.0, abs(q) - slack * (abs(ab) + abs(bb))), q)
    # the matrix 1 + jσ²H with the window's variance, and its determinant, of which the square root
    # is the product of those of both eigenvalues, each with a positive real part
    v = BEAM_WIDTH * BEAM_WIDTH
    m, o, w = complex(1.0, v * aa), complex(0.0, v * ab), complex(1.0, v * bb)
    half, product = 0.5 * (m + w), m * w - o * o
    gap = cmath.sqrt(half * half - product)
    root = cmath.sqrt(half + gap) * cmath.sqrt(half - gap)
    form = (w * p * p - 2.0 * o * p * q + m * q * q) / product
    return cmath.exp(-0.5 * v * form) / root


@inner
def _weight(hit: np.void, back: Vector, r2: float, wavenumber: float) -> complex:
    """Factor of F: −(j/8π) dS s e^{−jk(L+r2)}/r2 with the spread s, phase integral, roughness."""
    a, b, d = vector(hit["side_a"]), vector(hit["side_b"]), vector(hit["direction"])
    turn = (d[0] - back[0], d[1] - back[1], d[2] - back[2])
    square = cross(a, b)
    p, q = wavenumber * dot(turn, a), wavenumber * dot(turn, b)
    if hit["is_curved"]:
        share = _beam_share(hit, back, r2, wavenumber, 0.0)
    elif hit["is_triangle"]:
        share = 0.5 * _triangle_share(p, q)
    else:
        share = complex(_sinc(0.5 * p) * _sinc(0.5 * q))
    phase = wavenumber * hit["roughness"] * dot(turn, vector(hit["normal"]))
    if phase != 0.0:
        share *= math.exp(-0.5 * phase * phase)
    scale = math.sqrt(dot(square, square)) * hit["spread"] / (8.0 * math.pi * r2)
    return complex(0.0, -scale) * share * phasor(wavenumber * (hit["length"] + r2))


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
    transfer, direction, distance, power = borrowed(out)
    hits, sink, may_be_last = borrowed(hits), borrowed(sink), borrowed(may_be_last)
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
    hits, sink, may_be_last = borrowed(hits), borrowed(sink), borrowed(may_be_last)
    power, direction = borrowed(power), borrowed(direction)
    for i in range(begin, end):
        hit = hits[i]
        q, r2 = _last_leg(hit, sink)
        put(direction[i], q)
        if not may_be_last[hit["body"]] or dot(q, vector(hit["normal"])) <= 0.0:
            continue
        a, b, d = vector(hit["side_a"]), vector(hit["side_b"]), vector(hit["direction"])
        turn = (d[0] - q[0], d[1] - q[1], d[2] - q[2])
        square, half = cross(a, b), 0.5 * wavenumber
        if hit["is_curved"]:
            scale = abs(_beam_share(hit, q, r2, wavenumber, STATIONARY_SLACK))
        else:
            scale = _envelope(half * dot(turn, a)) * _envelope(half * dot(turn, b))
        scale *= math.sqrt(dot(square, square)) * hit["spread"] / (8.0 * math.pi * r2)
        v, h = _basis(q)
        most = 0.0
        for t in range(2):
            current = hit["current"][t]
            most = max(most, _square(_received(current, q, v)), _square(_received(current, q, h)))
        power[i] = scale * scale * most
