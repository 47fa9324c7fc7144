"""Tubes, rings and spokes as rods: the metal of two-wheelers."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.moving_parts import Rods

TUBE_STEP: Final = 0.04
"""Greatest distance of the rods of a straight tube, m. Chosen: over a rod and 5 m away, waves are
spherical to 0.1 mm; half of it doubles the number of rods."""

RING_STEP: Final = 0.018
"""Greatest distance of the rods of a ring, m. Chosen: a ring of 0.3 m is straight over it to a
seventh of a wavelength; twice of it is not."""

RUBBER_REFLECTIVITY: Final = 0.09
"""Power that a tyre reflects: permittivity 3.5, as the material "rubber" (an assumption)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tube:
    """A straight round tube of metal from ``start`` to ``end``, m ``(x, y, z)``."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float

    @property
    def other_side(self) -> "Tube":
        """The same tube on the other side of the body."""
        (a, b, c), (d, e, f) = self.start, self.end
        return Tube(start=(a, -b, c), end=(d, -e, f), radius=self.radius)


def both_sides(tubes: Sequence[Tube]) -> list[Tube]:
    """Tubes on the left side, and on the right side."""
    return [*tubes, *(tube.other_side for tube in tubes)]


def rods_of(tubes: Sequence[Tube]) -> Rods:
    """Rods of straight tubes; those of a tube begin and end half a step within it.

    >>> rods_of([Tube(start=(0, 0, 0), end=(0, 0, 0.4), radius=0.01)]).centre.shape
    (10, 3)
    """
    centre, reach, radius = [], [], []
    for tube in tubes:
        start, way = np.array(tube.start), np.subtract(tube.end, tube.start)
        count = max(1, math.ceil(float(np.linalg.norm(way)) / TUBE_STEP - 1e-9))
        share = (np.arange(count) + 0.5) / count
        centre.append(start + share[:, None] * way)
        reach.append(np.tile(way / count, (count, 1)))
        radius.append(np.full(count, tube.radius))
    widths = np.concatenate(radius)
    return Rods(
        centre=np.concatenate(centre),
        reach=np.concatenate(reach),
        radius=widths,
        reflectivity=np.ones(len(widths)),
    )


def ring(
    axle: FloatArray, radius: float, *, tube: float, aside: float = 0.0, reflectivity: float = 1.0
) -> Rods:
    """Rods of a ring in the plane of x and z about an axle.

    A ring that turns about its axle stays the same, so its rods do not turn.

    Parameters
    ----------
    axle : m, ``(xyz,)``; aside : distance of the ring's plane from it, m
    radius, tube : of the ring and of its tube, m
    """
    count = math.ceil(2 * math.pi * radius / RING_STEP)
    angle = 2 * math.pi * np.arange(count) / count
    zero = np.zeros(count)
    outwards = np.stack([np.cos(angle), zero, np.sin(angle)], axis=1)
    along = np.stack([-np.sin(angle), zero, np.cos(angle)], axis=1)
    return Rods(
        centre=axle + np.array([0.0, aside, 0.0]) + radius * outwards,
        reach=2 * math.pi * radius / count * along,
        radius=np.full(count, tube),
        reflectivity=np.full(count, reflectivity),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Spokes:
    """Spokes of a wheel about the axle (x, z), m.

    Parameters
    ----------
    count : number of spokes
    inner, outer : distances of their ends from the axle, m
    flange : distance of their inner ends from the wheel's plane, m, left and right in turn
    radius : of a spoke, m
    """

    x: float
    z: float
    count: int
    inner: float
    outer: float
    flange: float
    radius: float

    def at(self, turn: float) -> Rods:
        """Rods of the spokes after the wheel has rolled forwards by an angle, rad."""
        angle = 2 * math.pi * np.arange(self.count) / self.count - turn
        side = self.flange * np.where(np.arange(self.count) % 2, 1.0, -1.0)
        pieces = max(1, math.ceil((self.outer - self.inner) / TUBE_STEP - 1e-9))
        share = (np.arange(pieces) + 0.5) / pieces
        outwards = np.stack([np.cos(angle), np.zeros(self.count), np.sin(angle)], axis=1)
        start = self.inner * outwards + side[:, None] * np.array([0.0, 1.0, 0.0])
        way = self.outer * outwards - start
        centre = start[:, None] + share[:, None] * way[:, None]
        count = self.count * pieces
        return Rods(
            centre=centre.reshape(-1, 3) + np.array([self.x, 0.0, self.z]),
            reach=np.repeat(way / pieces, pieces, axis=0),
            radius=np.full(count, self.radius),
            reflectivity=np.ones(count),
        )


def together(parts: Sequence[Rods]) -> Rods:
    """Rods of several parts, in their order."""
    return Rods(
        **{
            name: np.concatenate([getattr(part, name) for part in parts])
            for name in ("centre", "reach", "radius", "reflectivity")
        }
    )
