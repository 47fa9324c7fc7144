r"""Closed forms of the probability that radars cause ghosts, or pulses, in each other.

**Synchronous radars.** An interferer sends the victim's own ramps a time s late, with a clock that
is fast by ε, over a path of delay τ. At time t the victim receives what it sent itself a time

.. math:: D(t) = s + \tau(t) - \varepsilon\,t

earlier, to first order in ε. D is the round-trip delay of a point at range cD/2 whose range rate is
:math:`c(\dot\tau - \varepsilon)/2`. A clock error has the same effect on all phases as a speed, so
that no receiver can distinguish the ghost from a target. It can be detected if the point is
in the receiver's range-rate map.

The other forms are from the literature: from `parallel` to `crossing_time` from Rao and Mani,
"Interference characterization in FMCW radars", 2020, and those after them, for radars that hop over
a band, from Bazzi et al. 2024. All are probabilities that signals meet, whether or not the receiver
then makes a detection.
"""

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError


def apparent_point(
    *,
    delay: FloatArray | float,
    delay_rate: FloatArray | float,
    start_offset: FloatArray | float,
    clock_offset: FloatArray | float,
) -> tuple[FloatArray, FloatArray]:
    r"""Range, m, and range rate, m/s, at which a synchronous radar appears at the frame's start.

    .. math:: R = \tfrac c2 (s + \tau), \qquad \dot R = \tfrac c2 (\dot\tau - \varepsilon)

    Parameters
    ----------
    delay, delay_rate : s and ratio, one way, between the radars
    start_offset, clock_offset : s and ratio, of the interferer's clock against the victim's

    Examples
    --------
    >>> apparent, rate = apparent_point(
    ...     delay=13.2 / SPEED_OF_LIGHT, delay_rate=0.0, start_offset=20e-9, clock_offset=1e-7)
    >>> round(float(apparent), 2), round(float(rate), 1)
    (9.6, -15.0)
    """
    half = 0.5 * SPEED_OF_LIGHT
    distance = half * (np.asarray(start_offset) + np.asarray(delay))
    return np.asarray(distance), np.asarray(half * (np.asarray(delay_rate) - clock_offset))


def ghost_by_start(
    delay: FloatArray | float,
    *,
    spread: float,
    least_range: FloatArray | float,
    greatest_range: FloatArray | float,
) -> FloatArray:
    r"""Probability that a radar with equal ramps and a random start appears inside the map.

    The interferer's start, relative to the victim's, is uniform within 0…S.
    The ghost is between :math:`R_-` and :math:`R_+` for starts of
    :math:`2R_-/c - \tau` to :math:`2R_+/c - \tau`; the probability is the share of S that they
    fill. For a start anywhere in a period P it is :math:`2(R_+ - R_-)/(cP)`, whatever τ.

    Parameters
    ----------
    delay : s, one way, of any shape
    spread : s, S; 0 for a simultaneous start

    Examples
    --------
    >>> limits = {"least_range": 0.0, "greatest_range": 30.0}
    >>> bool(ghost_by_start(40e-9, spread=0.0, **limits))
    True
    >>> round(float(ghost_by_start(40e-9, spread=1e-6, **limits)), 3)
    0.16
    """
    low = 2.0 * least_range / SPEED_OF_LIGHT - np.asarray(delay, dtype=np.float64)
    high = 2.0 * greatest_range / SPEED_OF_LIGHT - np.asarray(delay, dtype=np.float64)
    return _share(low, high, first=0.0, last=spread)


def ghost_by_clock(
    delay_rate: FloatArray | float, *, spread: float, greatest_speed: FloatArray | float
) -> FloatArray:
    r"""Probability that a synchronous radar with a clock error appears inside the map's speeds.

    The error is uniform within ±E. The ghost is no faster than v for errors of
    :math:`\dot\tau \pm 2v/c`: ±0.21 ppm for 32 m/s between radars at rest.

    Parameters
    ----------
    delay_rate : ratio, time derivative of the delay of the path between the radars, of any shape
    spread : ratio, E; 0 for equal clocks

    Examples
    --------
    >>> round(float(ghost_by_clock(0.0, spread=1e-6, greatest_speed=32.0)), 4)
    0.2135
    """
    rate = np.asarray(delay_rate, dtype=np.float64)
    limit = 2.0 * np.asarray(greatest_speed) / SPEED_OF_LIGHT
    return _share(rate - limit, rate + limit, first=-spread, last=spread)


