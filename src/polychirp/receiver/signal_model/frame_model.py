"""What a moving point puts into a frame: its beats, phases and what the front end makes of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.model.front_end import HighPass
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.signal_model.point_signal import beat_frequency, beat_phase


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Waves:
    """Points' signals in frames of one schedule.

    Parameters
    ----------
    schedule, times : of the ramps and their samples
    high_pass : that the receiver knows of
    along : m, of the channels, ``(channel,)``
    time : s, to which motions refer
    """

    schedule: RampSchedule
    times: SampleTimes
    high_pass: HighPass | None
    along: FloatArray
    time: float

    @classmethod
    def of(cls, frame: IfFrame) -> Waves:
        """Of a frame, motions being those at its first ramp's start."""
        return cls(
            schedule=frame.schedule,
            times=frame.times,
            high_pass=frame.high_pass,
            along=frame.array.position[:, 1],
            time=float(frame.schedule.start_time[0]),
        )

    def beats(self, distance: FloatArray, range_rate: FloatArray) -> FloatArray:
        """Hz, ``(…, ramp)``, of points ``(…)``."""
        return beat_frequency(
            self.schedule, self.times, distance=distance, range_rate=range_rate, time=self.time
        )

    def phases(self, motion: FloatArray) -> FloatArray:
        """`beat_phase` of points ``(point, 3)``: ``(point, ramp, 3)``."""
        return beat_phase(self.schedule, self.times, motion=motion, time=self.time)

    def response(self, motion: FloatArray) -> ComplexArray:
        """How the high pass weakens and turns each point's beats, ``(point, 1, ramp)``."""
        beats = self.beats(motion[:, 0], motion[:, 1])
        if self.high_pass is None:
            return np.ones((len(motion), 1, beats.shape[1]), dtype=np.complex128)
        return np.asarray(self.high_pass.response(beats)[:, None])

    def turned_back(self, motion: FloatArray) -> ComplexArray:
        """Takes back how the high pass turns up- and down-beats against each other.

        ``(point, 1, ramp)``, of points of any ``motion`` ``(point, 3)``.
        """
        if self.high_pass is None:
            return self.response(motion)
        return np.asarray(np.exp(-1j * np.angle(self.response(motion))))
