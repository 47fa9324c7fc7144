r"""Field behind two parallel edges, relative to the field without them.

Two opaque half-planes with parallel edges stand one behind the other between a transmitter and a
point. With only one of them in place the wave over its edge is longer by :math:`e_i` than the
straight line. Its height is the Fresnel parameter :math:`\nu_i = \pm\sqrt{4e_i/\lambda}`, positive
if the edge hides the straight line. In the plane across the edges, the distances from the
transmitter to the first edge, from there to the second, and from there to the point are a, b and c.
The paraxial Kirchhoff integral over both apertures, one after the other, is

.. math::
    \frac{U}{U_0} = \frac j2 \iint_{u>\nu_1,\;\rho u+\sqrt{1-\rho^2}\,v>\nu_2}
    e^{-j\pi(u^2+v^2)/2}\,\mathrm du\,\mathrm dv,\qquad
    \rho = \sqrt{\frac{ac}{(a+b)(b+c)}}

(Millington, Hewitt and Immirzi 1962). The region is a wedge, whose Fresnel window is an integral
along its border as in `ray_tubes.fresnel_window`. One edge is the limit ρ → 1. At grazing
incidence on both, U/U₀ is :math:`\frac14 + \frac{\arcsin\rho}{2\pi}`.

The integral along each side of the wedge, from its corner on, is that to the corner less that to
infinity. The phases of the foot of the side and of the corner occur in both, or in both sides, so
`_beyond_corner` writes out the difference: a point takes half the time.
"""

import math
from typing import Final, NamedTuple

from polychirp.channel.physical_optics.facet_integral import phasor
from polychirp.channel.physical_optics.flat_terms import fresnel_tail
from polychirp.channel.ray_tubes.fresnel_window import (
    LONGEST_QUADRATURE,
    edge_quadrature,
    phased_tail,
)
from polychirp.jit import inlined, inner

ONE_EDGE: Final = 1.0 - 1e-9
"""Value of ρ from which on both edges are one. Chosen: above it, rounding would decide the place of
the wedge's corner."""

OVER_FIRST, OVER_SECOND, OVER_BOTH = 0, 1, 2
"""Values of `EdgeField.over`."""


class EdgeField(NamedTuple):
    """U/U₀ behind two edges, as the straight wave and the wave of the edges.

    ``clear`` is 1 if the straight line passes both edges, else 0, and ``wave`` is U/U₀ less
    ``clear``. The phase of ``wave`` is close to that of the shortest path over an edge or both,
    which is by ``square``·λ/4 longer than the straight line and meets the edges ``over``, one of
    `OVER_FIRST`, `OVER_SECOND` and `OVER_BOTH`.
    """

    clear: float
    wave: complex
    square: float
    over: int


@inlined
def _foot_wave(h: float) -> complex:
    """Wave of the foot of an endless edge at the distance h, in units of (u, v).

    The edge's integral, as of `fresnel_window`, is the sign of h times π/2, less this wave.
    """
    turned = phasor(0.5 * math.pi * h * h) * fresnel_tail(math.pi * abs(h), math.pi)
    return turned * math.copysign(0.5 * math.pi, h) * complex(1.0, 1.0)


@inner
def _beyond_corner(h: float, t: float, corner: complex) -> complex:
    """Minus the integral along an edge at the distance h, from the place t along it to infinity.

    ``corner`` is e^{−jπ(h² + t²)/2}.
    """
    quarter, size = math.copysign(0.5 * math.pi, h), abs(t)
    if size < LONGEST_QUADRATURE:
        part = edge_quadrature(h, size)
        return (part if t >= 0.0 else -part) - quarter + _foot_wave(h)
    angle = math.copysign(math.atan2(size, abs(h)), h)
    tail = phased_tail(h, size, corner)
    # behind the corner, the foot's wave is in neither integral, or in their difference
    if t >= 0.0:
        return angle - quarter + tail
    return 2.0 * _foot_wave(h) - angle - quarter - tail


@inner
def two_edge_field(first: float, second: float, correlation: float) -> EdgeField:
    """Field behind edges of heights ν₁ and ν₂; ``correlation`` is ρ."""
    if correlation >= ONE_EDGE:
        nu = max(first, second)
        clear = 1.0 if nu <= 0.0 else 0.0
        half = 0.5 - math.copysign(0.5, nu)
        return EdgeField(clear, half - clear + _foot_wave(nu) / math.pi, nu * nu, OVER_FIRST)
    clear = 1.0 if first <= 0.0 and second <= 0.0 else 0.0
    sine = math.sqrt(1.0 - correlation * correlation)
    # the corner of the wedge is at (first, height), and at ``start`` along its second side
    height = (second - correlation * first) / sine
    start = sine * first - correlation * height
    total = 0.5 * math.pi + math.asin(correlation)
    corner = first * first + height * height
    turned = phasor(0.5 * math.pi * corner)
    border = _beyond_corner(first, height, turned) + _beyond_corner(second, start, turned)
    wave = (total + border) / (2.0 * math.pi) - clear
    if height <= 0.0 and (start > 0.0 or abs(first) <= abs(second)):
        return EdgeField(clear, wave, first * first, OVER_FIRST)
    if start <= 0.0:
        return EdgeField(clear, wave, second * second, OVER_SECOND)
    return EdgeField(clear, wave, corner, OVER_BOTH)
