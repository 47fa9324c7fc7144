"""Frames with interference made by hand: noise on some ramps, from one direction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.if_frame import IfFrame


def with_noisy_ramps(
    frame: IfFrame, power: FloatArray, *, azimuth: float = 0.3, seed: int = 0
) -> IfFrame:
    """The frame with noise of this power per sample on each ramp, ``(ramp,)``, from a direction."""
    draw = np.random.default_rng([97, seed])
    shape = frame.samples.shape[1:]
    noise = np.sqrt(0.5) * (draw.normal(size=shape) + 1j * draw.normal(size=shape))
    channel = np.arange(frame.samples.shape[0])
    phasor = np.exp(-1j * np.pi * channel * np.sin(azimuth))  # half a wavelength apart
    added = phasor[:, None, None] * noise * np.sqrt(power)[:, None] * frame.times.is_sample
    return replace(frame, samples=frame.samples + added)
