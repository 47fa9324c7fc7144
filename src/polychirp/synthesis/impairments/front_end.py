"""Stages from the IF filter's output to the samples, for each part of a frame by itself.

High-pass, I/Q imbalance and the choice of the branch I are linear and act on each part. Offset,
saturation and quantisation are not: the error that they add to the sum of all parts is a separate
part, the distortion.
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

    Real samples have no imaginary part. ``samples`` are at the times of `high_pass.with_lead`, and
    may be overwritten.
    """
    samples = high_passed(radar, samples, times)
    imbalance = radar.front_end.imbalance
    if imbalance is not None:
        for part in samples:
            part[...] = imbalance.applied(part)
    if radar.converter.is_real:
        samples.imag = 0.0
    return samples


def sample_scale(radar: Radar) -> float:
    """Ratio of a frame's samples to the sampled voltages: 2 of real samples (`Converter`)."""
    return 2.0 if radar.converter.is_real else 1.0


def distortion(radar: Radar, linear: ComplexArray, times: SampleTimes) -> ComplexArray:
    """Offset and digitiser errors of ``linear``, the sum of parts, V ``(channel, ramp, fast)``."""
    added = _offset(radar, times)
    if radar.front_end.digitiser is None:
        return np.broadcast_to(added, linear.shape)
    return np.asarray(digitised(radar.front_end.digitiser, linear + added).samples - linear)


def reading(radar: Radar, parts: IfParts, times: SampleTimes) -> Digitised:
    """The frame digitised again, for gains and overloads, which its samples do not show.

    `InputError` is raised if the radar has no digitiser.
    """
    digitiser = radar.front_end.digitiser
    if digitiser is None:
        raise InputError(f"radar '{radar.name}' has no digitiser; give its front end one")
    linear = parts.total(*(part for part in parts.names if part != "distortion"))
    return digitised(digitiser, linear / sample_scale(radar) + _offset(radar, times))


def undisturbed(radar: Radar, parts: IfParts, times: SampleTimes) -> ComplexArray:
    """Samples that a frame would have without other radars, V ``(channel, ramp, fast)``.

    A digitiser reads the other parts again, since it may clip, or choose another gain, because of
    the interference.
    """
    others = ("direct", "indirect", "distortion")
    scale = sample_scale(radar)
    linear = parts.total(*(part for part in parts.names if part not in others)) / scale
    return np.asarray(scale * (linear + distortion(radar, linear, times)))


def _offset(radar: Radar, times: SampleTimes) -> ComplexArray:
    """Constant voltage that is added to the samples, V ``(ramp, fast)``."""
    offset = radar.front_end.offset
    voltage = 0.0 if offset is None else offset.voltage
    return np.where(times.is_sample, voltage.real if radar.converter.is_real else voltage, 0.0 + 0j)
