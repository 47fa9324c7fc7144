r"""Phase noise of another radar at offsets beyond those that are computed as waves.

At frequencies f that are further from the beat of another radar than the highest offset, its
received power P leaves Gaussian noise of density

.. math:: P\,\left[L_v(f - f_{IF}) + L_i(f - f_{IF})\right] ,

with the path's beat :math:`f_{IF}`. The noise arrives from the directions of the paths, and is
independent between victims.

Limits. Beats are those of linear ramps: errors of ramps do not move them here. Noise of paths that
are later than the strongest one by more than three stop edges of the IF filter over the slope is
weakened, and from 5.5 stop edges on it is missing.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.synthesis.base import SynthesisEngine
from polychirp.synthesis.impairments.wide_victim import Wide
from polychirp.synthesis.links.links import links_of_all
from polychirp.synthesis.links.thermal_noise import noise_density

BANDS_PER_STOPBAND: Final = 4
"""Number of bands in the width of a `stopband`; chosen: at offsets of two stop edges, a density
that falls by 20 dB per decade changes by 1 dB across a band."""

NEGLIGIBLE_NOISE: Final = 1e-6
"""Greatest neglected noise density beyond the highest offset over that of thermal noise; chosen."""


def far_noise(
    inner: SynthesisEngine,
    wide: Wide,
    schedules: Sequence[RampSchedule],
    paths: Sequence[PropagationPaths],
    *,
    victim: int,
    transmitter: int,
    streams: Streams,
) -> ComplexArray:
    """Noise at offsets beyond the highest one, V ``(part, channel, ramp, fast)``, at the wide rate.

    It is 0, without axes, if it is negligible. The other radar's noise at the victim's own
    frequency is mixed as if that radar sent the victim's ramp, without a code, so early that it
    is synchronous with the victim's after the strongest path. The other radar's own code would
    spread its noise by the code's band, which is neglected.

    Parameters
    ----------
    inner : engine for linear chirps
    wide : the victim
    schedules : ramps of every radar
    paths : those from ``transmitter`` to ``victim``, at least one of them
    streams : noise comes from ``streams["oscillator", victim, "far", transmitter]``, by names
    """
    radar, other = wide.radar, wide.scene.radars[transmitter]
    links = links_of_all(wide.scene, paths, victim=victim, transmitter=transmitter)
    strength = np.concatenate([np.abs(link.amplitude) for link in links])
    delays = np.concatenate([link.delay for link in links])
    delay = float(delays[np.argmax(strength)])
    level = _Level.of(
        wide,
        schedules[victim],
        other,
        schedules[transmitter],
        delay=delay,
        spread=float(np.abs(delays - delay).max()),
    )
    most = max(float(np.abs(link.amplitude).sum()) for link in links)
    if level.highest() * most**2 < NEGLIGIBLE_NOISE * noise_density(radar):
        return np.zeros((), dtype=np.complex128)
    generator = streams["oscillator", radar.name, "far", other.name]
    shape = (*wide.times.time.shape, 2)
    white = generator.standard_normal(shape).view(np.complex128)[..., 0]
    noise = np.zeros_like(white)
    for centre, band in _bands(white, wide.times.rate, width=level.width, edge=level.edge):
        noise += band * np.sqrt(0.5 * wide.times.rate * level.density(centre))
    carrier = _on_own_ramps(inner, wide, schedules, paths, victim, transmitter, delay)
    return np.asarray(carrier * noise)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Level:
    """Density of two radars' phase noise beyond the highest offset, at the victim's wide samples.

    Parameters
    ----------
    radars : victim and transmitter
    beat : Hz, ``(ramp, fast)``, of the strongest path
    is_on : whether both radars send
    highest_offset : Hz, of the noise that is computed as waves
    width : Hz, of a band
    edge : Hz, highest frequency of the noise that the carrier may bring into the victim's band
    """

    radars: tuple[Radar, Radar]
    beat: FloatArray
    is_on: BoolArray
    highest_offset: float
    width: float
    edge: float

    @classmethod
    def of(
        cls,
        wide: Wide,
        own: RampSchedule,
        other: Radar,
        sent: RampSchedule,
        *,
        delay: float,
        spread: float,
    ) -> "_Level":
        """The level if the strongest path has this ``delay``, s, and others ± ``spread``, s."""
        time, stopband = wide.times.time, wide.radar.if_filter.stopband
        mine, mixes = _frequency(own, time)
        others, sends = _frequency(sent, time - delay)
        return cls(
            radars=(wide.radar, other),
            beat=mine - others,
            is_on=mixes & sends,
            highest_offset=wide.highest_offset,
            width=stopband / BANDS_PER_STOPBAND,
            edge=stopband + spread * float(np.abs(own.slope).max()),
        )

    def density(self, frequency: float) -> FloatArray:
        """Mean density in the band about ``frequency``, 1/Hz, ``(ramp, fast)``."""
        offset = np.abs(frequency - self.beat)
        beyond = np.clip((offset - self.highest_offset) / self.width + 0.5, 0.0, 1.0)
        return self.is_on * beyond * self._of_both(offset)

    def highest(self) -> float:
        """Highest density in the victim's band at any time, 1/Hz."""
        away = np.abs(self.beat)
        nearest = np.maximum(away - self.edge, self.highest_offset)
        is_beyond = self.is_on & (away + self.edge > self.highest_offset)
        return float((is_beyond * self._of_both(nearest)).max())

    def _of_both(self, offset: FloatArray) -> FloatArray:
        noises = [radar.oscillator.phase_noise for radar in self.radars]
        densities = [noise.density(offset) for noise in noises if noise is not None]
        return np.asarray(sum(densities, start=np.zeros_like(offset)))


