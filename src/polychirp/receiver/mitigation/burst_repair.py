"""Repair of bursts: first a detector says which samples are hit, then a method repairs them."""

from dataclasses import dataclass
from typing import Annotated

from polychirp.axes import BoolArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation.base import refuse_unfit
from polychirp.receiver.mitigation.burst_detectors import AnyBurstDetector, MedianThreshold
from polychirp.receiver.mitigation.burst_detectors.base import guard_time
from polychirp.receiver.mitigation.burst_detectors.median_threshold import FALSE_MITIGATION
from polychirp.spec import Spec
from polychirp.units import Between, Seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class BurstRepair(Spec):
    """Settings of the first step, which all repairs of bursts share: detection.

    Parameters
    ----------
    factor, false_mitigation, guard, whitening : settings of the default detector, `MedianThreshold`
    detector : another detector, with settings of its own; None for the default one
    """

    factor: float | None = None
    false_mitigation: float = FALSE_MITIGATION
    guard: Seconds | None = None
    whitening: Annotated[int, Between(greatest=1024)] = 8
    detector: AnyBurstDetector | None = None

    def __post_init__(self) -> None:
        if self.detector is not None and self._default() != MedianThreshold():
            raise InputError(
                "factor, false_mitigation, guard and whitening are settings of the default "
                "detector; give them in the table 'detector', or leave that table out"
            )
        self._default()  # refuses what it cannot use

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples that are hit, ``(ramp, fast)``; False in the padding of a ramp."""
        return (self.detector or self._default()).hit(frame)

    def refuse(
        self, schedule: RampSchedule, *, times: SampleTimes, is_real: bool, num_channels: int
    ) -> None:
        """Refuse ramps that the detector cannot read."""
        refuse_unfit(
            self.detector, schedule, times=times, is_real=is_real, num_channels=num_channels
        )

    def _default(self) -> MedianThreshold:
        return MedianThreshold(
            factor=self.factor,
            false_mitigation=self.false_mitigation,
            guard=self.guard,
            whitening=self.whitening,
        )

    def guard_time(self, sample_rate: float) -> float:
        """The detector's guard, s, if the converter takes ``sample_rate`` samples per second.

        >>> BurstRepair().guard_time(20e6)
        4e-07
        """
        guard = self.guard if self.detector is None else self.detector.guard
        return guard_time(guard, sample_rate)
