"""Correlation by its definition."""

from __future__ import annotations

import math

import numpy as np

from polychirp.correlation.base import Correlation, need_comparable
from polychirp.model.baseband import Baseband


def plain_correlate(a: Baseband, b: Baseband) -> Correlation:
    """Correlation by its definition, lag by lag: slow, as a reference for `correlate`."""
    need_comparable(a, b)
    lags = range(1 - b.num_samples, a.num_samples)
    sums = [
        np.vdot(
            b.samples[max(0, -k) : max(0, a.num_samples - k)],
            a.samples[max(0, k) : max(0, k + b.num_samples)],
        )
        for k in lags
    ]
    scale = 1.0 / (a.sample_rate * math.sqrt(a.energy * b.energy))
    return Correlation(
        amplitude=np.array(sums, dtype=np.complex128) * scale,
        lag=np.array(lags) / a.sample_rate + (a.start_time - b.start_time),
    )
