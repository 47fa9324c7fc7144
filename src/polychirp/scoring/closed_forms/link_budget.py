r"""Powers of an echo and of another radar, their ratio, and the noise that chirps raise.

Antennas are equal at both radars, with the gain G. All equations are those of Alland et al. 2019,
who cite Schipper et al. 2014 for the first ones.
"""

import math

from polychirp.constants import BOLTZMANN, REFERENCE_TEMPERATURE, SPEED_OF_LIGHT


def echo_power(
    *, power: float, gain: float, wavelength: float, cross_section: float, distance: float
) -> float:
    r"""Power of the echo of a point, W: :math:`P_t G^2\lambda^2\sigma/((4\pi)^3R^4)`.

    >>> echo = echo_power(
    ...     power=0.01, gain=100.0, wavelength=3.9e-3, cross_section=10.0, distance=50.0)
    >>> round(10 * math.log10(echo / 1e-3), 1)
    -89.1
    """
    spread = (4.0 * math.pi) ** 3 * distance**4
    return power * (gain * wavelength) ** 2 * cross_section / spread


def interferer_power(*, power: float, gain: float, wavelength: float, distance: float) -> float:
    r"""Power of another radar in sight, W: :math:`P_t G^2\lambda^2/((4\pi)^2r^2)`.

    >>> other = interferer_power(power=0.01, gain=100.0, wavelength=3.9e-3, distance=50.0)
    >>> round(10 * math.log10(other / 1e-3), 1)
    -54.1
    """
    return power * (gain * wavelength / (4.0 * math.pi * distance)) ** 2


def signal_to_interference(
    *, cross_section: float, distance: float, interferer_distance: float, gain: float = 1.0
) -> float:
    r"""Ratio of an echo to another radar behind the receiver: :math:`G_p\sigma r^2/(4\pi R^4)`.

    Parameters
    ----------
    cross_section : m², σ
    distance : m, R, to the target
    interferer_distance : m, r
    gain : G_p, by which processing raises echoes over the interferer

    Examples
    --------
    >>> ratio = signal_to_interference(
    ...     cross_section=10.0, distance=89.2, interferer_distance=89.2, gain=1e5)
    >>> round(10 * math.log10(ratio), 2)
    10.0
    """
    spread = 4.0 * math.pi * distance**4
    return gain * cross_section * interferer_distance**2 / spread


def range_beside_interferer(
    ratio: float, *, cross_section: float, interferer_distance: float, gain: float
) -> float:
    r"""Range, m, up to which `signal_to_interference` is at least ``ratio``.

    .. math:: R = \left(\frac{G_p\sigma r^2}{4\pi\,\mathrm{SIR}}\right)^{1/4}

    >>> rest = {"cross_section": 10.0, "gain": 1e5}
    >>> round(range_beside_interferer(10.0, interferer_distance=10.0, **rest), 2)
    29.87
    """
    spread = 4.0 * math.pi * ratio
    return math.sqrt(interferer_distance * math.sqrt(gain * cross_section / spread))


def range_at_interferer(ratio: float, *, cross_section: float, gain: float) -> float:
    r"""Range, m, of a target that carries the interferer: :math:`\sqrt{G_p\sigma/4\pi SIR}`.

    >>> round(range_at_interferer(10.0, cross_section=10.0, gain=1e5), 1)
    89.2
    """
    return math.sqrt(gain * cross_section / (4.0 * math.pi * ratio))


def slope_factor(*, own_slope: float, other_slope: float) -> float:
    r"""Factor K by which the victim's mixer raises the density of a chirp: |S_i/(S_v − S_i)|.

    An interferer that sends the band B with the power P has the mean density P/B. Behind the mixer
    its frequency moves at the difference of the slopes, and the density is K times as high. Alland
    et al. 2019 give this K for chirps that start together, and twice it for chirps with equal
    centres: there the difference changes its sign, and real samples add both sides. With complex
    samples K holds on each side of the spectrum that the difference passes. Slopes have signs.

    A chirp of the interferer, of the duration B/|S_i|, is crossed |S_v − S_i|/|S_i| = 1/K times on
    average over random starts of chirps without pauses: nearly equal slopes raise the density more,
    but more rarely, so that the mean density is P/B, whatever the slopes.

    >>> slope_factor(own_slope=6e12, other_slope=5e12), slope_factor(own_slope=1, other_slope=-1)
    (5.0, 0.5)
    """
    return abs(other_slope / (own_slope - other_slope))


def interference_to_noise(
    *, power: float, bandwidth: float, factor: float, noise_figure: float, share: float = 1.0
) -> float:
    r"""Density of a crossing interferer over that of thermal noise.

    .. math:: \frac{P}{B}\,\frac{K D_F}{k T_0 F}

    Parameters
    ----------
    power : W, P, that the victim receives: `interferer_power`
    bandwidth : Hz, B, of the interferer's chirps
    factor : K, `slope_factor`, twice it for real samples and equal centres
    noise_figure : ratio F
    share : D_F, mean number of crossings of a chirp of the interferer, which is above 1 where K is
        below; of chirps of equal duration, crossed once at most, it is the share that is crossed

    Examples
    --------
    >>> ratio = interference_to_noise(power=1e-9, bandwidth=1e9, factor=5.0, noise_figure=10.0)
    >>> round(10 * math.log10(ratio), 1)
    21.0
    """
    noise = BOLTZMANN * REFERENCE_TEMPERATURE * noise_figure
    return power / bandwidth * factor * share / noise


def share_in_band(
    *, power: float, gain: float, frequency: float, distance: float, share: float,
    noise_figure: float, band: float,
) -> float:  # fmt: skip
    r"""Interference over noise in an IF band that the interferer is in for a share of the time.

    .. math:: \frac IN = P_t\,G\left(\frac{c}{4\pi f d}\right)^2\frac{p}{k T_0 F B_{IF}}

    It is table 2-1 of Texas Instruments' application report SWRA662A, whose entries follow from
    B_IF = 10 MHz, which the report does not state. It is no floor rise, which is 1 + I/N.

    Parameters
    ----------
    power : W, P_t
    gain : G, product of the gains of both antennas
    frequency : Hz
    distance : m
    share : p, share of the time
    noise_figure : ratio F
    band : Hz, B_IF

    Examples
    --------
    >>> ratio = share_in_band(power=0.01, gain=10**1.4, frequency=77e9, distance=10.0, share=0.01,
    ...     noise_figure=10**1.4, band=10e6)
    >>> round(10 * math.log10(ratio)), round(10 * math.log10(1 + ratio), 1)
    (4, 5.3)
    """
    spread = (SPEED_OF_LIGHT / (4.0 * math.pi * frequency * distance)) ** 2
    noise = BOLTZMANN * REFERENCE_TEMPERATURE * noise_figure * band
    return power * gain * spread * share / noise


def greatest_range(*, duration: float, bandwidth: float, if_band: float) -> float:
    r"""Range, m, whose beat is at the end of the IF band: :math:`cTB_{IF}/2B`.

    >>> round(greatest_range(duration=30e-6, bandwidth=300e6, if_band=15e6))
    225
    """
    return 0.5 * SPEED_OF_LIGHT * duration * if_band / bandwidth
