r"""Correlation with a code on a carrier of constant frequency, in the frequency domain.

A code of the period :math:`T_p` on the carrier f has the Fourier coefficients :math:`C_k`. An echo
of the delay τ and amplitude a has, after the mixer, the samples
:math:`a\,e^{j2\pi f\tau}\,\overline{c(t - \tau)}`, whose spectrum at the frequency
:math:`-k/T_p` is :math:`a\,H_k\,\overline{C_k}\,e^{j2\pi(f + k/T_p)\tau}` behind an IF filter of
the real and even response :math:`H_k`. Multiplied by :math:`C_k`, the transform of a correlation
with the code, it is

.. math:: D_k = a\,H_k\,|C_k|^2\,e^{j2\pi(f + k/T_p)\tau} .

These are nearly the samples of a short chirp that covers the band: the frequency
:math:`f + k/T_p` is sample k. A transform over k gives the correlation over delays, and so the
range-Doppler receiver reads :math:`D_k` as it reads a chirp. Its taper over the band lowers the
side lobes of a peak; those of the code and of the filter are in :math:`H_k|C_k|^2`.
"""

from typing import NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.range_doppler.transforms import taper

SWEEP_DURATION = 2e-6
"""Greatest duration T of the ramps of a decoded frame, s.

Chosen between two errors, as the frequencies of a chirp follow each other and those of a code do
not. A receiver of chirps corrects the range for motion within a ramp, by vfT/B: 6 mm at 20 m/s for
B = 500 MHz at 79 GHz. The phase ½(B/T)τ² of a chirp's echo is missing, which changes the range rate
by the share Bτ/Tf: 1.3e-3 at 60 m. Twice the duration doubles the first and halves the second.
"""


def samples_per_period(schedule: RampSchedule, times: SampleTimes) -> int:
    """Number of samples in a period of the code."""
    code = schedule.code
    assert code is not None
    return round(float(code.period[0]) * times.rate)


def _num_periods(schedule: RampSchedule, times: SampleTimes) -> int:
    return int(times.num_samples.min()) // samples_per_period(schedule, times)


