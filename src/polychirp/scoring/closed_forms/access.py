r"""Capacity of a road for radars that share a band without coordination, Jin and Roy 2021.

Radars of density λ along a road receive each other up to the distance d. Chirps have the slope h,
and one that starts within :math:`f_H/h` of the victim's is in its IF band, up to :math:`f_H`. Each
radar sends a chirp in every period :math:`T_g`. As in ALOHA, a radar is undisturbed with the
probability that no other one starts in its window.
"""

import math

from polychirp.constants import SPEED_OF_LIGHT


def undisturbed_density(
    density: float, *, reach: float, window: float, period: float, gain: float = 1.0
) -> float:
    r"""Mean number of undisturbed radars per metre of road.

    .. math:: C(\lambda) = \lambda\, e^{-2\lambda d\,(f_H/h)/(T_g g)}

    Parameters
    ----------
    density : λ, radars per metre
    reach : m, d, greatest distance at which a radar disturbs
    window : s, :math:`f_H/h`, IF band over slope
    period : s, :math:`T_g`
    gain : g, number by which a scheme divides the probability of a hit: M for M bands, `hop_gain`,
        each over the residual probability p₀ of a phase code that a hit is decoded

    Examples
    --------
    >>> round(undisturbed_density(0.5, reach=100.0, window=0.2e-6, period=20e-6), 4)
    0.1839
    """
    return density * math.exp(-2.0 * density * reach * window / (period * gain))


def best_density(*, reach: float, window: float, period: float, gain: float = 1.0) -> float:
    r"""Density, 1/m, at which most radars are undisturbed: :math:`g T_g/(2 d f_H/h)`.

    There are then 1/e of it undisturbed.

    >>> rest = {"reach": 100.0, "window": 0.2e-6, "period": 20e-6}
    >>> round(best_density(**rest), 3)
    0.5
    """
    return gain * period / (2.0 * reach * window)


def hop_gain(*, num_bins: int, num_targets: int) -> float:
    r"""Gain of a radar that hops from chirp to chirp: :math:`1/(1 - (1 - 1/N)^x)`.

    Hops move an interferer's beat to a random one of N range bins, where it disturbs if one of x
    targets is there.

    >>> round(hop_gain(num_bins=256, num_targets=10), 2)
    26.05
    """
    return 1.0 / (1.0 - (1.0 - 1.0 / num_bins) ** num_targets)


def targets_where_hopping_wins(*, num_bins: int, num_bands: int) -> float:
    r"""Number of targets below which hops gain more than M fixed bands.

    .. math:: x = \frac{\ln(1 - 1/M)}{\ln(1 - 1/N)}

    >>> round(targets_where_hopping_wins(num_bins=256, num_bands=4), 1)
    73.5
    """
    return math.log(1.0 - 1.0 / num_bands) / math.log(1.0 - 1.0 / num_bins)


def slotted_density(
    *, bandwidth: float, if_band: float, slope: float, reach: float, num_bands: int = 1
) -> float:
    r"""Greatest density of radars without interference, if all have slots of their own, 1/m.

    .. math:: \frac{M B_c}{2d\,(f_H + h d/c)}

    A chirp of the band B_c has room for :math:`B_c/(f_H + hd/c)` starts that are as far apart as an
    IF band and the delay over the distance d.

    Parameters
    ----------
    bandwidth : Hz, B_c, of a chirp
    if_band : Hz, f_H
    slope : Hz/s, h
    reach : m, d
    num_bands : M

    Examples
    --------
    >>> round(slotted_density(bandwidth=200e6, if_band=10e6, slope=1e13, reach=100.0), 4)
    0.075
    """
    return num_bands * bandwidth / (2.0 * reach * (if_band + slope * reach / SPEED_OF_LIGHT))
