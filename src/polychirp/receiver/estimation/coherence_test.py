"""Tests that a candidate moves like one point over the frame, on ramps of both slopes."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT

GREATEST_ACCELERATION = 60.0
"""Greatest second derivative of range that the test compensates, m/s²; chosen: v²/R = 60 m/s² for a
body that passes at v = 14 m/s and a distance of R = 3.3 m."""

LEAST_COHERENCE = 0.4
"""Coherence that a point on many ramps needs (`least_coherence`); chosen from 4000 random draws of
each case. Noise stays below 0.19. One point stays above 0.88 with any error of speed that its
beats permit. False pairs (up-beat of one echo, down-beat of another) have a median of 0.26 if the
slopes of all ramps are equal in magnitude (8 % exceed 0.4, 17 % exceed 0.35), and of 0.21 if the
magnitudes differ (1 % exceed 0.4)."""

MOST_COHERENCE = 0.6
"""Upper limit of the threshold of `least_coherence`, which rises as the ramps become fewer; chosen:
a point 2 dB above the noise of its ramps has this coherence."""

CHANCE_COHERENCE_PROBABILITY = 1e-3
"""Greatest probability with which amplitudes that are random from ramp to ramp exceed the threshold
`least_coherence`; chosen."""

HIGHEST_HALF_THRESHOLD = 0.15
"""Greatest threshold for each half, up-ramps and down-ramps (`half_threshold`); chosen from 600
detected targets in frames of ten points or bodies. In the weaker half, the least coherence of a
target was 0.17, and 99 % had at least 0.3. Cross-pairing ridges have less than 0.01 in the half
that they are not from, unless an echo of that half lies in the same cell."""

FALSE_REJECTION_PROBABILITY = 1e-3
"""Probability with which noise makes a point of coherence `LEAST_COHERENCE` fail the test
`is_on_both_slopes`; chosen."""


def coherence(amplitude: ComplexArray, frequency: FloatArray, elapsed: FloatArray) -> FloatArray:
    r"""Share of a point's power that adds up in phase over all ramps, ``(point,)``, 0 … 1.

    .. math:: \max_{\delta v, \delta a} \frac{\left\|\sum_k a_k\,
              e^{-j4\pi f_k(\delta v\,t_k + \delta a\,t_k^2/2)/c}\right\|^2}{K\sum_k \|a_k\|^2}

    Beat frequencies give the speed to a few cm/s only. For one point, some correction of speed and
    acceleration within that uncertainty brings the phases of all K ramps to agree. A false pair
    (the up-beat of one echo with the down-beat of another) has two phase histories: no correction
    fits both, and about a quarter of its power adds up.

    Parameters
    ----------
    amplitude : ``(point, channel, ramp)``, with the phase of the point's estimated motion removed
    frequency : Hz, mean transmitted frequency of each ramp, ``(ramp,)``
    elapsed : s, middle of each ramp, ``(ramp,)``
    """
    return aligned(amplitude, frequency, elapsed).coherence


class Alignment(NamedTuple):
    """Coherence ``(point,)``, and amplitudes brought in phase, ``(point, channel, ramp)``."""

    coherence: FloatArray
    amplitude: ComplexArray


def aligned(amplitude: ComplexArray, frequency: FloatArray, elapsed: FloatArray) -> Alignment:
    """`coherence`, and the amplitudes after the correction with which most power adds up.

    The amplitudes are scaled: those of a point, over all channels and ramps, have the total power
    1/K. Parameters as of `coherence`.
    """
    phasors = _tried_phasors(frequency.tobytes(), elapsed.tobytes())
    power = elapsed.size * np.sum(np.abs(amplitude) ** 2, axis=(1, 2))
    # scaled to the same power for every point, as the sums are in single precision
    scaled = amplitude / np.sqrt(np.maximum(power, 1e-300))[:, None, None]
    in_phase = _power_in_phase(scaled, phasors)
    best = np.argmax(in_phase, axis=1)
    share = np.take_along_axis(in_phase, best[:, None], axis=1)[:, 0].astype(np.float64)
    return Alignment(share, scaled * phasors[best, None])


def least_coherence(frequency: FloatArray, elapsed: FloatArray) -> float:
    r"""Threshold on the `coherence` of a point on these ramps.

    The threshold rejects bursts of another radar. They come from one direction, so that more
    channels do not lower their coherence. If their amplitudes are complex Gaussian, independent on
    each of K ramps, one correction gives a coherence above C with the probability
    :math:`(1 - C)^{K-1}` (tail of a beta distribution), and the best of N corrections with N times
    that at most. At `CHANCE_COHERENCE_PROBABILITY`, C is 0.59 for 16 ramps of 1.5 ms. For
    32 it would be less than `LEAST_COHERENCE`, which is then the threshold.

    >>> ramps = np.arange(16)
    >>> round(least_coherence(np.full(16, 79e9), 1.5e-3 * ramps), 2)
    0.59
    """
    rate, acceleration = _tried_corrections(frequency, elapsed)
    by_chance = (CHANCE_COHERENCE_PROBABILITY / (rate.size * acceleration.size)) ** (
        1.0 / max(elapsed.size - 1, 1)
    )
    return float(np.clip(1.0 - by_chance, LEAST_COHERENCE, MOST_COHERENCE))


def best_corrections(
    amplitude: ComplexArray, frequency: FloatArray, elapsed: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Corrections δv, m/s, at the frame's middle, and δa, m/s², with which most power adds up.

    ``(point,)`` each; parameters as of `coherence`.
    """
    phasors = _tried_phasors(frequency.tobytes(), elapsed.tobytes())
    scale = np.max(np.abs(amplitude), axis=(1, 2), initial=1e-300)
    best = np.argmax(_power_in_phase(amplitude / scale[:, None, None], phasors), axis=1)
    rate, acceleration = _tried_corrections(frequency, elapsed)
    return rate[best // acceleration.size], acceleration[best % acceleration.size]


def coherence_of_halves(
    straight: ComplexArray, *, slope: FloatArray, present: FloatArray
) -> FloatArray:
    r"""Coherence of the up-ramps and of the down-ramps, each alone: ``(point, 2)``.

    .. math:: B_h = \frac{\left\|\sum_{k \in h} w_k\,a_k e^{-j\varphi_k}\right\|^2}
              {\left(\sum_{k \in h} w_k\right)^2} \Bigg/
              \frac{\sum_k w_k \|a_k\|^2}{\sum_k w_k}

    It is the squared magnitude of the mean amplitude on half h, divided by the mean power on all
    ramps; φ are the phases of the correction with which most power of all ramps adds up. A point
    has nearly its `coherence` on both halves. A target beyond the map may leave a cross-pairing
    ridge: its up-beats alone, say, appear in the map at other ranges and speeds. The ridge has a
    high coherence on that half, and one near 0 on the other half.

    Parameters
    ----------
    straight : :math:`a_k e^{-j\varphi_k}`, ``(point, channel, ramp)``, from `aligned`
    slope : Hz/s, of each ramp, ``(ramp,)``; its sign separates the halves
    present : w, share of each ramp that is present after mitigation, ``(ramp,)``; a half without
        any has the coherence 1
    """
    power = np.sum(np.abs(straight) ** 2, axis=1) @ present / max(float(present.sum()), 1e-300)
    share = np.ones((len(straight), 2))
    for n, is_in in enumerate((slope > 0, slope < 0)):
        weight = present * is_in
        if np.any(weight > 0):
            mean = straight @ (weight / weight.sum())
            share[:, n] = np.sum(np.abs(mean) ** 2, axis=1) / np.maximum(power, 1e-300)
    return share


def is_on_both_slopes(
    straight: ComplexArray, *, slope: FloatArray, present: FloatArray
) -> BoolArray:
    """Mask of the points that are coherent on up-ramps and on down-ramps, ``(point,)``.

    Parameters as of `coherence_of_halves`. All points pass the test of a half without ramps.
    """
    halves = coherence_of_halves(straight, slope=slope, present=present)
    least = [
        half_threshold(num_ramps=round(float(present[is_in].sum())), channels=straight.shape[1])
        for is_in in (slope > 0, slope < 0)
    ]
    return np.asarray(np.all(halves >= np.array(least), axis=1))


@lru_cache(maxsize=256)
def half_threshold(*, num_ramps: int, channels: int) -> float:
    r"""Threshold for a half of ``num_ramps``: `HIGHEST_HALF_THRESHOLD`, or less for few ramps.

    A point of amplitude A per channel in noise of σ² has the coherence
    :math:`C = A^2/(A^2 + \sigma^2)`, and on H ramps and M channels

    .. math:: \frac{2HM}{1 - C}\,B \sim \chi'^2_{2M}\!\left(\frac{2HMC}{1 - C}\right)

    (Kay 1998, §2.2.3, of the sum of 2M squared Gaussian means of variance σ²/2H; the power in the
    denominator is replaced by its mean). The threshold is the quantile of
    `FALSE_REJECTION_PROBABILITY`/2, for two halves, at the least coherence: stronger points are
    rejected far less often.

    >>> round(half_threshold(num_ramps=16, channels=4), 3)
    0.15
    >>> half_threshold(num_ramps=4, channels=4) < 0.12
    True
    """
    from scipy.special import chndtrix

    scale = 2.0 * max(num_ramps, 1) * channels / (1.0 - LEAST_COHERENCE)
    chance = 0.5 * FALSE_REJECTION_PROBABILITY
    quantile = chndtrix(chance, 2 * channels, scale * LEAST_COHERENCE) / scale
    return float(min(HIGHEST_HALF_THRESHOLD, quantile))


def _power_in_phase(amplitude: ComplexArray, phasors: NDArray[np.complex64]) -> NDArray[np.float32]:
    """Power that adds up in phase with every correction, all channels: ``(point, correction)``."""
    points, channels, ramps = amplitude.shape
    total = amplitude.astype(np.complex64).reshape(-1, ramps) @ phasors.T
    power = total.real**2 + total.imag**2
    return np.asarray(power.reshape(points, channels, len(phasors)).sum(axis=1), dtype=np.float32)


@lru_cache(maxsize=4)
def _tried_phasors(frequencies: bytes, times: bytes) -> NDArray[np.complex64]:
    """Phasors of all corrections, ``(correction, ramp)``; bytes can be keys of the cache."""
    frequency, elapsed = np.frombuffer(frequencies), np.frombuffer(times)
    return correction_phasors(
        *_tried_corrections(frequency, elapsed), frequency=frequency, elapsed=elapsed
    )


def correction_phasors(
    rate: FloatArray, acceleration: FloatArray, *, frequency: FloatArray, elapsed: FloatArray
) -> NDArray[np.complex64]:
    """Phasors that compensate every rate with every acceleration, ``(rate × acceleration, ramp)``.

    The rates, m/s, are those at the mean time of the ramps; accelerations are in m/s². In the rows
    of the result, the acceleration varies fastest.
    """
    centred = elapsed - float(np.mean(elapsed))
    scale = -4j * np.pi * frequency / SPEED_OF_LIGHT
    first = np.exp(scale * rate[:, None] * centred).astype(np.complex64)
    second = np.exp(scale * 0.5 * acceleration[:, None] * centred**2).astype(np.complex64)
    return np.asarray((first[:, None] * second).reshape(-1, elapsed.size))


def _tried_corrections(frequency: FloatArray, elapsed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rates, m/s, and accelerations, m/s², of all corrections.

    A step of either changes the phase by a sixth of a cycle at the ends of the frame, relative to
    its middle. Rates reach ±2 wavelengths per frame, accelerations ±`GREATEST_ACCELERATION`.
    """
    span = float(np.ptp(elapsed)) or 1.0
    wavelength = SPEED_OF_LIGHT / float(np.mean(frequency))
    step = wavelength / (1.5 * span**2)
    count = int(np.ceil(GREATEST_ACCELERATION / step))
    rate = wavelength / (6.0 * span) * np.arange(-12.0, 13.0)
    return rate, step * np.arange(-count, count + 1, dtype=np.float64)
