r"""Delays of waves between points that move uniformly in straight lines, without approximation.

A wave that arrives at the sink X at time t left the source S at :math:`t - \tau`, where
:math:`c\tau = |X(t) - S(t-\tau)|`. With linear motion this is a quadratic equation in τ.
"""

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT


def range_acceleration(way: FloatArray, velocity: FloatArray) -> FloatArray:
    r"""Second derivative of the distance between two points in uniform motion, m/s² ``(…,)``.

    .. math:: \ddot R = \frac{|v|^2 - (u\cdot v)^2}{R}

    R is the distance, u the unit vector from one point to the other, and v the relative velocity.

    Parameters
    ----------
    way : vector from the first point to the second, m ``(…, xyz)``
    velocity : of the second point relative to the first, m/s ``(…, xyz)``

    Examples
    --------
    >>> float(range_acceleration(np.array([5.0, 0.0, 0.0]), np.array([3.0, 10.0, 0.0])))
    20.0
    """
    length = np.linalg.norm(way, axis=-1)
    along = np.sum(way * velocity, axis=-1) / length
    return np.asarray((np.sum(np.asarray(velocity) ** 2, axis=-1) - along**2) / length)


def turning(direction: FloatArray, length: FloatArray, velocity: FloatArray) -> FloatArray:
    r"""Rate at which the direction between two points turns, 1/s ``(…, xyz)``.

    .. math:: \dot u = \frac{v - (u\cdot v)\,u}{R}

    Parameters
    ----------
    direction : unit vector u from the first point to the second, ``(…, xyz)``
    length : their distance R, m ``(…,)``
    velocity : v of the second point relative to the first, m/s ``(…, xyz)``

    Examples
    --------
    >>> turning(np.array([1.0, 0.0, 0.0]), np.array(5.0), np.array([3.0, 10.0, 0.0])).tolist()
    [0.0, 2.0, 0.0]
    """
    along = np.sum(direction * velocity, axis=-1, keepdims=True)
    return np.asarray((velocity - along * direction) / np.asarray(length)[..., None])


def retarded_leg(
    *,
    source: FloatArray,
    source_velocity: FloatArray,
    sink: FloatArray,
    sink_velocity: FloatArray,
    later_delay: FloatArray | float = 0.0,
    later_delay_rate: FloatArray | float = 0.0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    r"""Delay, delay rate and direction of flight of a wave on one leg to a moving sink.

    The wave arrives at the sink at :math:`t - \tau_0(t)`, where t is the time of reception at the
    end of the path and τ₀ (``later_delay``) the delay of all later legs. With :math:`u` the
    direction of flight and the velocities :math:`v_S` of the source and :math:`v_X` of the sink,

    .. math:: \dot\tau = \frac{(1 - \dot\tau_0)\, u\cdot(v_X - v_S)}{c - u\cdot v_S}

    Parameters
    ----------
    source, sink : positions at time t, m ``(…, xyz)``; their velocities in m/s
    later_delay, later_delay_rate : s and s/s, ``(…,)``

    Returns
    -------
    delay : s, ``(…,)``; delay_rate : s/s, ``(…,)``; flight : unit vectors ``(…, xyz)``

    Examples
    --------
    The way back from a target that recedes at 10 m/s and is at 30 m at the time of reception:

    >>> delay, rate, _ = retarded_leg(source=np.array([30.0, 0, 0]), sink=np.zeros(3),
    ...     source_velocity=np.array([10.0, 0, 0]), sink_velocity=np.zeros(3))
    >>> bool(abs(delay - 30.0 / (SPEED_OF_LIGHT + 10.0)) < 1e-21)
    True
    """
    late = np.asarray(later_delay)[..., None]
    # from the source to the sink, both at the time of arrival
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
