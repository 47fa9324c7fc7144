r"""Mirror images in finite plates: road and walls between a transmitter and a receiver.

.. math:: A = \frac{\lambda}{4\pi(r_1+r_2)}\,\Gamma\,\rho\,F,\qquad
    F = \frac j2\,[f(u_2)-f(u_1)]\,[f(v_2)-f(v_1)],\quad f(x) = C(x) - jS(x)

Γ is the reflection coefficient, ρ the roughness factor, C and S are the Fresnel integrals. u and v
are the distances of the plate's edges from the specular point, seen across the ray, times
:math:`\sqrt{2/\lambda\,(1/r_1+1/r_2)}`. F is 1 for a large plate, ½ at its edge, and falls smoothly
beyond: a path neither appears nor vanishes suddenly. F is exact for paraxial waves if a side of the
plate lies in the plane of incidence; otherwise the cross term of the phase is neglected, which
matters within a Fresnel zone of a corner.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.channel.base import no_paths, path_table
from polychirp.channel.geometry.retarded_delay import (
    range_acceleration,
    retarded_leg,
    turning,
)
from polychirp.channel.scene.occlusion import blocked
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


class Reflections(NamedTuple):
    """``paths`` by one reflection in a plate, whether or not something opaque is in their way.

    ``plate`` ``(path,)`` is the number of each path's plate; ``is_free`` ``(path,)`` tells that
    nothing opaque is in its way.
    """

    paths: PropagationPaths
    plate: IntArray
    is_free: BoolArray


def mirror_paths(world: World, pairs: IntArray) -> PropagationPaths:
    """Paths of ``pairs`` ``(pair, 2)`` by one reflection in a plate, also a radar's own echoes."""
    found = reflections(world, pairs)
    return found.paths.select(found.is_free)


def reflections(world: World, pairs: IntArray, *, actor: int | None = None) -> Reflections:
    """One path for every pair ``(pair, 2)`` and every plate that both of its radars are before.

    ``actor`` is the number of the actor whose plates are meant; None: those of all.
    """
    plates = np.arange(len(world.plates.actor))
    if actor is not None:
        plates = plates[world.plates.actor == actor]
    pair = np.repeat(pairs, len(plates), axis=0)
    number = np.tile(plates, len(pairs))
    place = world.scene.radar_position
    normal, centre = world.plates.normal[number], world.plates.centre[number]
    height = [np.sum((place[pair[:, end]] - centre) * normal, axis=-1) for end in (0, 1)]
    before = (height[0] > 0) & (height[1] > 0)
    if not np.any(before):
        none = no_paths(world.scene, world.frequency)
        return Reflections(none, number[before], before[before])
    return _reflections(world, pair[before], number[before])


def _reflections(world: World, pair: IntArray, number: IntArray) -> Reflections:
    """One path for every pair ``(path, 2)`` of radars in front of the plate with that number."""
    scene, plates = world.scene, world.plates.of(number)
    speed = scene.radar_velocity
    source, sink = (scene.radar_position[pair[:, end]] for end in (0, 1))
    image = image_of(source, plates)
    image_speed = image_velocity(world, plates, speed[pair[:, 0]])
    delay, delay_rate, flight = retarded_leg(
        source=image,
        source_velocity=image_speed,
        sink=sink,
        sink_velocity=speed[pair[:, 1]],
    )
    below = np.sum((plates.centre - image) * plates.normal, axis=-1)
    above = np.sum((sink - image) * plates.normal, axis=-1)
    meet = image + (below / above)[:, None] * (sink - image)
    leaving = mirrored(flight, plates.normal)
    length, velocity = delay * SPEED_OF_LIGHT, speed[pair[:, 1]] - image_speed
    turn = turning(flight, length, velocity)
    swerve = scene.radar_acceleration
    bend = range_acceleration(sink - image, velocity)
    bend += np.sum(flight * swerve[pair[:, 1]] - leaving * swerve[pair[:, 0]], axis=-1)
    share = np.stack([below / above, 1 - below / above], axis=-1) * length[:, None]
    factor = plate_factor(plates, meet, leaving, share, world.wavenumber)
    amplitude = factor / (2 * world.wavenumber * length)
    paths = path_table(
        scene=scene,
        frequency=world.frequency,
        pair=pair,
        delay=delay,
        delay_rate=delay_rate,
        transfer=amplitude[:, None, None] * _reflection_matrix(world, plates, leaving, flight),
        departure=leaving,
        arrival=-flight,
        bounces=[(Bounce.REFLECTION, plates.actor, meet)],
        delay_acceleration=bend / SPEED_OF_LIGHT,
        transfer_drift=-delay_rate / delay,
        departure_rate=mirrored(turn, plates.normal),
        arrival_rate=-turn,
    )
    # just in front of the plate, so that the plate does not hide its own point
    before = nearest_on_plates(plates, meet) + 1e-6 * plates.normal
    is_free = ~(blocked(world, source, before) | blocked(world, sink, before))
    legs = [transmission_matrices(world, end, before) for end in (source, sink)]
    paths = replace(paths, transfer=with_leg_losses(paths.transfer, *legs))
    return Reflections(paths, number, is_free)


def _reflection_matrix(
    world: World, plates: Plates, leaving: FloatArray, flight: FloatArray
) -> ComplexArray:
    """Reflection from the departing to the arriving polarisations (V, H), ``(path, 2, 2)``."""
    cosine = -np.sum(leaving * plates.normal, axis=-1)
    gamma, side = coefficients_of(world, plates, cosine), across_incidence(plates, leaving)
    before, after = np.cross(leaving, side), np.cross(flight, side)
    sent, received = polarisation_basis(leaving), polarisation_basis(-flight)
    total = np.zeros((len(cosine), 2, 2), dtype=np.complex128)
    for coefficient, into, out in ((gamma[0], side, side), (gamma[1], before, after)):
        total += coefficient[:, None, None] * np.einsum(
            "pri,pi,ptj,pj->prt", received, out, sent, into
        )
    return total


def plate_factor(
    plates: Plates,
    meet: FloatArray,
    leaving: FloatArray,
    legs: FloatArray,
    wavenumber: float,
) -> ComplexArray:
    """Factor F of a plate's reflection relative to that of an endless mirror, ``(path,)``.

    Parameters
    ----------
    meet : specular points, m ``(path, xyz)``
    leaving : directions of the incident waves, ``(path, xyz)``
    legs : lengths before and after the reflection, m ``(path, 2)``
    """
    from scipy.special import fresnel

    scale = np.sqrt(wavenumber / np.pi * np.sum(1 / legs, axis=-1))
    factor = np.full(len(meet), 0.5j)
    for axis, half in (
        (plates.across, plates.half_across),
        (plates.along, plates.half_along),
    ):
        # lengths across the ray are shorter: by cosθ in the plane of incidence, by 1 perpendicular
        squeeze = np.sqrt(1 - np.sum(axis * leaving, axis=-1) ** 2)
        middle = np.sum((plates.centre - meet) * axis, axis=-1)
        ends = []
        for edge in (middle + half, middle - half):
            sine, cosine = fresnel(edge * squeeze * scale)
            ends.append(cosine - 1j * sine)
        factor = factor * (ends[0] - ends[1])
    return np.asarray(factor)
