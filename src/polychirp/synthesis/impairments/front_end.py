"""Stages from the IF filter's output to the samples, for each part of a frame by itself.

High-pass and I/Q imbalance are linear and act on each part. Offset, saturation and quantisation
are not: the error that they add to the sum of all parts is a separate part, the distortion.
"""

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfParts, SampleTimes
from polychirp.model.radar import Radar
from polychirp.synthesis.impairments.adc import Digitised, digitised
from polychirp.synthesis.impairments.high_pass import high_passed


def linear_steps(radar: Radar, samples: ComplexArray, times: SampleTimes) -> ComplexArray:
    """Samples after high-pass and I/Q imbalance, V ``(part, channel, ramp, fast)``, at ``times``.

    ``samples`` are at the times of `high_pass.with_lead`, and may be overwritten.
    """
    samples = high_passed(radar, samples, times)
    imbalance = radar.front_end.imbalance
    if imbalance is not None:
        for part in samples:
            part[...] = imbalance.applied(part)
    return samples


def distortion(radar: Radar, linear: ComplexArray, times: SampleTimes) -> ComplexArray:
    """Offset and digitiser errors of ``linear``, the sum of parts, V ``(channel, ramp, fast)``."""
    offset = radar.front_end.offset
    added = 0.0 if offset is None else np.where(times.is_sample, offset.voltage, 0.0)
    if radar.front_end.digitiser is None:
        return np.broadcast_to(added, linear.shape)
    return np.asarray(digitised(radar.front_end.digitiser, linear + added).samples - linear)


def reading(radar: Radar, parts: IfParts, times: SampleTimes) -> Digitised:
    """The frame digitised again, for gains and overloads, which its samples do not show.

    `InputError` is raised if the radar has no digitiser.
    """
    digitiser, offset = radar.front_end.digitiser, radar.front_end.offset
    if digitiser is None:
        raise InputError(f"radar '{radar.name}' has no digitiser; give its front end one")
    linear = parts.total(*(part for part in parts.names if part != "distortion"))
    if offset is not None:
        linear = linear + np.where(times.is_sample, offset.voltage, 0.0)
    return digitised(digitiser, linear)
