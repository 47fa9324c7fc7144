r"""Mirror images in finite plates: road and walls between a transmitter and a receiver.

.. math:: A = \frac{\lambda}{4\pi(r_1+r_2)}\,\Gamma\,\rho\,F,\qquad
    F = \frac j2\,[f(u_2)-f(u_1)]\,[f(v_2)-f(v_1)],\quad f(x) = C(x) - jS(x)

with the plate's edges measured from the specular point in units of its Fresnel zone. F is 1 for a
large plate, ½ at its edge, and falls smoothly beyond: a path neither appears nor vanishes at
once. Exact for paraxial waves where the plane of incidence holds a side of the plate; otherwise
the cross term of the phase is left out, which matters within a Fresnel zone of a corner.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.base import no_paths, path_table
from polychirp.channel.geometry.retarded_delay import passing, retarded_leg
from polychirp.channel.materials.fresnel import reflection
from polychirp.channel.scene.occlusion import blocked
from polychirp.channel.scene.transmission import through, with_legs
from polychirp.channel.scene.world import Plates, World
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import polarisation_basis
from polychirp.model.paths import Bounce, PropagationPaths


def mirror_paths(world: World, pairs: IntArray) -> PropagationPaths:
    """Paths of ``pairs`` by one reflection in a plate, a radar's own echo of a wall included."""
    num_plates = len(world.plates.actor)
    if not num_plates or not len(pairs):
        return no_paths(world.scene, world.frequency)
    pair = np.repeat(pairs, num_plates, axis=0)
    number = np.tile(np.arange(num_plates), len(pairs))
    place = world.scene.radar_position
    normal, centre = world.plates.normal[number], world.plates.centre[number]
    height = [np.sum((place[pair[:, end]] - centre) * normal, axis=-1) for end in (0, 1)]
    before = (height[0] > 0) & (height[1] > 0)
    if not np.any(before):
        return no_paths(world.scene, world.frequency)
    return _reflections(world, pair[before], number[before])


def _reflections(world: World, pair: IntArray, number: IntArray) -> PropagationPaths:
    """One path for every pair and plate, of which both radars are in front."""
    scene, plates = world.scene, world.plates.of(number)
    speed = scene.radar_velocity
    carried = np.array([scene.actors[actor].velocity for actor in plates.actor])
    source, sink = (scene.radar_position[pair[:, end]] for end in (0, 1))
    image = _mirrored(source - plates.centre, plates.normal) + plates.centre
    image_speed = _mirrored(speed[pair[:, 0]] - carried, plates.normal) + carried
    delay, delay_rate, flight = retarded_leg(
        source=image,
        source_velocity=image_speed,
        sink=sink,
        sink_velocity=speed[pair[:, 1]],
    )
    below = np.sum((plates.centre - image) * plates.normal, axis=-1)
    above = np.sum((sink - image) * plates.normal, axis=-1)
    meet = image + (below / above)[:, None] * (sink - image)
    leaving = _mirrored(flight, plates.normal)
    length = delay * SPEED_OF_LIGHT
    share = np.stack([below / above, 1 - below / above], axis=-1) * length[:, None]
    factor = plate_factor(plates, meet, leaving, share, world.wavenumber)
    amplitude = factor / (2 * world.wavenumber * length)
    paths = path_table(
        scene=scene,
        frequency=world.frequency,
        pair=pair,
        delay=delay,
        delay_rate=delay_rate,
        transfer=amplitude[:, None, None] * _turn(world, plates, leaving, flight),
        departure=leaving,
        arrival=-flight,
        bounces=[(Bounce.REFLECTION, plates.actor, meet)],
        delay_acceleration=passing(sink - image, speed[pair[:, 1]] - image_speed) / SPEED_OF_LIGHT,
    )
    # just before the plate, so that it does not hide itself
    before = _onto(plates, meet) + 1e-6 * plates.normal
    free = ~(blocked(world, source, before) | blocked(world, sink, before))
    legs = [through(world, end[free], before[free]) for end in (source, sink)]
    paths = paths.select(free)
    return replace(paths, transfer=with_legs(paths.transfer, *legs))


def _mirrored(vector: FloatArray, normal: FloatArray) -> FloatArray:
    return np.asarray(vector - 2 * np.sum(vector * normal, axis=-1, keepdims=True) * normal)


def _onto(plates: Plates, point: FloatArray) -> FloatArray:
    """The points of plates nearest to points of their planes."""
    gap = point - plates.centre
    u = np.clip(np.sum(gap * plates.across, axis=-1), -plates.half_across, plates.half_across)
    v = np.clip(np.sum(gap * plates.along, axis=-1), -plates.half_along, plates.half_along)
    return np.asarray(plates.centre + u[:, None] * plates.across + v[:, None] * plates.along)


def _turn(world: World, plates: Plates, leaving: FloatArray, flight: FloatArray) -> ComplexArray:
    """Fresnel reflection between the polarisations of both ends, ``(path, 2, 2)``."""
    cosine = -np.sum(leaving * plates.normal, axis=-1)
    gamma = np.empty((2, len(cosine)), dtype=np.complex128)
    for medium in np.unique(plates.medium):
        mine = plates.medium == medium
        gamma[:, mine] = reflection(
            world.table[world.materials[medium]], cosine[mine], world.frequency
        )
    # at normal incidence any side will do, and Γs = −Γp makes all the same
    side = np.cross(leaving, plates.normal)
    size = np.linalg.norm(side, axis=-1, keepdims=True)
    side = np.where(size > 1e-9, side / np.maximum(size, 1e-9), plates.across)
    before, after = np.cross(leaving, side), np.cross(flight, side)
    sent, heard = polarisation_basis(leaving), polarisation_basis(-flight)
    total = np.zeros((len(cosine), 2, 2), dtype=np.complex128)
    for coefficient, into, out in ((gamma[0], side, side), (gamma[1], before, after)):
        total += coefficient[:, None, None] * np.einsum(
            "pri,pi,ptj,pj->prt", heard, out, sent, into
        )
    return total


def plate_factor(
    plates: Plates,
    meet: FloatArray,
    leaving: FloatArray,
    legs: FloatArray,
    wavenumber: float,
) -> ComplexArray:
    """F ``(path,)``: what a plate's size leaves of an endless mirror.

    Parameters
    ----------
    meet : specular points, m ``(path, xyz)``
    leaving : directions of incidence, ``(path, xyz)``
    legs : lengths before and after, m ``(path, 2)``
    """
    from scipy.special import fresnel

    scale = np.sqrt(wavenumber / np.pi * np.sum(1 / legs, axis=-1))
    factor = np.full(len(meet), 0.5j)
    for axis, half in (
        (plates.across, plates.half_across),
        (plates.along, plates.half_along),
    ):
        # cosθ in the plane of incidence and 1 across it: 1 − (axis · direction)² in all
        squeeze = np.sqrt(1 - np.sum(axis * leaving, axis=-1) ** 2)
        middle = np.sum((plates.centre - meet) * axis, axis=-1)
        ends = []
        for edge in (middle + half, middle - half):
            sine, cosine = fresnel(edge * squeeze * scale)
            ends.append(cosine - 1j * sine)
        factor = factor * (ends[0] - ends[1])
    return np.asarray(factor)
