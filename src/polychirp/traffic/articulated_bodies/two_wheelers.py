"""Bicycle and motorcycle with their riders, as ellipsoids and rods that turn with the wheels."""

import math
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.moving_parts import Ellipsoids, MovingParts, Rods
from polychirp.traffic.articulated_bodies.rider import rider
from polychirp.traffic.articulated_bodies.tubes import (
    RUBBER_REFLECTIVITY,
    Spokes,
    Tube,
    both_sides,
    ring,
    rods_of,
    together,
)

RIDER_HEIGHT: Final = 1.75
"""Height of riders, m; chosen: that of an adult."""

BICYCLE_AXLES: Final = (-0.525, 0.525)
"""Places of a bicycle's axles along it, m; chosen, as all its measures: a city bicycle of 28 inch.
"""
BICYCLE_RADIUS: Final = 0.345
"""Radius of a bicycle's wheel with its tyre, m (ISO 5775: 37-622 has 0.348 m)."""
BOTTOM_BRACKET: Final = (-0.085, 0.285)
"""Place of the cranks' axle, m (x, z)."""
CRANK: Final = 0.17
"""Length of a crank, m."""

_LEFT_TUBES: Final = (
    Tube(start=(-0.085, 0.03, 0.285), end=(-0.525, 0.065, 0.345), radius=0.009),
    Tube(start=(-0.21, 0.03, 0.83), end=(-0.525, 0.065, 0.345), radius=0.008),
    Tube(start=(0.40, 0.05, 0.66), end=(0.525, 0.05, 0.345), radius=0.012),
    Tube(start=(0.31, 0.03, 1.03), end=(0.24, 0.29, 1.05), radius=0.012),
)
_MIDDLE_TUBES: Final = (
    Tube(start=(-0.085, 0.0, 0.285), end=(-0.245, 0.0, 0.93), radius=0.016),
    Tube(start=(-0.21, 0.0, 0.81), end=(0.33, 0.0, 0.83), radius=0.016),
    Tube(start=(-0.085, 0.0, 0.285), end=(0.37, 0.0, 0.71), radius=0.019),
    Tube(start=(0.38, 0.0, 0.68), end=(0.31, 0.0, 1.03), radius=0.018),
    Tube(start=(0.31, -0.03, 1.03), end=(0.31, 0.03, 1.03), radius=0.012),
    Tube(start=(-0.525, -0.06, 0.345), end=(-0.525, 0.06, 0.345), radius=0.020),
    Tube(start=(0.525, -0.05, 0.345), end=(0.525, 0.05, 0.345), radius=0.018),
)


@dataclass(frozen=True, kw_only=True)
class BicycleRide:
    """Movement of a bicycle and its rider at ``speed``, m/s.

    Parameters
    ----------
    num_spokes : of each wheel
    development : way for one turn of the cranks, m; the rider pedals all the time
    phase : share of a wheel's turn at time 0
    """

    speed: float
    num_spokes: int
    development: float
    phase: float

    def parts_at(self, time: float) -> MovingParts:
        """Frame, wheels and rider at a time, s."""
        way = self.speed * time
        turn = 2 * math.pi * self.phase + way / BICYCLE_RADIUS
        wheels = [
            Spokes(x=x, z=BICYCLE_RADIUS, count=self.num_spokes, inner=0.025, outer=0.30,
                   flange=0.03, radius=1e-3).at(turn)
            for x in BICYCLE_AXLES
        ]  # fmt: skip
        crank = 2 * math.pi * (self.phase + way / self.development)
        pedals = np.array([_pedal(crank + math.pi, -1.0), _pedal(crank, 1.0)])
        x, z = BOTTOM_BRACKET
        cranks = [
            Tube(start=(x, float(place[1]), z), end=tuple(place.tolist()), radius=0.012)
            for place in pedals
        ]
        person = rider(
            height=RIDER_HEIGHT,
            seat=np.array([-0.25, 0.0, 1.0]),
            lean=math.radians(30.0),
            hands=np.array([[0.26, -0.27, 1.07], [0.26, 0.27, 1.07]]),
            ankles=pedals + np.array([-0.06, 0.0, 0.10]),
        )
        return MovingParts(
            ellipsoids=person, rods=together([*wheels, rods_of(cranks), _bicycle_frame()])
        )


def _pedal(angle: float, side: float) -> FloatArray:
    """Place of a pedal, m ``(xyz,)``, after its crank has turned forwards from the front, rad."""
    x, z = BOTTOM_BRACKET
    return np.array([x + CRANK * math.cos(angle), 0.12 * side, z - CRANK * math.sin(angle)])


@cache
def _bicycle_frame() -> Rods:
    """Frame, handlebar, rims and tyres, none of which changes when the wheels turn."""
    axles = [np.array([x, 0.0, BICYCLE_RADIUS]) for x in BICYCLE_AXLES]
    rims = [ring(axle, 0.311, tube=0.011) for axle in axles]
    tyres = [ring(axle, 0.328, tube=0.017, reflectivity=RUBBER_REFLECTIVITY) for axle in axles]
    return together([rods_of([*both_sides(_LEFT_TUBES), *_MIDDLE_TUBES]), *rims, *tyres])


