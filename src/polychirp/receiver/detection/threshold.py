"""Thresholds for a given false-alarm probability, and the paper's threshold, the mean."""

import math
from functools import lru_cache

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError


def mean_threshold(profile: FloatArray) -> float:
    r"""The paper's threshold (eq. 12): the mean of the profile.

    On noise alone a Rayleigh amplitude exceeds its mean with probability
    :math:`e^{-\pi/4} = 45.6\,\%`, an exponential power with :math:`1/e = 36.8\,\%`: more than
    a third of all noise cells exceed it. This threshold is for comparison only.
    """
    return float(np.mean(profile))


@lru_cache(maxsize=256)
def log_mean_threshold(*, num_ramps: int, false_alarm_probability: float) -> float:
    r"""Threshold on the mean over ramps of ln(power), relative to ln of the noise power σ².

    The statistic :math:`S = \tfrac1K\sum_k \ln |X_k|^2` of K independent cells of noise has
    the cumulant generating function :math:`\kappa(s) = K \ln\Gamma(1 + s/K)`; its tail is taken
    from the saddle-point formula of Lugannani and Rice (1980), whose probability is accurate to a
    fraction of a per cent at any level. The noise level only shifts S, so that a threshold above
    the S of neighbouring cells gives a constant false-alarm rate.

    Raises
    ------
    InputError
        The probability is not between 0 and 0.4; the search needs a threshold above S's mean.

    Examples
    --------
    >>> round(log_mean_threshold(num_ramps=1, false_alarm_probability=1e-3), 2)  # ln(ln 1000)
    1.93
    """
    if not 0.0 < false_alarm_probability < 0.4:
        raise InputError(
            f"a false-alarm probability of {false_alarm_probability:g} has no threshold; take one "
            "between 0 and 0.4"
        )
    low, high = log_mean_of_noise() + 1e-6, 8.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        if _tail(middle, num_ramps) > false_alarm_probability:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def log_mean_of_noise() -> float:
    """Mean of ln(power) of complex Gaussian noise of unit power: −γ, γ Euler's constant."""
    return -float(np.euler_gamma)


def log_median_of_noise(num_ramps: int) -> float:
    r"""Median of the mean over ramps of ln(power) of complex Gaussian noise of unit power.

    .. math:: -\gamma - \frac{\kappa_3}{6\kappa_2 K} = -\gamma + \frac{2\zeta(3)}{\pi^2 K}

    This is the first term of the expansion of Cornish and Fisher; :math:`\kappa_2 = \pi^2/6` and
    :math:`\kappa_3 = -2\zeta(3)` are cumulants of the ln of an exponential variable.
    """
    zeta_3 = 1.2020569031595942
    return log_mean_of_noise() + 2.0 * zeta_3 / (math.pi**2 * num_ramps)


def log_threshold_above_floor(
    *, num_ramps: int, false_alarm_probability: float, covariance: float, variance: float
) -> float:
    r"""Threshold on S − F: S as in `log_mean_threshold`, F a floor, the median of S over cells.

    The floor is correlated with the cell's S: F = C S + ε, with an independent ε of zero mean
    and variance :math:`s^2 = (V - C^2)\,\mathrm{var}\,S`. S exceeds its mean by more than x with
    the probability :math:`Q(x) \approx p\,e^{-\lambda(x - x_0) - \kappa(x - x_0)^2/2}` near
    :math:`x_0`, the threshold for a known floor. Then the threshold on S − F, above its mean,

    .. math:: (1 - C)\,x + \epsilon = (1 - C) \left(x_0
              + \frac{(\lambda^2 - \kappa)\,s^2}{2\lambda\,(1 - C)^2}\right)

    is exceeded with the false-alarm probability p, to first order in s².

    Parameters
    ----------
    covariance, variance : C and V of `polychirp.receiver.detection.floor_correlation`; zero for a
        known floor

    Examples
    --------
    >>> ask = {"num_ramps": 32, "false_alarm_probability": 1e-4}
    >>> round(log_threshold_above_floor(**ask, covariance=0.0, variance=0.0), 2)
    0.75
    >>> round(log_threshold_above_floor(**ask, covariance=0.02, variance=0.02), 2)
    0.74
    """
    level = log_mean_threshold(num_ramps=num_ramps, false_alarm_probability=false_alarm_probability)
    slope, bend = _decay(level, num_ramps)
    spread = (variance - covariance**2) * math.pi**2 / (6.0 * num_ramps)
    wider = (slope**2 - bend) * spread / (2.0 * slope * (1.0 - covariance) ** 2)
    above_mean = (1.0 - covariance) * (level - log_mean_of_noise() + wider)
    return above_mean + log_mean_of_noise() - log_median_of_noise(num_ramps)


@lru_cache(maxsize=256)
def _decay(level: float, num_ramps: int) -> tuple[float, float]:
    """First and second derivatives of −ln P(S > level) by ``level``: λ and κ, by differences."""
    step = 0.1 / math.sqrt(num_ramps)
    low, middle, high = (-math.log(_tail(level + n * step, num_ramps)) for n in (-1, 0, 1))
    return (high - low) / (2.0 * step), (high - 2.0 * middle + low) / step**2


def _tail(level: float, num_ramps: int) -> float:
    """P(S > level) for noise of unit power, by the formula of Lugannani and Rice."""
    from scipy.special import digamma, gammaln, ndtr, polygamma

    low, high = 0.0, math.exp(level) + 2.0  # digamma(1 + u) = level at a u < e^level + 1
    for _ in range(80):
        middle = 0.5 * (low + high)
        if digamma(1.0 + middle) < level:
            low = middle
        else:
            high = middle
    u = 0.5 * (low + high)
    exponent = num_ramps * (u * level - float(gammaln(1.0 + u)))
    w = math.sqrt(max(2.0 * exponent, 0.0))
    v = u * math.sqrt(num_ramps * float(polygamma(1, 1.0 + u)))
    if w < 1e-4:  # at the mean the formula is ∞ − ∞
        return 0.5
    density = math.exp(-0.5 * w * w) / math.sqrt(2.0 * math.pi)
    return float(ndtr(-w)) + density * (1.0 / v - 1.0 / w)