def _on_own_ramps(
    inner: SynthesisEngine,
    wide: Wide,
    schedules: Sequence[RampSchedule],
    paths: Sequence[PropagationPaths],
    victim: int,
    transmitter: int,
    delay: float,
) -> ComplexArray:
    """The victim's samples, V, if the transmitter sent the victim's ramps with its own weights.

    It sends them earlier by ``delay``, s. The samples are those of one element after the other,
    since the weights may change within a ramp of the victim.
    """
    own, sent = schedules[victim], schedules[transmitter]
    weight = sent.transmit_weight[_ramp_at(sent, wide.times.time - delay)]
    carrier = np.zeros((), dtype=np.complex128)
    for element in np.flatnonzero(np.any(sent.transmit_weight, axis=0)):
        alone = np.zeros((own.num_ramps, sent.num_elements), dtype=np.complex128)
        alone[:, element] = 1.0
        like_own = replace(own, start_time=own.start_time - delay, transmit_weight=alone, code=None)
        instead = [like_own if n == transmitter else ramps for n, ramps in enumerate(schedules)]
        carrier = carrier + weight[..., element] * inner.contribution(
            wide.scene, instead, paths, victim=victim, transmitter=transmitter
        )
    return carrier


def _bands(
    signal: ComplexArray, rate: float, *, width: float, edge: float
) -> Iterator[tuple[float, ComplexArray]]:
    """Middle of every band of ``width`` Hz up to ±``edge``, Hz, and the part of ``signal`` in it.

    The last axis of ``signal`` is time, in samples at ``rate`` Hz.
    """
    from scipy.fft import fft, fftfreq, ifft

    spectrum = fft(signal, axis=-1)
    band_of = np.round(fftfreq(signal.shape[-1], 1.0 / rate) / width)
    for band in range(-math.ceil(edge / width), math.ceil(edge / width) + 1):
        inside = band_of == band
        if np.any(inside):
            yield band * width, np.asarray(ifft(np.where(inside, spectrum, 0.0), axis=-1))


def _frequency(schedule: RampSchedule, time: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Frequency at ``time``, Hz, and a mask that is true while a ramp is sent."""
    ramp = _ramp_at(schedule, time)
    into = time - schedule.start_time[ramp]
    sends = (into >= 0.0) & (into < schedule.duration[ramp])
    return schedule.start_frequency[ramp] + schedule.slope[ramp] * into, sends


def _ramp_at(schedule: RampSchedule, time: FloatArray) -> IntArray:
    """Number of the ramp that is sent at ``time``, or was the last one, and 0 before the first."""
    return np.maximum(np.searchsorted(schedule.start_time, time, side="right") - 1, 0)
