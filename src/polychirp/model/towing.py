"""`Towing`: how a trailer follows the pin by which it is drawn."""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.frames import Pose, steady_turn, turned_at_rate


class Motion(NamedTuple):
    """Pose of a body, velocity of its frame's origin, m/s ``(xyz,)``, and yaw rate, rad/s."""

    pose: Pose
    velocity: FloatArray
    yaw_rate: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Towing:
    r"""A trailer whose pin is moved by the vehicle before it, and whose axle does not slip.

    The pin moves with the velocity w, which turns at a steady rate :math:`\omega` to the left; the
    axle is ℓ behind it. Since the axle moves along the heading :math:`\psi` alone, the trailer's
    yaw rate is

    .. math:: \dot\psi = \frac{w\cdot n}{\ell}

    with the unit vector n to the left of the heading. The angle :math:`\delta` from w to the
    heading then obeys :math:`\dot\delta = -\frac{|w|}{\ell}\sin\delta - \omega`, for which half of
    it has the closed form (a linear equation for :math:`(x, y) \propto (\cos\frac\delta2,
    \sin\frac\delta2)`)

    .. math:: \dot x = \tfrac{|w|}{2\ell}\,x + \tfrac\omega2\,y, \qquad
        \dot y = -\tfrac\omega2\,x - \tfrac{|w|}{2\ell}\,y

    (the tractrix of a straight way; Rajamani, Vehicle Dynamics and Control, 2012, section 2.2, has
    the kinematics without slip).

    Parameters
    ----------
    pin_x, axle_x : m, places of pin and axle on the x axis of the trailer's frame
    pin_yaw_rate : :math:`\omega`, rad/s

    Raises
    ------
    InputError
        The axle is not behind the pin.

    Examples
    --------
    Behind a pin that goes straight on, tan δ/2 falls by a factor of e within the length ℓ:

    >>> towing = Towing(pin_x=0.0, axle_x=-8.0)
    >>> bent = Pose(yaw=0.4)
    >>> rate = towing.yaw_rate(bent.yaw, np.array([10.0, 0.0, 0.0]))
    >>> later = towing.after(0.8, Motion(bent, np.array([10.0, 0.0, 0.0]), rate))
    >>> round(math.tan(0.2) / math.tan(later.pose.yaw / 2), 6) == round(math.e, 6)
    True
    """

    pin_x: float
    axle_x: float
    pin_yaw_rate: float = 0.0

    def __post_init__(self) -> None:
        if not self.axle_x < self.pin_x:
            raise InputError(
                f"the axle at {self.axle_x:g} m is not behind the pin at {self.pin_x:g} m; a "
                "trailer needs it behind"
            )

    def yaw_rate(self, heading: float, pin_velocity: FloatArray) -> float:
        """Yaw rate, rad/s, of a trailer with this heading, rad, and pin's velocity, m/s."""
        left = _direction(heading + 0.5 * math.pi)
        return float(pin_velocity @ left) / (self.pin_x - self.axle_x)

    def drawn(self, pose: Pose, pin_velocity: FloatArray) -> Motion:
        """Motion of a trailer with this pose, whose pin has the velocity ``pin_velocity``, m/s."""
        rate = self.yaw_rate(pose.yaw, pin_velocity)
        arm = -self.pin_x * _direction(pose.yaw)
        return Motion(pose, pin_velocity + turned_at_rate(rate, arm), rate)

    def after(self, elapsed: float, now: Motion) -> Motion:
        """Motion of a trailer ``elapsed`` seconds after its motion ``now``."""
        pin, w = self._pin(now)
        way, velocity = steady_turn(w, self.pin_yaw_rate, elapsed)
        heading = now.pose.yaw + self.pin_yaw_rate * elapsed
        heading += self._swing(elapsed, now.pose.yaw, w)
        x, y, z = (pin + way - self.pin_x * _direction(heading)).tolist()
        return self.drawn(replace(now.pose, x=x, y=y, z=z, yaw=heading), velocity)

    def extra_acceleration(self, now: Motion, point: FloatArray) -> FloatArray:
        r"""Acceleration of the trailer's matter beyond that of a steady turn, m/s² ``(…, xyz)``.

        In a steady turn the matter at p has :math:`\dot\psi\,e_z\times v(p)`. A trailer's has

        .. math:: (\omega - \dot\psi)\,e_z\times w + \ddot\psi\,e_z\times(p - p_{pin})

        more, with :math:`\ddot\psi = (\omega - \dot\psi)\,w\cdot e/\ell` for the heading e.
        """
        pin, w = self._pin(now)
        excess = self.pin_yaw_rate - now.yaw_rate
        quickening = excess * float(w @ _direction(now.pose.yaw)) / (self.pin_x - self.axle_x)
        return turned_at_rate(excess, w) + turned_at_rate(quickening, point - pin)

    def _pin(self, now: Motion) -> tuple[FloatArray, FloatArray]:
        """Place of the pin, m, and its velocity, m/s, ``(xyz,)``."""
        arm = self.pin_x * _direction(now.pose.yaw)
        return now.pose.position + arm, now.velocity + turned_at_rate(now.yaw_rate, arm)

    def _swing(self, elapsed: float, heading: float, w: FloatArray) -> float:
        """Change of the angle from the pin's velocity to the heading, rad."""
        speed, omega = math.hypot(w[0], w[1]), self.pin_yaw_rate
        if speed == 0.0:
            return -omega * elapsed
        delta = heading - math.atan2(w[1], w[0])
        x, y = math.cos(0.5 * delta), math.sin(0.5 * delta)
        pull, half = 0.5 * speed / (self.pin_x - self.axle_x), 0.5 * omega
        # with M² = μ², exp(Mt) is cosh(μt) + M sinh(μt)/μ, of which the direction alone counts
        square = (pull - half) * (pull + half)
        mu = math.sqrt(abs(square))
        if square > 0.0:
            even, odd = 1.0, math.tanh(mu * elapsed) / mu
        elif square < 0.0:
            even, odd = math.cos(mu * elapsed), math.sin(mu * elapsed) / mu
        else:
            even, odd = 1.0, elapsed
        later_x = even * x + odd * (pull * x + half * y)
        later_y = even * y - odd * (half * x + pull * y)
        return math.remainder(2.0 * math.atan2(later_y, later_x) - delta, 2.0 * math.pi)


def _direction(angle: float) -> FloatArray:
    """Level unit vector at an angle to the x axis, ``(xyz,)``."""
    return np.array([math.cos(angle), math.sin(angle), 0.0])
