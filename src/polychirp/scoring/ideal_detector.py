r"""The ideal detector of a steady point in white Gaussian noise, with which receivers are compared.

It knows where the point is, adds the samples of each of M channels in phase, and compares the sum
of the channels' powers, over the noise power of a sample, with a threshold τ. With the coherent SNR
S, the point's energy in all samples of all channels over the noise power of a sample, the statistic
is half a :math:`\chi^2_{2M}(2S)` variable, so that

.. math:: P_d = P\{\chi^2_{2M}(2S) > 2\tau\} = Q_M(\sqrt{2S}, \sqrt{2\tau}), \qquad
          P_{fa} = e^{-\tau}\sum_{m<M}\frac{\tau^m}{m!}

with Marcum's function of order M (Marcum 1960; Swerling's case 0, in which the point's amplitude
does not change).
"""

import numpy as np
from numpy.typing import ArrayLike

from polychirp.axes import FloatArray


def ideal_detection(snr: ArrayLike, *, num_channels: int, threshold: float) -> FloatArray:
    """Detection probability at the coherent SNR ``snr`` (ratio), of its shape.

    Parameters
    ----------
    num_channels : M, number of channels whose powers are added
    threshold : τ, in noise powers of a sample

    Examples
    --------
    >>> threshold = cell_threshold(1e-6, num_channels=1)
    >>> round(float(ideal_detection(10.0 ** 1.32, num_channels=1, threshold=threshold)), 2)
    0.9
    """
    from scipy.special import chndtr

    energy = np.asarray(snr, dtype=np.float64)
    return np.asarray(1.0 - chndtr(2.0 * threshold, 2.0 * num_channels, 2.0 * energy))


def cell_threshold(probability: float, *, num_channels: int) -> float:
    """Threshold τ that noise alone exceeds in one cell with this probability.

    >>> round(cell_threshold(1e-6, num_channels=1), 2)  # ln 10⁶
    13.82
    """
    from scipy.special import gammainccinv

    return float(gammainccinv(num_channels, probability))


def needed_snr(detection: float, *, num_channels: int, threshold: float) -> float:
    """Coherent SNR (ratio) at which the ideal detector has this detection probability.

    >>> threshold = cell_threshold(1e-6, num_channels=4)
    >>> snr = needed_snr(0.5, num_channels=4, threshold=threshold)
    >>> round(float(ideal_detection(snr, num_channels=4, threshold=threshold)), 6)
    0.5
    """
    from scipy.optimize import brentq

    def excess(snr: float) -> float:
        found = ideal_detection(snr, num_channels=num_channels, threshold=threshold)
        return float(found) - detection

    return float(brentq(excess, 0.0, 4.0 * threshold + 100.0))
