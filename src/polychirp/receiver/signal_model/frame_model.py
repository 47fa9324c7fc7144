"""Beats and phases of moving points in a frame, and the response of the front end to them."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.model.front_end import HighPass
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.signal_model.point_signal import beat_frequency, beat_phase
from polychirp.receiver.signal_model.transmit_codes import need_own_line


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrameModel:
    """Beats, phases and high-pass responses of points in frames of one schedule.

    Parameters
    ----------
    schedule, times : the ramps, and the times of their samples
    high_pass : filter of the front end, which the receiver knows; None if there is none
    channel_y : m, y of every channel's element in the radar's frame, ``(channel,)``
    time : s, at which a motion (R, v, a) has its range, range rate and acceleration
    """

    schedule: RampSchedule
    times: SampleTimes
    high_pass: HighPass | None
    channel_y: FloatArray
    time: float

    @classmethod
    def of(cls, frame: IfFrame) -> Self:
        """The model of a frame; motions refer to the start of the frame's first ramp.

        `CapabilityError` is raised if the receiving elements are no evenly spaced line.
        """
        need_own_line(frame.array)
        return cls(
            schedule=frame.schedule,
            times=frame.times,
            high_pass=frame.high_pass,
            channel_y=frame.array.position[:, 1],
            time=float(frame.schedule.start_time[0]),
        )

    def beats(self, distance: FloatArray, range_rate: FloatArray) -> FloatArray:
        """Beat frequencies ``(…, ramp)``, Hz, of points ``(…)`` in m and m/s."""
        return beat_frequency(
            self.schedule, self.times, distance=distance, range_rate=range_rate, time=self.time
        )

    def phases(self, motion: FloatArray) -> FloatArray:
        """`beat_phase` of motions R, v, a ``(point, 3)``: ``(point, ramp, 3)``."""
        return beat_phase(self.schedule, self.times, motion=motion, time=self.time)

    def response(self, motion: FloatArray) -> ComplexArray:
        """Complex response of the high pass at the points' beats, ``(point, 1, ramp)``."""
        beats = self.beats(motion[:, 0], motion[:, 1])
        if self.high_pass is None:
            return np.ones((len(motion), 1, beats.shape[1]), dtype=np.complex128)
        return np.asarray(self.high_pass.response(beats)[:, None])
