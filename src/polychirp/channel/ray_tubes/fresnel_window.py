r"""The part of a mirror's wave that edges leave: a Fresnel window of the mirror's border.

A transmitter has the image T′ in the plane of a flat part, and the line from T′ to a point P meets
the plane at S. A path over another point of the plane is longer by ΔL than over S. In coordinates
(u, v) in which :math:`\Delta L = \lambda(u^2+v^2)/4`, the part leaves of the endless mirror's wave

.. math:: W = \frac j2 \iint e^{-j\pi(u^2+v^2)/2}\,\mathrm du\,\mathrm dv
    = \frac1{2\pi} \oint \left(1 - e^{-j\pi\rho^2/2}\right) \mathrm d\theta

with polar coordinates ρ, θ about S, which follows from Green's theorem. The integrand has no pole,
so W is continuous through the border of the part's shadow, where it is ½ at a straight edge. For an
endless edge it is the Fresnel integral of the knife edge; for a rectangle with sides along u and v
it is F of `specular.double_plates`.

**Coordinates.** S is the origin; u is along the plane of incidence, shortened by the cosine of
incidence, v across it. The scale of both is that with the exact ΔL at every corner of the border,
so that the phases of waves from the corners are exact. Between them edges are straight lines, or
two with the exact ΔL also where they meet (`LARGEST_BEND`).
"""

import math
from typing import Final, NamedTuple

from polychirp.axes import FloatArray
from polychirp.channel.geometry.vectors import Vector, cross, dot, vector
from polychirp.channel.physical_optics.facet_integral import phasor
from polychirp.channel.physical_optics.flat_terms import fresnel_tail
from polychirp.channel.physical_optics.kernels import any_normal_to
from polychirp.jit import inlined, inner

LONGEST_QUADRATURE: Final = 2.0
"""Distance along an edge from the foot of S, in units of (u, v), up to which the integral is a sum
over `GAUSS_POINTS`. Beyond, it is the asymptotic tail, which is wrong by 1e-4 there and by 4e-4 at
1.5 (chosen)."""

GAUSS_POINTS: Final = (
    (0.033765242898423975, 0.085662246189585164),
    (0.169395306766867648, 0.180380786524069316),
    (0.380690406958401561, 0.233956967286345519),
    (0.619309593041598439, 0.233956967286345519),
    (0.830604693233132352, 0.180380786524069316),
    (0.966234757101576025, 0.085662246189585164),
)
"""Points and weights of Gauss's quadrature of six points from 0 to 1. Over `LONGEST_QUADRATURE` it
is wrong by 2e-5, and with five points by 2e-4."""

LARGEST_BEND: Final = 0.05
"""Distance, in units of (u, v), by which the point of an edge nearest to S may be off the straight
line between the edge's ends; if it is farther off, the edge is cut in two there. Chosen: W is then
wrong by less than 0.02. Only edges that are long against the distance from S are cut."""

Point = tuple[float, float]
"""A point (u, v)."""


class Windowed(NamedTuple):
    """A wave by way of a flat part to a point.

    ``share`` is W; ``specular`` is S and ``nearest`` the point of the part that is nearest to S in
    (u, v), m.
    """

    share: complex
    specular: Vector
    nearest: Vector


@inlined
def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def _size(a: Vector) -> float:
    return math.sqrt(dot(a, a))


@inner
def _edge_term(h: float, t: float) -> complex:
    r""":math:`\int_0^t h\,(1 - e^{-j\pi\rho^2/2})/\rho^2\,\mathrm d\tau`, ρ² = h² + τ², for t ≥ 0.

    h and t are distances of S from the edge and along it, in units of (u, v).
    """
    if t < LONGEST_QUADRATURE:
        return edge_quadrature(h, t)
    # the part without the phase is an angle; of the rest, what is beyond t is taken from the whole
    beyond = phased_tail(h, t, phasor(0.5 * math.pi * (h * h + t * t)))
    whole = phasor(0.5 * math.pi * h * h) * fresnel_tail(math.pi * abs(h), math.pi)
    whole *= math.copysign(0.5 * math.pi, h) * complex(1.0, 1.0)
    return math.atan2(t, abs(h)) * math.copysign(1.0, h) - (whole - beyond)


@inner
def edge_quadrature(h: float, t: float) -> complex:
    """The integral of `_edge_term` for t from 0 to `LONGEST_QUADRATURE`."""
    real, imaginary = 0.0, 0.0
    for share, weight in GAUSS_POINTS:
        # at the corner itself the factor h·t makes the sum zero, whatever the least square
        square = max(h * h + share * share * t * t, 1e-12)
        turned, scale = phasor(0.5 * math.pi * square), weight / square
        real += scale * (1.0 - turned.real)
        imaginary -= scale * turned.imag
    return complex(h * t * real, h * t * imaginary)


