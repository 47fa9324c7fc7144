"""Estimates over many trials, each with a confidence interval.

Targets of one trial share street, waveform and interference, so that their detections are
correlated: **a trial counts as one draw**, however many targets it has. All functions take sums per
trial, ``(trial,)``, and are deterministic.
"""

import math
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Final, Self

import numpy as np

from polychirp.axes import FloatArray

CONFIDENCE_LEVEL: Final = 0.95
"""Default probability with which an interval contains the true value; 95 % is the convention."""

_ROUNDING: Final = 1e-12
"""Greatest influence of a trial, over the ratio itself, that is taken for an error of rounding."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A value and the limits of its confidence interval; NaN where data do not suffice.

    Examples
    --------
    >>> round(wilson(0.9, 100).low, 2)
    0.83
    """

    value: float
    low: float
    high: float

    @property
    def half_width(self) -> float:
        """Half of the distance between the limits."""
        return 0.5 * (self.high - self.low)

    def within(self, least: float, greatest: float) -> Self:
        """The same value, with the limits moved to where the true value can be.

        >>> Estimate(value=0.5, low=-4.1, high=3.6).within(-1.0, 1.0)
        Estimate(value=0.5, low=-1.0, high=1.0)
        """
        low, high = np.clip([self.low, self.high], least, greatest).tolist()
        return replace(self, low=low, high=high)


UNKNOWN_ESTIMATE: Final = Estimate(value=math.nan, low=math.nan, high=math.nan)


def wilson(share: float, number: float, *, level: float = CONFIDENCE_LEVEL) -> Estimate:
    r"""Interval of a probability from the ``share`` of ``number`` independent draws.

    .. math::

        \frac{\hat p + z^2/2n \pm z\sqrt{\hat p(1-\hat p)/n + z^2/4n^2}}{1 + z^2/n}

    Wilson, J. Am. Stat. Assoc. 22 (1927) 209. The interval stays within 0…1, and its width
    is positive even if no draw or every draw succeeds.

    >>> found = wilson(1.0, 20)
    >>> round(found.low, 3), found.high
    (0.839, 1.0)
    """
    if not number > 0:
        return UNKNOWN_ESTIMATE
    z = NormalDist().inv_cdf(0.5 + 0.5 * level)
    middle = share + z * z / (2 * number)
    reach = z * math.sqrt(share * (1 - share) / number + z * z / (4 * number * number))
    scale = 1 + z * z / number
    low, high = (middle - reach) / scale, (middle + reach) / scale
    return Estimate(
        value=share,
        low=0.0 if share == 0.0 else max(low, 0.0),
        high=1.0 if share == 1.0 else min(high, 1.0),
    )


def proportion(
    hits: FloatArray, counts: FloatArray, *, level: float = CONFIDENCE_LEVEL
) -> Estimate:
    r"""Probability of a hit, from ``hits`` of ``counts`` in every trial.

    Wilson's interval for the number n of independent draws with the same variance:
    :math:`n = \hat p(1-\hat p)/v`, with the variance between trials of a ratio of sums
    :math:`v = \frac{k}{k-1}\sum_i(h_i - \hat p m_i)^2/(\sum_i m_i)^2`, times :math:`(z/t_{k-1})^2`
    because :math:`v` itself is an estimate (Korn and Graubard, Survey Methodology 24 (1998) 193;
    Dean and Pagano, J. Surv. Stat. Methodol. 3 (2015) 484). A few misses do not show how misses
    cluster; therefore :math:`n` is computed with two more trials, one of hits and one of misses,
    each with a weight of a quarter. Before the factor of :math:`t`, :math:`n` is at most the total
    of ``counts``, and at least :math:`(\sum m_i)^2/\sum m_i^2`, the value for trials that hit or
    miss as a whole. It has this value if all or none are hits, as :math:`v` is then unknown.
    ``hits`` and ``counts`` are ``(trial,)``; trials without counts are left out.

    >>> targets = np.full(20, 5.0)
    >>> found = proportion(np.where(np.arange(20) < 16, 5.0, 0.0), targets)  # all five or none
    >>> found.value, round(found.low, 2), round(found.high, 2)
    (0.8, 0.57, 0.92)
    """
    hits, counts = hits[counts > 0], counts[counts > 0]
    if not counts.size:
        return UNKNOWN_ESTIMATE
    total = float(counts.sum())
    share = float(hits.sum()) / total
    if counts.max() == 1:
        return wilson(share, total, level=level)
    number = total**2 / float((counts**2).sum())
    if counts.size > 1:
        if 0.0 < share < 1.0:
            number = min(max(number, _independent_draws(hits, counts)), total)
        z = NormalDist().inv_cdf(0.5 + 0.5 * level)
        number *= (z / _student(level, counts.size - 1)) ** 2
    return wilson(share, number, level=level)


