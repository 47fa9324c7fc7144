"""`Links` — the paths between one transmitter and one victim, antennas and front ends included."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Final, NamedTuple

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
from polychirp.frames import polarisation_basis, rotation, turned_at_rate
from polychirp.model.antenna import ElementPattern
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene

DERIVATIVE_TIME: Final = 1e-4
"""Time over which the change of an antenna's gain is computed, s; chosen: directions turn by less
than 1 mrad."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Links(Sealed):
    r"""Delays and amplitudes of one transmitter's signal at one victim, for one tracing of paths.

    Every propagation path appears once for each transmitting element in use, as "path" p. With
    :math:`s = t - t_0`, the victim's element m receives at time t the signal of magnitude 1 that
    the transmitting element sent at :math:`t - \tau_{pm}(t)`,

    .. math:: \tau_{pm}(t) = \tau_p + \dot\tau_p\,s + \tfrac12\ddot\tau_p\,s^2
              + \delta_{pm} + \dot\delta_{pm}\,s

    times :math:`a_p + \dot a_p\,s`, where

    .. math:: a_p = e_p\,\sqrt{P_t G_{ft} G_t}\;(j_r^T A_p\, j_t)\,\sqrt{G_r G_{fr}}

    with the transmit power P_t, the front ends' gains G_f, the patterns' gains G and polarisations
    j towards the path, its transfer A_p and the transmitting element's error e_p. The weights of
    the schedule are not in a_p, since they change from ramp to ramp. A wave front is taken to be
    a plane across an array, because the arrays are small against the paths' lengths.

    Parameters
    ----------
    reference_time : s, :math:`t_0`, the time for which the paths were traced
    delay, delay_rate, delay_acceleration : s, s/s and 1/s, :math:`\tau_p` from the transmitting
        element to the origin of the victim's frame, and its derivatives, ``(path,)``
    transmit_element : number of the transmitting element, ``(path,)``
    element_delay : s, :math:`\delta_{pm}`, delay at the victim's element m less the delay at the
        origin of its frame, ``(path, channel)``
    element_delay_rate : s/s, :math:`\dot\delta_{pm}`, ``(path, channel)``
    amplitude : :math:`a_p`, V across 1 Ω (its square is W), ``(path,)`` complex
    amplitude_rate : :math:`\dot a_p`, V/s, ``(path,)`` complex; the antennas' gains change, too
    part : 1 for a victim's own mirrored echo and for an interferer's indirect path, else 0
    """

    reference_time: float
    delay: PerPath
    delay_rate: PerPath
    delay_acceleration: PerPath
    transmit_element: PerPathIndex
    element_delay: Annotated[FloatArray, Axes("path", "channel")]
    element_delay_rate: Annotated[FloatArray, Axes("path", "channel")]
    amplitude: Annotated[ComplexArray, Axes("path", dtype=np.complex128)]
    amplitude_rate: Annotated[ComplexArray, Axes("path", dtype=np.complex128)]
    part: PerPathIndex

    def delay_at(self, time: float) -> FloatArray:
        """Delay of the signal that is received at ``time``, s, ``(path, channel)``."""
        since = time - self.reference_time
        centre = self.delay + since * (self.delay_rate + 0.5 * since * self.delay_acceleration)
        return centre[:, None] + self.element_delay + since * self.element_delay_rate


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
    """`links_between` of every snapshot; the antennas turn with the vehicles that carry them."""
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
    moments = [paths.reference_time for paths in chosen]
    transmits = _Antenna.of(
        scene, transmitter, sender.array.transmit_position[:num_elements], moments
    )
    receives = _Antenna.of(scene, victim, receiver.array.position, moments)
    out = transmits.ends([(paths.departure, paths.departure_rate) for paths in chosen])
    back = receives.ends([(paths.arrival, paths.arrival_rate) for paths in chosen])
    # the fields at both ends contain the patterns' gains
    power = sender.transmit_power * sender.transmit_gain * receiver.receive_gain
    weight = math.sqrt(power) * sender.array.transmitter_response[:num_elements]
    return [
        _links(
            paths,
            paths.is_mirrored if transmitter == victim else ~paths.is_direct,
            out=departing,
            back=arriving,
            weight=weight,
        )
        for paths, departing, arriving in zip(chosen, out, back, strict=True)
    ]


