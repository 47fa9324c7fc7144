"""`Truth`: the targets as one radar could see them at best."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import Axes, BoolArray, FloatArray, PerTarget, Sealed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth(Sealed):
    """Visible point of every target body that is nearest to a radar's phase centre.

    Parameters
    ----------
    time : instant of all values, s
    name : names of the targets, ``(target,)``
    range, range_rate : m, m/s (positive = away), ``(target,)``
    azimuth, elevation : rad (positive left, up), ``(target,)``
    point : position of the point in the world, m, ``(target, xyz)``
    is_visible : ``(target,)``; if false, the other values are those of the nearest hidden point
    """

    time: float
    name: tuple[str, ...]
    range: PerTarget
    range_rate: PerTarget
    azimuth: PerTarget
    elevation: PerTarget
    point: Annotated[FloatArray, Axes("target", "3")]
    is_visible: Annotated[BoolArray, Axes("target", dtype=np.bool_)]