def _independent_draws(hits: FloatArray, counts: FloatArray) -> float:
    """Number n of independent draws with the variance of ``hits``, with the two added trials."""
    extra = _ADDED_TRIAL_SHARE * counts.mean()
    share = (hits.sum() + extra) / (counts.sum() + 2 * extra)
    weight = np.append(np.ones(counts.size), [_ADDED_TRIAL_SHARE, _ADDED_TRIAL_SHARE])
    size = np.append(counts, [counts.mean()] * 2)
    residual = np.append(hits, [counts.mean(), 0.0]) - share * size
    number = counts.size
    variance = number / (number - 1) * (weight @ residual**2) / (weight @ size) ** 2
    return float(share * (1 - share) / variance * number / weight.sum())


_ADDED_TRIAL_SHARE: Final = 0.25
"""Weight of each of the two added trials. Chosen: with it the 95 % intervals of probabilities of
0.02 to 0.98 contain the true value in at least 94 of 100 cases if there are 20 trials or more."""


def mean_count(counts: FloatArray, *, level: float = CONFIDENCE_LEVEL) -> Estimate:
    r"""Mean of a number per trial, such as ghosts in a frame.

    Garwood's interval (Biometrika 28 (1936) 437) of a Poisson number, for the total divided by the
    counts' dispersion (variance over mean) and multiplied by :math:`(z/t_{n-1})^2`. The variance is
    taken as at least :math:`1 - (\alpha/2)^{1/n}`: if counts differed in this share of the trials,
    n equal counts would occur with the probability α/2; but not above the mean, so that few single
    events have the interval of a Poisson number. Counts that are all zero are not scaled. The
    limits are NaN for a single trial with events, which does not show how these cluster: an
    interferer makes dozens of ghosts at once or none.

    >>> found = mean_count(np.zeros(100))
    >>> found.value, round(found.high, 3)
    (0.0, 0.037)
    """
    if not counts.size:
        return UNKNOWN_ESTIMATE
    mean, number, tail = float(counts.mean()), counts.size, 0.5 * (1 - level)
    draws = float(number)
    if number == 1 and mean > 0:
        return Estimate(value=mean, low=math.nan, high=math.nan)
    if mean > 0:
        least = 1 - tail ** (1 / number)
        z = NormalDist().inv_cdf(1 - tail)
        dispersion = max(float(counts.var(ddof=1)), min(least, mean)) / mean
        draws *= (z / _student(level, number - 1)) ** 2 / dispersion
    low, high = _garwood(mean * draws, tail)
    return Estimate(value=mean, low=low / draws, high=high / draws)


def poisson_mean(counts: FloatArray, *, level: float = CONFIDENCE_LEVEL) -> Estimate:
    """Mean of a number per trial that is known to be a Poisson number, such as peaks of noise.

    The limits are exact (Garwood 1936), and narrower than those of `mean_count` for few events.

    >>> found = poisson_mean(np.array([0.0, 1.0]))
    >>> found.value, round(found.low, 3), round(found.high, 3)
    (0.5, 0.013, 2.786)
    """
    if not counts.size:
        return UNKNOWN_ESTIMATE
    low, high = _garwood(float(counts.sum()), 0.5 * (1 - level))
    return Estimate(value=float(counts.mean()), low=low / counts.size, high=high / counts.size)


def _garwood(events: float, tail: float) -> tuple[float, float]:
    """Limits of the mean of a Poisson number, each with the probability ``tail`` beyond it."""
    from scipy.special import gammaincinv

    low = float(gammaincinv(events, tail)) if events > 0 else 0.0
    return low, float(gammaincinv(events + 1, 1 - tail))


def rms(squares: FloatArray, counts: FloatArray, *, level: float = CONFIDENCE_LEVEL) -> Estimate:
    r"""Root mean square of errors, from their sum of ``squares`` and number in every trial.

    The logarithm of the mean square is assumed to be Student-distributed about its true value, with
    the variance of a ratio of sums, estimated between trials. The variance is at least that of K
    independent normal errors, :math:`\psi_1(K/2) \approx 2/K`. If all errors of a trial are
    equal, the interval contains the true value in 91 of 100 cases with 20 trials, and in 94 of 100
    with 100 trials. ``squares`` and ``counts`` are ``(trial,)``; trials without errors are left
    out.

    >>> found = rms(np.full(50, 0.01), np.ones(50))
    >>> round(found.value, 3), round(found.low, 3), round(found.high, 3)
    (0.1, 0.082, 0.123)
    """
    from scipy.special import polygamma

    squares, counts = squares[counts > 0], counts[counts > 0]
    if not counts.size:
        return UNKNOWN_ESTIMATE
    total = float(counts.sum())
    mean = float(squares.sum()) / total
    if counts.size < 2 or mean == 0.0:
        return Estimate(value=math.sqrt(mean), low=math.nan, high=math.nan)
    spread = _variance(squares - mean * counts) / (float(counts.mean()) * mean) ** 2
    spread = max(spread, float(polygamma(1, total / 2)))
    reach = math.exp(0.5 * _student(level, counts.size - 1) * math.sqrt(spread))
    value = math.sqrt(mean)
    return Estimate(value=value, low=value / reach, high=value * reach)


