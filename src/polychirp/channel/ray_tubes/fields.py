"""Ray tubes and their fields: at launch, and after reflection and transmission."""

import math
from typing import Final, NamedTuple

from polychirp.channel.geometry.vectors import Vector, cross, dot, plus, row, vector
from polychirp.channel.materials.fresnel import Media, sheet_transmission, smooth_reflection
from polychirp.channel.physical_optics.kernels import (
    ComplexVector,
    across_plane_of_incidence,
    any_normal_to,
)
from polychirp.channel.ray_tubes.flat_parts import NO_PART
from polychirp.channel.ray_tubes.intersections import Contact, turn_of_normal
from polychirp.channel.ray_tubes.launch_grid import Launch
from polychirp.jit import inlined, inner

MIN_FIELD_POWER: Final = 1e-8
"""Ratio of |E|² (spreading loss excluded) to its value at launch, below which a ray is dropped:
−80 dB, chosen: weaker rays cost time."""

NOT_REFLECTED: Final = -2
"""`Ray.part` of a ray that has met no surface."""

NO_DETOUR: Final = -1
"""`Detour.number` of a ray that was reflected by its first body alone."""


class Rates(NamedTuple):
    """Derivatives of one quantity over a tube's two sides and over time."""

    a: float
    b: float
    time: float


class Detour(NamedTuple):
    """A surface on the way between two bodies: where it was met, m, and its number.

    The number is that of a body, or `NO_DETOUR` − 1 − p for the plate p, or `NO_DETOUR`.
    """

    point: Vector
    number: int


class Ray(NamedTuple):
    r"""A tube's central ray, with the fields of waves sent with V and with H, without spreading.

    ``point`` is where the ray starts. To the next tube in direction a or b of the window, it
    changes by ``side_a`` or ``side_b``, m, and ``direction`` by ``edge_a`` or ``edge_b``; within
    time, for the same direction at launch, they change by ``side_t``, m/s, and ``edge_t``, 1/s.

    ``length`` is the path length so far, m. Its ``rate``, m/s, is by Fermat's principle that of
    the matter at the ends of the legs alone,

    .. math:: \dot L = \sum_m (d_{m-1} - d_m)\cdot v_m

    with the directions d before and after each point m and the velocity v of its matter.
    ``rates`` are the derivatives of that sum.

    ``num_bodies`` counts reflections by bodies, ``turns`` those by bodies and plates;
    ``departure`` is the direction at launch, and ``solid`` the solid angle of the tube there;
    ``first_point`` is the point of the first reflection by a body, and ``detour`` the first
    reflection by another surface than that body. ``part`` is the flat part of the first reflection,
    `NO_PART` if it was by none or the ray has passed a sheet, and `NOT_REFLECTED` before;
    ``is_curved`` tells whether any surface that reflected it is curved.
    """

    point: Vector
    direction: Vector
    side_a: Vector
    side_b: Vector
    side_t: Vector
    edge_a: Vector
    edge_b: Vector
    edge_t: Vector
    length: float
    rate: float
    rates: Rates
    num_bodies: int
    turns: int
    departure: Vector
    solid: float
    first_point: Vector
    detour: Detour
    part: int
    is_curved: bool
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
def foci_within(ray: Ray, distance: float) -> int:
    """Number of focal lines, 0 to 2, that a tube passes within ``distance`` m.

    There its cross section, a quadratic function of the way, changes its sign.
    """
    d, a, b, u, v = ray.direction, ray.side_a, ray.side_b, ray.edge_a, ray.edge_b
    first = dot(cross(a, b), d)
    slope = dot(cross(a, v), d) + dot(cross(u, b), d)
    square = dot(cross(u, v), d)
    last = first + distance * (slope + distance * square)
    if first * last < 0.0:
        return 1
    if first == 0.0 or square == 0.0:
        return 0
    middle = -0.5 * slope / square
    least = first + 0.5 * slope * middle
    return 2 if 0.0 < middle < distance and least * first < 0.0 else 0


@inlined
def focused(wave: ComplexVector, foci: int) -> ComplexVector:
    """A field behind some focal lines, each of which advances its phase by π/2."""
    if foci == 0:
        return wave
    factor = 1j if foci == 1 else complex(-1.0)
    return factor * wave[0], factor * wave[1], factor * wave[2]


@inlined
def _step_along(side: Vector, edge: Vector, ray: Ray, met: Contact) -> Vector:
    """Step of the contact along the surface, given those of the ray's start and direction."""
    free = plus(side, edge, met.distance)
    return plus(free, ray.direction, -dot(free, met.normal) / dot(ray.direction, met.normal))


