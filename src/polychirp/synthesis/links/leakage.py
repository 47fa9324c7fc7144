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
"""Number of the leakage's part in the contribution of a radar to itself.

Parts 0 and 1 are unmirrored and mirrored paths."""


def all_links(
    scene: Scene,
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    transmitter: int,
    num_elements: int = 1,
) -> list[Links]:
    """The traced links of every snapshot, and for a radar's own signal its leakage and bumper."""
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
    r"""Leakages, then the bumper: at rest with the radar, so the same at every snapshot.

    A leakage reaches all channels alike, with :math:`|a|^2 = P_t G_{ft} G_{fr} / I`. The bumper at
    distance d, with r its reflected share, gives

    .. math:: |a|^2 = P_t G_{ft} G_{fr}\; r \left(\frac{G\lambda}{4\pi\cdot 2d}\right)^2

    at delays :math:`\sqrt{4d^2 + y_m^2}/c`, exact for each element; amplitude and antenna gain
    are those along the axis, for all elements. The sheet is flat, large and square to the axis;
    multiple reflections between it and the radar are neglected.

    Parameters
    ----------
    frequency : Hz, for the wavelength of Friis's law
    num_elements : transmitting elements in use; all of them leak alike

    Warns
    -----
    ModelWarning
        The bumper is so near to antennas so large that Friis's law returns more power than is
        sent: then the power that is sent is taken.
    """
    power = radar.transmit_power * radar.transmit_gain * radar.receive_gain
    delay = [leak.delay for leak in radar.leakage]
    share = [1.0 / leak.isolation for leak in radar.leakage]
    phase = [leak.phase for leak in radar.leakage]
    element_delay = np.zeros((len(delay), radar.array.num_channels))
    if radar.bumper is not None:
        delay.append(2.0 * radar.bumper.distance / SPEED_OF_LIGHT)
        share.append(radar.bumper.reflection * _coupling(radar, radar.bumper, frequency))
        phase.append(radar.bumper.phase)
        element_delay = np.vstack([element_delay, _detour(radar, radar.bumper) / SPEED_OF_LIGHT])
    amplitude = np.sqrt(power * np.array(share)) * np.exp(1j * np.array(phase))
    count = num_elements * len(delay)
    return Links(
        reference_time=reference_time,
        delay=np.repeat(delay, num_elements),
        delay_rate=np.zeros(count),
        transmit_element=np.tile(np.arange(num_elements), len(delay)),
        element_delay=np.repeat(element_delay, num_elements, axis=0),
        amplitude=np.outer(amplitude, radar.array.transmitter_response[:num_elements]).ravel(),
        part=np.full(count, LEAKAGE_PART),
    )


def joined(first: Links, second: Links) -> Links:
    """The links of both tables, of one snapshot."""
    columns = [field.name for field in fields(Links) if field.name != "reference_time"]
    both = {name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in columns}
    return Links(reference_time=first.reference_time, **both)


def num_parts(radar: Radar, *, is_own: bool) -> int:
    """Parts of a contribution: three for a radar that receives its own leakage, else two."""
    return LEAKAGE_PART + 1 if is_own and radar.receives_itself else LEAKAGE_PART


def _coupling(radar: Radar, bumper: Bumper, frequency: float) -> float:
    """Share of the transmitted power that a perfect mirror would return to an element."""
    ahead = np.array([1.0, 0.0, 0.0])
    gain = float(radar.array.pattern.gain(ahead))
    coupling = (gain * SPEED_OF_LIGHT / (8.0 * math.pi * frequency * bumper.distance)) ** 2
    if coupling > 1.0:
        warnings.warn(
            f"the bumper {bumper.distance:.3g} m before radar '{radar.name}' is in the near field "
            f"of its antennas: Friis's law returns {coupling:.3g} times what is sent, 1 is taken",
            ModelWarning,
            stacklevel=2,
        )
    return min(coupling, 1.0)


def _detour(radar: Radar, bumper: Bumper) -> FloatArray:
    """Distance of each element from the transmitter's image, less that of the centre, m."""
    image = np.array([2.0 * bumper.distance, 0.0, 0.0])
    away = np.linalg.norm(radar.array.position - image, axis=1)
    return np.asarray(away - 2.0 * bumper.distance)
