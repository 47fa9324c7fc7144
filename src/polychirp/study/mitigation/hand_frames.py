r"""Frames of points and of other radars' chirps, with an ideal IF filter and without a channel.

Papers on mitigation mostly measure on such signals. The beat with another radar's chirp has the
phase :math:`\phi_v(t) - \phi_i(t)`; its frequency is the difference of both chirps' frequencies. A
sample contains it if that is within half the sample rate: an ideal filter, whose bursts begin and
end at once. With a `Butterworth` filter bursts fade in and ring. The engines of
`polychirp.synthesis` have the filters of radars instead.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame, IfParts, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams


@dataclass(frozen=True, slots=True, kw_only=True)
class ChirpSequence:
    """Equal chirps of a radar.

    Parameters
    ----------
    start_frequency, slope : Hz, Hz/s
    num_ramps, interval : number of ramps, and time from one to the next, s
    """

    start_frequency: float
    slope: float
    num_ramps: int
    interval: float

    def beat_cycles(self, victim: ChirpSequence, start: float, time: FloatArray) -> FloatArray:
        """Phase of the victim's chirp over this one's, cycles ``(ramp, fast)``, from `beat` on.

        Parameters
        ----------
        victim : its chirps start at 0 s
        start : of this radar's first chirp, s
        time : of the samples from the start of the victim's ramps on, s ``(fast,)``
        """
        late = self._late(victim, start, time)
        # both carriers are counted from the victim's, so that no digits are lost
        away = self.start_frequency - victim.start_frequency
        own, other = 0.5 * victim.slope * time**2, away * late + 0.5 * self.slope * late**2
        return np.asarray(own - other)

    def beat(self, victim: ChirpSequence, start: float, time: FloatArray) -> FloatArray:
        """Frequency of the victim's chirp less that of this one, Hz ``(ramp, fast)``."""
        late = self._late(victim, start, time)
        away = self.start_frequency - victim.start_frequency
        return np.asarray(victim.slope * time - away - self.slope * late)

    def _late(self, victim: ChirpSequence, start: float, time: FloatArray) -> FloatArray:
        """Time into this radar's chirp at every sample of the victim, s."""
        every = victim.interval * np.arange(victim.num_ramps)[:, None] + time
        return np.asarray(np.mod(every - start, self.interval))


@dataclass(frozen=True, slots=True, kw_only=True)
class HandTarget:
    """A point: m, m/s, and its amplitude, V."""

    range: float
    range_rate: float = 0.0
    amplitude: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class HandInterferer:
    """Another radar: its chirps, the start of the first one, s, and its amplitude, V."""

    chirps: ChirpSequence
    start: float
    amplitude: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Butterworth:
    """A low-pass filter before the converter.

    It works on samples that are `OVERSAMPLING` times as dense as the converter's. Beyond these the
    beat of an interferer is left out: at 8 times the cutoff a filter of order 9 passes −162 dB.

    Parameters
    ----------
    order : of the filter
    cutoff : Hz, at which it passes half of the power
    """

    order: int
    cutoff: float

    def filtered(self, dense: ComplexArray, rate: float) -> ComplexArray:
        """Samples that the converter takes of dense samples ``(ramp, fast)`` of ``rate``, Hz."""
        from scipy.signal import butter, sosfilt

        sections = butter(self.order, self.cutoff, fs=rate, output="sos")
        return np.asarray(sosfilt(sections, dense, axis=-1)[..., ::OVERSAMPLING])


OVERSAMPLING: Final = 8
"""Dense samples of a filter for each sample of the converter; chosen."""

SETTLING_SAMPLES: Final = 64
"""Samples of the converter before each ramp in which a filter settles; chosen: the response of
order 9 at half the sample rate falls by 60 dB within some 40."""


def hand_frame(
    victim: ChirpSequence,
    *,
    num_samples: int,
    sample_rate: float,
    targets: Sequence[HandTarget],
    interferers: Sequence[HandInterferer],
    noise: float,
    streams: Streams,
    filtering: Butterworth | None = None,
) -> tuple[IfFrame, IfParts]:
    """A frame of one channel, and its parts echo, direct and noise.

    Parameters
    ----------
    noise : mean power of a sample's noise, W
    streams : of the phases of points and interferers, and of the noise
    filtering : of echoes and interference; None: an ideal filter of the converter's band
    """
    random = streams["hand frame"]
    time, dense_rate = np.arange(num_samples) / sample_rate, sample_rate
    if filtering is not None:
        dense_rate = OVERSAMPLING * sample_rate
        time = np.arange(-SETTLING_SAMPLES * OVERSAMPLING, num_samples * OVERSAMPLING) / dense_rate
    ramp = np.arange(victim.num_ramps)[:, None]
    shape = (victim.num_ramps, time.size)
    echo, direct = np.zeros(shape, dtype=np.complex128), np.zeros(shape, dtype=np.complex128)
    for target in targets:
        distance = target.range + target.range_rate * (victim.interval * ramp + time)
        delay = 2.0 * distance / SPEED_OF_LIGHT
        cycles = (victim.start_frequency + victim.slope * time - 0.5 * victim.slope * delay) * delay
        echo += target.amplitude * _phasor(cycles + random.random())
    for other in interferers:
        beat = other.chirps.beat(victim, other.start, time)
        cycles = other.chirps.beat_cycles(victim, other.start, time) + random.random()
        direct += other.amplitude * _phasor(cycles) * (np.abs(beat) < 0.5 * dense_rate)
    if filtering is not None:
        echo, direct = (
            filtering.filtered(part, dense_rate)[:, SETTLING_SAMPLES:] for part in (echo, direct)
        )
    white = random.normal(size=echo.shape) + 1j * random.normal(size=echo.shape)
    parts = np.stack([echo, direct, math.sqrt(0.5 * noise) * white])[:, None]
    start = victim.interval * np.arange(float(victim.num_ramps))
    equal = np.ones(victim.num_ramps)
    frame = IfFrame(
        samples=parts.sum(axis=0),
        times=SampleTimes(
            first=start,
            num_samples=np.full(victim.num_ramps, num_samples),
            rate=sample_rate,
        ),
        schedule=RampSchedule(
            start_time=start,
            duration=equal * num_samples / sample_rate,
            start_frequency=victim.start_frequency * equal,
            slope=victim.slope * equal,
            start_phase=0.0 * equal,
            sweep=np.arange(victim.num_ramps),
        ),
        array=AntennaArray(num_channels=1),
    )
    return frame, IfParts(samples=parts, names=("echo", "direct", "noise"))


def _phasor(cycles: FloatArray) -> ComplexArray:
    return np.asarray(np.exp(2j * np.pi * np.mod(cycles, 1.0)))
