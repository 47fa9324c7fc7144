r"""`Gait`: angles and offsets of a walking person's joints over the cycle of two steps.

The model is that of Boulic et al. 1990, which Chen 2011 uses for radar echoes. It was fitted to
measured walkers.
All depends on the relative speed :math:`v_r = v / H_t`, where :math:`H_t` (m) is the height of the
hip joint above the ankle. A cycle has the length :math:`1.346\sqrt{v_r}\,H_t`, so that it lasts
:math:`1.346 / \sqrt{v_r}` seconds. The cycle begins at the strike of the right heel.

Joints with control points follow monotonic cubic curves, which are level at their extremes.

The model's torsions of pelvis and thorax are positive to the right, and our yaws to the left. At
the strike of the right heel, right hip and left shoulder are in front, as the literature has it
(Perry 1992; Bruijn et al. 2008).
"""

import math
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Final, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from polychirp.errors import InputError

GREATEST_RELATIVE_SPEED: Final = 3.0
"""Greatest relative speed of the model, 1/s: 2.6 m/s for an adult."""

SLOW_WALK, FAST_WALK = 0.5, 1.3
"""Relative speeds, 1/s, between which the model changes its formulas."""

Knots = tuple[tuple[float, float], ...]
"""Control points of a joint: share of the cycle, and angle in degrees."""


class Joints(NamedTuple):
    """Angles of all joints at one time, rad, and the offset of the pelvis, m ``(x, y, z)``.

    Flexion moves the limb forwards at hip, shoulder and elbow, and backwards at the knee; at the
    ankle it raises the toes. Upper and lower limbs are (right, left). Yaws are positive to the
    left, so that a positive one brings the right side forwards.
    """

    hip: tuple[float, float]
    knee: tuple[float, float]
    ankle: tuple[float, float]
    shoulder: tuple[float, float]
    elbow: tuple[float, float]
    pelvis_yaw: float
    pelvis_roll: float
    thorax_yaw: float
    lean: float
    offset: tuple[float, float, float]


STANDING: Final = Joints(
    hip=(0.0, 0.0),
    knee=(0.0, 0.0),
    ankle=(0.0, 0.0),
    shoulder=(0.0, 0.0),
    elbow=(0.0, 0.0),
    pelvis_yaw=0.0,
    pelvis_roll=0.0,
    thorax_yaw=0.0,
    lean=0.0,
    offset=(0.0, 0.0, 0.0),
)
"""A person who stands upright with hanging hands."""


@dataclass(frozen=True, kw_only=True)
class Gait:
    """Walk with a relative speed (1/s) of a person whose hips are ``leg`` (m) above the ankles.

    Raises
    ------
    InputError
        The relative speed is not positive, or above `GREATEST_RELATIVE_SPEED`.

    Examples
    --------
    A cycle of two steps of an adult with 1.4 m/s:

    >>> walk = Gait(relative_speed=1.4 / 0.86, leg=0.86)
    >>> round(walk.period, 2), round(1.4 * walk.period, 2)
    (1.05, 1.48)
    """

    relative_speed: float
    leg: float

    def __post_init__(self) -> None:
        if not 0 < self.relative_speed <= GREATEST_RELATIVE_SPEED:
            raise InputError(
                f"a walk of {self.relative_speed * self.leg:.3g} m/s with legs of {self.leg:.2g} m "
                f"is outside the model; use up to {GREATEST_RELATIVE_SPEED * self.leg:.2g} m/s"
            )

    @property
    def period(self) -> float:
        """Duration of a cycle of two steps, s."""
        return 1.346 / math.sqrt(self.relative_speed)

    @property
    def support(self) -> float:
        """Share of the cycle during which a foot is on the ground."""
        return 0.752 - 0.143 / self.period

    def joints(self, phase: float) -> Joints:
        """Joints at a share ``phase`` of the cycle; whole numbers are strikes of the right heel."""
        right, left = phase % 1.0, (phase + 0.5) % 1.0
        curves = self._curves
        swing = math.radians(9.88 * self.relative_speed)
        hip, knee, ankle, elbow = (
            (_at(curves[name], right), _at(curves[name], left))
            for name in ("hip", "knee", "ankle", "elbow")
        )
        shoulder = [
            math.radians(3.0) - 0.5 * swing - swing * math.cos(2 * math.pi * one)
            for one in (right, left)
        ]
        return Joints(
            hip=hip,
            knee=knee,
            ankle=ankle,
            shoulder=(shoulder[0], shoulder[1]),
            elbow=elbow,
            pelvis_yaw=math.radians(4.0 * self.relative_speed) * math.cos(2 * math.pi * right),
            pelvis_roll=self._pelvis_roll(right),
            thorax_yaw=-_at(curves["thorax"], right),
            lean=self._lean(right),
            offset=self._offset(right),
        )

    def _offset(self, phase: float) -> tuple[float, float, float]:
        """Offset of the pelvis: forward, left and up, m."""
        speed = min(self.relative_speed, SLOW_WALK)
        forward, aside = 0.084 * speed * (1.0 - speed), 0.128 * speed * (1.0 - speed)
        rise, late = 0.015 * self.relative_speed, 0.625 - self.support
        return (
            -self.leg * forward * math.sin(4 * math.pi * (phase + late)),
            -self.leg * aside * math.sin(2 * math.pi * (phase - 0.1)),
            self.leg * rise * (math.sin(2 * math.pi * (2 * phase - 0.35)) - 1.0),
        )

    def _lean(self, phase: float) -> float:
        """Forward lean of the trunk, rad."""
        speed = min(self.relative_speed, SLOW_WALK)
        bend = math.radians(8.0 * speed * (1.0 - speed))
        return bend - bend * math.sin(2 * math.pi * (2 * phase - 0.1))

    def _pelvis_roll(self, phase: float) -> float:
        """Roll of the pelvis, rad, positive if its right side is lower."""
        fall = math.radians(1.66 * self.relative_speed)
        side = 1.0 if phase < 0.5 else -1.0
        within = phase % 0.5
        if within < 0.15:
            return -side * fall * (1.0 - math.cos(2 * math.pi * within / 0.3))
        return -side * fall * (1.0 + math.cos(2 * math.pi * (within - 0.15) / 0.7))

    @cached_property
    def _curves(self) -> dict[str, PchipInterpolator]:
        return _curves_of(self.relative_speed, self.support)


