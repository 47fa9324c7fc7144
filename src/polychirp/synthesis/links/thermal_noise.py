"""Thermal noise after the IF filter, at the analogue-to-digital converter."""

import math

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import BOLTZMANN, REFERENCE_TEMPERATURE
from polychirp.model.if_filter import IfFilter, gauss_panels
from polychirp.model.if_frame import SampleTimes
from polychirp.model.radar import Radar


def noise_density(radar: Radar) -> float:
    r"""Noise density before the IF filter, W/Hz: :math:`k T_0 F G_{fr}`, at all frequencies.

    F is the noise figure and :math:`G_{fr}` the receive gain, both power ratios.

    >>> from polychirp.model.radar import Radar
    >>> level = noise_density(Radar(name="r", noise_figure=2.0, receive_gain=100.0))
    >>> round(level / 1e-19, 2)
    8.01
    """
    return BOLTZMANN * REFERENCE_TEMPERATURE * radar.noise_figure * radar.receive_gain


def thermal_noise(radar: Radar, times: SampleTimes, generator: np.random.Generator) -> ComplexArray:
    r"""Noise, V, ``(channel, ramp, fast)``, independent between channels and between ramps.

    It is zero where a ramp has no sample. Its power is :math:`k T_0 F G_{fr} B_n`, with the
    noise bandwidth :math:`B_n = \int h^2 ds`, and its autocovariance at a lag of m samples is

    .. math:: r_m = k T_0 F G_{fr} \int h(s)\, h(s + m/f_s)\, ds

    with h the filter's impulse response. r is zero beyond the duration of h, so that a circulant
    covariance matrix as long as ramp and r together has it exactly (Davies & Harte 1987).
    """
    covariance = filter_covariance(radar.if_filter, times.rate)
    length = times.most_samples + covariance.size
    ring = np.zeros(length)
    ring[: covariance.size] = covariance
    ring[-covariance.size + 1 :] += covariance[:0:-1]
    # the transform of the covariance is at least 0, but rounding may leave −1e-16 in the stop band
    level = np.sqrt(noise_density(radar) * np.maximum(np.fft.fft(ring).real, 0.0) / length)
    shape = (radar.array.num_channels, times.num_samples.size, length)
    white = generator.standard_normal((*shape, 2)).view(np.complex128)[..., 0] / np.sqrt(2.0)
    noise = np.fft.fft(level * white)[..., : times.most_samples]
    return np.asarray(np.where(times.is_sample, noise, 0.0))


def filter_covariance(if_filter: IfFilter, rate: float) -> FloatArray:
    """∫h(s)h(s + m/rate) ds, 1/s, for lags m = 0, 1, … up to the filter's support."""
    support = if_filter.support
    lag = np.arange(int(np.ceil(support * rate)) + 1) / rate
    # the product of two h has at most 2 · support · stop band cycles; each gets a panel
    node, weight = gauss_panels(math.ceil(2 * support * if_filter.stopband))
    overlap = np.maximum(support - lag, 0.0)
    first = -0.5 * support + 0.5 * overlap[:, None] * (node + 1.0)
    product = if_filter.impulse_response(first) * if_filter.impulse_response(first + lag[:, None])
    return np.asarray(0.5 * overlap * (product @ weight))
