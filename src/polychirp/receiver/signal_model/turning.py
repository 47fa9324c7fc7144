r"""Loss of samples that are added while a motion turns their phase.

A range rate v turns the phase of an echo at the frequency f by :math:`2 f v/c` cycles per second.
The mean of its samples over the time T has the share

.. math:: \mathrm{sinc}^2\!\left(\frac{2 f v}{c}\,T\right)

of the power of one sample.
"""

from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT

LEAST_TURNING: Final = 0.01
"""Least share of the power that `turning_loss` gives. Chosen: near its zeros, a power that is
divided by it would be made of noise."""


def turning_loss(range_rate: FloatArray, *, frequency: float, duration: float) -> FloatArray:
    """Power of the mean of samples over that of one sample, for range rates, m/s ``(…,)``.

    Parameters
    ----------
    frequency : Hz, of the carrier
    duration : s, over which samples are added

    Examples
    --------
    20 m/s at 79 GHz over 40 µs:

    >>> round(float(10 * np.log10(turning_loss(np.array(20.0), frequency=79e9, duration=40e-6))), 2)
    -2.71
    """
    cycles = 2.0 * frequency * range_rate / SPEED_OF_LIGHT * duration
    return np.asarray(np.maximum(np.sinc(cycles) ** 2, LEAST_TURNING))
