"""The compiled signal of one point on one ramp."""

from typing import Any

import numpy as np

from polychirp.jit import reordered

RECURRENCE_LANES = 16
"""Number of recurrences that run side by side, each for every 16th sample. Chosen: a single one
waits for each product, which prevents vector instructions."""


@reordered
def unit_signal_into(real: Any, imag: Any, phase: Any, rate: float) -> None:  # pragma: no cover
    """Signal of amplitude 1 of one point on one ramp; recurrences compute its quadratic phase."""
    slope, bend = phase[1] / rate, phase[2] / rate**2
    tr, ti, sr, si = (
        np.empty(RECURRENCE_LANES),
        np.empty(RECURRENCE_LANES),
        np.empty(RECURRENCE_LANES),
        np.empty(RECURRENCE_LANES),
    )
    for i in range(RECURRENCE_LANES):
        turn = 2.0 * np.pi * ((phase[0] + slope * i + 0.5 * bend * i * i) % 1.0)
        step = (
            2.0 * np.pi * ((RECURRENCE_LANES * (slope + bend * (i + 0.5 * RECURRENCE_LANES))) % 1.0)
        )
        tr[i], ti[i], sr[i], si[i] = np.cos(turn), np.sin(turn), np.cos(step), np.sin(step)
    gr = np.cos(2.0 * np.pi * bend * RECURRENCE_LANES**2)
    gi = np.sin(2.0 * np.pi * bend * RECURRENCE_LANES**2)
    for first in range(0, real.size, RECURRENCE_LANES):
        count = min(RECURRENCE_LANES, real.size - first)
        for i in range(count):
            real[first + i], imag[first + i] = tr[i], ti[i]
        for i in range(RECURRENCE_LANES):
            x, y = tr[i], ti[i]
            tr[i], ti[i] = x * sr[i] - y * si[i], x * si[i] + y * sr[i]
            x, y = sr[i], si[i]
            sr[i], si[i] = x * gr - y * gi, x * gi + y * gr
