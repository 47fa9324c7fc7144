"""The compiled signal of one point on one ramp."""

from typing import Any

import numpy as np

from polychirp.jit import inlined, reordered

RECURRENCE_LANES = 16
"""Number of recurrences that run side by side, each for every 16th sample. Chosen: a single one
waits for each product, which prevents vector instructions."""


@reordered
def unit_signal_into(real: Any, imag: Any, phase: Any, rate: float) -> None:  # pragma: no cover
    """Signal of amplitude 1 of one point on one ramp; recurrences compute its quadratic phase."""
    lanes = RECURRENCE_LANES
    slope, bend = phase[1] / rate, phase[2] / rate**2
    tr, ti, sr, si = np.empty(lanes), np.empty(lanes), np.empty(lanes), np.empty(lanes)
    x, y = _phasor(phase[0])  # of the first samples, lane by lane
    u, v = _phasor(slope + 0.5 * bend)
    a, b = _phasor(bend)
    p, q = _phasor(lanes * (slope + 0.5 * lanes * bend))  # to the next sample of the lane
    c, d = _phasor(lanes * bend)
    for i in range(lanes):
        tr[i], ti[i], sr[i], si[i] = x, y, p, q
        x, y = x * u - y * v, x * v + y * u
        u, v = u * a - v * b, u * b + v * a
        p, q = p * c - q * d, p * d + q * c
    gr, gi = _phasor(bend * lanes**2)
    whole = real.size // lanes * lanes
    for first in range(0, whole, lanes):
        for i in range(lanes):
            x, y = tr[i], ti[i]
            real[first + i], imag[first + i] = x, y
            tr[i], ti[i] = x * sr[i] - y * si[i], x * si[i] + y * sr[i]
            x, y = sr[i], si[i]
            sr[i], si[i] = x * gr - y * gi, x * gi + y * gr
    for i in range(real.size - whole):
        real[whole + i], imag[whole + i] = tr[i], ti[i]


@inlined
def _phasor(cycles: float) -> Any:  # pragma: no cover - compiled
    angle = 2.0 * np.pi * (cycles % 1.0)
    return np.cos(angle), np.sin(angle)
