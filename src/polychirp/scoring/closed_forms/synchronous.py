r"""Ghosts of synchronous radars: their place, and the probability that they are in the map.

An interferer sends the victim's own ramps a time s late, with a clock that
is fast by ε, over a path of delay τ. At time t the victim receives what it sent itself a time

.. math:: D(t) = s + \tau(t) - \varepsilon\,t

earlier, to first order in ε. D is the round-trip delay of a point at range cD/2 whose range rate is
:math:`c(\dot\tau - \varepsilon)/2`. A clock error has the same effect on all phases as a speed, so
that no receiver can distinguish the ghost from a target. It can be detected if the point is
in the receiver's range-rate map.

All probabilities are those that the ghost's point is in the map, whether or not the receiver then
makes a detection.
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
