"""Whether what was found on every ramp moves like one point."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT

GREATEST_ACCELERATION = 60.0
"""m/s², of a distance: at 3.3 m from a body that passes at 14 m/s, v²/R."""


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
    turns = _turns(frequency.tobytes(), elapsed.tobytes())
    power = elapsed.size * np.sum(np.abs(amplitude) ** 2, axis=(1, 2))
    # single precision, hence the points' own scale
    scaled = amplitude / np.sqrt(np.maximum(power, 1e-300))[:, None, None]
    return np.asarray(np.max(_added(scaled, turns), axis=1, initial=0.0), dtype=np.float64)


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
    rate, acceleration = _steps(frequency, elapsed)
    centred = elapsed - float(np.mean(elapsed))
    way = rate[:, None, None] * centred + 0.5 * acceleration[:, None] * centred**2
    turns = np.exp(-4j * np.pi * frequency / SPEED_OF_LIGHT * way).reshape(-1, elapsed.size)
    return np.asarray(turns, dtype=np.complex64)


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