def _share(low: FloatArray, high: FloatArray, *, first: float, last: float) -> FloatArray:
    """Share of the interval from ``first`` to ``last`` that lies between ``low`` and ``high``."""
    if not last >= first:
        raise InputError("a spread must be 0 or more")
    if last == first:
        return np.asarray((low <= first) & (first <= high), dtype=np.float64)
    inside = np.minimum(high, last) - np.maximum(low, first)
    return np.asarray(np.clip(inside, 0.0, None) / (last - first))


def has_ridge_in_map(
    *,
    distance: FloatArray | float,
    range_rate: FloatArray | float,
    coupling: float,
    least_range: float,
    greatest_range: float,
    greatest_speed: float,
) -> BoolArray:
    r"""True if the up- or the down-beats of a point are those of some point of the map.

    All points of equal :math:`R + \kappa v` have the same up-beat, and all of equal
    :math:`R - \kappa v` the same down-beat, with :math:`\kappa = f/b`. These two lines are the
    point's cross-pairing ridges. The ridge of a strong point outside the map can cross the map,
    where the point cannot be found and subtracted; with half of the ramps in phase its coherence is
    one half.

    Parameters
    ----------
    distance, range_rate : m, m/s, of the point
    coupling : s, κ: centre frequency over slope

    Examples
    --------
    >>> limits = {"least_range": 0.5, "greatest_range": 30.0, "greatest_speed": 32.0}
    >>> found = has_ridge_in_map(
    ...     distance=np.array([31.3, 60.0]), range_rate=-30.0, coupling=0.13, **limits)
    >>> found.tolist()
    [True, False]
    """
    reach = coupling * greatest_speed
    turn = coupling * np.asarray(range_rate)
    sums = np.stack([distance + turn, distance - turn])
    is_inside = (sums >= least_range - reach) & (sums <= greatest_range + reach)
    return np.asarray(np.any(is_inside, axis=0))


def random_start(*, greatest_range: float, period: float) -> float:
    """Probability that two radars with equal triangles, started at random, cause a ghost.

    `ghost_by_start` for a spread of the whole period, two ramps: delays up to 2R/c over it.

    >>> round(random_start(greatest_range=30.0, period=3e-3), 7)
    6.67e-05
    """
    return 2.0 * greatest_range / SPEED_OF_LIGHT / period


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


def removing_slope_difference(*, greatest_delay: float, duration: float) -> float:
    r"""Relative difference of slopes above which a ghost vanishes: :math:`2\tau_{max}/T`.

    Kim, Mun and Lee, IEEE Trans. Veh. Technol. 67 (2018): the beat, which changes by δB on a ramp,
    is then outside the band of τ_max for half of the ramp or more. T is the chirp of a chirp
    sequence, or the whole frame of a slow ramp. The ghost is wider than a cell, and weaker, from
    :math:`\delta B T = 1` on: `correlation.theory.crossing_peak`.

    >>> round(removing_slope_difference(greatest_delay=0.2e-6, duration=1.5e-3), 6)
    0.000267
    """
    return 2.0 * greatest_delay / duration


def parallel(*, greatest_delay: float, duration: float, number: float = 1) -> float:
    """Mean number of interferers with equal chirps whose beats are in the band: N τ_max/T_c.

    For one interferer it is the probability, also P_CS of Kim, Mun and Lee, and, with a period of
    L chirps for ``duration``, their P_FMCW.

    >>> delay = 2 * 200.0 / SPEED_OF_LIGHT
    >>> round(parallel(greatest_delay=delay, duration=20e-6), 4)
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
    >>> bin_delay = 2 * 0.78 / SPEED_OF_LIGHT
    >>> rest = {"bin_delay": bin_delay, "duration": 20e-6, "num_chirps": 250, "duty": 0.25}
    >>> round(parallel_in_a_bin(clock_spread=100e-6, **rest), 6)
    0.003255
    """
    walk = 0.25 * num_chirps * clock_spread * duration
    return 2.0 * duty * (bin_delay + walk) / duration


def crossing(*, own_slope: float, other_slope: float) -> float:
    """Probability that a steeper interferer in the same band crosses a chirp: (S_i − S_v)/S_i.

    >>> round(crossing(own_slope=9.5e12, other_slope=50e12), 2)
    0.81
    """
    if not 0 < own_slope <= other_slope:
        raise InputError("own_slope must be positive, and other_slope at least as large")
    return (other_slope - own_slope) / other_slope


def crossing_time(*, own_slope: float, other_slope: float, band: float) -> float:
    """Time that a crossing interferer is in the IF band of a complex mixer: B_IF/|ΔS|, s.

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
