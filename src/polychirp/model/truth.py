"""`Truth`: the targets as one radar could see them at best."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from polychirp.axes import Axes, BoolArray, FloatArray, IntArray, PerTarget, seal
from polychirp.model.extent import Extent, extent_of

PerPlace = Annotated[FloatArray, Axes("place")]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """Visible metal of every target body, and the point of it that is nearest to the radar.

    A `VictimResult` has it.

    Parameters
    ----------
    time : instant of all values, s
    name : names of the targets, ``(target,)``
    range, range_rate : of the nearest visible point, m, m/s (positive = away), ``(target,)``
    azimuth, elevation : of this point, rad (positive left, up), ``(target,)``
    point : its position in the world, m, ``(target, xyz)``
    is_visible : ``(target,)``; if false, the other values are those of the nearest hidden point
    visible_share : share of the metal towards the radar that is in line of sight, by the solid
        angle that it fills at the radar, ``(target,)``; by default 1 for visible targets, else 0
    place_target : numbers of the targets on whose visible metal there are places, ``(place,)``,
        ascending; by default every visible target has one place, its nearest point
    place_range, place_range_rate, place_azimuth, place_elevation : of these places, ``(place,)``
    """

    time: float
    name: tuple[str, ...]
    range: PerTarget
    range_rate: PerTarget
    azimuth: PerTarget
    elevation: PerTarget
    point: Annotated[FloatArray, Axes("target", "3")]
    is_visible: Annotated[BoolArray, Axes("target", dtype=np.bool_)]
    visible_share: PerTarget = field(default_factory=lambda: np.zeros(0))
    place_target: Annotated[IntArray, Axes("place", dtype=np.int64)] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    place_range: PerPlace = field(default_factory=lambda: np.zeros(0))
    place_range_rate: PerPlace = field(default_factory=lambda: np.zeros(0))
    place_azimuth: PerPlace = field(default_factory=lambda: np.zeros(0))
    place_elevation: PerPlace = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if not np.size(self.visible_share):
            share = np.asarray(self.is_visible, dtype=np.float64)
            object.__setattr__(self, "visible_share", share)
        if not np.size(self.place_target):
            seen = np.flatnonzero(self.is_visible)
            object.__setattr__(self, "place_target", seen)
            for name in ("range", "range_rate", "azimuth", "elevation"):
                object.__setattr__(self, f"place_{name}", np.asarray(getattr(self, name))[seen])
        seal(self)

    def extent(self, target: int) -> Extent:
        """Extent of the visible metal of a target, by its number; 0 for a hidden one."""
        mine = self.place_target == target
        return extent_of(
            range=self.place_range[mine],
            range_rate=self.place_range_rate[mine],
            azimuth=self.place_azimuth[mine],
        )