def present_share(weight: FloatArray, schedule: RampSchedule, times: SampleTimes) -> FloatArray:
    """Mean weight over the periods at the place of each sample in the code, ``(ramp, fast)``."""
    size, periods = samples_per_period(schedule, times), _num_periods(schedule, times)
    whole = weight[:, : periods * size].reshape(-1, periods, size).mean(axis=1)
    repeats = -(-weight.shape[1] // size)
    return np.asarray(np.tile(whole, (1, repeats))[:, : weight.shape[1]])


def mean_of_periods(weight: FloatArray, schedule: RampSchedule, times: SampleTimes) -> FloatArray:
    """Mean weight of the samples ``(ramp, fast)`` that are added in a ramp, ``(ramp, 1)``."""
    size = samples_per_period(schedule, times) * _num_periods(schedule, times)
    return np.asarray(weight[:, :size].mean(axis=1, keepdims=True))


def _orders(size: int) -> FloatArray:
    """Numbers k of the coefficients that ``size`` samples hold."""
    return np.arange(-((size - 1) // 2), (size - 1) // 2 + 1.0)


def decoded_ramps(schedule: RampSchedule, times: SampleTimes) -> tuple[RampSchedule, SampleTimes]:
    """Ramps of the decoded frame, and the times of its samples.

    A ramp lies in the middle of the samples that were added.
    """
    code = schedule.code
    assert code is not None
    size = samples_per_period(schedule, times)
    order = _orders(size)
    interval = float(np.min(np.diff(schedule.start_time), initial=np.inf))
    duration = min(SWEEP_DURATION, 0.5 * interval)
    last = (_num_periods(schedule, times) * size - 1) / times.rate
    start = times.first + 0.5 * last - 0.5 * duration
    rate = (order.size - 1) / duration
    ramps = RampSchedule(
        start_time=start,
        duration=np.full(start.size, duration),
        start_frequency=schedule.start_frequency + order[0] / code.period,
        slope=rate / code.period,
        start_phase=np.zeros(start.size),
        sweep=schedule.sweep,
        transmit_weight=schedule.transmit_weight,
    )
    count = np.full(start.size, order.size, dtype=np.int64)
    return ramps, SampleTimes(first=start, num_samples=count, rate=rate)


def correlated(
    samples: ComplexArray,
    schedule: RampSchedule,
    times: SampleTimes,
    *,
    if_filter: IfFilter | None = None,
) -> ComplexArray:
    """The products :math:`D_k` of samples ``(…, ramp, fast)``, V ``(…, ramp, k)``.

    They are divided by the mean of :math:`H_k|C_k|^2`, with the taper over the band, so that a peak
    has the amplitude of the echo. Without an IF filter, :math:`H_k` is 1.
    """
    size, periods = samples_per_period(schedule, times), _num_periods(schedule, times)
    order = _orders(size)
    whole = samples[..., : periods * size]
    mean = whole.reshape(*whole.shape[:-1], periods, size).mean(axis=-2)
    spectrum = np.fft.fft(mean, axis=-1)[..., -order.astype(np.int64) % size] / size
    return np.asarray(spectrum * _weights(schedule, times, order, if_filter))


def added_time(schedule: RampSchedule, times: SampleTimes) -> float:
    """Time over which the samples of a sweep are added, s."""
    return _num_periods(schedule, times) * samples_per_period(schedule, times) / times.rate


def line_power(
    schedule: RampSchedule, times: SampleTimes, *, if_filter: IfFilter | None = None
) -> FloatArray:
    """Weight :math:`H_k|C_k|^2` of each ramp's lines over its tapered mean, ``(ramp, k)``."""
    lines = _lines(schedule, _orders(samples_per_period(schedule, times)), if_filter)
    return np.asarray(lines.response * np.abs(lines.coefficient) ** 2 / lines.mean)


def matched_share(
    schedule: RampSchedule, times: SampleTimes, *, if_filter: IfFilter | None = None
) -> float:
    r"""Greatest SNR of a decoded echo in a cell over its coherent SNR, without a taper over ramps.

    With the taper :math:`w_k` over the band, and lines of noise of the power :math:`H_k^2` of white
    noise, that of a ramp is

    .. math:: \frac{(\sum_k w_k H_k |C_k|^2)^2}{P \sum_k w_k^2 H_k^2 |C_k|^2}

    with the mean power P of the chips, times the share of the samples that are in whole periods. An
    echo has the same amplitude on all decoded ramps, so that their noise is added. The noise that
    sampling folds into the band is left out.
    """
    code = schedule.code
    assert code is not None
    size = samples_per_period(schedule, times)
    whole = _num_periods(schedule, times) * size / float(np.mean(times.num_samples))
    order = _orders(size)
    lines, along = _lines(schedule, order, if_filter), taper(order.size)
    noise = (lines.response * np.abs(lines.coefficient)) ** 2 @ along**2
    return float(whole / np.mean(noise / lines.mean[:, 0] ** 2) / code.mean_power)


class _Lines(NamedTuple):
    """Lines of each ramp's code, the IF filter's response to them, and their tapered mean."""

    coefficient: ComplexArray  # (ramp, k)
    response: FloatArray  # (ramp, k)
    mean: FloatArray  # (ramp, 1)


def _lines(schedule: RampSchedule, order: FloatArray, if_filter: IfFilter | None) -> _Lines:
    code = schedule.code
    assert code is not None
    coefficient = code_coefficients(code.value, order)[code.row]
    response = np.ones(coefficient.shape)
    if if_filter is not None:
        response[:] = if_filter.response(order / float(code.period[0]))
    mean = (response * np.abs(coefficient) ** 2) @ taper(order.size)
    return _Lines(coefficient, response, mean[:, None])


def _weights(
    schedule: RampSchedule, times: SampleTimes, order: FloatArray, if_filter: IfFilter | None
) -> ComplexArray:
    """Factors ``(ramp, k)``: the coefficients, at the code's phase where the samples begin."""
    code = schedule.code
    assert code is not None
    lines = _lines(schedule, order, if_filter)
    into = (times.first - schedule.start_time) / code.period
    turned = np.exp(2j * np.pi * into[:, None] * order)
    return np.asarray(lines.coefficient / lines.mean * turned)


def code_coefficients(chips: ComplexArray, order: FloatArray) -> ComplexArray:
    r"""Fourier coefficients ``(code, k)`` of codes ``(code, chip)`` that repeat.

    .. math:: C_k = \frac1L \sum_m v_m e^{-j2\pi km/L}\;
              \mathrm{sinc}\!\left(\frac kL\right) e^{-j\pi k/L}

    >>> code_coefficients(np.array([[1.0, -1.0]]), np.array([0.0, 1.0])).round(3)
    array([[0.+0.j   , 0.-0.637j]])
    """
    length = chips.shape[1]
    spectrum = np.fft.fft(chips, axis=1)[:, order.astype(np.int64) % length] / length
    shape = np.sinc(order / length) * np.exp(-1j * np.pi * order / length)
    return np.asarray(spectrum * shape)
