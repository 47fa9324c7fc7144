"""Energies of the echoes of single bodies in a frame, from the paths (`scoring.sight`)."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.if_frame import IfFrame
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene
from polychirp.scoring.echoes import sending_back
from polychirp.synthesis.impairments.front_end import sample_scale
from polychirp.synthesis.links.interference_levels import mean_power
from polychirp.synthesis.links.links import links_between
from polychirp.synthesis.links.thermal_noise import noise_density

NUM_FREQUENCIES: Final = 128
"""Number of frequencies over which echoes are averaged; chosen: over 1 GHz they are 8 MHz apart, so
that echoes of a body up to 19 m long are averaged without error."""


def body_echoes(
    scene: Scene,
    paths: PropagationPaths,
    *,
    victim: int,
    targets: Sequence[str],
    frame: IfFrame,
) -> FloatArray:
    """Coherent SNRs of the echoes of targets to radar ``victim``, ratios ``(target,)``.

    This is the energy of an echo in all samples and channels over that of the noise in one of them
    at the noise's density in the pass band: a matched filter has it, however fast a converter
    samples. Elements that send together add their energies, and chips have their mean power.

    Parameters
    ----------
    scene, paths : at one instant of the frame, about its middle
    targets : names of actors
    frame : as received, before any decoding
    """
    power = echo_powers(scene, paths, victim=victim, frequency=_band(frame))
    sent = float(frame.times.num_samples @ mean_power(frame.schedule))
    radar = scene.radars[victim]
    noise = sample_scale(radar) * noise_density(radar) * frame.times.rate
    snr = power * (len(frame.samples) * sent / noise)
    whole = np.array([actor.whole for actor in scene.actors])
    return np.array([float(np.sum(snr[whole == name])) for name in targets])


def echo_powers(
    scene: Scene, paths: PropagationPaths, *, victim: int, frequency: FloatArray
) -> FloatArray:
    """Power that a channel of radar ``victim`` receives from each actor, W, ``(actor,)``.

    It is the mean over ``frequency``, Hz, of the power of the sum of an actor's paths without
    mirrors, to and from the first transmitting element.
    """
    is_own = (paths.transmitter == victim) & (paths.receiver == victim)
    own = paths.select(is_own & (paths.num_bounces > 0) & ~paths.is_mirrored)
    links = links_between(scene, own, victim=victim, transmitter=victim)
    actor, out = sending_back(own), np.zeros(len(scene.actors))
    for number in np.unique(actor):
        mine = actor == number
        turns = np.exp(-2j * np.pi * frequency[:, None] * links.delay[mine])
        out[number] = np.mean(np.abs(turns @ links.amplitude[mine]) ** 2)
    return out


def _band(frame: IfFrame) -> FloatArray:
    """Frequencies over the band of a frame's ramps and their code, Hz, evenly spaced."""
    low, high = frame.schedule.occupied
    return np.linspace(float(low.min()), float(high.max()), NUM_FREQUENCIES)
