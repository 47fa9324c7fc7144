"""Detection of interference bursts as ridges of the time-frequency plane."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import BoolArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation.burst_detectors.base import guard_time, widened
from polychirp.receiver.mitigation.stft_excision import StftExcision, nearest_slices
from polychirp.spec import Spec
from polychirp.units import Between, Seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class StftCfar(Spec):
    """Detector of bursts that exceed the threshold of `StftExcision` in the plane of a ramp.

    A sample is hit if ``least_rows`` rows of the slice whose middle is nearest to it exceed their
    thresholds, or if a sample within ``guard`` is hit. Bursts that are much weaker than the echoes
    are found in the rows beside theirs, and the false-alarm probability of a cell is known on ramps
    of three windows or more (`StftExcision`). It takes 32 log₂(window) real multiplications per
    sample and channel.

    Parameters
    ----------
    window : length of the Hann window, samples; slices are an eighth of it apart
    false_alarm_probability : of a cell that contains noise alone
    least_rows : number of rows above their thresholds from which a slice is hit
    guard : s, before and after a hit slice; None for `GUARD_SAMPLES` intervals of the samples
    """

    kind: Literal["stft-cfar"] = "stft-cfar"
    window: Annotated[int, Between(greatest=65_536)] = 32
    false_alarm_probability: float = 1e-6
    least_rows: Annotated[int, Between(greatest=65_536)] = 1
    guard: Seconds | None = None

    def __post_init__(self) -> None:
        self._excision()  # refuses what it cannot use
        if self.least_rows < 1:
            raise InputError("a detector's number of rows must be 1 or more")
        if self.guard is not None and self.guard < 0:
            raise InputError("a detector's guard cannot be negative")

    def refuse(
        self, schedule: RampSchedule, *, times: SampleTimes, is_real: bool, num_channels: int
    ) -> None:
        """Refuse ramps of which none is as long as the window, as `StftExcision` does."""
        self._excision().refuse(schedule, times=times, is_real=is_real, num_channels=num_channels)

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples that are hit, ``(ramp, fast)``; False in the padding of a ramp."""
        present = frame.times.is_sample
        rows = np.count_nonzero(self._excision().hit_cells(frame), axis=1)
        near = nearest_slices(self.window, present.shape[1])
        hit = (rows >= self.least_rows)[:, near] & present
        rate = frame.times.rate
        return widened(hit, guard_time(self.guard, rate) * rate) & present

    def _excision(self) -> StftExcision:
        return StftExcision(
            window=self.window, false_alarm_probability=self.false_alarm_probability
        )
