"""Errors of a receiver with an isolated point, relative to the Cramér–Rao bound."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.if_frame import IfFrame
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.estimation.azimuth_rate import TYPICAL_CROSSING_SPEED
from polychirp.receiver.estimation.cramer_rao import cramer_rao_bound
from polychirp.receiver.signal_model.point_signal import path_of
from tests.support.points import HandPoint, frame_of, true_motions

FAR_OFF = 5.0
"""Ratio to the bound above which an error comes from another peak, not from noise."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Estimation:
    """Errors of one SNR's trials.

    Parameters
    ----------
    ratio : errors of range, range rate and azimuth over the bound of their trial, ``(found, 3)``
    bound : rms over all trials of that bound, ``(3,)``: m, m/s, rad
    trials : number of trials
    """

    ratio: FloatArray
    bound: FloatArray
    trials: int

    @property
    def efficiency(self) -> FloatArray:
        """Rms error over the bound, ``(3,)``: 1 for an efficient receiver."""
        return np.asarray(np.sqrt(np.mean(self.ratio**2, axis=0)))

    @property
    def found(self) -> float:
        """Share of the trials with a detection."""
        return len(self.ratio) / self.trials

    @property
    def outliers(self) -> float:
        """Share of found points with any error beyond `FAR_OFF`: the threshold effect, if not 0."""
        return float(np.mean(np.any(np.abs(self.ratio) > FAR_OFF, axis=1)))

    @property
    def spread(self) -> float:
        """Standard deviation of `efficiency` with n normal errors: 1/√2n."""
        return float(1.0 / np.sqrt(2.0 * max(len(self.ratio), 1)))


def estimate_points(
    receiver: CoherentReceiver, schedule: RampSchedule, *, snr: float, trials: int, seed: int = 0
) -> Estimation:
    """Trials with one random point: 4 … 26 m, ±25 m/s, ±3 m/s², ±50°, and a changing azimuth.

    The rate of its azimuth is random with the receiver's prior, which the bound includes. Errors
    and bound are those in the middle of the frame.

    Parameters
    ----------
    snr : power ratio per sample and channel at the start of the frame
    """
    ratios, bounds = [], []
    for trial in range(trials):
        draw = np.random.default_rng([seed, trial])
        point = HandPoint(
            range=draw.uniform(4.0, 26.0),
            range_rate=draw.uniform(-25.0, 25.0),
            acceleration=draw.uniform(-3.0, 3.0),
            azimuth=draw.uniform(-0.87, 0.87),
            power=snr,
        )
        point = replace(point, sine_rate=TYPICAL_CROSSING_SPEED / point.range * draw.normal())
        frame = frame_of(schedule, [point], seed=seed * 100_003 + trial)
        true, bound = _truth_and_bound(point, frame)
        bounds.append(bound)
        found = receiver.detect(frame)
        if found.num_detections:
            values = np.array([found.range[0], found.range_rate[0], found.azimuth[0]])
            ratios.append((values - true) / bound)
    return Estimation(
        ratio=np.array(ratios).reshape(-1, 3),
        bound=np.sqrt(np.mean(np.square(bounds), axis=0)),
        trials=trials,
    )


def _truth_and_bound(point: HandPoint, frame: IfFrame) -> tuple[FloatArray, FloatArray]:
    """Range, m, range rate, m/s, and azimuth, rad, in the middle of the frame, and their bounds.

    The bound's SNR is the mean over the samples, as the point's power follows 1/R⁴.
    """
    schedule, times = frame.schedule, frame.times
    (*motion, azimuth) = true_motions(schedule, [point])[0]
    start = np.array([[point.range, point.range_rate, point.acceleration]])
    first, last = float(schedule.start_time.min()), float(schedule.end_time.max())
    distance = path_of(start, (times.time - first)[times.is_sample])[0]
    bound = cramer_rao_bound(
        schedule,
        times,
        frame.array,
        motion=np.array(motion),
        azimuth=azimuth,
        snr=point.power * float(np.mean((point.range / distance) ** 4)),
        time=0.5 * (first + last),
        sine_rate_deviation=TYPICAL_CROSSING_SPEED / point.range,
    )
    true = np.array([motion[0], motion[1], azimuth])
    return true, np.array([bound.range, bound.range_rate, bound.azimuth])