@inlined
def _mirrored_edge(edge: Vector, turn: Vector, direction: Vector, normal: Vector) -> Vector:
    """Change of a reflected direction, given those of the direction before and of the normal."""
    along, across = dot(direction, normal), dot(edge, normal) + dot(direction, turn)
    return (
        edge[0] - 2.0 * (across * normal[0] + along * turn[0]),
        edge[1] - 2.0 * (across * normal[1] + along * turn[1]),
        edge[2] - 2.0 * (across * normal[2] + along * turn[2]),
    )


@inlined
def _about_z(rate: float, a: Vector) -> Vector:
    """The vector product of a turn about z, rad/s, and a vector."""
    return -rate * a[1], rate * a[0], 0.0


@inlined
def _rate_after(rate: float, before: Vector, edge: Vector, step: Vector,
                ray: Ray, direction: Vector, met: Contact) -> float:  # fmt: skip
    """A derivative of `Ray.rate` after a reflection.

    ``before`` and ``edge`` are the changes of direction before and after it, ``step`` that of the
    contact in the world.
    """
    d, v, spin = ray.direction, met.velocity, _about_z(met.yaw_rate, step)
    return rate + dot(before, v) - dot(edge, v) + dot(d, spin) - dot(direction, spin)


@inner
def passed(ray: Ray, met: Contact, media: Media, wavenumber: float) -> Ray:
    """The ray after transmission through the sheet that it met, with its direction unchanged."""
    cosine = abs(dot(ray.direction, met.normal))
    factor = sheet_transmission(media, met.medium, cosine, wavenumber)
    side = across_plane_of_incidence(ray.direction, met.normal, any_normal_to(met.normal))
    foci, d = foci_within(ray, met.distance), ray.direction
    return Ray(
        met.point,
        d,
        plus(ray.side_a, ray.edge_a, met.distance),
        plus(ray.side_b, ray.edge_b, met.distance),
        plus(ray.side_t, ray.edge_t, met.distance),
        ray.edge_a,
        ray.edge_b,
        ray.edge_t,
        ray.length + met.distance,
        ray.rate,
        ray.rates,
        ray.num_bodies,
        ray.turns,
        ray.departure,
        ray.solid,
        met.point if ray.num_bodies == 0 else ray.first_point,
        ray.detour,
        NO_PART,
        ray.is_curved,
        _turned_field(focused(ray.wave_v, foci), d, d, side, factor),
        _turned_field(focused(ray.wave_h, foci), d, d, side, factor),
    )


@inner
def reflected(ray: Ray, met: Contact, media: Media, wavenumber: float) -> Ray:
    """The ray after reflection by a surface, as if the surface were smooth.

    `settled` adds roughness and the count of bodies.
    """
    n, d, v = met.normal, ray.direction, met.velocity
    factor = smooth_reflection(media, met.medium, -dot(d, n), wavenumber)
    after = mirrored(d, n)
    step_a = _step_along(ray.side_a, ray.edge_a, ray, met)
    step_b = _step_along(ray.side_b, ray.edge_b, ray, met)
    step_t = _step_along(plus(ray.side_t, v, -1.0), ray.edge_t, ray, met)
    edge_a = _mirrored_edge(ray.edge_a, turn_of_normal(met, step_a, d), d, n)
    edge_b = _mirrored_edge(ray.edge_b, turn_of_normal(met, step_b, d), d, n)
    turn_t = plus(turn_of_normal(met, step_t, d), _about_z(met.yaw_rate, n), 1.0)
    edge_t = _mirrored_edge(ray.edge_t, turn_t, d, n)
    step_t = plus(step_t, v, 1.0)
    side = across_plane_of_incidence(d, n, any_normal_to(n))
    foci = foci_within(ray, met.distance)
    return Ray(
        met.point,
        after,
        step_a,
        step_b,
        step_t,
        edge_a,
        edge_b,
        edge_t,
        ray.length + met.distance,
        ray.rate + dot(d, v) - dot(after, v),
        Rates(
            _rate_after(ray.rates.a, ray.edge_a, edge_a, step_a, ray, after, met),
            _rate_after(ray.rates.b, ray.edge_b, edge_b, step_b, ray, after, met),
            _rate_after(ray.rates.time, ray.edge_t, edge_t, step_t, ray, after, met),
        ),
        ray.num_bodies,
        ray.turns + 1,
        ray.departure,
        ray.solid,
        met.point if ray.num_bodies == 0 else ray.first_point,
        ray.detour,
        met.part if ray.part == NOT_REFLECTED else ray.part,
        ray.is_curved or met.is_curved,
        _turned_field(focused(ray.wave_v, foci), d, after, side, factor),
        _turned_field(focused(ray.wave_h, foci), d, after, side, factor),
    )


