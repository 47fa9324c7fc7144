r"""The error θ(t) of a radar's transmitted phase over one frame, the same for every victim.

Phase noise is a sum of waves with independent Gaussian amplitudes,

.. math:: 2\pi\,\theta(t) = 2\,\mathrm{Re} \sum_m c_m e^{j2\pi m t/P}, \qquad
          \mathrm{E}|c_m|^2 = L(m/P)/P ,

up to a highest offset m/P. The period P is at least twice the frame, so that the frame's ends are
independent; the lowest wave has the offset 1/P.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.model.oscillator import AnyRampError, PhaseNoise
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams

PHASE_MARGIN: Final = 100e-6
"""Time in a noise record before the first and after the last ramp, s; chosen: above all delays."""

GRID_OVERSAMPLING: Final = 4
"""Grid points per Nyquist interval of the highest offset; chosen together with `SPLINE_DEGREE`."""

SPLINE_DEGREE: Final = 7
"""Degree of the splines; chosen: with `GRID_OVERSAMPLING` the highest wave is right to 2·7⁻⁸."""

PhaseError = Callable[[FloatArray], FloatArray]
"""Function of times in s, of any shape, that gives θ in cycles."""


def phase_error(
    radar: Radar, schedule: RampSchedule, *, highest_offset: float, streams: Streams
) -> PhaseError | None:
    """Error that the radar's oscillator adds to the phase of ``schedule``; None if it is ideal.

    Parameters
    ----------
    highest_offset : Hz, up to which phase noise is drawn
    streams : noise comes from ``streams["oscillator", name of the radar]``
    """
    oscillator = radar.oscillator
    parts: list[PhaseError] = []
    if oscillator.phase_noise is not None:
        parts.append(
            noise_record(
                oscillator.phase_noise,
                begin=float(schedule.start_time[0]) - PHASE_MARGIN,
                end=float(schedule.end_time[-1]) + PHASE_MARGIN,
                highest_offset=highest_offset,
                streams=streams.of("oscillator", radar.name),
            )
        )
    if oscillator.ramp_error is not None:
        parts.append(RampPhase(error=oscillator.ramp_error, schedule=schedule))
    if not parts:
        return None
    return lambda time: np.asarray(sum(part(time) for part in parts))


@lru_cache(maxsize=16)
def noise_record(
    noise: PhaseNoise, *, begin: float, end: float, highest_offset: float, streams: Streams
) -> PhaseError:
    """Phase noise from ``begin`` to ``end``, s; the same arguments give the same noise.

    The record is a spline on a grid. A wave's coefficients are its samples divided by the spline's
    frequency response, so that its only errors are its images about the grid's rate. Beyond its
    ends, where nothing is sent, the record is constant.
    """
    from scipy.fft import irfft, next_fast_len

    from polychirp.synthesis.impairments.splines import basis, evaluate

    rate = 2.0 * GRID_OVERSAMPLING * highest_offset
    size = int(np.ceil((end - begin) * rate)) + SPLINE_DEGREE + 1
    period = next_fast_len(2 * size, real=True)
    offset, height = noise_waves(
        noise, spacing=rate / period, highest_offset=highest_offset, streams=streams
    )
    coefficients = irfft(height / np.sinc(offset / rate) ** (SPLINE_DEGREE + 1), period)[:size]
    coefficients = coefficients * (period / (2.0 * np.pi))

    def at(time: FloatArray) -> FloatArray:
        place = (np.asarray(time) - begin) * rate
        out = np.empty(place.shape)
        evaluate(out.reshape(-1), place.reshape(-1), coefficients, basis(SPLINE_DEGREE))
        return out

    return at


def noise_waves(
    noise: PhaseNoise, *, spacing: float, highest_offset: float, streams: Streams
) -> tuple[FloatArray, ComplexArray]:
    """Offsets m/P, Hz, and amplitudes c_m, rad, ``(wave,)``, from m = 0 on; ``spacing`` is 1/P."""
    offset = spacing * np.arange(int(highest_offset / spacing) + 1, dtype=np.float64)
    draws = streams["phase noise"].standard_normal((offset.size, 2)).view(np.complex128)[:, 0]
    height = draws * np.sqrt(0.5 * noise.density(offset) * spacing)
    height[0] = 0.0
    return offset, height


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RampPhase:
    """Phase error θ by the frequency error of ramps, continuous from ramp to ramp."""

    error: AnyRampError
    schedule: RampSchedule

    def __call__(self, time: FloatArray) -> FloatArray:
        """θ, cycles, at times ``(…,)``; between ramps it is constant."""
        start, duration = self.schedule.start_time, self.schedule.duration
        whole = float(self.error.phase(np.ones(()))) * duration
        before = np.concatenate([[0.0], np.cumsum(whole)[:-1]])
        ramp = np.maximum(np.searchsorted(start, time, side="right") - 1, 0)
        fraction = np.clip((time - start[ramp]) / duration[ramp], 0.0, 1.0)
        return np.asarray(before[ramp] + self.error.phase(fraction) * duration[ramp])
