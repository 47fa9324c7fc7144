"""From a cell of the map to a range and a rate: the generalised up/down pairing."""

from __future__ import annotations

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.point import beat_frequency

TYPICAL_ACCELERATION = 20.0
"""m/s², of a point's distance: braking, and the lateral motion of what passes by."""


def range_and_rate_from_beats(
    logs: FloatArray,
    schedule: RampSchedule,
    times: SampleTimes,
    *,
    distance: float,
    range_rate: float,
    time: float,
) -> tuple[float, float]:
    r"""Least-squares range and rate from the beat measured on every ramp.

    Near the guess the beat of ramp k is linear in (R, v); with peaks :math:`\hat f_k` of the
    spectra ``logs`` ``(ramp, frequency)`` this is eqs 9 and 10 of the paper, for any number of
    ramps of any slopes. Ramps where another echo or interference pulls the peak away are given
    Tukey's biweight. Returns m and m/s at ``time``; the guess where the fit runs away.
    """
    point = np.array([distance, range_rate])
    jacobian = _jacobian(schedule, times, point, time)
    for _ in range(3):
        predicted = beat_frequency(
            schedule, times, distance=point[0], range_rate=point[1], time=time
        )
        error = _nearest_peaks(logs, times, predicted) - predicted
        step = _robust_step(jacobian, error, resolution=times.rate / times.num_samples)
        point = point + step
    limit = np.array([0.3, 0.8])  # a cell of the map and a bit: further away is another point
    if np.any(np.abs(point - [distance, range_rate]) > limit):
        return distance, range_rate
    return float(point[0]), float(point[1])


def _jacobian(
    schedule: RampSchedule, times: SampleTimes, point: FloatArray, time: float
) -> FloatArray:
    """Beat per metre and per metre per second, ``(ramp, 2)``."""
    moved = [
        beat_frequency(schedule, times, distance=point[0] + dr, range_rate=point[1] + dv, time=time)
        for dr, dv in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    ]
    return np.stack([moved[1] - moved[0], moved[2] - moved[0]], axis=-1)


def _nearest_peaks(logs: FloatArray, times: SampleTimes, predicted: FloatArray) -> FloatArray:
    """Frequency of the strongest bin near each prediction, a parabola through its top: Hz."""
    ramps, size = logs.shape
    reach = np.maximum(2, np.round(0.75 * size / times.num_samples)).astype(np.int64)
    offsets = np.arange(-reach.max(), reach.max() + 1)
    centre = np.round(predicted * size / times.rate).astype(np.int64)
    index = centre[:, None] + offsets
    rows = np.arange(ramps)[:, None]
    values = np.where(np.abs(offsets) <= reach[:, None], logs[rows, index % size], -np.inf)
    best = index[np.arange(ramps), np.argmax(values, axis=1)]
    left, middle, right = (logs[np.arange(ramps), (best + d) % size] for d in (-1, 0, 1))
    bend = left - 2.0 * middle + right
    shift = np.where(bend < 0, 0.5 * (left - right) / np.where(bend < 0, bend, -1.0), 0.0)
    return np.asarray((best + np.clip(shift, -0.5, 0.5)) * times.rate / size)


def _robust_step(jacobian: FloatArray, error: FloatArray, resolution: FloatArray) -> FloatArray:
    """One weighted least-squares step; errors beyond a fifth of a cell fade out."""
    spread = np.maximum(1.5 * np.median(np.abs(error)), 0.01 * resolution)
    weight = np.clip(1.0 - (error / (4.0 * spread)) ** 2, 0.0, 1.0)  # square root of Tukey's
    solution, *_ = np.linalg.lstsq(jacobian * weight[:, None], error * weight, rcond=None)
    return np.asarray(solution)


def motion_steps(
    errors: FloatArray, strength: FloatArray, sensitivity: FloatArray, resolution: FloatArray
) -> FloatArray:
    r"""Corrections of (R, v, a) that the beat errors of all ramps ask for: ``(point, 3)``.

    Weighted least squares over ramps, by the point's power on each, Tukey's biweight against
    ramps that another echo or a burst spoils; a street's accelerations (a few m/s², lateral
    motion included) are the prior on a.

    Parameters
    ----------
    errors : Hz, ``(point, ramp)``
    strength : power, ``(point, ramp)``
    sensitivity : Hz per m, m/s, m/s², ``(ramp, 3)``
    resolution : Hz, ``(ramp,)``, one over a ramp's window
    """
    bounded = np.clip(errors, -0.5 * resolution, 0.5 * resolution)
    spread = np.median(np.abs(bounded), axis=1, keepdims=True) + 1e-4 * resolution
    tukey = np.clip(1.0 - (bounded / (6.0 * spread)) ** 2, 0.0, 1.0) ** 2
    weight = tukey * strength / (spread**2 * np.mean(strength, axis=1, keepdims=True) + 1e-300)
    normal = np.einsum("pk,ki,kj->pij", weight, sensitivity, sensitivity)
    right = np.einsum("pk,ki,pk->pi", weight, sensitivity, bounded)
    normal += np.diag([1e-6, 1e-6, 1.0 / TYPICAL_ACCELERATION**2])
    return np.asarray(np.linalg.solve(normal, right[..., None])[..., 0])
