"""Probabilities that signals of radars meet in time and band, from the literature.

- From `parallel` to `crossing_time`: Rao and Mani 2020.
- `same_band` to `frames_lost`: radars that hop over a band, Bazzi et al. 2024.
- `frames_overlap`: radars whose frames start at random, Aydogdu et al. 2021.

All are probabilities that signals meet, whether or not the receiver then makes a detection.
"""

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError


def any_of(probability: FloatArray | float, number: float = 1) -> float:
    r"""Probability of at least one ghost: :math:`1 - \prod_i (1 - p_i)^N`.

    Parameters
    ----------
    probability : of each interferer, or one for all of them
    number : N, number of interferers with each of these probabilities

    Examples
    --------
    >>> round(1.0 - any_of(3.255e-3, 20), 3)  # Rao and Mani: the frame is clean
    0.937
    """
    return float(1.0 - np.prod((1.0 - np.asarray(probability, dtype=np.float64)) ** number))


def parallel(*, greatest_delay: float, duration: float, number: float = 1) -> float:
    """Mean number of interferers with equal chirps whose beats are in the band: N τ_max/T_c.

    For one interferer it is the probability, also P_CS of Kim, Mun and Lee, and, with a period of
    L chirps for ``duration``, their P_FMCW.

    >>> round(parallel(greatest_delay=2 * 200.0 / 3e8, duration=20e-6), 4)
    0.0667
    """
    return number * greatest_delay / duration


def parallel_in_a_bin(
    *, bin_delay: float, duration: float, num_chirps: int, clock_spread: float, duty: float
) -> float:
    r"""Probability that an interferer with equal chirps is in a given range bin of a frame.

    .. math:: p_1 = 2\,\mathrm{duty}\,\frac{\tau_{bin} + \tfrac14 N\delta_{max}T_c}{T_c}

    Parameters
    ----------
    bin_delay : s, width of a range bin in round-trip delay
    duration : s, T_c, of a chirp
    num_chirps : N, number of chirps of the frame
    clock_spread : ratio, greatest error of a clock
    duty : share of the time in which frames are active

    Examples
    --------
    >>> rest = {"duration": 20e-6, "num_chirps": 250, "clock_spread": 100e-6, "duty": 0.25}
    >>> round(parallel_in_a_bin(bin_delay=5.204e-9, **rest), 6)
    0.003255
    """
    walk = 0.25 * num_chirps * clock_spread * duration
    return 2.0 * duty * (bin_delay + walk) / duration


def crossing(*, own_slope: float, other_slope: float) -> float:
    """Probability that a chirp of a steeper interferer crosses the victim's: (S_i − S_v)/S_i.

    Both radars send chirps over the same band, one after the other without a pause.

    >>> round(crossing(own_slope=9.5e12, other_slope=50e12), 2)
    0.81
    """
    if not 0 < own_slope <= other_slope:
        raise InputError("own_slope must be positive, and other_slope at least as large")
    return (other_slope - own_slope) / other_slope


def crossing_time(*, own_slope: float, other_slope: float, band: float) -> float:
    """Time that a crossing interferer is in the IF band of a complex mixer: B_IF/|ΔS|, s.

    The band reaches from −B_IF/2 to +B_IF/2. With real samples of a band up to B_IF the time is
    twice as long.

    >>> round(crossing_time(own_slope=9.5e12, other_slope=50e12, band=12.7e6) * 1e6, 3)
    0.314
    """
    return band / abs(other_slope - own_slope)


def same_band(*, chirp_band: float, total_band: float, tolerated: float = 0.0) -> float:
    r"""Probability that two chirps at random places in a band overlap by more than tolerated.

    .. math:: P_f = \frac{2w}{L}\Bigl(1 - \frac{w}{2L}\Bigr), \quad
              w = (1 - x)B_{ch},\; L = B_T - B_{ch}

    Bazzi et al. 2024: the probability that two uniform places within L are closer than w.

    Parameters
    ----------
    chirp_band, total_band : Hz
    tolerated : share x of the chirp's band that may overlap

    Examples
    --------
    >>> same_band(chirp_band=1e9, total_band=5e9)
    0.4375
    """
    room, width = total_band - chirp_band, (1.0 - tolerated) * chirp_band
    if not 0.0 <= tolerated < 1.0 or room < 0.0:
        raise InputError(
            "chirp_band must be at most total_band, and tolerated at least 0 and below 1"
        )
    if width >= room:
        return 1.0
    return 2.0 * width / room * (1.0 - 0.5 * width / room)