class _End(NamedTuple):
    """One end of paths, with its antennas; derivatives by time are per second.

    ``field`` ``(path, 2)`` is that of `antenna_field`. ``lead`` ``(path, element)``, s, is the time
    by which a plane wave's delay at an element is shorter than at the origin.
    """

    field: ComplexArray
    field_rate: ComplexArray
    lead: FloatArray
    lead_rate: FloatArray

    def of(self, rows: slice) -> "_End":
        """The end of some of the paths."""
        return _End._make(column[rows] for column in self)


class _Antenna(NamedTuple):
    """Elements of one radar, as they are directed at the times of some snapshots.

    ``position`` m ``(element, xyz)`` is in the radar's frame; ``turn`` has one matrix from there to
    the world for every snapshot; ``yaw_rate`` rad/s is that of the radar's vehicle.
    """

    pattern: ElementPattern
    position: FloatArray
    turn: list[FloatArray]
    yaw_rate: float

    @staticmethod
    def of(scene: Scene, radar: int, position: FloatArray, moments: Sequence[float]) -> "_Antenna":
        """Elements of the radar with this number at ``moments``, s, in the time of the scene."""
        yaw_rate, turn = scene.actors[scene.carriers[radar]].yaw_rate, scene.radar_rotation[radar]
        turns = [turn] * len(moments)
        if yaw_rate:
            turns = [rotation(yaw_rate * (moment - scene.time)) @ turn for moment in moments]
        return _Antenna(scene.radars[radar].array.pattern, position, turns, yaw_rate)

    def ends(self, directions: Sequence[tuple[FloatArray, FloatArray]]) -> list[_End]:
        """Ends of the paths of every snapshot, given their directions in the world and rates."""
        if self.yaw_rate:
            return [self._end(turn, *one) for turn, one in zip(self.turn, directions, strict=True)]
        # one call for all is faster
        all_ends = self._end(self.turn[0], *map(np.concatenate, zip(*directions, strict=True)))
        ends = np.cumsum([0, *(len(direction) for direction, _ in directions)])
        return [all_ends.of(slice(begin, end)) for begin, end in pairwise(ends)]

    def _end(self, turn: FloatArray, direction: FloatArray, direction_rate: FloatArray) -> _End:
        """End of paths in ``direction``, at the elements as ``turn`` directs them."""
        light = self.position @ turn.T / SPEED_OF_LIGHT
        field = antenna_field(self.pattern, direction, turn)
        field_rate = np.zeros_like(field)
        # rate of the directions as the antenna, which may turn itself, sees them
        seen_rate = direction_rate - turned_at_rate(self.yaw_rate, direction)
        moving = np.flatnonzero(np.any(seen_rate != 0, axis=-1))
        if moving.size:
            later, earlier = (
                antenna_field(
                    self.pattern,
                    direction[moving] + time * direction_rate[moving],
                    rotation(self.yaw_rate * time) @ turn,
                )
                for time in (DERIVATIVE_TIME, -DERIVATIVE_TIME)
            )
            field_rate[moving] = (later - earlier) / (2.0 * DERIVATIVE_TIME)
        return _End(
            field=field,
            field_rate=field_rate,
            lead=direction @ light.T,
            lead_rate=seen_rate @ light.T,
        )


def _links(
    paths: PropagationPaths, part: BoolArray, *, out: _End, back: _End, weight: ComplexArray
) -> Links:
    """The links of one snapshot, with every path once for each transmitting element.

    ``weight`` ``(element,)`` is the amplitude of an element, √W.
    """
    num_elements = weight.size

    def amplitude(received: ComplexArray, sent: ComplexArray) -> ComplexArray:
        return np.asarray(np.einsum("pi,pij,pj->p", received, paths.transfer, sent))

    total = amplitude(back.field, out.field)
    rate = amplitude(back.field_rate, out.field) + amplitude(back.field, out.field_rate)
    rate += paths.transfer_drift * total
    return Links(
        reference_time=paths.reference_time,
        delay=(paths.delay[:, None] - out.lead).ravel(),
        delay_rate=(paths.delay_rate[:, None] - out.lead_rate).ravel(),
        delay_acceleration=np.repeat(paths.delay_acceleration, num_elements),
        transmit_element=np.tile(np.arange(num_elements), part.size),
        element_delay=-np.repeat(back.lead, num_elements, axis=0),
        element_delay_rate=-np.repeat(back.lead_rate, num_elements, axis=0),
        amplitude=np.outer(total, weight).ravel(),
        amplitude_rate=np.outer(rate, weight).ravel(),
        part=np.repeat(part.astype(np.int64), num_elements),
    )


def antenna_field(pattern: ElementPattern, direction: FloatArray, turn: FloatArray) -> ComplexArray:
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
