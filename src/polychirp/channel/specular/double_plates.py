r"""Double reflections: mirror images of mirror images, in two different plates.

The transmitter T has the image T′ in plate A, and T′ the image T″ in plate B. The straight line
from T″ to the receiver X meets B at the last bounce, and the line from T′ to there meets A at the
first one.

.. math:: A = \frac{\lambda}{4\pi|T''X|}\,\Gamma_A\Gamma_B\,\rho_A\rho_B\,F,\qquad
    F = \frac j2\,[f(u_2)-f(u_1)]\,[f(v_2)-f(v_1)],\quad f(x) = C(x) - jS(x)

Γ and ρ are as in `specular.plates`. F belongs to the opening that both plates leave for the
unfolded ray; its limits u and v are the edges', each by

.. math:: u = \pm\sqrt{4\,\Delta L/\lambda}

ΔL is the detour of the shortest way that touches the endless line through the edge; the sign says
on which side of the ray the edge is. (For small ΔL this is the u of `specular.plates`.) Intervals
of A and B are intersected along the two directions across the ray that fit their edges best.

**Corners.** Both orders of reflection in a right-angled corner have the same T″. The corner's edge
has the same u in both, and it is the upper limit of the opening in one order and the lower one in
the other: both F add up to that of an opening over the whole corner, wherever the ray passes. In a
radar's own echo the edge is at u = 0, and each order contributes half.

Reflections in three and more plates, and the motion of plates during the flight, are neglected. F
is exact in the Fresnel approximation for one plate whose sides lie in and across the plane of
incidence, and for two plates that share their edges. If edges of both plates limit one interval at
different distances, the wave is diffracted twice, but only the narrower opening is counted. Sides
that are oblique to each other are treated as parallel.
"""

from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.base import no_paths, path_table, strength
from polychirp.channel.geometry.retarded_delay import (
    range_acceleration,
    retarded_leg,
    turning,
)
from polychirp.channel.scene.occlusion import blocked
from polychirp.channel.scene.shadow_tests import strongest_visible
from polychirp.channel.scene.transmission import transmission_matrices, with_leg_losses
from polychirp.channel.scene.world import Plates, World
from polychirp.channel.specular.images import (
    across_incidence,
    coefficients_of,
    image_of,
    image_velocity,
    mirrored,
    nearest_on_plates,
)
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import polarisation_basis
from polychirp.model.paths import Bounce, PropagationPaths

LEAST_OPENING: Final = 1e-3
"""1 + n·n' of the normals of two plates, below which they face each other and meet in no corner.
Chosen: it is an angle of 2.6 degrees between them."""


def corner_paths(world: World, pairs: IntArray) -> PropagationPaths:
    """Paths of ``pairs`` ``(pair, 2)`` by reflections in two different plates, in either order.

    A radar's own echoes of corners are included. Plates A and B are tried if part of each is in
    front of the other, the transmitter is in front of A and its image in A in front of B, and the
    receiver is in front of B and its image in B in front of A. Paths are left out if their power
    is below that of endless mirrors by more than the dynamic range D, |F|² < 1/D. The others are
    tested for shadow from the strongest (by `strength`, with the elements' gains) down to D below
    the strongest visible one; weaker paths are left out, as by `without_weak`.

    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.model.scene import Scene
    >>> empty = Composite().prepare(Scene(time=0.0, actors=()))
    >>> corner_paths(empty, np.zeros((0, 2), dtype=np.int64)).num_paths
    0
    """
    if len(world.plates.actor) < 2 or not len(pairs):
        return no_paths(world.scene, world.frequency)
    group, first, second = _candidates(world, pairs)
    if not len(group):
        return no_paths(world.scene, world.frequency)
    rays = _rays(world, pairs[group], world.plates.of(first), world.plates.of(second))
    is_open = np.flatnonzero(np.abs(rays.opening) ** 2 * world.dynamic_range >= 1)
    rays, group = rays.of(is_open), group[is_open]
    nothing = np.broadcast_to(np.eye(2, dtype=np.complex128), (len(group), 3, 2, 2))
    free = strongest_visible(
        strength(_paths(world, rays, nothing), world.scene),
        group,
        lambda numbers: ~_is_hidden(world, rays.legs[numbers]),
        world.dynamic_range,
    )
    rays = rays.of(free)
    return _paths(world, rays, _losses(world, rays.legs))


