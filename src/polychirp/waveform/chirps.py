"""`chirps`: the schedule of single ramps with given bands, durations and starts."""

import numpy as np

from polychirp.axes import BoolArray, FloatArray, IntArray
from polychirp.model.ramp import RampSchedule, continuous_phase


def chirps(
    *,
    start_time: FloatArray,
    duration: FloatArray,
    lowest: FloatArray,
    bandwidth: FloatArray,
    is_up: BoolArray,
    sweep: IntArray,
) -> RampSchedule:
    """Schedule of ramps, each from one edge of its band to the other, with a continuous phase.

    Parameters
    ----------
    start_time, duration : s, ``(ramp,)``
    lowest, bandwidth : Hz, ``(ramp,)``, lowest frequency and width of each ramp's band
    is_up : ``(ramp,)``, true if the frequency rises
    sweep : ``(ramp,)``, number of the sweep of each ramp

    Examples
    --------
    >>> ramps = chirps(
    ...     start_time=np.array([0.0]), duration=np.array([1e-3]), lowest=np.array([79e9]),
    ...     bandwidth=np.array([1e9]), is_up=np.array([False]), sweep=np.array([0]))
    >>> ramps.start_frequency / 1e9, ramps.stop_frequency / 1e9
    (array([80.]), array([79.]))
    """
    start_frequency = lowest + np.where(is_up, 0.0, bandwidth)
    slope = np.where(is_up, 1.0, -1.0) * bandwidth / duration
    return RampSchedule(
        start_time=start_time,
        duration=duration,
        start_frequency=start_frequency,
        slope=slope,
        start_phase=continuous_phase(
            duration=duration, start_frequency=start_frequency, slope=slope
        ),
        sweep=sweep,
    )


def starts(interval: FloatArray) -> FloatArray:
    """Start times, s ``(ramp,)``, of ramps from whose starts to the next ones are ``interval`` s.

    >>> starts(np.array([1.0, 2.0, 3.0]))
    array([0., 1., 3.])
    """
    return np.concatenate([[0.0], np.cumsum(interval)[:-1]])
