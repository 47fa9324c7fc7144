"""`Detections` of a receiver in one frame."""

from dataclasses import dataclass, field

import numpy as np

from polychirp.axes import PerDetection, seal


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Detections:
    """Detections of a receiver in one frame, strongest first.

    Parameters
    ----------
    time : instant to which range and azimuth refer, s
    range, range_rate : m, m/s (positive = away)
    azimuth : rad, positive left; NaN if all channels of the radar are above each other, as a
        single one, which measure none
    elevation : rad, positive up; NaN, as by default, if all channels are at one height
    power : W at the converter, squared amplitude of the detection in one channel
    snr : ratio of the detection statistic to its local floor
    """

    time: float
    range: PerDetection
    range_rate: PerDetection
    azimuth: PerDetection
    power: PerDetection
    snr: PerDetection
    elevation: PerDetection = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if not np.size(self.elevation):
            object.__setattr__(self, "elevation", np.full(np.size(self.range), np.nan))
        seal(self)

    @property
    def num_detections(self) -> int:
        """Number of detections."""
        return int(self.range.size)
