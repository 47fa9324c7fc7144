"""Ray tubes and their fields: at launch, and after reflection and transmission."""

import math
from typing import Final, NamedTuple

from polychirp.channel.geometry.vectors import Vector, cross, dot, row, vector
from polychirp.channel.materials.fresnel import Media, sheet_transmission, smooth_reflection
from polychirp.channel.physical_optics.kernels import (
    ComplexVector,
    across_plane_of_incidence,
    any_normal_to,
)
from polychirp.channel.ray_tubes.flat_parts import NO_PART
from polychirp.channel.ray_tubes.intersections import Contact
from polychirp.channel.ray_tubes.launch_grid import Launch
from polychirp.jit import inlined, inner

MIN_FIELD_POWER: Final = 1e-8
"""Ratio of |E|² (spreading loss excluded) to its value at launch, below which a ray is dropped:
−80 dB, chosen: weaker rays cost time."""

NOT_REFLECTED: Final = -2
"""`Ray.part` of a ray that has met no surface."""


class Ray(NamedTuple):
    """A tube's central ray, with the fields of waves sent with V and with H, without their 1/L.

    ``point`` is where the ray starts; ``edge_a`` and ``edge_b`` are the changes of direction from
    this tube to its neighbours; ``length`` is the path length so far, m, and ``rate`` its time
    derivative, m/s; ``num_bodies`` counts reflections by bodies, ``turns`` those by bodies and
    plates; ``departure`` is the direction at launch; ``first_point`` is the point of the first
    reflection by a body; ``part`` is the flat part of that reflection, `NO_PART` if it was by none
    or the ray has passed a sheet, and `NOT_REFLECTED` before.
    """

    point: Vector
    direction: Vector
    edge_a: Vector
    edge_b: Vector
    length: float
    rate: float
    num_bodies: int
    turns: int
    departure: Vector
    first_point: Vector
    part: int
    wave_v: ComplexVector
    wave_h: ComplexVector


@inlined
def _turned_field(
    field: ComplexVector,
    before: Vector,
    after: Vector,
    side: Vector,
    factor: tuple[complex, complex],
) -> ComplexVector:
    """A field in a new direction; ``factor`` (s, p) scales its parts along and across ``side``."""
    into, out = cross(before, side), cross(after, side)
    s = factor[0] * (field[0] * side[0] + field[1] * side[1] + field[2] * side[2])
    p = factor[1] * (field[0] * into[0] + field[1] * into[1] + field[2] * into[2])
    return (
        s * side[0] + p * out[0],
        s * side[1] + p * out[1],
        s * side[2] + p * out[2],
    )


@inlined
def ahead(point: Vector, direction: Vector, distance: float) -> Vector:
    """The point at ``distance``, m, from ``point`` along a unit vector."""
    return (
        point[0] + distance * direction[0],
        point[1] + distance * direction[1],
        point[2] + distance * direction[2],
    )


@inlined
def mirrored(a: Vector, normal: Vector) -> Vector:
    """A direction after reflection at a plane with the unit vector ``normal``."""
    turn = 2.0 * dot(a, normal)
    return a[0] - turn * normal[0], a[1] - turn * normal[1], a[2] - turn * normal[2]


@inlined
def _power(a: ComplexVector) -> float:
    return (
        a[0].real * a[0].real
        + a[0].imag * a[0].imag
        + a[1].real * a[1].real
        + a[1].imag * a[1].imag
        + a[2].real * a[2].real
        + a[2].imag * a[2].imag
    )


@inlined
def is_strong(ray: Ray) -> bool:
    """True if |E|² of the wave sent with V or of that sent with H exceeds `MIN_FIELD_POWER`."""
    return max(_power(ray.wave_v), _power(ray.wave_h)) > MIN_FIELD_POWER


@inlined
def _continued(
    ray: Ray,
    met: Contact,
    direction: Vector,
    edges: tuple[Vector, Vector],
    factor: tuple[complex, complex],
    turns: int,
    part: int,
) -> Ray:
    """The ray behind a contact, in a new direction; factors scale its field parts s and p."""
    side = across_plane_of_incidence(ray.direction, met.normal, any_normal_to(met.normal))
    return Ray(
        met.point,
        direction,
        edges[0],
        edges[1],
        ray.length + met.distance,
        ray.rate,
        ray.num_bodies,
        turns,
        ray.departure,
        met.point if ray.num_bodies == 0 else ray.first_point,
        part,
        _turned_field(ray.wave_v, ray.direction, direction, side, factor),
        _turned_field(ray.wave_h, ray.direction, direction, side, factor),
    )


