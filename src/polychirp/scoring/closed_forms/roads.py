r"""Interference of all radars of a road, in the mean and as a distribution.

Interferers are points on lines along the road. Nothing hides them: vehicles between an interferer
and the victim make the interference of a real road weaker. :math:`P_1` is the power that the victim
receives from an interferer 1 m away in both beams, :math:`P_tG^2\lambda^2/(4\pi)^2`, and ρ their
density, per metre, times the share of the time in which they send in the victim's band.
"""

import math
from typing import Final

import numpy as np
from scipy.special import erf, erfc

from polychirp.axes import FloatArray

BEST_LOAD: Final = 0.5315969
"""Argument that maximises u·erfc(u), a ratio: root of erfc(u) = 2u exp(−u²)/√π."""


def mean_of_lane(power: float, *, density: float, offset: float, opening: float) -> float:
    r"""Mean interference of a lane, W: :math:`P_1\rho\,\theta/2L`.

    The victim sees the lane, an offset L to its side, from :math:`L/\tan(\theta/2)` on. The gain
    is constant within the opening of the beams and zero outside (Aydogdu et al. 2020, with
    L = ℓR for lane ℓ, and Al-Hourani et al. 2018).

    Parameters
    ----------
    power : W, P₁
    density : 1/m, ρ
    offset : m, L, from the victim's line to that of the interferers
    opening : rad, θ, full opening of the beams in azimuth

    Examples
    --------
    >>> mean = mean_of_lane(1.0, density=1 / 30, offset=3.5, opening=math.radians(30.0))
    >>> round(mean, 5)
    0.00249
    """
    return power * density * opening / (2.0 * offset)


def mean_of_lane_in_lobes(
    power: float, *, density: float, offset: float, opening: float, beamwidth: float
) -> float:
    r"""Mean interference of a lane, W, if both antennas have Gaussian lobes.

    .. math:: P_1\rho\,\frac{\sqrt\pi}{2L\sqrt a}\,\mathrm{erf}\Bigl(\frac{\theta\sqrt a}{2}\Bigr),
              \quad a = \frac{8\ln 2}{\beta^2}

    Wang et al. 2023. Radars face each other, so that the angle φ is the same at both ends, and the
    product of both gains is :math:`e^{-a\varphi^2}` with the full 3-dB width β of one. Their text
    has "10 ln" where levels are meant; decibels are 10 log₁₀.

    Parameters
    ----------
    power, density, offset, opening : as of `mean_of_lane`
    beamwidth : rad, β

    Examples
    --------
    >>> rest = {"density": 1 / 30, "offset": 3.5, "opening": math.radians(30.0)}
    >>> round(mean_of_lane_in_lobes(1.0, beamwidth=math.radians(30.0), **rest), 5)
    0.0017
    >>> wide = mean_of_lane_in_lobes(1.0, beamwidth=100.0, **rest)
    >>> math.isclose(wide, mean_of_lane(1.0, **rest), rel_tol=1e-4)
    True
    """
    root = math.sqrt(8.0 * math.log(2.0)) / beamwidth
    lobe = math.sqrt(math.pi) / (2.0 * root) * float(erf(0.5 * opening * root))
    return power * density * lobe / offset


def hard_core_density(density: float, *, gap: float) -> float:
    r"""Density, 1/m, of vehicles that keep a gap d: :math:`(1 - e^{-2\rho d})/2d`.

    It is Matérn's process of type II: of Poisson points with random marks, each one with a smaller
    mark than all others within the gap is kept (Wang et al. 2023).

    >>> round(hard_core_density(0.1, gap=5.0), 4)
    0.0632
    """
    return -math.expm1(-2.0 * density * gap) / (2.0 * gap)


def interference_below(level: FloatArray | float, *, power: float, density: float) -> FloatArray:
    r"""Probability that the interference of one line of radars is at most a level y.

    .. math:: P(I \le y) = \mathrm{erfc}\Bigl(\frac{\rho\sqrt{\pi P_1}}{2\sqrt y}\Bigr)

    Al-Hourani et al. 2018: interferers are a Poisson process on the victim's own line, in front of
    it, with the exponent 2 of free space. The distribution is Lévy's and has no mean. Of two lines,
    the densities add.

    Parameters
    ----------
    level : W, y, of any shape
    power : W, P₁
    density : 1/m, ρ

    Examples
    --------
    >>> interference_below(np.array([1e-4, 1e-3]), power=1.0, density=0.02).round(4)
    array([0.0122, 0.428 ])
    """
    ratio = density * np.sqrt(math.pi * power / np.asarray(level, dtype=np.float64))
    return np.asarray(erfc(0.5 * ratio))


def success(
    *, density: float, distance: float, cross_section: float, gain: float, least_ratio: float
) -> float:
    r"""Probability that an echo is ``least_ratio`` 𝒯 over the interference of one line of radars.

    .. math:: p_s = \mathrm{erfc}\Bigl(\frac{\rho R^2}{2}
              \sqrt{\frac{4\pi^2\mathcal T}{\sigma G_p}}\Bigr)

    Al-Hourani et al. 2018: `interference_below` for the level of the echo over 𝒯, without noise.

    Parameters
    ----------
    density : 1/m, ρ
    distance : m, R, of the target
    cross_section : m², σ
    gain : G_p, by which processing raises echoes over interference
    least_ratio : 𝒯

    Examples
    --------
    >>> round(success(
    ...     density=0.02, distance=30.0, cross_section=10.0, gain=1e5, least_ratio=10.0), 3)
    0.8
    """
    return float(erfc(density * _load(distance, cross_section, gain, least_ratio)))


def best_duty(
    *, density: float, distance: float, cross_section: float, gain: float, least_ratio: float
) -> float:
    r"""Share of the time in which radars should send so that most echoes are received.

    Of radars of the density ρ that all send the share ξ of the time, :math:`\xi\,p_s(\xi\rho)` is
    greatest at :math:`\xi = u^*/u`, with u the argument of erfc in `success` at ξ = 1 and
    :math:`u^*` of `BEST_LOAD`, or at 1 (Al-Hourani et al. 2018).

    >>> round(best_duty(
    ...     density=0.2, distance=30.0, cross_section=10.0, gain=1e5, least_ratio=10.0), 3)
    0.297
    """
    full = density * _load(distance, cross_section, gain, least_ratio)
    return min(1.0, BEST_LOAD / full)


def _load(distance: float, cross_section: float, gain: float, least_ratio: float) -> float:
    """Argument of erfc in `success` per density, m."""
    return distance**2 * math.pi * math.sqrt(least_ratio / (cross_section * gain))
