"""Schedules of ramps that no waveform of the package makes."""

import numpy as np

from polychirp.model.ramp import RampSchedule


def drawn_chirps(count: int, *, seed: int) -> RampSchedule:
    """Chirps of one direction whose durations, slopes, starts and intervals are all drawn."""
    draw = np.random.default_rng(seed)
    duration = draw.uniform(28e-6, 42e-6, count)
    bandwidth = draw.uniform(0.7e9, 1e9, count)
    interval = duration + draw.uniform(12e-6, 22e-6, count)
    return RampSchedule(
        start_time=np.concatenate([[0.0], np.cumsum(interval)[:-1]]),
        duration=duration,
        start_frequency=76.5e9 + draw.uniform(0.0, 1e9 - bandwidth),
        slope=bandwidth / duration,
        start_phase=np.zeros(count),
        sweep=np.arange(count),
    )
