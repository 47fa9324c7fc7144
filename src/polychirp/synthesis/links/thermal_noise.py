"""Thermal noise behind the IF filter, at the converter."""

import math

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import BOLTZMANN, REFERENCE_TEMPERATURE
from polychirp.model.if_filter import IfFilter, gauss_panels
from polychirp.model.if_frame import SampleTimes
from polychirp.model.radar import Radar


def noise_density(radar: Radar) -> float:
    r"""W/Hz before the IF filter: :math:`k T_0 F G_{fr}`, on both sides of zero.

    >>> from polychirp.model.radar import Radar
    >>> level = noise_density(Radar(name="r", noise_figure=2.0, receive_gain=100.0))
    >>> round(level / 1e-19, 2)
    8.01
    """
    return BOLTZMANN * REFERENCE_TEMPERATURE * radar.noise_figure * radar.receive_gain


def thermal_noise(radar: Radar, times: SampleTimes, generator: np.random.Generator) -> ComplexArray:
    r"""Noise, V, ``(channel, ramp, fast)``: independent channels and ramps, zero in the padding.

    Its power is :math:`k T_0 F G_{fr} B_n`; its autocovariance over samples is

    .. math:: r_m = k T_0 F G_{fr} \int h(s)\, h(s + m/f_s)\, ds

    whose spectrum is \|H\|² folded at the sample rate. r is zero beyond the filter's support, so
    a circulant longer than ramp and support together has it exactly (Davies & Harte 1987).
    """
    covariance = filter_covariance(radar.if_filter, times.rate)
    length = times.most_samples + covariance.size
    ring = np.zeros(length)
    ring[: covariance.size] = covariance
    ring[-covariance.size + 1 :] += covariance[:0:-1]
    # folded |H|² times the rate; rounding may leave −1e-16 in the stop band
    level = np.sqrt(noise_density(radar) * np.maximum(np.fft.fft(ring).real, 0.0) / length)
    shape = (radar.array.num_channels, times.num_samples.size, length)
    white = generator.standard_normal((*shape, 2)).view(np.complex128)[..., 0] / np.sqrt(2.0)
    noise = np.fft.fft(level * white)[..., : times.most_samples]
    return np.asarray(np.where(times.is_sample, noise, 0.0))


def filter_covariance(if_filter: IfFilter, rate: float) -> FloatArray:
    """∫h(s)h(s + m/rate) ds, 1/s, for lags m = 0, 1, … until it vanishes."""
    support = if_filter.support
    lag = np.arange(int(np.ceil(support * rate)) + 1) / rate
    # h² oscillates up to twice the stop band, and a panel takes two cycles
    node, weight = gauss_panels(math.ceil(2 * support * if_filter.stopband))
    overlap = np.maximum(support - lag, 0.0)
    first = -0.5 * support + 0.5 * overlap[:, None] * (node + 1.0)
    product = if_filter.impulse_response(first) * if_filter.impulse_response(first + lag[:, None])
    return np.asarray(0.5 * overlap * (product @ weight))
