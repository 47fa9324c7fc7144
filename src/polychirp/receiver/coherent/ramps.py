"""`Ramps`: the times, frequencies and channels of a frame, as kernels read them."""

from typing import NamedTuple, Self

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.receiver.signal_model.frame_model import FrameModel


class Ramps(NamedTuple):
    """Arrays over the ramps of a frame, ``(ramp,)``, and what all ramps share.

    Parameters
    ----------
    begin, elapsed : time from the middle of the frame to the first sample, and to the middle of the
        sampling window, s
    first_frequency, frequency : transmitted frequency then, Hz
    slope : Hz/s
    half : time from the first sample to the middle of the window, s
    reach : half the length of the window, s; a sample's step longer than twice ``half``
    used : number of samples that are used
    channel_y : place of every channel on the array's line, m, ``(channel,)``
    corners : of the high pass, Hz, ``(section,)``; empty if there is none
    mean_frequency : mean of ``frequency``, Hz
    rate : sample rate, 1/s
    """

    begin: FloatArray
    elapsed: FloatArray
    first_frequency: FloatArray
    frequency: FloatArray
    slope: FloatArray
    half: FloatArray
    reach: FloatArray
    used: FloatArray
    channel_y: FloatArray
    corners: FloatArray
    mean_frequency: float
    rate: float

    @classmethod
    def of(cls, model: FrameModel, present: BoolArray) -> Self:
        """Those of a frame of which the samples ``present`` ``(ramp, fast)`` are used."""
        schedule, times = model.schedule, model.times
        half = np.asarray(0.5 * (times.num_samples - 1) / times.rate)
        first = schedule.start_frequency + schedule.slope * (times.first - schedule.start_time)
        frequency = first + schedule.slope * half
        corners = () if model.high_pass is None else model.high_pass.corners
        return cls(
            begin=times.first - model.time,
            elapsed=times.first - model.time + half,
            first_frequency=first,
            frequency=frequency,
            slope=np.array(schedule.slope),
            half=half,
            reach=np.asarray(0.5 * times.num_samples / times.rate),
            used=present.sum(axis=1).astype(np.float64),
            channel_y=np.array(model.channel_y),
            corners=np.array(corners, dtype=np.float64),
            mean_frequency=float(frequency.mean()),
            rate=float(times.rate),
        )
