"""Whether what was found on every ramp moves like one point, and is on ramps of both slopes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT

GREATEST_ACCELERATION = 60.0
"""m/s², of a distance: at 3.3 m from a body that passes at 14 m/s, v²/R."""

LEAST_COHERENCE = 0.4
"""Asked of a point's many ramps (`least_coherence`). Of 4000 drawn each: noise stays below 0.19;
one point, whatever beats leave open, above 0.88; a pair of two echoes' ramps has a median of 0.26
with equal slopes (8 % above 0.4, 17 % above 0.35) and 0.21 with diverse ones (1 % above 0.4)."""

MOST_COHERENCE = 0.6
"""Asked of few ramps: points that are 2 dB above the noise on every ramp have it."""

CHANCE = 1e-3
"""Probability that what has any amplitude on every ramp coheres by chance."""

MOST_OF_A_HALF = 0.15
"""Asked of the weaker half of a point's ramps (`coherence_of_halves`) where they are many. Of 600
targets found, ten points or bodies a frame, the least had 0.17 and 99 % had 0.3; arms have less
than 0.01, and more only where they meet something on the other half."""

FALSE_REJECTIONS = 1e-3
"""Probability that noise takes a point of the least coherence for one on half of its ramps."""


def coherence(amplitude: ComplexArray, frequency: FloatArray, elapsed: FloatArray) -> FloatArray:
    r"""Share of a point's power that adds up in phase over all ramps, ``(point,)``, 0 … 1.

    .. math:: \max_{\delta v, \delta a} \frac{\left\|\sum_k a_k\,
              e^{-j4\pi f_k(\delta v\,t_k + \delta a\,t_k^2/2)/c}\right\|^2}{K\sum_k \|a_k\|^2}

    Beats fix speed only to a few cm/s; phases must agree once speed and acceleration are corrected
    within that. A false pair (the up-beat of one echo with the down-beat of another) has two
    phase histories: about a quarter of its power adds up, more where they happen to agree.

    Parameters
    ----------
    amplitude : ``(point, channel, ramp)``, relative to the point's own motion
    frequency : Hz, mean on each ramp, ``(ramp,)``
    elapsed : s, middle of each ramp, ``(ramp,)``
    """
    return straightened(amplitude, frequency, elapsed)[0]


def straightened(
    amplitude: ComplexArray, frequency: FloatArray, elapsed: FloatArray
) -> tuple[FloatArray, ComplexArray]:
    """`coherence`, and the amplitudes with the correction at which most adds up taken back.

    ``(point,)`` and ``(point, channel, ramp)``, the latter of power 1/K; parameters as of
    `coherence`.
    """
    turns = _turns(frequency.tobytes(), elapsed.tobytes())
    power = elapsed.size * np.sum(np.abs(amplitude) ** 2, axis=(1, 2))
    # single precision, hence the points' own scale
    scaled = amplitude / np.sqrt(np.maximum(power, 1e-300))[:, None, None]
    added = _added(scaled, turns)
    best = np.argmax(added, axis=1)
    share = np.take_along_axis(added, best[:, None], axis=1)[:, 0].astype(np.float64)
    return share, scaled * turns[best, None]


def least_coherence(frequency: FloatArray, elapsed: FloatArray) -> float:
    r"""What is asked of the `coherence` of a point on these ramps.

    Bursts of another radar come from one direction, so that all channels say the same. If their
    amplitudes are Gaussian, with any phase on every one of K ramps, one correction finds a
    coherence above C in them with the probability :math:`(1 - C)^{K-1}`, a beta distribution's
    tail, and N corrections with no more than N times that: at `CHANCE`, 0.59 for 16 ramps of
    1.5 ms. For 32 that is less than `LEAST_COHERENCE`, which is asked then.

    >>> ramps = np.arange(16)
    >>> round(least_coherence(np.full(16, 79e9), 1.5e-3 * ramps), 2)
    0.59
    """
    rate, acceleration = _steps(frequency, elapsed)
    by_chance = (CHANCE / (rate.size * acceleration.size)) ** (1.0 / max(elapsed.size - 1, 1))
    return float(np.clip(1.0 - by_chance, LEAST_COHERENCE, MOST_COHERENCE))


def best_corrections(
    amplitude: ComplexArray, frequency: FloatArray, elapsed: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The δv and δa, m/s and m/s² about the middle of the frame, at which most adds up.

    ``(point,)`` each; parameters as of `coherence`.
    """
    turns = _turns(frequency.tobytes(), elapsed.tobytes())
    scale = np.max(np.abs(amplitude), axis=(1, 2), initial=1e-300)
    best = np.argmax(_added(amplitude / scale[:, None, None], turns), axis=1)
    rate, acceleration = _steps(frequency, elapsed)
    return rate[best // acceleration.size], acceleration[best % acceleration.size]


def coherence_of_halves(
    straight: ComplexArray, *, slope: FloatArray, present: FloatArray
) -> FloatArray:
    r"""Coherence that the up-ramps and the down-ramps would each give alone: ``(point, 2)``.

    .. math:: B_h = \frac{\left\|\sum_{k \in h} w_k\,a_k e^{-j\varphi_k}\right\|^2}
              {\left(\sum_{k \in h} w_k\right)^2} \Bigg/
              \frac{\sum_k w_k \|a_k\|^2}{\sum_k w_k}

    with the phases φ of the correction at which most of all ramps adds up: the square of the mean
    amplitude on a half over the mean power on all. A point has nearly its `coherence` in both.
    What lies beyond the map leaves its up-beats at other ranges and speeds in it, an arm: all
    up-ramps in phase are a coherence of one half, with the other half near 0.

    Parameters
    ----------
    straight : :math:`a_k e^{-j\varphi_k}`, ``(point, channel, ramp)``, as of `straightened`
    slope : Hz/s, of each ramp, ``(ramp,)``: its sign tells the halves
    present : w, share of each ramp that was heard, ``(ramp,)``; a half without any counts as whole
    """
    power = np.sum(np.abs(straight) ** 2, axis=1) @ present / max(float(present.sum()), 1e-300)
    share = np.ones((len(straight), 2))
    for n, is_in in enumerate((slope > 0, slope < 0)):
        weight = present * is_in
        if np.any(weight > 0):
            mean = straight @ (weight / weight.sum())
            share[:, n] = np.sum(np.abs(mean) ** 2, axis=1) / np.maximum(power, 1e-300)
    return share


def is_on_both_halves(
    straight: ComplexArray, *, slope: FloatArray, present: FloatArray
) -> BoolArray:
    """Points that are on the up-ramps and on the down-ramps, ``(point,)``.

    Parameters as of `coherence_of_halves`. Ramps of one direction only have no second half, and
    nothing is asked of them.
    """
    halves = coherence_of_halves(straight, slope=slope, present=present)
    least = [
        least_of_half(num_ramps=round(float(present[is_in].sum())), channels=straight.shape[1])
        for is_in in (slope > 0, slope < 0)
    ]
    return np.asarray(np.all(halves >= np.array(least), axis=1))


@lru_cache(maxsize=256)
def least_of_half(*, num_ramps: int, channels: int) -> float:
    r"""What a half of so many ramps must have: `MOST_OF_A_HALF`, or what noise allows.

    A point of amplitude A per channel in noise of σ² has the coherence
    :math:`C = A^2/(A^2 + \sigma^2)`, and on H ramps and M channels

    .. math:: \frac{2HM}{1 - C}\,B \sim \chi'^2_{2M}\!\left(\frac{2HMC}{1 - C}\right)

    (Kay 1998, §2.2.3, of the sum of 2M squared Gaussian means of variance σ²/2H, the power in the
    denominator taken as its mean). Asked is the quantile of half of `FALSE_REJECTIONS`, there being
    two halves, at the least coherence: stronger points are lost far more seldom.

    >>> round(least_of_half(num_ramps=16, channels=4), 3)
    0.15
    >>> least_of_half(num_ramps=4, channels=4) < 0.12
    True
    """
    from scipy.stats import ncx2

    scale = 2.0 * max(num_ramps, 1) * channels / (1.0 - LEAST_COHERENCE)
    quantile = ncx2.ppf(0.5 * FALSE_REJECTIONS, 2 * channels, scale * LEAST_COHERENCE) / scale
    return float(min(MOST_OF_A_HALF, quantile))


def _added(amplitude: ComplexArray, turns: NDArray[np.complex64]) -> NDArray[np.float32]:
    """Power that adds up at every correction, all channels together: ``(point, correction)``."""
    points, channels, ramps = amplitude.shape
    total = amplitude.astype(np.complex64).reshape(-1, ramps) @ turns.T
    power = total.real**2 + total.imag**2
    return np.asarray(power.reshape(points, channels, len(turns)).sum(axis=1), dtype=np.float32)


@lru_cache(maxsize=4)
def _turns(frequencies: bytes, times: bytes) -> NDArray[np.complex64]:
    """The corrections that are tried, ``(correction, ramp)``: the same for all of a frame."""
    frequency, elapsed = np.frombuffer(frequencies), np.frombuffer(times)
    return turns_back(*_steps(frequency, elapsed), frequency=frequency, elapsed=elapsed)


def turns_back(
    rate: FloatArray, acceleration: FloatArray, *, frequency: FloatArray, elapsed: FloatArray
) -> NDArray[np.complex64]:
    """What takes every rate with every acceleration back, ``(rate × acceleration, ramp)``.

    m/s and m/s² about the middle of the ramps, the accelerations of one rate side by side.
    """
    centred = elapsed - float(np.mean(elapsed))
    scale = -4j * np.pi * frequency / SPEED_OF_LIGHT
    first = np.exp(scale * rate[:, None] * centred).astype(np.complex64)
    second = np.exp(scale * 0.5 * acceleration[:, None] * centred**2).astype(np.complex64)
    return np.asarray((first[:, None] * second).reshape(-1, elapsed.size))


def _steps(frequency: FloatArray, elapsed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rates and accelerations that are tried, m/s and m/s².

    Steps of a third of a cycle at the frame's ends, over the ranges that beats leave open.
    """
    span = float(np.ptp(elapsed)) or 1.0
    wavelength = SPEED_OF_LIGHT / float(np.mean(frequency))
    step = wavelength / (1.5 * span**2)
    count = int(np.ceil(GREATEST_ACCELERATION / step))
    rate = wavelength / (6.0 * span) * np.arange(-12.0, 13.0)
    return rate, step * np.arange(-count, count + 1, dtype=np.float64)