def ratio_difference(
    first: tuple[FloatArray, FloatArray],
    second: tuple[FloatArray, FloatArray],
    *,
    level: float = CONFIDENCE_LEVEL,
) -> Estimate:
    r"""First minus second ratio of sums, of variants that share their random draws trial by trial.

    Common variations cancel in the difference of their influences
    :math:`u_i = (a_i - R b_i)/\bar b`, whose mean is Student-distributed. A few trials that differ
    do not show how rare such trials are; therefore the variance is computed with two more trials,
    one for and one against, that differ by the typical :math:`s^2 = \sum u_i^4/\sum u_i^2`
    (Agresti and Min, Stat. Med. 24 (2005) 729, add two pairs for this reason). If no trial differs,
    the interval is ± the upper limit of the probability that a trial differs,
    :math:`1 - (\alpha/2)^{1/n}`, about the value. ``first`` and ``second`` are numerator and
    denominator in every trial, ``(trial,)`` each; ones as the denominator make it a difference of
    means.

    An interval cannot tell what the trials do not show: where one variant makes three ghosts at
    once in 1 % of 100 or 200 trials, and none of them has occurred, it is too narrow (of such
    intervals of 95 %, 87 to 91 % contained the truth).

    >>> found, seen = np.array([4.0, 5.0, 3.0, 5.0]), np.full(4, 5.0)
    >>> gain = ratio_difference((found, seen), (found - 1.0, seen))  # always one target more
    >>> round(gain.value, 3)
    0.2
    """
    value_1, influence_1 = _ratio(*first)
    value_2, influence_2 = _ratio(*second)
    change = influence_1 - influence_2
    return _difference(value_1, value_2, change, level=level, least=1.0)


def rms_difference(
    first: tuple[FloatArray, FloatArray],
    second: tuple[FloatArray, FloatArray],
    *,
    level: float = CONFIDENCE_LEVEL,
) -> Estimate:
    r"""First minus second root mean square, of variants that share their draws trial by trial.

    As `ratio_difference`, with the influence of a square root, :math:`u_i/2\sqrt R`. Limits are
    NaN where no trial differs. ``first`` and ``second`` are the sum of squares and the number in
    every trial, ``(trial,)`` each.
    """
    mean_1, influence_1 = _ratio(*first)
    mean_2, influence_2 = _ratio(*second)
    if not (mean_1 > 0 and mean_2 > 0):
        return UNKNOWN_ESTIMATE
    root_1, root_2 = math.sqrt(mean_1), math.sqrt(mean_2)
    change = influence_1 / (2 * root_1) - influence_2 / (2 * root_2)
    return _difference(root_1, root_2, change, level=level, least=math.nan)


def _ratio(above: FloatArray, below: FloatArray) -> tuple[float, FloatArray]:
    """Ratio of sums, and each trial's influence on it."""
    total = float(below.sum())
    if not total > 0:
        return math.nan, np.full(below.shape, math.nan)
    ratio = float(above.sum()) / total
    return ratio, np.asarray((above - ratio * below) * (below.size / total))


def _difference(
    first: float, second: float, influence: FloatArray, *, level: float, least: float
) -> Estimate:
    value = first - second
    if influence.size < 2 or not math.isfinite(value):
        return Estimate(value=value, low=math.nan, high=math.nan)
    reach = _student(level, influence.size - 1) * math.sqrt(_variance_of_difference(influence))
    rounding = _ROUNDING * max(abs(first), abs(second))
    if np.all(np.abs(influence) <= rounding):  # no trial differs from the others
        reach = least * (1 - (0.5 * (1 - level)) ** (1 / influence.size))
    return Estimate(value=value, low=value - reach, high=value + reach)


def _variance(influence: FloatArray) -> float:
    """Variance of the mean of values that are zero on average."""
    number = influence.size
    return float(influence @ influence) / (number * (number - 1))


def _variance_of_difference(influence: FloatArray) -> float:
    """Variance of the mean, with two more trials of the typical difference."""
    squares = influence**2
    total = float(squares.sum())
    if not total > 0:
        return 0.0
    typical = float((squares / total) @ squares)
    return _variance(influence) + _ADDED_DIFFERENCES * typical / influence.size**2


_ADDED_DIFFERENCES: Final = 2.0
"""Number of added trials that differ. Chosen: with it the 95 % intervals contain the true value in
at least 94 of 100 cases if 3 to 10 % of 100 or 200 trials differ, all in one direction."""


def _student(level: float, freedom: int) -> float:
    from scipy.special import stdtrit

    return float(stdtrit(freedom, 0.5 + 0.5 * level))
