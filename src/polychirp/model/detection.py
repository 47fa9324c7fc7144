"""`Detections` of a receiver in one frame."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from polychirp.axes import Axes, IntArray, PerDetection, seal


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Detections:
    """Detections of a receiver in one frame, strongest first.

    A detection is a point. If the receiver groups points to objects, each entry is an object, with
    the place of its group and an extent (`Extent`).

    A `VictimResult` has them; every receiver returns them for an `IfFrame`.

    Parameters
    ----------
    time : instant to which range and azimuth refer, s
    range, range_rate : m, m/s (positive = away)
    azimuth : rad, positive left; NaN if all channels of the radar are above each other, as a
        single one, which measure none
    elevation : rad, positive up; NaN, as by default, if all channels are at one height
    power : W at the converter, squared amplitude of the detection in one channel
    snr : ratio of the detection statistic to its local floor. The statistic is that of each
        receiver: of `coherent` the coherent SNR over all channels, of receivers by transforms the
        mean power of the channels in the cell, noise included, which does not grow with the array
    num_points : number of points of each object; 1 by default
    length, width, range_rate_span : extent of each object along range, m, across, m, and in range
        rate, m/s; 0 by default
    num_unresolved : number of detections that a receiver of subframes left out, since not all
        subframes have them or since their range rate remains ambiguous: the number in the subframe
        with most of them; 0 by default
    """

    time: float
    range: PerDetection
    range_rate: PerDetection
    azimuth: PerDetection
    power: PerDetection
    snr: PerDetection
    elevation: PerDetection = field(default_factory=lambda: np.zeros(0))
    num_points: Annotated[IntArray, Axes("detection", dtype=np.int64)] = field(
        default_factory=lambda: np.zeros(0, dtype=np.int64)
    )
    length: PerDetection = field(default_factory=lambda: np.zeros(0))
    width: PerDetection = field(default_factory=lambda: np.zeros(0))
    range_rate_span: PerDetection = field(default_factory=lambda: np.zeros(0))
    num_unresolved: int = 0

    def __post_init__(self) -> None:
        size = np.size(self.range)
        if not np.size(self.elevation):
            object.__setattr__(self, "elevation", np.full(size, np.nan))
        if not np.size(self.num_points):
            object.__setattr__(self, "num_points", np.ones(size, dtype=np.int64))
        for name in ("length", "width", "range_rate_span"):
            if not np.size(getattr(self, name)):
                object.__setattr__(self, name, np.zeros(size))
        seal(self)

    @property
    def num_detections(self) -> int:
        """Number of detections."""
        return int(self.range.size)