class _Rays(NamedTuple):
    """Rays by two plates, one per path.

    ``pair``, and the plates ``first`` and ``second``; ``opening`` F; ``delay`` s, its rate and
    acceleration; ``turn`` 1/s ``(path, xyz)``, the rate of the last leg's direction; ``ways`` unit
    directions of the legs ``(path, 3, xyz)``; ``meet`` m ``(path, 2, xyz)`` where the ray meets the
    planes; ``legs`` m ``(path, 3, 2, xyz)`` both ends of every leg, at the plates' nearest points
    and just in front of them; the last leg begins at the receiver.
    """

    pair: IntArray
    first: Plates
    second: Plates
    opening: ComplexArray
    delay: FloatArray
    delay_rate: FloatArray
    delay_acceleration: FloatArray
    turn: FloatArray
    ways: FloatArray
    meet: FloatArray
    legs: FloatArray

    def of(self, number: IntArray) -> "_Rays":
        """The rays of these numbers."""
        return _Rays._make(x.of(number) if isinstance(x, Plates) else x[number] for x in self)


def _candidates(world: World, pairs: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Row of ``pairs``, first and second plate, ``(path,)`` each, of the paths that may exist."""
    plates, place = world.plates, world.scene.radar_position
    height = place @ plates.normal.T - np.sum(plates.centre * plates.normal, axis=-1)
    image = place[:, None] - 2 * height[..., None] * plates.normal
    beyond = image @ plates.normal.T - np.sum(plates.centre * plates.normal, axis=-1)
    may = (height > 0)[:, :, None] & (beyond > 0) & _facing(plates)
    group, first, second = np.nonzero(may[pairs[:, 0]] & np.swapaxes(may[pairs[:, 1]], 1, 2))
    return group, first, second


def _facing(plates: Plates) -> BoolArray:
    """Mask ``(plate, plate)`` of the pairs of plates with part of each in front of the other."""
    u = plates.across * plates.half_across[:, None]
    v = plates.along * plates.half_along[:, None]
    corner = plates.centre + np.stack([u + v, u - v, -u + v, -u - v])
    above = corner @ plates.normal.T - np.sum(plates.centre * plates.normal, axis=-1)
    sees = np.max(above, axis=0).T > 1e-6
    return np.asarray(sees & sees.T)


def _rays(world: World, pair: IntArray, first: Plates, second: Plates) -> _Rays:
    """Rays of pairs (transmitter, receiver) ``(path, 2)`` by their first and second plates."""
    scene = world.scene
    source, sink = (scene.radar_position[pair[:, end]] for end in (0, 1))
    image = image_of(source, first)
    twice = image_of(image, second)
    speed = scene.radar_velocity[pair[:, 1]]
    image_speed = image_velocity(
        world, second, image_velocity(world, first, scene.radar_velocity[pair[:, 0]])
    )
    delay, delay_rate, flight = retarded_leg(
        source=twice, source_velocity=image_speed, sink=sink, sink_velocity=speed
    )
    between = mirrored(flight, second.normal)
    leaving = mirrored(between, first.normal)
    swerve = scene.radar_acceleration
    bend = range_acceleration(sink - twice, speed - image_speed)
    bend += np.sum(flight * swerve[pair[:, 1]] - leaving * swerve[pair[:, 0]], axis=-1)
    last = _crossing(second, twice, flight)
    meet = np.stack([_crossing(first, image, between), last], axis=1)
    opening = _opening(
        first, second, (image, twice), (image_of(sink, second), sink), 2 * np.pi / world.wavenumber
    )
    one, two = (
        nearest_on_plates(plates, meet[:, number]) + _lift(plates, other)
        for number, (plates, other) in enumerate([(first, second), (second, first)])
    )
    return _Rays(
        pair=pair,
        first=first,
        second=second,
        opening=opening,
        delay=delay,
        delay_rate=delay_rate,
        delay_acceleration=bend / SPEED_OF_LIGHT,
        turn=turning(flight, delay * SPEED_OF_LIGHT, speed - image_speed),
        ways=np.stack([leaving, between, flight], axis=1),
        meet=meet,
        legs=np.stack([source, one, one, two, sink, two], axis=1).reshape(-1, 3, 2, 3),
    )


def _lift(plates: Plates, other: Plates) -> FloatArray:
    """Ways, m ``(path, xyz)``, by which points on ``plates`` come in front of both plates.

    Neither plate then hides them, even in the corner of both. Plates that face each other have no
    corner, and opposite normals, whose sum is no way.
    """
    opening = 1 + np.sum(plates.normal * other.normal, axis=-1, keepdims=True)
    has_corner = opening > LEAST_OPENING
    both = (plates.normal + other.normal) / np.where(has_corner, opening, 1.0)
    return np.asarray(1e-6 * np.where(has_corner, both, plates.normal))


def _paths(world: World, rays: _Rays, losses: ComplexArray) -> PropagationPaths:
    """Paths with the transmission ``losses`` of their legs ``(path, 3, 2, 2)``; without shadows."""
    length = rays.delay * SPEED_OF_LIGHT
    amplitude = rays.opening / (2 * world.wavenumber * length)
    go, cross, come = np.moveaxis(rays.ways, 1, 0)
    middle = polarisation_basis(cross)
    transfer = (
        (polarisation_basis(-come) @ _reflector(world, rays.second, cross, come))
        @ (np.swapaxes(middle, 1, 2) @ losses[:, 1] @ middle)
        @ (_reflector(world, rays.first, go, cross) @ np.swapaxes(polarisation_basis(go), 1, 2))
    )
    return path_table(
        scene=world.scene,
        frequency=world.frequency,
        pair=rays.pair,
        delay=rays.delay,
        delay_rate=rays.delay_rate,
        delay_acceleration=rays.delay_acceleration,
        transfer_drift=-rays.delay_rate / rays.delay,
        departure_rate=mirrored(mirrored(rays.turn, rays.second.normal), rays.first.normal),
        arrival_rate=-rays.turn,
        transfer=amplitude[:, None, None] * with_leg_losses(transfer, losses[:, 0], losses[:, 2]),
        departure=go,
        arrival=-come,
        bounces=[
            (Bounce.REFLECTION, rays.first.actor, rays.meet[:, 0]),
            (Bounce.REFLECTION, rays.second.actor, rays.meet[:, 1]),
        ],
    )


def _crossing(plates: Plates, start: FloatArray, way: FloatArray) -> FloatArray:
    """Points where lines from ``start`` along ``way`` meet the plates' planes, m."""
    below = np.sum((plates.centre - start) * plates.normal, axis=-1, keepdims=True)
    slope = np.sum(way * plates.normal, axis=-1, keepdims=True)
    return np.asarray(start + below / np.where(slope == 0, np.inf, slope) * way)


def _reflector(world: World, plates: Plates, before: FloatArray, after: FloatArray) -> ComplexArray:
    """Dyad from the incident field (along ``before``) to the reflected, ``(path, xyz, xyz)``."""
    cosine = np.abs(np.sum(before * plates.normal, axis=-1))
    gamma, side = coefficients_of(world, plates, cosine), across_incidence(plates, before)
    into, out = np.cross(before, side), np.cross(after, side)
    return np.asarray(
        gamma[0, :, None, None] * side[:, :, None] * side[:, None, :]
        + gamma[1, :, None, None] * out[:, :, None] * into[:, None, :]
    )


def _opening(
    first: Plates,
    second: Plates,
    starts: tuple[FloatArray, FloatArray],
    ends: tuple[FloatArray, FloatArray],
    wavelength: float,
) -> ComplexArray:
    """F of two plates' common opening, ``(path,)``, from both ends of the ray by each plate."""
    from scipy.special import fresnel

    inner, other = _edges(first, starts[0], ends[0], wavelength)
    outer, facing = _edges(second, starts[1], ends[1], wavelength)
    other = mirrored(other, second.normal[:, None])
    alike = np.einsum("pix,pjx->pij", facing, other)
    size = np.abs(alike)
    crossed = size[:, 0, 1] + size[:, 1, 0] > size[:, 0, 0] + size[:, 1, 1]
    inner = np.where(crossed[:, None, None], inner[:, ::-1], inner)
    along = np.where(
        crossed[:, None],
        np.stack([alike[:, 0, 1], alike[:, 1, 0]], axis=-1),
        np.stack([alike[:, 0, 0], alike[:, 1, 1]], axis=-1),
    )
    inner = np.where(along[..., None] < 0, -inner[..., ::-1], inner)
    low = np.maximum(outer[..., 0], inner[..., 0])
    high = np.maximum(low, np.minimum(outer[..., 1], inner[..., 1]))
    sine, cosine = fresnel(np.stack([low, high]))
    part = np.diff(cosine - 1j * sine, axis=0)[0]
    return np.asarray(0.5j * part[:, 0] * part[:, 1])


def _edges(
    plates: Plates, start: FloatArray, end: FloatArray, wavelength: float
) -> tuple[FloatArray, FloatArray]:
    """Positions of the two edges that limit each of the plates' axes, relative to the rays.

    Returns
    -------
    edge : u, ``(path, axis, 2)``, the lower first
    across : unit vectors perpendicular to the ray and to the edges, ``(path, axis, xyz)``
    """
    way = end - start
    edges, across = [], []
    for axis, half, line in (
        (plates.across, plates.half_across, plates.along),
        (plates.along, plates.half_along, plates.across),
    ):
        aside = np.cross(way, line)
        aside /= np.maximum(np.linalg.norm(aside, axis=-1, keepdims=True), 1e-12)
        aside = np.where(np.sum(aside * axis, axis=-1, keepdims=True) < 0, -aside, aside)
        both = []
        for sign in (-1.0, 1.0):
            point = plates.centre + sign * half[:, None] * axis
            side = np.sign(np.sum((point - start) * aside, axis=-1))
            both.append(side * np.sqrt(4 / wavelength * _detour(start, end, point, line)))
        edges.append(np.stack(both, axis=-1))
        across.append(aside)
    return np.stack(edges, axis=1), np.stack(across, axis=1)


def _detour(start: FloatArray, end: FloatArray, point: FloatArray, line: FloatArray) -> FloatArray:
    """Detour of the shortest way that touches ``line``, over the straight way, m ``(path,)``."""
    near, far = start - point, end - point
    rise = [np.sum(gap * line, axis=-1) for gap in (near, far)]
    off = [gap - up[:, None] * line for gap, up in zip((near, far), rise, strict=True)]
    reach = [np.linalg.norm(gap, axis=-1) for gap in off]
    bent = np.hypot(reach[0] + reach[1], rise[1] - rise[0])
    # the difference of the squared lengths, written with little cancellation
    excess = 2 * (reach[0] * reach[1] + np.sum(off[0] * off[1], axis=-1))
    return np.asarray(np.maximum(excess, 0.0) / (bent + np.linalg.norm(end - start, axis=-1)))


def _is_hidden(world: World, legs: FloatArray) -> BoolArray:
    """Mask of the paths with an opaque body or plate in one of their legs ``(path, 3, 2, xyz)``."""
    return np.asarray(
        blocked(world, legs[:, 0, 0], legs[:, 0, 1])
        | blocked(world, legs[:, 1, 0], legs[:, 1, 1], clearance=0.0)
        | blocked(world, legs[:, 2, 0], legs[:, 2, 1])
    )


def _losses(world: World, legs: FloatArray) -> ComplexArray:
    """Transmission matrices of every leg through thin sheets and leaves, ``(path, 3, 2, 2)``."""
    return np.stack(
        [
            transmission_matrices(world, legs[:, 0, 0], legs[:, 0, 1]),
            transmission_matrices(world, legs[:, 1, 0], legs[:, 1, 1], clearance=0.0),
            transmission_matrices(world, legs[:, 2, 0], legs[:, 2, 1]),
        ],
        axis=1,
    )
