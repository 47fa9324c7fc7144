"""Range and range rate from the beats of an up- and a down-ramp (the paper's eqs 9 and 10)."""

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError
from polychirp.model.ramp import RampSchedule

LARGEST_DIFFERENCE = 1e-3
"""Greatest relative difference between the slopes of the two ramps of a triangle. Chosen far above
the drift of a clock: such a difference changes a range by half of it at most."""


def range_and_rate(
    *,
    up_beat: FloatArray | float,
    down_beat: FloatArray | float,
    slope: float,
    turning_frequency: float,
) -> tuple[FloatArray | float, FloatArray | float]:
    r"""Separate range from range rate.

    .. math:: R = \frac{c}{2b}\,\frac{f_{bu} + f_{bd}}{2}, \qquad
              \dot R = \frac{c}{2 f_0}\,\frac{f_{bu} - f_{bd}}{2}

    This differs from the paper twice. Its eq. 9 has cT/4B, right only if T spans both ramps; here b
    is the slope of one ramp. Its eq. 10 (for the closing speed, so with the other sign) has λ of
    the nominal carrier. Because the target moves between the ramps, the exact frequency f₀ is that
    at the *outer* ends of both ramps: the lowest for up-then-down, the highest for down-then-up.
    R is the range at the apex of the triangle. Derivation: docs, errata 2, 3.

    Parameters
    ----------
    up_beat, down_beat : Hz, magnitudes of the mean beat over the up- and the down-ramp
    slope : Hz/s, of the up-ramp, positive
    turning_frequency : f₀, Hz, at the start of the first ramp and at the end of the second

    Returns
    -------
    range : m
    range_rate : m/s, positive = away

    Examples
    --------
    >>> distance, rate = range_and_rate(
    ...     up_beat=100e3, down_beat=100e3, slope=1e12, turning_frequency=79e9)
    >>> round(distance, 2), rate
    (14.99, 0.0)
    """
    distance = SPEED_OF_LIGHT / (2.0 * slope) * 0.5 * (up_beat + down_beat)
    rate = SPEED_OF_LIGHT / (2.0 * turning_frequency) * 0.5 * (up_beat - down_beat)
    return distance, rate


def unpaired(schedule: RampSchedule) -> str:
    """Reason why `range_and_rate` cannot read ramps, as the end of a sentence; empty if it can.

    >>> from polychirp.rng import Streams
    >>> from polychirp.waveform import DiverseTriangular, Sawtooth
    >>> unpaired(DiverseTriangular().schedule(num_sweeps=4, streams=Streams(seed=1)))
    ''
    >>> unpaired(Sawtooth().schedule(num_sweeps=4, streams=Streams(seed=1)))
    'a sweep has one ramp'
    """
    count = np.bincount(schedule.sweep)
    other = count[count != 2]
    if other.size:
        return f"a sweep has {'one ramp' if other[0] == 1 else f'{other[0]} ramps'}"
    slope = schedule.slope.reshape(-1, 2)
    if np.any(np.prod(slope, axis=1) > 0):
        return "both ramps of a sweep rise, or both fall"
    if np.any(np.abs(slope.sum(axis=1)) > LARGEST_DIFFERENCE * np.abs(slope).max(axis=1)):
        return "a sweep rises and falls at different slopes"
    return ""


def refuse_unpaired(schedule: RampSchedule) -> None:
    """Refuse ramps that are not triangles, with a `CapabilityError` that says why."""
    reason = unpaired(schedule)
    if reason:
        raise CapabilityError(
            "the paper's receiver pairs the beats of a rising and a falling ramp in every sweep, "
            f"and of this schedule {reason}; the receiver 'auto' chooses one that reads it"
        )
