"""Amplifier with gain control, saturation and quantisation of I and Q."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import Axes, BoolArray, ComplexArray, FloatArray, PerRamp, Sealed
from polychirp.model.front_end import Digitiser, GainControl


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Digitised(Sealed):
    """A frame after a digitiser.

    Parameters
    ----------
    samples : V, quantised and divided by the amplifier's gain, ``(channel, ramp, fast)``
    gain : power gain of the amplifier on each ramp, ``(ramp,)``
    is_overloaded : true where I or Q, amplified, was beyond full scale, ``(channel, ramp, fast)``
    """

    samples: Annotated[ComplexArray, Axes("channel", "ramp", "fast", dtype=np.complex128)]
    gain: PerRamp
    is_overloaded: Annotated[BoolArray, Axes("channel", "ramp", "fast", dtype=np.bool_)]


def digitised(digitiser: Digitiser, samples: ComplexArray) -> Digitised:
    """Digitise ``samples``, V ``(channel, ramp, fast)``; 0 V stays 0 V.

    >>> digitised(Digitiser(full_scale=1.0, bits=2), np.array([[[0.3 - 2.0j]]])).samples
    array([[[0.5-1.j]]])
    """
    limit = math.sqrt(digitiser.full_scale)
    gain = np.ones(samples.shape[1])
    if digitiser.gain_control is not None:
        gain = gains(digitiser.gain_control, digitiser.full_scale, _peaks(samples))
    amplifier = np.sqrt(gain)[:, None]
    voltage = amplifier * samples
    overloaded = np.maximum(np.abs(voltage.real), np.abs(voltage.imag)) > limit
    read = np.empty_like(voltage)
    read.real = _read(digitiser, voltage.real, limit)
    read.imag = _read(digitiser, voltage.imag, limit)
    return Digitised(samples=read / amplifier, gain=gain, is_overloaded=overloaded)


def gains(control: GainControl, full_scale: float, peaks: FloatArray) -> FloatArray:
    """Power gain on every ramp, ``(ramp,)``, from each ramp's strongest I or Q voltage, V."""
    former = [
        float(np.max(peaks[max(0, k - control.num_ramps) : max(1, k)])) for k in range(peaks.size)
    ]
    room = full_scale / (control.back_off * np.maximum(np.square(former), 1e-300))
    # 1e-9: rounding must not reduce a whole number of steps by one
    steps = np.floor(np.log(room) / math.log(control.step) + 1e-9)
    wanted = np.exp(np.clip(steps * math.log(control.step), -690.0, 690.0))
    return np.clip(wanted, control.least, control.greatest)


def _peaks(samples: ComplexArray) -> FloatArray:
    return np.asarray(np.maximum(np.abs(samples.real), np.abs(samples.imag)).max(axis=(0, 2)))


def _read(digitiser: Digitiser, voltage: FloatArray, limit: float) -> FloatArray:
    bent = voltage if digitiser.softness is None else _bent(voltage, limit, digitiser.softness)
    if digitiser.bits is None:
        return np.clip(bent, -limit, limit)
    half = 1 << (digitiser.bits - 1)
    step = limit / half
    return np.asarray(step * np.clip(np.rint(bent / step), -half, half - 1))


def _bent(voltage: FloatArray, limit: float, softness: float) -> FloatArray:
    """Voltage after Rapp's compression, by logarithms: the powers of a hard limit overflow."""
    ratio = np.log(np.maximum(np.abs(voltage) / limit, 1e-30))
    return np.asarray(voltage * np.exp(-0.5 / softness * np.logaddexp(0.0, 2 * softness * ratio)))