@inlined
def settled(
    ray: Ray,
    turned: Ray,
    met: Contact,
    media: Media,
    wavenumber: float,
    surface: tuple[int, int],
) -> Ray:
    """The reflection ``turned`` of a ray, with the surface's roughness added.

    ``surface`` has 1 for a body and 0 for a plate, and its number as of `Detour`, `NO_DETOUR` for
    the first body.
    """
    num_bodies, number = surface
    phase = wavenumber * media.roughness[met.medium] * dot(ray.direction, met.normal)
    factor = math.exp(-2.0 * phase * phase) if phase != 0.0 else 1.0
    detour = ray.detour
    if detour.number == NO_DETOUR and number != NO_DETOUR:
        detour = Detour(met.point, number)
    return weakened(turned, factor, num_bodies, detour)


@inner
def mirrored_by(ray: Ray, met: Contact, media: Media, wavenumber: float) -> Ray:
    """The ray after reflection by its first body's surface, the roughness included."""
    return settled(
        ray, reflected(ray, met, media, wavenumber), met, media, wavenumber, (1, NO_DETOUR)
    )


@inner
def weakened(ray: Ray, factor: float, num_bodies: int, detour: Detour) -> Ray:
    """The ray with its fields times ``factor``, ``num_bodies`` added to its own, and a detour."""
    v, h = ray.wave_v, ray.wave_h
    return Ray(
        ray.point,
        ray.direction,
        ray.side_a,
        ray.side_b,
        ray.side_t,
        ray.edge_a,
        ray.edge_b,
        ray.edge_t,
        ray.length,
        ray.rate,
        ray.rates,
        ray.num_bodies + num_bodies,
        ray.turns,
        ray.departure,
        ray.solid,
        ray.first_point,
        detour,
        ray.part,
        ray.is_curved,
        (factor * v[0], factor * v[1], factor * v[2]),
        (factor * h[0], factor * h[1], factor * h[2]),
    )


@inlined
def fixed_point_motion(after: Ray, at: Contact) -> tuple[float, float]:
    """Tubes per second, along a and b, by which a fixed point of the matter at a contact moves.

    ``after`` is the ray behind the contact.
    """
    n, a, b = at.normal, after.side_a, after.side_b
    slip = plus(after.side_t, at.velocity, -1.0)
    size = dot(cross(a, b), n)
    if size == 0.0:
        return 0.0, 0.0
    return -dot(cross(slip, b), n) / size, -dot(cross(a, slip), n) / size


@inlined
def acceleration_to(ray: Ray, after: Ray, at: Contact) -> float:
    """Second derivative, m/s², of the path's length to a fixed point of the matter at a contact.

    ``ray`` and ``after`` are the ray before and behind the contact. The acceleration of the matter
    itself and that of the transmitter are left out.
    """
    u, v = fixed_point_motion(after, at)
    turn = plus(plus(ray.edge_t, ray.edge_a, u), ray.edge_b, v)
    rates = ray.rates
    return rates.time + u * rates.a + v * rates.b + dot(turn, at.velocity)


@inner
def launched(launch: Launch, tube: int) -> Ray:
    """The ray at the radar of the tube with this number; tubes are numbered row by row."""
    origin, u, v = vector(launch.origin), row(launch.axes, 1), row(launch.axes, 2)
    step_a, step_b = launch.step[0], launch.step[1]
    a = launch.start[0] + (tube // launch.columns) * step_a
    b = launch.start[1] + (tube % launch.columns) * step_b
    d = plus(plus(row(launch.axes, 0), u, a), v, b)
    size = math.sqrt(dot(d, d))
    d = (d[0] / size, d[1] / size, d[2] / size)
    share_a, share_b = step_a / size, step_b / size
    ua, vb = plus(u, d, -dot(d, u)), plus(v, d, -dot(d, v))
    edge_a = (share_a * ua[0], share_a * ua[1], share_a * ua[2])
    edge_b = (share_b * vb[0], share_b * vb[1], share_b * vb[2])
    return ray_along(origin, vector(launch.velocity), d, (edge_a, edge_b))


@inner
def ray_along(origin: Vector, velocity: Vector, d: Vector, edges: tuple[Vector, Vector]) -> Ray:
    """A ray from a transmitter that moves with a velocity (m/s); ``edges`` as in `Ray`."""
    # the basis of frames.polarisation_basis
    h = across_plane_of_incidence((0.0, 0.0, 1.0), d, (0.0, 1.0, 0.0))
    up, none = cross(d, h), (0.0, 0.0, 0.0)
    return Ray(
        origin,
        d,
        none,
        none,
        velocity,
        edges[0],
        edges[1],
        none,
        0.0,
        -dot(d, velocity),
        Rates(-dot(edges[0], velocity), -dot(edges[1], velocity), 0.0),
        0,
        0,
        d,
        abs(dot(cross(edges[0], edges[1]), d)),
        origin,
        Detour(origin, NO_DETOUR),
        NOT_REFLECTED,
        False,
        (complex(up[0]), complex(up[1]), complex(up[2])),
        (complex(h[0]), complex(h[1]), complex(h[2])),
    )
