"""`Detections` of a receiver in one frame."""

from dataclasses import dataclass

from polychirp.axes import PerDetection, Sealed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Detections(Sealed):
    """Detections of a receiver in one frame, strongest first.

    Parameters
    ----------
    time : instant to which range and azimuth refer, s
    range, range_rate : m, m/s (positive = away)
    azimuth : rad, positive left; NaN if the radar has a single channel, which measures none
    power : W at the converter, squared amplitude of the detection in one channel
    snr : ratio of the detection statistic to its local floor
    """

    time: float
    range: PerDetection
    range_rate: PerDetection
    azimuth: PerDetection
    power: PerDetection
    snr: PerDetection

    @property
    def num_detections(self) -> int:
        """Number of detections."""
        return int(self.range.size)