def _at(curve: PchipInterpolator, phase: float) -> float:
    return math.radians(float(curve(phase)))


def _periodic(knots: Knots) -> PchipInterpolator:
    """Curve through control points that repeat with every cycle."""
    rows = {(round(share + turn, 9), angle) for share, angle in knots for turn in range(-2, 4)}
    share, angle = np.array(sorted(rows)).T
    return PchipInterpolator(share, angle)


@cache
def _curves_of(speed: float, support: float) -> dict[str, PchipInterpolator]:
    """Curves of the joints that have control points."""
    quick = max(speed - FAST_WALK, 0.0) / 1.7
    middle = min(max(speed - SLOW_WALK, 0.0) / 0.8, 1.0)
    slow = min(speed, SLOW_WALK)
    hip: Knots = ((0.5, -30 * slow), (0.9, 50 * slow))
    if quick > 0:
        hip = ((-0.1 + 0.2 * quick, 25 + 5 * quick), (0.5, -15), (0.9, 25 + 6 * quick))
    knee: Knots = (
        (0.17 - 0.05 * quick, 3 + 22 * quick),
        (0.4, 3),
        (0.75 - 0.05 * quick, 140 * slow - 5 * quick),
        (1.0 - 0.03 * quick, 3 + 3 * quick),
    )
    ankle: Knots = (
        (0.0, -3 + 5 * quick),
        (0.08, -30 * slow - 3 + 4 * quick),
        (0.5 - 0.1 * quick, 22 * slow - 3 - 3 * quick),
        (support, -34 * slow - 3 - 8 * quick),
        (0.85, -3 + 5 * quick),
    )
    elbow: Knots = ((0.05, 6 * speed + 3), (0.5, 34 * speed + 3), (0.9, 10 * speed + 3))
    if speed >= SLOW_WALK:
        elbow = (
            (0.05, 6 + 8 * middle - 6 * quick),
            (0.5 + 0.01 * middle + 0.04 * quick, 20 + 24 * middle + 26 * quick),
            (0.9 - 0.1 * quick, 8 + 9 * middle - 6 * quick),
        )
    thorax: Knots = (
        (0.1, 4 / 3 * speed),
        (0.4, -4.5 / 3 * speed),
        (0.6, -4 / 3 * speed),
        (0.9, 4.5 / 3 * speed),
    )
    knots = {"hip": hip, "knee": knee, "ankle": ankle, "elbow": elbow, "thorax": thorax}
    return {name: _periodic(some) for name, some in knots.items()}
