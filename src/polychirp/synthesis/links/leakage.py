"""Links of a radar to itself without any scene: leakage, and the reflection at a bumper."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import fields
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import ModelWarning
from polychirp.model.leakage import Bumper
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Radar
from polychirp.model.scene import Scene
from polychirp.synthesis.links.links import Links, links_of_all

LEAKAGE_PART: Final = 2
"""Number of the part of a radar's contribution to itself that holds leakage and bumper.

Part 0 holds the paths without a mirror, part 1 those with one."""


def all_links(
    scene: Scene,
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    transmitter: int,
    num_elements: int = 1,
) -> list[Links]:
    """The traced links of every snapshot; of a radar's own signal, leakage and bumper also."""
    traced = links_of_all(
        scene, snapshots, victim=victim, transmitter=transmitter, num_elements=num_elements
    )
    radar = scene.radars[victim]
    if victim != transmitter or not radar.receives_itself:
        return traced
    return [
        joined(
            links,
            own_links(
                radar,
                frequency=paths.frequency,
                reference_time=paths.reference_time,
                num_elements=num_elements,
            ),
        )
        for links, paths in zip(traced, snapshots, strict=True)
    ]


def own_links(
    radar: Radar, *, frequency: float, reference_time: float, num_elements: int = 1
) -> Links:
    r"""Links of all leakages, then that of the bumper; both are at rest in the radar's frame.

    A leakage with isolation I reaches all channels alike, with the power
    :math:`|a|^2 = P_t G_{ft} G_{fr} / I`. The bumper at distance d, which reflects a share r of the
    power, gives, with the gain G of an element along the axis,

    .. math:: |a|^2 = P_t G_{ft} G_{fr}\; r \left(\frac{G\lambda}{4\pi\cdot 2d}\right)^2

    at the delay from the mirror image of each transmitting element to each receiving element;
    with both in the plane x = 0, the delay is :math:`\sqrt{4d^2 + (y_m-y_l)^2 + (z_m-z_l)^2}/c`.
    All elements have the same amplitude, that along the axis. The sheet is flat, large and
    perpendicular to the axis; multiple reflections between sheet and radar are neglected.

    Parameters
    ----------
    frequency : Hz, for the wavelength of Friis's law
    num_elements : number of transmitting elements in use; each has the same leakages and bumper

    Warns
    -----
    ModelWarning
        The bumper is in the antennas' near field: Friis's law with r = 1 gives more power than is
        transmitted. Then the transmitted power is used instead.
    """
    power = radar.transmit_power * radar.transmit_gain * radar.receive_gain
    delay = [leak.delay for leak in radar.leakage]
    share = [1.0 / leak.isolation for leak in radar.leakage]
    phase = [leak.phase for leak in radar.leakage]
    element_delay = np.zeros((num_elements * len(delay), radar.array.num_channels))
    if radar.bumper is not None:
        delay.append(2.0 * radar.bumper.distance / SPEED_OF_LIGHT)
        share.append(radar.bumper.reflection * _coupling(radar, radar.bumper, frequency))
        phase.append(radar.bumper.phase)
        detour = _detour(radar, radar.bumper)[:num_elements]
        element_delay = np.vstack([element_delay, detour / SPEED_OF_LIGHT])
    amplitude = np.sqrt(power * np.array(share)) * np.exp(1j * np.array(phase))
    count = num_elements * len(delay)
    return Links(
        reference_time=reference_time,
        delay=np.repeat(delay, num_elements),
        delay_rate=np.zeros(count),
        delay_acceleration=np.zeros(count),
        transmit_element=np.tile(np.arange(num_elements), len(delay)),
        element_delay=element_delay,
        element_delay_rate=np.zeros((count, radar.array.num_channels)),
        amplitude=np.outer(amplitude, radar.array.transmitter_response[:num_elements]).ravel(),
        amplitude_rate=np.zeros(count, dtype=np.complex128),
        part=np.full(count, LEAKAGE_PART),
    )


def joined(first: Links, second: Links) -> Links:
    """The links of two tables of the same snapshot, in one table."""
    columns = [field.name for field in fields(Links) if field.name != "reference_time"]
    both = {name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in columns}
    return Links(reference_time=first.reference_time, **both)


def num_parts(radar: Radar, *, is_own: bool) -> int:
    """Number of parts: three for a radar's own signal with leakage or bumper, otherwise two."""
    return LEAKAGE_PART + 1 if is_own and radar.receives_itself else LEAKAGE_PART


def _coupling(radar: Radar, bumper: Bumper, frequency: float) -> float:
    """Share of the transmitted power that a perfect mirror would return to an element."""
    ahead = np.array([1.0, 0.0, 0.0])
    gain = float(radar.array.pattern.gain(ahead))
    coupling = (gain * SPEED_OF_LIGHT / (8.0 * math.pi * frequency * bumper.distance)) ** 2
    if coupling > 1.0:
        warnings.warn(
            f"the bumper {bumper.distance:.3g} m before radar '{radar.name}' is in the near field "
            f"of its antennas: Friis's law would return {coupling:.3g} times the transmitted "
            "power; the transmitted power is used instead",
            ModelWarning,
            stacklevel=2,
        )
    return min(coupling, 1.0)


def _detour(radar: Radar, bumper: Bumper) -> FloatArray:
    """Way from a transmitting element to a receiving one by the sheet, minus 2d, m, ``(l, m)``."""
    image = radar.array.transmit_position * [-1.0, 1.0, 1.0] + [2.0 * bumper.distance, 0.0, 0.0]
    away = np.linalg.norm(radar.array.position - image[:, None], axis=-1)
    return np.asarray(away - 2.0 * bumper.distance)
