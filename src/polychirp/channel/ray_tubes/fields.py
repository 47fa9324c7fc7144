"""Tubes as rays with their fields: how they leave, and what surfaces make of them."""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from polychirp.axes import FloatArray
from polychirp.channel.geometry.bvh import Vector
from polychirp.channel.geometry.vectors import cross, dot, vector
from polychirp.channel.materials.fresnel import Media, sheet_transmission, smooth_reflection
from polychirp.channel.physical_optics.kernels import (
    ComplexVector,
    across_plane_of_incidence,
    any_normal_to,
)

FAINT = 1e-8
"""|E|² below which a wave that left with 1 is followed no further."""


class Ray(NamedTuple):
    """A tube on its way, and the fields of a wave that left V- and H-polarised, without 1/L.

    ``edge_a``, ``edge_b``: what a step to the neighbours changes of the direction; ``length`` m
    so far and its ``rate`` m/s; ``met``: bodies that have reflected it; ``turns``: those and
    plates; ``departure``; ``first``: where it met the first body.
    """

    point: Vector
    direction: Vector
    edge_a: Vector
    edge_b: Vector
    length: float
    rate: float
    met: int
    turns: int
    departure: Vector
    first: Vector
    wave_v: ComplexVector
    wave_h: ComplexVector


@njit(cache=True, nogil=True, error_model="numpy")
def _turned_field(
    field: ComplexVector,
    before: Vector,
    after: Vector,
    side: Vector,
    turn: tuple[complex, complex],
) -> ComplexVector:
    """A field that goes on along another direction, its parts across and in a plane weighed."""
    into, out = cross(before, side), cross(after, side)
    s = turn[0] * (field[0] * side[0] + field[1] * side[1] + field[2] * side[2])
    p = turn[1] * (field[0] * into[0] + field[1] * into[1] + field[2] * into[2])
    return (
        s * side[0] + p * out[0],
        s * side[1] + p * out[1],
        s * side[2] + p * out[2],
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def ahead(point: Vector, direction: Vector, distance: float) -> Vector:
    """The point at a distance along a direction."""
    return (
        point[0] + distance * direction[0],
        point[1] + distance * direction[1],
        point[2] + distance * direction[2],
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def mirrored(a: Vector, normal: Vector) -> Vector:
    """A direction after a mirror with a normal."""
    turn = 2.0 * dot(a, normal)
    return a[0] - turn * normal[0], a[1] - turn * normal[1], a[2] - turn * normal[2]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _power(a: ComplexVector) -> float:
    return (
        a[0].real * a[0].real
        + a[0].imag * a[0].imag
        + a[1].real * a[1].real
        + a[1].imag * a[1].imag
        + a[2].real * a[2].real
        + a[2].imag * a[2].imag
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def is_heard(ray: Ray) -> bool:
    """Whether a ray is worth following."""
    return max(_power(ray.wave_v), _power(ray.wave_h)) > FAINT


@njit(cache=True, nogil=True, error_model="numpy")
def passed(
    ray: Ray, point: Vector, distance: float, normal: Vector, media: Media, medium: int,
    wavenumber: float,
) -> Ray:  # fmt: skip
    """The ray behind a sheet that it met at a point."""
    d = ray.direction
    turn = sheet_transmission(media, medium, abs(dot(d, normal)), wavenumber)
    side = across_plane_of_incidence(d, normal, any_normal_to(normal))
    return Ray(
        point,
        d,
        ray.edge_a,
        ray.edge_b,
        ray.length + distance,
        ray.rate,
        ray.met,
        ray.turns,
        ray.departure,
        ray.first,
        _turned_field(ray.wave_v, d, d, side, turn),
        _turned_field(ray.wave_h, d, d, side, turn),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def bounced(
    ray: Ray, point: Vector, distance: float, normal: Vector, media: Media, medium: int,
    wavenumber: float,
) -> Ray:  # fmt: skip
    """The ray after a smooth surface at rest that is no body, which it met at a point."""
    cosine = -dot(ray.direction, normal)
    after = mirrored(ray.direction, normal)
    turn = smooth_reflection(media, medium, cosine, wavenumber)
    side = across_plane_of_incidence(ray.direction, normal, any_normal_to(normal))
    return Ray(
        point,
        after,
        mirrored(ray.edge_a, normal),
        mirrored(ray.edge_b, normal),
        ray.length + distance,
        ray.rate,
        ray.met,
        ray.turns + 1,
        ray.departure,
        point if ray.met == 0 else ray.first,
        _turned_field(ray.wave_v, ray.direction, after, side, turn),
        _turned_field(ray.wave_h, ray.direction, after, side, turn),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def weakened(ray: Ray, loss: float, rate: float, met: int) -> Ray:
    """A ray with a loss of amplitude, and with more of its rate and its bodies."""
    v, h = ray.wave_v, ray.wave_h
    return Ray(
        ray.point,
        ray.direction,
        ray.edge_a,
        ray.edge_b,
        ray.length,
        ray.rate + rate,
        ray.met + met,
        ray.turns,
        ray.departure,
        ray.first,
        (loss * v[0], loss * v[1], loss * v[2]),
        (loss * h[0], loss * h[1], loss * h[2]),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def launched(window: FloatArray, row: int, column: int) -> Ray:
    """The tube in a row and a column of a window, as it leaves."""
    origin, velocity, u, v = window[0], window[1], vector(window[3]), vector(window[4])
    step_a, step_b = window[6, 0], window[6, 1]
    a, b = window[5, 0] + row * step_a, window[5, 1] + column * step_b
    d = ahead(ahead(vector(window[2]), u, a), v, b)
    size = math.sqrt(dot(d, d))
    d = (d[0] / size, d[1] / size, d[2] / size)
    share_a, share_b = step_a / size, step_b / size
    ua, vb = ahead(u, d, -dot(d, u)), ahead(v, d, -dot(d, v))
    # the basis of frames.polarisation_basis
    h = across_plane_of_incidence((0.0, 0.0, 1.0), d, (0.0, 1.0, 0.0))
    up = cross(d, h)
    return Ray(
        vector(origin),
        d,
        (share_a * ua[0], share_a * ua[1], share_a * ua[2]),
        (share_b * vb[0], share_b * vb[1], share_b * vb[2]),
        0.0,
        -dot(d, vector(velocity)),
        0,
        0,
        d,
        vector(origin),
        (complex(up[0]), complex(up[1]), complex(up[2])),
        (complex(h[0]), complex(h[1]), complex(h[2])),
    )