MOTORCYCLE_AXLES: Final = (-0.72, 0.72)
"""Places of a motorcycle's axles along it, m; chosen, as all its measures: one without fairing."""
MOTORCYCLE_RADIUS: Final = 0.31
"""Radius of a motorcycle's wheel with its tyre, m (120/70 R17 has 0.30 m, 180/55 R17 0.315 m)."""

CORNER_RCS: Final = 0.5
"""Cross section of each group of corners in `_CORNERS`, m². Calibrated: the mean over all aspects
at 10 m is then the middle of published means of motorcycles at 77–79 GHz, 5 dBsm (0 to 10 dBsm).
With half of it the mean is 3 dBsm, with twice 7.5 dBsm."""
_CORNER_RADIUS: Final = 0.03

_CORNERS: Final = (
    (0.62, 0.0, 0.86),  # lamp and instruments
    (0.34, 0.0, 0.55),  # radiator behind the fork
    (0.10, 0.23, 0.45),  # engine and footrest, left
    (0.10, -0.23, 0.45),  # and right
    (-0.45, 0.14, 0.55),  # suspension and chain, left
    (-0.45, -0.14, 0.55),  # and right
    (-0.80, 0.0, 0.65),  # number plate and lamp
)
_SOLIDS: Final = (
    ((0.12, 0.0, 0.88), (0.25, 0.14, 0.12)),  # tank
    ((0.08, 0.0, 0.50), (0.25, 0.20, 0.20)),  # engine
    ((0.56, 0.0, 0.86), (0.06, 0.09, 0.09)),  # lamp
)
_MOTORCYCLE_LEFT: Final = (
    Tube(start=(0.48, 0.10, 0.95), end=(0.72, 0.10, 0.31), radius=0.025),
    Tube(start=(-0.10, 0.11, 0.38), end=(-0.72, 0.11, 0.31), radius=0.025),
    Tube(start=(0.46, 0.03, 0.98), end=(0.36, 0.36, 1.02), radius=0.014),
)
_MOTORCYCLE_MIDDLE: Final = (
    Tube(start=(0.10, -0.19, 0.32), end=(-0.75, -0.19, 0.42), radius=0.05),
    Tube(start=(-0.72, -0.11, 0.31), end=(-0.72, 0.11, 0.31), radius=0.03),
    Tube(start=(0.72, -0.10, 0.31), end=(0.72, 0.10, 0.31), radius=0.03),
)


@dataclass(frozen=True, kw_only=True)
class MotorcycleRide:
    """Movement of a motorcycle and its rider at ``speed``, m/s; see `BicycleRide`."""

    speed: float
    phase: float

    def parts_at(self, time: float) -> MovingParts:
        """Body, wheels and rider at a time, s."""
        turn = 2 * math.pi * self.phase + self.speed * time / MOTORCYCLE_RADIUS
        wheels = [
            Spokes(x=x, z=MOTORCYCLE_RADIUS, count=10, inner=0.05, outer=0.21, flange=0.02,
                   radius=8e-3).at(turn)
            for x in MOTORCYCLE_AXLES
        ]  # fmt: skip
        return MovingParts(
            ellipsoids=_motorcycle_solids(), rods=together([*wheels, _motorcycle_frame()])
        )


@cache
def _motorcycle_frame() -> Rods:
    """Fork, swing, exhaust, rims, brakes and tyres: all rods but the spokes."""
    axles = [np.array([x, 0.0, MOTORCYCLE_RADIUS]) for x in MOTORCYCLE_AXLES]
    rings = [ring(axle, 0.22, tube=0.02) for axle in axles]
    rings += [ring(axle, 0.14, tube=0.01, aside=side) for axle in axles for side in (-0.07, 0.07)]
    rings += [ring(axle, 0.25, tube=0.06, reflectivity=RUBBER_REFLECTIVITY) for axle in axles]
    return together([rods_of([*both_sides(_MOTORCYCLE_LEFT), *_MOTORCYCLE_MIDDLE]), *rings])


@cache
def _motorcycle_solids() -> Ellipsoids:
    """Rider, tank, engine and lamp, and the groups of corners as bright balls."""
    person = rider(
        height=RIDER_HEIGHT,
        seat=np.array([-0.22, 0.0, 0.88]),
        lean=math.radians(15.0),
        hands=np.array([[0.35, -0.33, 1.02], [0.35, 0.33, 1.02]]),
        ankles=np.array([[-0.02, -0.20, 0.40], [-0.02, 0.20, 0.40]]),
    )
    bright = CORNER_RCS / (math.pi * _CORNER_RADIUS**2)
    balls = np.tile(_CORNER_RADIUS * np.eye(3), (len(_CORNERS), 1, 1))
    solids = np.array([np.diag(size) for _, size in _SOLIDS])
    return Ellipsoids(
        centre=np.concatenate([person.centre, [place for place, _ in _SOLIDS], _CORNERS]),
        axes=np.concatenate([person.axes, solids, balls]),
        reflectivity=np.concatenate(
            [person.reflectivity, np.ones(len(solids)), np.full(len(balls), bright)]
        ),
    )
