"""The direct path from one radar to another."""

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.channel.base import path_table
from polychirp.channel.geometry.retarded_delay import (
    range_acceleration,
    retarded_leg,
    turning,
)
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import polarisation_basis
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene


def straight_path_polarisation(departure: FloatArray, arrival: FloatArray) -> ComplexArray:
    """Polarisation matrix of a straight path, ``(path, receiving, transmitting)``.

    Each end's basis belongs to its outward direction: V is the same at both ends, H changes sign.

    >>> ahead = np.array([[1.0, 0.0, 0.0]])
    >>> straight_path_polarisation(ahead, -ahead)[0].real
    array([[ 1.,  0.],
           [ 0., -1.]])
    """
    sent, received = polarisation_basis(departure), polarisation_basis(arrival)
    return np.asarray(received @ np.swapaxes(sent, -1, -2), dtype=np.complex128)


def line_of_sight(scene: Scene, *, frequency: float, pairs: IntArray) -> PropagationPaths:
    r"""Direct paths of ``pairs`` (transmitter, receiver) ``(pair, 2)``; obstacles are ignored.

    .. math:: |A| = \frac{\lambda}{4\pi d}

    This is Friis' equation; d is the distance from the transmitter at departure to the receiver at
    arrival. The delay is exact for linear motion. A radar paired with itself has no direct path.
    `InputError` is raised if two radars are at the same place.
    """
    pair = pairs[pairs[:, 0] != pairs[:, 1]]
    place, speed = scene.radar_position, scene.radar_velocity
    same = np.all(place[pair[:, 0]] == place[pair[:, 1]], axis=-1)
    if np.any(same):
        names = [scene.radars[number].name for number in pair[np.argmax(same)]]
        raise InputError(
            f"radars '{names[0]}' and '{names[1]}' are at the same position; move one of them"
        )
    delay, delay_rate, flight = retarded_leg(
        source=place[pair[:, 0]],
        source_velocity=speed[pair[:, 0]],
        sink=place[pair[:, 1]],
        sink_velocity=speed[pair[:, 1]],
    )
    amplitude = 1.0 / (4 * np.pi * frequency * delay)  # λ/4πd with d = cτ
    length, velocity = SPEED_OF_LIGHT * delay, speed[pair[:, 1]] - speed[pair[:, 0]]
    bend = range_acceleration(length[:, None] * flight, velocity)
    swerve = scene.radar_acceleration
    bend += np.sum(flight * (swerve[pair[:, 1]] - swerve[pair[:, 0]]), axis=-1)
    turn = turning(flight, length, velocity)
    return path_table(
        scene=scene,
        frequency=frequency,
        pair=pair,
        delay=delay,
        delay_rate=delay_rate,
        transfer=amplitude[:, None, None] * straight_path_polarisation(flight, -flight),
        departure=flight,
        arrival=-flight,
        delay_acceleration=bend / SPEED_OF_LIGHT,
        transfer_drift=-delay_rate / delay,
        departure_rate=turn,
        arrival_rate=-turn,
    )
