r"""Correlation of ramps in closed form, and laws for its peaks.

On the overlap of two ramps, the product of one with the conjugate of the other is a chirp whose
slope is the difference of their slopes. The integral of this chirp is a difference of Fresnel
integrals (Cook and Bernfeld, Radar Signals, 1967, chapter 6), or a sinc if the slopes are equal.
"""

import math
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.correlation.base import Correlation
from polychirp.errors import CapabilityError
from polychirp.model.ramp import RampSchedule

OVERSHOOT: Final = 1.370437
"""Maximum of |∫₋∞ˣ exp(jπu²/2) du|²/2, +1.37 dB: power overshoot by one end of the overlap."""

BOTH_ENDS_OVERSHOOT: Final = 1.801416
"""Maximum of 2|∫₀ˣ exp(jπu²/2) du|², +2.56 dB: power overshoot by both ends at once."""

NEGLIGIBLE_CURVATURE: Final = 1e-4
"""Greatest |μ|w², slope times squared width, of a chirp that is treated as a tone. Chosen: the
integral's error is at most π/12 of this value times the width w."""


def expected(a: RampSchedule, b: RampSchedule, lag: FloatArray) -> Correlation:
    """Correlation of the signals of two schedules, in closed form, at growing lags (s, ``(lag,)``).

    It holds for continuous signals, without aliasing by sampling. The computing time grows with the
    product of the numbers of ramps of ``a``, ramps of ``b`` and lags. Carriers are not removed: the
    phase is that of signals at the schedules' radio frequencies. `CapabilityError` is raised if
    ramps carry a code.

    >>> ramp = RampSchedule(start_time=[0.0], duration=[1e-4], start_frequency=[3.95e9],
    ...     slope=[1e12], start_phase=[0.0], sweep=[0])
    >>> abs(expected(ramp, ramp, np.array([0.0, 10e-9, 20e-9])).amplitude).round(4)
    array([1., 0., 0.])
    """
    if a.code is not None or b.code is not None:
        raise CapabilityError(
            "no closed form here holds for ramps with a code; correlate the samples of both signals"
        )
    lag = np.asarray(lag, dtype=np.float64)
    total = np.zeros(lag.shape, dtype=np.complex128)
    for k in range(a.num_ramps):
        for n in range(b.num_ramps):
            # the two ramps overlap at the lags from first to last - 1 only
            first = np.searchsorted(lag, a.start_time[k] - b.end_time[n])
            last = np.searchsorted(lag, a.end_time[k] - b.start_time[n])
            if first < last:
                total[first:last] += _pair(a, k, b, n, lag[first:last])
    energy = float(a.duration.sum()) * float(b.duration.sum())
    return Correlation(amplitude=total / math.sqrt(energy), lag=lag)


def _pair(a: RampSchedule, k: int, b: RampSchedule, n: int, lag: FloatArray) -> ComplexArray:
    """Integral ∫ a(t + τ) b̄(t) dt over the overlap of ramp k of ``a`` and ramp n of ``b``, s."""
    begin = np.maximum(a.start_time[k] - lag, b.start_time[n])
    end = np.minimum(a.end_time[k] - lag, b.end_time[n])
    width = np.maximum(end - begin, 0.0)
    middle = 0.5 * (begin + end)
    into_a, into_b = middle + lag - a.start_time[k], middle - b.start_time[n]
    turns = a.start_phase[k] + (a.start_frequency[k] + 0.5 * a.slope[k] * into_a) * into_a
    turns -= b.start_phase[n] + (b.start_frequency[n] + 0.5 * b.slope[n] * into_b) * into_b
    beat = a.start_frequency[k] + a.slope[k] * into_a
    beat -= b.start_frequency[n] + b.slope[n] * into_b
    bend = float(a.slope[k] - b.slope[n])
    return np.asarray(np.exp(2j * np.pi * (turns % 1.0)) * _chirp(beat, bend, width))


def _chirp(beat: FloatArray, bend: float, width: FloatArray) -> ComplexArray:
    """Integral ∫ exp(j2π(fu + μu²/2)) du over |u| ≤ w/2, s, of beat f, slope μ and width w."""
    from scipy.special import fresnel

    out = (width * np.sinc(beat * width)).astype(np.complex128)
    bent = abs(bend) * width**2 > NEGLIGIBLE_CURVATURE
    if not np.any(bent):
        return out
    scale = math.sqrt(2.0 * abs(bend))
    f, w = beat[bent], width[bent]
    low, high = (
        cosine + 1j * math.copysign(1.0, bend) * sine
        for sine, cosine in (fresnel(scale * (f / bend + half * w)) for half in (-0.5, 0.5))
    )
    out[bent] = np.exp(-1j * np.pi * ((f * f / bend) % 2.0)) * (high - low) / scale
    return out


def crossing_peak(a_slope: float, b_slope: float, a_duration: float, b_duration: float) -> float:
    r"""Power |R|² of the highest lobe in the correlation of two ramps whose frequencies cross.

    .. math:: \max_\tau |R|^2 \approx \frac{C}{|\beta_a - \beta_b|\,T_a T_b}

    The law is that of stationary phase times C, the overshoot where the crossing is about one
    Fresnel zone from an end of the overlap: `OVERSHOOT`, 1.37 dB. For ramps of equal duration T
    and bandwidths that differ by ΔB the peak is −10 log₁₀(\|ΔB\| T) + 1.4 dB. The law needs
    \|Δβ\|T_a T_b of some tens; below, no whole Fresnel zone fits into the overlap (use `expected`).

    >>> round(10 * math.log10(crossing_peak(1.2e12, 1e12, 1e-4, 1e-4)), 1)
    -31.6
    """
    return OVERSHOOT / (abs(a_slope - b_slope) * a_duration * b_duration)


def opposite_peak(slope: float, a_duration: float, b_duration: float) -> float:
    r"""The same for two ramps of opposite slopes ±β whose bands begin, or end, at one frequency.

    The crossing is then in the middle of the overlap at many lags, so that both ends overshoot: C
    is `BOTH_ENDS_OVERSHOOT`, 2.56 dB. Other ramps of opposite slopes follow `crossing_peak`.

    >>> round(10 * math.log10(opposite_peak(1e12, 1e-4, 1e-4)), 1)
    -40.5
    """
    return BOTH_ENDS_OVERSHOOT / (2.0 * abs(slope) * a_duration * b_duration)


def are_opposite(a_slope: float, b_slope: float) -> bool:
    """True if one slope is the negative of the other, to within rounding errors.

    >>> are_opposite(1e8 / 1e-4, -(1e8 / 3e-5 * 0.3))
    True
    """
    return math.isclose(a_slope, -b_slope)


def disjoint_peak(gap: float, a_duration: float, b_duration: float) -> float:
    r"""Upper bound of the power |R|² of all lobes of two ramps whose bands are ``gap`` Hz apart.

    .. math:: |R| \le \frac{1}{\pi\,\Delta f \sqrt{T_a T_b}}

    Δf is the gap. The difference of the ramps' frequencies is never smaller than Δf, so that only
    the two ends of the overlap contribute to the integral, each by 1/2πΔf at most.

    >>> round(10 * math.log10(disjoint_peak(140e6, 1e-4, 1e-4)), 1)
    -92.9
    """
    return 1.0 / ((math.pi * gap) ** 2 * a_duration * b_duration)
