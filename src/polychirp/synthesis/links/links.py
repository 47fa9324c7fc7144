"""`Links` — the paths between one transmitter and one victim, antennas and front ends included."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import (
    Axes,
    BoolArray,
    ComplexArray,
    FloatArray,
    IntArray,
    PerPath,
    PerPathIndex,
    Sealed,
)
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.frames import polarisation_basis
from polychirp.model.antenna import ElementPattern
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Links(Sealed):
    r"""Delays and amplitudes of one transmitter's signal at one victim, for one tracing of paths.

    Every propagation path appears once for each transmitting element in use, as "path" p. The
    victim's element m receives at time t the signal of magnitude 1 that the transmitting element
    sent at :math:`t - \tau_p - \dot\tau_p (t - t_0) - \delta_{pm}`, times

    .. math:: a_p = e_p\,\sqrt{P_t G_{ft} G_t}\;(j_r^T A_p\, j_t)\,\sqrt{G_r G_{fr}}

    with the transmit power P_t, the front ends' gains G_f, the patterns' gains G and polarisations
    j towards the path, its transfer A_p and the transmitting element's error e_p. The weights of
    the schedule are not in a_p, since they change from ramp to ramp. A wave front is taken to be
    a plane across an array, because the arrays are small against the paths' lengths.

    Parameters
    ----------
    reference_time : s, :math:`t_0`, the time for which the paths were traced
    delay, delay_rate : s and s/s, :math:`\tau_p, \dot\tau_p` from the transmitting element to the
        origin of the victim's frame, ``(path,)``
    transmit_element : number of the transmitting element, ``(path,)``
    element_delay : s, :math:`\delta_{pm}`, delay at the victim's element m less the delay at the
        origin of its frame, ``(path, channel)``
    amplitude : :math:`a_p`, V across 1 Ω (its square is W), ``(path,)`` complex
    part : 1 for a victim's own mirrored echo and for an interferer's indirect path, else 0
    """

    reference_time: float
    delay: PerPath
    delay_rate: PerPath
    transmit_element: PerPathIndex
    element_delay: Annotated[FloatArray, Axes("path", "channel")]
    amplitude: Annotated[ComplexArray, Axes("path", dtype=np.complex128)]
    part: PerPathIndex

    def delay_at(self, time: float) -> FloatArray:
        """Delay of the signal that is received at ``time``, s, ``(path, channel)``."""
        centre = self.delay + self.delay_rate * (time - self.reference_time)
        return centre[:, None] + self.element_delay


def links_between(
    scene: Scene, paths: PropagationPaths, *, victim: int, transmitter: int, num_elements: int = 1
) -> Links:
    """The links from one transmitter to one victim, of the paths traced for one time.

    The schedule drives ``num_elements`` transmitting elements, the array's first ones. `InputError`
    is raised if the array has fewer.
    """
    return links_of_all(
        scene, [paths], victim=victim, transmitter=transmitter, num_elements=num_elements
    )[0]


def links_of_all(
    scene: Scene,
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    transmitter: int,
    num_elements: int = 1,
) -> list[Links]:
    """`links_between` of every snapshot, with the antennas directed as in ``scene``."""
    sender, receiver = scene.radars[transmitter], scene.radars[victim]
    if num_elements > sender.array.num_transmitters:
        raise InputError(
            f"the schedule of radar '{sender.name}' drives {num_elements} transmitting elements, "
            f"but its array has {sender.array.num_transmitters}; raise its num_transmitters"
        )
    chosen = [
        paths.select((paths.receiver == victim) & (paths.transmitter == transmitter))
        for paths in snapshots
    ]
    departure = np.concatenate([paths.departure for paths in chosen])
    arrival = np.concatenate([paths.arrival for paths in chosen])
    transfer = np.concatenate([paths.transfer for paths in chosen])
    turns = scene.radar_rotation
    turn_out, turn_in = turns[transmitter], turns[victim]
    sent = _field(sender.array.pattern, departure, turn_out)
    received = _field(receiver.array.pattern, arrival, turn_in)
    power = (
        sender.transmit_power * sender.transmit_gain * receiver.receive_gain
    )  # sent and received contain the patterns' gains
    amplitude = np.sqrt(power) * np.einsum("pi,pij,pj->p", received, transfer, sent)
    amplitude = np.outer(amplitude, sender.array.transmitter_response[:num_elements])
    ahead = _lead(sender.array.transmit_position[:num_elements], departure, turn_out)
    lead = _lead(receiver.array.position, arrival, turn_in)
    ends = np.cumsum([0, *(paths.num_paths for paths in chosen)])
    return [
        _links(
            paths,
            paths.is_mirrored if transmitter == victim else ~paths.is_direct,
            ahead=ahead[begin:end],
            lead=lead[begin:end],
            amplitude=amplitude[begin:end],
        )
        for paths, begin, end in zip(chosen, ends[:-1], ends[1:], strict=True)
    ]


def _links(
    paths: PropagationPaths,
    part: BoolArray,
    *,
    ahead: FloatArray,
    lead: FloatArray,
    amplitude: ComplexArray,
) -> Links:
    """The links of one snapshot, with every path once for each transmitting element.

    ``ahead`` (s) and ``amplitude`` are ``(path, element)``, ``lead`` (s) is ``(path, channel)``.
    """
    num_elements = ahead.shape[1]
    return Links(
        reference_time=paths.reference_time,
        delay=(paths.delay[:, None] - ahead).ravel(),
        delay_rate=np.repeat(paths.delay_rate, num_elements),
        transmit_element=np.tile(np.arange(num_elements), part.size),
        element_delay=-np.repeat(lead, num_elements, axis=0),
        amplitude=amplitude.ravel(),
        part=np.repeat(part.astype(np.int64), num_elements),
    )


def _lead(position: FloatArray, direction: FloatArray, turn: FloatArray) -> FloatArray:
    """Time by which a plane wave's delay at an element is shorter than at the origin, s."""
    return np.asarray(direction @ (position @ turn.T).T / SPEED_OF_LIGHT)


def _field(pattern: ElementPattern, direction: FloatArray, turn: FloatArray) -> FloatArray:
    """Square root of the gain times the polarisation in the world's (V, H) basis, ``(path, 2)``.

    The antenna's V and H are defined in the radar's frame, and pitch or roll of the radar turns
    them about the direction of the wave. Without pitch and roll they are those of the world.
    """
    local = direction @ turn
    polarisation = pattern.jones @ polarisation_basis(local) @ turn.T
    in_world = np.einsum("pbx,px->pb", polarisation_basis(direction), polarisation)
    return np.asarray(np.sqrt(pattern.gain(local))[:, None] * in_world)


def nearest_snapshots(schedule: RampSchedule, snapshots: Sequence[PropagationPaths]) -> IntArray:
    """Index of the snapshot nearest in time to the middle of every ramp, ``(ramp,)``."""
    moments = np.array([paths.reference_time for paths in snapshots])
    middle = schedule.start_time + 0.5 * schedule.duration
    return np.asarray(np.argmin(np.abs(middle[:, None] - moments), axis=1), dtype=np.int64)
