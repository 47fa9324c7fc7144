r"""Suppression of interference by processing that adds the samples of a frame in phase.

A target's samples add up in phase, those of an interferer of another slope only in power. Of a
frame of length :math:`T_{CPI}`, the interferer is in the IF band :math:`1/T_s` for the time
:math:`T_{dw}`. The ratio by which a target of equal power rises over it is

.. math:: G = \frac{T_{CPI}}{T_{dw}}\,\frac{T_{CPI}}{T_s}

Kim, Mun and Lee 2018. All slopes are positive, and all samples complex.
"""

import math
from collections.abc import Sequence


def suppression(*, frame: float, dwell: float, band: float) -> float:
    """Ratio G for a dwell time in the band: (frame/dwell) · frame · band.

    >>> suppression(frame=1e-2, dwell=1e-4, band=1e6)
    1000000.0
    """
    return frame / dwell * frame * band


def suppression_of_tone(*, bandwidth: float, duration: float) -> float:
    r"""Suppression of a steady tone by a sequence of chirps: :math:`B\,T_{cp}`.

    The tone crosses every chirp at the same place, so that the crossings add up in phase: the
    interference is one line over all ranges at one range rate, and this is the mean of that line.
    Single cells differ from it, since the spectrum of a crossing has Fresnel ripples.

    >>> suppression_of_tone(bandwidth=1e9, duration=20e-6)
    20000.0
    """
    return bandwidth * duration


def suppression_of_slow_ramp(*, bandwidth: float, frame: float, slope_ratio: float) -> float:
    r"""Suppression of another slow ramp by one ramp of the whole frame's length.

    .. math:: G = B\,T_{CPI}\,|\alpha_I/\alpha - 1|

    >>> round(suppression_of_slow_ramp(bandwidth=1e9, frame=1e-3, slope_ratio=1.1))
    100000
    """
    return bandwidth * frame * abs(slope_ratio - 1.0)


def suppression_of_chirps(
    *, bandwidth: float, frame: float, slope_ratio: float, num_chirps: int
) -> float:
    r"""Suppression of a sequence of chirps with another slope and the same band.

    .. math:: G = B\,T_{CPI}\,|\delta|\,\frac{N_{cp}}{\lceil N_{cp}|\delta|\rceil}, \quad
              \delta = \alpha_I/\alpha - 1

    The interferer is in the band once in :math:`1/|\delta|` chirps; a frame has the rounded number
    of such times or, depending on the start, one less. The mean over starts has no ceiling, and is
    :math:`B\,T_{CPI}` as long as chirps are long against a crossing.

    Parameters
    ----------
    bandwidth : Hz, B
    frame : s, T_CPI
    slope_ratio : of the interferer's slope α_I to the victim's α
    num_chirps : N_cp, chirps of the frame

    Examples
    --------
    >>> round(suppression_of_chirps(
    ...     bandwidth=1e9, frame=5e-3, slope_ratio=1.01, num_chirps=250) / 5e6, 3)
    0.833
    """
    turns = num_chirps * abs(slope_ratio - 1.0)
    # rounding must not make two crossings of one
    return bandwidth * frame * turns / math.ceil(turns * (1.0 - 1e-9))


def floor_of_crossings(
    power: Sequence[float], *, dwell: float, duration: float, band: float
) -> float:
    r"""Mean power of crossing interferers in a range cell, W.

    .. math:: \sum_i \frac{P_i\,T_{int}}{T_c^2\,B_{IF}}

    Rao and Mani 2020, for spectra in which a tone of the power P has the peak P. Thermal noise is
    :math:`kT_0F/T_c` there.

    Parameters
    ----------
    power : W, P_i of all interferers that cross a chirp
    dwell : s, T_int, `overlap.crossing_time`
    duration : s, T_c, of the victim's chirp
    band : Hz, B_IF

    Examples
    --------
    >>> floor_of_crossings([1e-9], dwell=0.4e-6, duration=20e-6, band=20e6)
    5e-14
    """
    return sum(power) * dwell / (duration**2 * band)