@inlined
def phased_tail(h: float, t: float, corner: complex) -> complex:
    r""":math:`\int_t^\infty h\,e^{-j\pi\rho^2/2}/\rho^2\,\mathrm d\tau`, ρ² = h² + τ².

    t is `LONGEST_QUADRATURE` or more, and ``corner`` is e^{−jπ(h² + t²)/2}.
    """
    square, slope = h * h + t * t, -2.0 * t * h / (h * h + t * t) ** 2
    tail = fresnel_tail(math.pi * t, math.pi)
    return ((h / square) * tail + slope * (complex(0.0, -1.0 / math.pi) - t * tail)) * corner


@inlined
def signed_edge_term(h: float, t: float) -> complex:
    """The integral of `_edge_term` for t of either sign, which is odd in t and in h."""
    return _edge_term(h, t) if t >= 0.0 else -_edge_term(h, -t)


@inner
def window(
    border: FloatArray, normal: Vector, image: Vector, at: Vector, wavenumber: float
) -> Windowed:
    """W of the part inside ``border`` m ``(edge, end, xyz)``, for a transmitter's ``image``, m.

    ``at`` m is before the plane, on the side of ``normal``; the image is behind it.
    """
    start = vector(border[0, 0])
    way = _minus(at, image)
    part = dot(_minus(start, image), normal) / dot(way, normal)
    s = (image[0] + part * way[0], image[1] + part * way[1], image[2] + part * way[2])
    length = _size(way)
    d = (way[0] / length, way[1] / length, way[2] / length)
    cosine = dot(d, normal)
    along = (d[0] - cosine * normal[0], d[1] - cosine * normal[1], d[2] - cosine * normal[2])
    size = _size(along)
    if size > 1e-6:
        along = (along[0] / size, along[1] / size, along[2] / size)
    else:
        along = any_normal_to(normal)
    across = cross(normal, along)
    plane = _Zones(s, along, across, cosine, image, at, length, wavenumber)
    total, turned, best, nearest = 0j, 0.0, math.inf, s
    for e in range(len(border)):
        start, end = vector(border[e, 0]), vector(border[e, 1])
        a, b = _in_zones(plane, start), _in_zones(plane, end)
        turned += math.atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1])
        share, square = _foot(a, b)
        point = _between(start, end, share)
        foot = _in_zones(plane, point)
        bend = foot[0] - a[0] - share * (b[0] - a[0]), foot[1] - a[1] - share * (b[1] - a[1])
        if math.hypot(bend[0], bend[1]) > LARGEST_BEND:
            total += _side(a, foot) + _side(foot, b)
            square = foot[0] * foot[0] + foot[1] * foot[1]
        else:
            total += _side(a, b)
        if square < best:
            best, nearest = square, point
    if turned > math.pi:
        return Windowed(total / (2.0 * math.pi), s, s)
    return Windowed(total / (2.0 * math.pi), s, nearest)


@inlined
def _between(start: Vector, end: Vector, share: float) -> Vector:
    way = _minus(end, start)
    return start[0] + share * way[0], start[1] + share * way[1], start[2] + share * way[2]


@inlined
def _foot(a: Point, b: Point) -> tuple[float, float]:
    """Point of a side nearest to S, as a share of the side, and its squared distance."""
    eu, ev = b[0] - a[0], b[1] - a[1]
    share = min(max(-(a[0] * eu + a[1] * ev) / max(eu * eu + ev * ev, 1e-30), 0.0), 1.0)
    u, v = a[0] + share * eu, a[1] + share * ev
    return share, u * u + v * v


@inner
def _side(a: Point, b: Point) -> complex:
    """Integral of 1 − e^{−jπρ²/2} over the angle, along a side."""
    eu, ev = b[0] - a[0], b[1] - a[1]
    size = math.sqrt(eu * eu + ev * ev)
    if size < 1e-12:
        return 0j
    eu, ev = eu / size, ev / size
    h, t = a[0] * ev - a[1] * eu, a[0] * eu + a[1] * ev
    return signed_edge_term(h, t + size) - signed_edge_term(h, t)


class _Zones(NamedTuple):
    """Fresnel zones about S: points of the plane as (u, v), see `window`."""

    origin: Vector
    along: Vector
    across: Vector
    cosine: float
    image: Vector
    at: Vector
    length: float
    wavenumber: float


@inner
def _in_zones(plane: _Zones, point: Vector) -> Point:
    """(u, v) of a point of the plane."""
    off = _minus(point, plane.origin)
    u, v = plane.cosine * dot(off, plane.along), dot(off, plane.across)
    square = u * u + v * v
    if square <= 0.0:
        return 0.0, 0.0
    detour = _size(_minus(point, plane.image)) + _size(_minus(plane.at, point)) - plane.length
    scale = math.sqrt(max(2.0 * plane.wavenumber * detour / math.pi, 0.0) / square)
    return scale * u, scale * v
