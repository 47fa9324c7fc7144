"""Convex parts of bodies that move within a frame: limbs, tubes, spokes."""

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from polychirp.axes import Axes, FloatArray, Sealed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ellipsoids(Sealed):
    """Ellipsoids at one time, in the frame of their actor.

    Parameters
    ----------
    centre : m, ``(ellipsoid, xyz)``
    axes : three semi-axes, perpendicular vectors whose lengths are in m, ``(ellipsoid, 3, xyz)``
    reflectivity : reflected over incident power at normal incidence, ``(ellipsoid,)``; more than 1
        for a part that stands for corners, which send more back than a smooth surface
    """

    centre: Annotated[FloatArray, Axes("ellipsoid", "3")]
    axes: Annotated[FloatArray, Axes("ellipsoid", "3", "3")]
    reflectivity: Annotated[FloatArray, Axes("ellipsoid")]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rods(Sealed):
    r"""Short pieces of round tubes or wires at one time, in the frame of their actor.

    A piece reaches from ``centre`` by ``reach`` to either side, and its share in the tube's current
    falls from 1 in the middle to 0 at both ends as :math:`\cos^2`. Pieces of a tube that overlap by
    half, one every \|reach\|, are therefore the whole tube.

    Parameters
    ----------
    centre : m, ``(rod, xyz)``
    reach : m, along the tube, ``(rod, xyz)``
    radius : of the tube, m, ``(rod,)``
    reflectivity : reflected over incident power at normal incidence, ``(rod,)``
    """

    centre: Annotated[FloatArray, Axes("rod", "3")]
    reach: Annotated[FloatArray, Axes("rod", "3")]
    radius: Annotated[FloatArray, Axes("rod")]
    reflectivity: Annotated[FloatArray, Axes("rod")]


NO_ELLIPSOIDS = Ellipsoids(
    centre=np.zeros((0, 3)), axes=np.zeros((0, 3, 3)), reflectivity=np.zeros(0)
)
NO_RODS = Rods(
    centre=np.zeros((0, 3)), reach=np.zeros((0, 3)), radius=np.zeros(0), reflectivity=np.zeros(0)
)


@dataclass(frozen=True, slots=True, kw_only=True)
class MovingParts:
    """All parts of a body at one time, in the frame of its actor."""

    ellipsoids: Ellipsoids = NO_ELLIPSOIDS
    rods: Rods = NO_RODS


class Movement(Protocol):
    """Movement of a body's parts in the frame of its actor, which itself moves and may turn."""

    def parts_at(self, time: float) -> MovingParts:
        """Parts at a time of the scene, s: the same parts in the same order at all times."""
