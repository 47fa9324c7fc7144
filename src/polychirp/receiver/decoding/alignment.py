r"""Decoding of chirps: alignment of the echoes' delays, and multiplication by the code.

After the mixer an echo of the delay τ on a ramp of slope b has the beat :math:`f = b\tau` and the
conjugate code, late by τ. A filter with the response

.. math:: G(f) = e^{j\pi f^2/b}

has the group delay −f/b: it advances every echo by its own delay, so that the codes of all echoes
coincide with that of the transmitter (Uysal, "Phase-Coded FMCW Automotive Radar", IEEE Trans. Veh.
Technol. 69, 2020). The code's own band passes the same filter, so that the code is dispersed, alike
for all echoes. The samples are therefore multiplied by the inverse of the dispersed code, and not
by the code itself; where the dispersed code is weak, its inverse is limited. The inverse filter
then gives each echo the delay and phase that it has without a code.
"""

import math

import numpy as np
from scipy.fft import next_fast_len

from polychirp.axes import ComplexArray, FloatArray
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule

LEAST_CODE = 0.5
"""Magnitude of the dispersed code below which its inverse is limited. Chosen: noise grows by 6 dB
at most, for a sample at the border of two chips."""

LEAST_KEPT = 0.1
"""Share of an echo, in the mean of all ramps, below which what is missing is not made up for.
Chosen below that at borders of chips, half of which differ from the next; it is less only outside
of the ramps."""


def decoded_chirps(
    samples: ComplexArray, schedule: RampSchedule, times: SampleTimes
) -> ComplexArray:
    """Samples ``(…, ramp, fast)`` of coded chirps, as if the chirps had no code."""
    size = samples.shape[-1]
    number, frequency = _padded_grid(schedule, times, size)
    bend = np.exp(1j * np.pi * frequency**2 / schedule.slope[:, None])
    inverse = _inverse_codes(schedule, times, number, bend)
    out = np.empty(samples.shape, dtype=np.complex128)
    for ramp in range(schedule.num_ramps):
        spectrum = np.fft.fft(samples[..., ramp, :], n=number.size, axis=-1) * bend[ramp]
        aligned = np.fft.ifft(spectrum, axis=-1) * inverse[ramp]
        spectrum = np.fft.fft(aligned, axis=-1) * np.conj(bend[ramp])
        out[..., ramp, :] = np.fft.ifft(spectrum, axis=-1)[..., :size]
    return out


def noise_gain(schedule: RampSchedule, times: SampleTimes) -> float:
    """Power of noise behind `decoded_chirps` over that of white noise before it, over all samples.

    An echo keeps its amplitude, so that its SNR is less by this ratio.
    """
    size = times.most_samples
    number, frequency = _padded_grid(schedule, times, size)
    bend = np.exp(1j * np.pi * frequency**2 / schedule.slope[:, None])
    inverse = _inverse_codes(schedule, times, number, bend)[:, :size]
    return float(np.mean(np.abs(inverse) ** 2))


def _padded_grid(
    schedule: RampSchedule, times: SampleTimes, size: int
) -> tuple[FloatArray, FloatArray]:
    """Numbers of samples, negative at the end, and frequencies, Hz, of the padded transforms.

    The padding takes the greatest delay and the greatest advance of the filter.
    """
    shift = 0.5 * times.rate / float(np.min(np.abs(schedule.slope)))
    pad = math.ceil(shift * times.rate) + 1
    total = next_fast_len(size + 2 * pad)
    number = np.arange(total)
    number[total - pad :] -= total
    frequency = np.asarray(np.fft.fftfreq(total, 1.0 / times.rate), dtype=np.float64)
    return number.astype(np.float64), frequency


def _inverse_codes(
    schedule: RampSchedule, times: SampleTimes, number: FloatArray, bend: ComplexArray
) -> ComplexArray:
    """Factors that remove the codes behind the filter ``bend``, ``(ramp, sample)``.

    They are the inverse of the conjugate code, limited where it is weak. What the limit takes of an
    echo is about the same where chips meet in many ramps, and would modulate the echo at the chip
    rate; the mean over the ramps is made up for.
    """
    width = 1.0 / times.rate
    sent = np.stack(
        [
            sent_code(schedule, ramp, number * width + float(first), width)
            for ramp, first in enumerate(times.first - schedule.start_time)
        ]
    )
    dispersed = np.fft.ifft(np.fft.fft(np.conj(sent), axis=1) * bend, axis=1)
    size = np.maximum(np.abs(dispersed), LEAST_CODE)
    kept = np.mean(np.abs(dispersed / size) ** 2, axis=0)
    return np.asarray(np.conj(dispersed) / (size**2 * np.maximum(kept, LEAST_KEPT)))


def sent_code(schedule: RampSchedule, ramp: int, into: FloatArray, width: float) -> ComplexArray:
    """Mean of a ramp's chips over an interval of ``width`` s about times from its start, s.

    Before and after the ramp the code is zero.
    """
    code = schedule.code
    assert code is not None
    chip = float(code.chip_duration[ramp])
    sent = code.value[code.row[ramp]]
    sums = np.concatenate([[0.0], np.cumsum(sent)])

    def integral(time: FloatArray) -> ComplexArray:
        chips = np.clip(time, 0.0, float(schedule.duration[ramp])) / chip
        whole = np.floor(chips).astype(np.int64)
        repeats, within = np.divmod(whole, sent.size)
        return np.asarray(repeats * sums[-1] + sums[within] + (chips - whole) * sent[within])

    return (integral(into + 0.5 * width) - integral(into - 0.5 * width)) * (chip / width)