@inner
def passed(ray: Ray, met: Contact, media: Media, wavenumber: float) -> Ray:
    """The ray after transmission through the sheet that it met, with its direction unchanged."""
    cosine = abs(dot(ray.direction, met.normal))
    factor = sheet_transmission(media, met.medium, cosine, wavenumber)
    edges = ray.edge_a, ray.edge_b
    return _continued(ray, met, ray.direction, edges, factor, ray.turns, NO_PART)


@inner
def reflected(ray: Ray, met: Contact, media: Media, wavenumber: float) -> Ray:
    """The ray after reflection by a surface, as if the surface were smooth and at rest.

    `weakened` adds roughness, the surface's motion and the count of bodies.
    """
    normal = met.normal
    factor = smooth_reflection(media, met.medium, -dot(ray.direction, normal), wavenumber)
    edges = mirrored(ray.edge_a, normal), mirrored(ray.edge_b, normal)
    part = met.part if ray.part == NOT_REFLECTED else ray.part
    return _continued(ray, met, mirrored(ray.direction, normal), edges, factor, ray.turns + 1, part)


@inlined
def settled(
    ray: Ray, turned: Ray, met: Contact, media: Media, wavenumber: float, num_bodies: int
) -> Ray:
    """The reflection ``turned`` of a ray, with the surface's roughness and motion added.

    ``num_bodies`` is 1 if the surface is a body's and 0 if it is a plate.
    """
    cosine = -dot(ray.direction, met.normal)
    phase = wavenumber * media.roughness[met.medium] * cosine
    # rate of the path length, v·(d − r) for directions d before and r after: only the normal part
    # of v counts, since by Fermat's principle a shift along the surface changes no length
    rate = -2.0 * cosine * dot(met.velocity, met.normal)
    factor = math.exp(-2.0 * phase * phase) if phase != 0.0 else 1.0
    return weakened(turned, factor, rate, num_bodies)


@inner
def mirrored_by(ray: Ray, met: Contact, media: Media, wavenumber: float) -> Ray:
    """The ray after reflection by a body's surface, its roughness and motion included."""
    return settled(ray, reflected(ray, met, media, wavenumber), met, media, wavenumber, 1)


@inner
def weakened(ray: Ray, factor: float, rate: float, num_bodies: int) -> Ray:
    """The ray, its fields times ``factor``, with ``rate`` and ``num_bodies`` added to its own."""
    v, h = ray.wave_v, ray.wave_h
    return Ray(
        ray.point,
        ray.direction,
        ray.edge_a,
        ray.edge_b,
        ray.length,
        ray.rate + rate,
        ray.num_bodies + num_bodies,
        ray.turns,
        ray.departure,
        ray.first_point,
        ray.part,
        (factor * v[0], factor * v[1], factor * v[2]),
        (factor * h[0], factor * h[1], factor * h[2]),
    )


@inner
def launched(launch: Launch, tube: int) -> Ray:
    """The ray at the radar of the tube with this number; tubes are numbered row by row."""
    origin, u, v = vector(launch.origin), row(launch.axes, 1), row(launch.axes, 2)
    step_a, step_b = launch.step[0], launch.step[1]
    a = launch.start[0] + (tube // launch.columns) * step_a
    b = launch.start[1] + (tube % launch.columns) * step_b
    d = ahead(ahead(row(launch.axes, 0), u, a), v, b)
    size = math.sqrt(dot(d, d))
    d = (d[0] / size, d[1] / size, d[2] / size)
    share_a, share_b = step_a / size, step_b / size
    ua, vb = ahead(u, d, -dot(d, u)), ahead(v, d, -dot(d, v))
    edge_a = (share_a * ua[0], share_a * ua[1], share_a * ua[2])
    edge_b = (share_b * vb[0], share_b * vb[1], share_b * vb[2])
    return ray_along(origin, vector(launch.velocity), d, (edge_a, edge_b))


@inner
def ray_along(origin: Vector, velocity: Vector, d: Vector, edges: tuple[Vector, Vector]) -> Ray:
    """A ray from a transmitter that moves with a velocity (m/s); ``edges`` as in `Ray`."""
    # the basis of frames.polarisation_basis
    h = across_plane_of_incidence((0.0, 0.0, 1.0), d, (0.0, 1.0, 0.0))
    up = cross(d, h)
    return Ray(
        origin,
        d,
        edges[0],
        edges[1],
        0.0,
        -dot(d, velocity),
        0,
        0,
        d,
        origin,
        NOT_REFLECTED,
        (complex(up[0]), complex(up[1]), complex(up[2])),
        (complex(h[0]), complex(h[1]), complex(h[2])),
    )
