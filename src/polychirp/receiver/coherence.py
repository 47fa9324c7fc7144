"""Whether what was found on every ramp moves like one point."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT

GREATEST_ACCELERATION = 40.0
"""m/s², of a distance: at 3 m from a body that passes at 11 m/s, v²/R."""


def coherence(amplitude: ComplexArray, frequency: FloatArray, elapsed: FloatArray) -> FloatArray:
    r"""Share of a point's power that adds up in phase over all ramps, ``(point,)``, 0 … 1.

    .. math:: \max_{\delta v, \delta a} \frac{\left\|\sum_k a_k\,
              e^{-j4\pi f_k(\delta v\,t_k + \delta a\,t_k^2/2)/c}\right\|^2}{K\sum_k \|a_k\|^2}

    Beats fix speed only to a few cm/s; phases must agree once speed and acceleration are corrected
    within that. A false pair (the up-beat of one echo with the down-beat of another) has two
    phase histories: a quarter of its power at most adds up, a little more by the search.

    Parameters
    ----------
    amplitude : ``(point, channel, ramp)``, relative to the point's own motion
    frequency : Hz, mean on each ramp, ``(ramp,)``
    elapsed : s, middle of each ramp, ``(ramp,)``
    """
    turns = _turns(frequency.tobytes(), elapsed.tobytes())
    total = np.abs(amplitude @ turns.T) ** 2
    power = elapsed.size * np.sum(np.abs(amplitude) ** 2, axis=(1, 2))
    return np.asarray(total.sum(axis=1).max(axis=1) / np.maximum(power, 1e-300))


@lru_cache(maxsize=4)
def _turns(frequencies: bytes, times: bytes) -> ComplexArray:
    """The corrections that are tried, ``(correction, ramp)``: the same for all of a frame."""
    frequency, elapsed = np.frombuffer(frequencies), np.frombuffer(times)
    span = float(np.ptp(elapsed)) or 1.0
    centred = elapsed - float(np.mean(elapsed))
    wavelength = SPEED_OF_LIGHT / float(np.mean(frequency))
    # steps of a third of a cycle at the frame's ends; ranges of what beats leave open
    rate = np.arange(-12, 13) * wavelength / (6.0 * span)
    step = wavelength / (1.5 * span**2)
    count = int(np.ceil(GREATEST_ACCELERATION / step))
    acceleration = step * np.arange(-count, count + 1)
    way = rate[:, None, None] * centred + 0.5 * acceleration[:, None] * centred**2
    return np.asarray(
        np.exp(-4j * np.pi * frequency / SPEED_OF_LIGHT * way).reshape(-1, elapsed.size)
    )
