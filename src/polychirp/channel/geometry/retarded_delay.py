r"""Delays of light between bodies that move in straight lines, without approximation.

A wave received at time t at X left S at :math:`t - \tau`, where
:math:`c\tau = |X(t) - S(t-\tau)|`. With linear motion this is a quadratic equation in τ.
"""

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT


def range_acceleration(way: FloatArray, velocity: FloatArray) -> FloatArray:
    r"""Second derivative of the distance between two ends that pass each other, m/s² ``(…,)``.

    .. math:: \ddot R = \frac{|v|^2 - (u\cdot v)^2}{R}

    R u is the vector between the ends, v their relative velocity; both velocities are constant.

    Parameters
    ----------
    way : from one end to the other, m ``(…, xyz)``
    velocity : of the other end relative to the first, m/s ``(…, xyz)``

    Examples
    --------
    >>> float(range_acceleration(np.array([5.0, 0.0, 0.0]), np.array([3.0, 10.0, 0.0])))
    20.0
    """
    length = np.linalg.norm(way, axis=-1)
    along = np.sum(way * velocity, axis=-1) / length
    return np.asarray((np.sum(np.asarray(velocity) ** 2, axis=-1) - along**2) / length)


def retarded_leg(
    *,
    source: FloatArray,
    source_velocity: FloatArray,
    sink: FloatArray,
    sink_velocity: FloatArray,
    later_delay: FloatArray | float = 0.0,
    later_delay_rate: FloatArray | float = 0.0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    r"""Delay, its rate, and direction of flight of a wave that arrives at a moving sink.

    The wave arrives at :math:`t - \tau_0(t)`, where τ₀ (``later_delay``) is the delay of all later
    legs. With :math:`u` the direction of flight,

    .. math:: \dot\tau = \frac{(1 - \dot\tau_0)\, u\cdot(v_X - v_S)}{c - u\cdot v_S}

    Parameters
    ----------
    source, sink : m, ``(…, xyz)`` at time t; velocities m/s
    later_delay, later_delay_rate : s and s/s, ``(…,)``

    Returns
    -------
    delay : s, ``(…,)``; delay_rate : s/s, ``(…,)``; flight : unit vectors ``(…, xyz)``

    Examples
    --------
    A target at 30 m that recedes at 10 m/s, on its way back:

    >>> delay, rate, _ = retarded_leg(source=np.array([30.0, 0, 0]), sink=np.zeros(3),
    ...     source_velocity=np.array([10.0, 0, 0]), sink_velocity=np.zeros(3))
    >>> bool(abs(delay - 30.0 / (SPEED_OF_LIGHT + 10.0)) < 1e-21)
    True
    """
    late = np.asarray(later_delay)[..., None]
    # both ends at the time of arrival
    gap = (sink - sink_velocity * late) - (source - source_velocity * late)
    along = np.sum(gap * source_velocity, axis=-1)
    speed = np.sum(np.asarray(source_velocity) ** 2, axis=-1)
    distance = np.sum(gap**2, axis=-1)
    # c²τ² = |gap + v τ|²: the positive root, written without cancellation
    rest = SPEED_OF_LIGHT**2 - speed
    delay = (along + np.sqrt(along**2 + rest * distance)) / rest
    flight = gap + source_velocity * delay[..., None]
    flight = flight / np.linalg.norm(flight, axis=-1, keepdims=True)
    closing = np.sum(flight * (sink_velocity - source_velocity), axis=-1)
    rate = (1.0 - np.asarray(later_delay_rate)) * closing
    rate = rate / (SPEED_OF_LIGHT - np.sum(flight * source_velocity, axis=-1))
    return np.asarray(delay), np.asarray(rate), np.asarray(flight)
