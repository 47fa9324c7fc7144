"""`Ramps`: the times, frequencies and channels of a frame, as kernels read them."""

from typing import NamedTuple, Self

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.receiver.signal_model.frame_model import FrameModel

BEGIN, ELAPSED, FIRST_FREQUENCY, FREQUENCY, SLOPE, HALF, HALF_LENGTH, USED = range(8)
"""Rows of `Ramps.table`."""


class Ramps(NamedTuple):
    """Numbers of all ramps of a frame, and what the ramps share.

    There are few arrays, because kernels compile the longer, the more they are given.

    Parameters
    ----------
    table : numbers of the ramps, ``(8, ramp)``: times from the middle of the frame to the first
        sample and to the middle of the sampling window, s; transmitted frequencies then, Hz; the
        slope, Hz/s; the time from the first sample to the middle, and half the length of the
        window, half a sample's step longer, s; the number of samples that are used
    channel_y : place of every channel on the array's line, m, ``(channel,)``
    corners : of the high pass, Hz, ``(section,)``; empty if there is none
    mean_frequency : mean of the frequencies in the middle, Hz
    rate : sample rate, 1/s
    """

    table: FloatArray
    channel_y: FloatArray
    corners: FloatArray
    mean_frequency: float
    rate: float

    @classmethod
    def of(cls, model: FrameModel, present: BoolArray) -> Self:
        """Those of a frame of which the samples ``present`` ``(ramp, fast)`` are used."""
        schedule, times = model.schedule, model.times
        half = 0.5 * (times.num_samples - 1) / times.rate
        begin = times.first - model.time
        first = schedule.start_frequency + schedule.slope * (times.first - schedule.start_time)
        frequency = first + schedule.slope * half
        reach = 0.5 * times.num_samples / times.rate
        used = present.sum(axis=1)
        rows = [begin, begin + half, first, frequency, schedule.slope, half, reach, used]
        corners = () if model.high_pass is None else model.high_pass.corners
        return cls(
            table=np.array(rows, dtype=np.float64),
            channel_y=np.array(model.channel_y),
            corners=np.array(corners, dtype=np.float64),
            mean_frequency=float(frequency.mean()),
            rate=float(times.rate),
        )

    @property
    def num_ramps(self) -> int:
        """Number of ramps."""
        return int(self.table.shape[1])
