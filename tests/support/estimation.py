"""Errors of a receiver with an isolated point, relative to the Cramér–Rao bound."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.chain import Receiver
from polychirp.receiver.estimation.azimuth_rate import TYPICAL_CROSSING_SPEED
from polychirp.receiver.estimation.cramer_rao import cramer_rao_bound
from tests.support.points import HandPoint, frame_of

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
    receiver: Receiver, schedule: RampSchedule, *, snr: float, trials: int, seed: int = 0
) -> Estimation:
    """Trials with one random point: 4 … 26 m, ±25 m/s, ±3 m/s², ±50°, and a changing azimuth.

    The rate of its azimuth is random with the receiver's prior, which the bound includes.

    Parameters
    ----------
    snr : power ratio per sample and channel
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
        deviation = TYPICAL_CROSSING_SPEED / point.range
        point = replace(point, sine_rate=deviation * draw.normal())
        frame = frame_of(schedule, [point], seed=seed * 100_003 + trial)
        least = cramer_rao_bound(
            schedule,
            frame.times,
            frame.array,
            motion=np.array([point.range, point.range_rate, point.acceleration]),
            azimuth=point.azimuth,
            snr=snr,
            time=float(schedule.start_time[0]),
            sine_rate_deviation=deviation,
        )
        bounds.append([least.range, least.range_rate, least.azimuth])
        found = receiver.detect(frame)
        if found.num_detections:
            values = np.array([found.range[0], found.range_rate[0], found.azimuth[0]])
            ratios.append(values - [point.range, point.range_rate, point.azimuth])
            ratios[-1] /= bounds[-1]
    return Estimation(
        ratio=np.array(ratios).reshape(-1, 3),
        bound=np.sqrt(np.mean(np.square(bounds), axis=0)),
        trials=trials,
    )