def same_time(*, duty: float, tolerated: float = 0.0) -> float:
    """Probability that two frames of equal period and ``duty`` overlap: min(1, 2δ(1 − x)).

    >>> same_time(duty=0.25)
    0.5
    """
    return min(1.0, 2.0 * duty * (1.0 - tolerated))


def frames_lost(*, together: float, number: int, in_a_row: int = 1) -> float:
    """Probability that each of ``in_a_row`` frames is hit by any of ``number`` interferers.

    ``together`` is the probability that one pair meets, P_f P_t (Bazzi et al. 2024).

    >>> round(frames_lost(together=0.4375 * 0.5, number=3, in_a_row=2), 4)
    0.2737
    """
    return any_of(together, number) ** in_a_row


def chirp_time(*, duty: float, chirp: float, repetition: float, if_share: float) -> float:
    r"""Probability that a chirp of a hopping interferer is heard in a chirp of the victim.

    .. math:: P_t = \delta\,\frac{T_{ch}}{T_{rch}}\,\frac{B_{ADC}}{B_{ch}}

    Bazzi et al. 2024, for equal chirps: the start of the interferer's chirp, uniform within the
    repetition interval, is heard if its beat is in the IF band. It is to be multiplied with the
    probability `same_band` that both chirps are in the same band.

    Parameters
    ----------
    duty : δ, share of the time in which frames are active
    chirp, repetition : s, duration of a chirp and interval between the starts of two
    if_share : B_ADC/B_ch, the IF band over the band of a chirp

    Examples
    --------
    >>> round(chirp_time(duty=0.5, chirp=20e-6, repetition=25e-6, if_share=0.05), 6)
    0.02
    """
    return duty * chirp / repetition * if_share


def frame_hit(*, together: float, num_chirps: int, tolerated: int = 0) -> float:
    r"""Probability that more than ``tolerated`` of a frame's chirps are hit, each on its own.

    .. math:: P = \sum_{i=K+1}^{N} \binom{N}{i} p^i (1-p)^{N-i}

    Bazzi et al. 2024, with p = ``together`` for one chirp. Their printed coefficient, N over K for
    all i, cannot be right: with it the terms from 0 to N do not add up to 1.

    Examples
    --------
    >>> round(frame_hit(together=0.02, num_chirps=128, tolerated=6), 4)
    0.0149
    """
    from scipy.stats import binom

    return float(binom.sf(tolerated, num_chirps, together))


def frames_overlap(
    *, duty: float, num_chirps: int, if_share: float, distance_share: float = 0.0
) -> float:
    r"""Probability that an interferer with equal chirps is in the IF band in some chirp of a frame.

    .. math:: P = (1 + \alpha_d)\,\frac{2N - 1}{N}\,U\,\frac{B_{max}}{B_r}

    Aydogdu et al. 2021 (RadChat). The frames of both radars are N chirps without pauses and start
    at random within a period of 1/U frames; two chirps meet if the later one starts within
    :math:`(1 + \alpha_d) B_{max}/B_r` of a chirp. There are 2N − 1 such windows in a period, and
    the form holds as long as they do not overlap and the duty U is at most one half.

    Parameters
    ----------
    duty : U, share of the time in which frames are active
    num_chirps : N, chirps of a frame
    if_share : B_max/B_r, the IF band over the band of a chirp
    distance_share : α_d, distance to the interferer over the radar's greatest range

    Examples
    --------
    >>> round(frames_overlap(duty=0.5, num_chirps=99, if_share=0.01, distance_share=0.5), 6)
    0.014924
    """
    if not 0.0 < duty <= 0.5 or not 0.0 < if_share * (1.0 + distance_share) <= 1.0:
        raise InputError(
            "duty must be above 0 and at most 0.5, and (1 + distance_share) if_share at most 1"
        )
    return (1.0 + distance_share) * (2 * num_chirps - 1) * duty * if_share / num_chirps
