"""Compiled sums over samples of signals with quadratic phases, as points have on every ramp."""

from typing import Any

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.jit import reordered
from polychirp.model.if_frame import SampleTimes

RECURRENCE_LANES = 16
"""Number of recurrences that run side by side, each for every 16th sample. Chosen: a single one
waits for each product, which prevents vector instructions."""


def moments(
    samples: ComplexArray, present: BoolArray, phases: FloatArray, times: SampleTimes
) -> ComplexArray:
    """Sums of the samples without each point's phase, times powers 0, 1 and 2 of the time.

    The time counts from the middle of each ramp's sampling window.

    Parameters
    ----------
    samples : V, ``(channel, ramp, fast)``
    present : mask of the samples that are used, ``(ramp, fast)``
    phases : `point_signal.beat_phase` of the points, ``(point, ramp, 3)``

    Returns
    -------
    V, V s and V s², ``(3, point, channel, ramp)``
    """
    value = _moments(samples, present, phases, times.num_samples, times.rate)
    value[1] /= times.rate
    value[2] /= times.rate**2
    return np.asarray(value)


def subtract(
    samples: ComplexArray,
    present: BoolArray,
    phases: FloatArray,
    polynomial: ComplexArray,
    times: SampleTimes,
) -> None:
    """Subtract points from ``samples`` in place.

    Their amplitude on a ramp is a polynomial of second degree in the time from the middle of its
    window, ``(point, channel, ramp, 3)``: V, V/s and V/s². The other arrays are as for `moments`.
    """
    scaled = polynomial / times.rate ** np.arange(3)
    _subtract(samples, present, phases, scaled, times.num_samples, times.rate)


@reordered
def _unit_signal_into(real: Any, imag: Any, phase: Any, rate: float) -> None:  # pragma: no cover
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


@reordered
def _moments(  # pragma: no cover - compiled
    samples: Any, present: Any, phases: Any, counts: Any, rate: float
) -> Any:
    channels, ramps, fast = samples.shape
    points = phases.shape[0]
    out = np.zeros((3, points, channels, ramps), dtype=np.complex128)
    real, imag, time = np.empty(fast), np.empty(fast), np.empty(fast)
    x, y = np.empty((channels, fast)), np.empty((channels, fast))
    for k in range(ramps):
        count = counts[k]
        for n in range(count):
            time[n] = n - 0.5 * (count - 1)
        for m in range(channels):
            for n in range(count):
                x[m, n] = samples[m, k, n].real if present[k, n] else 0.0
                y[m, n] = samples[m, k, n].imag if present[k, n] else 0.0
        for p in range(points):
            _unit_signal_into(real[:count], imag[:count], phases[p, k], rate)
            for m in range(channels):
                a, b, c, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for n in range(count):
                    re = x[m, n] * real[n] + y[m, n] * imag[n]
                    im = y[m, n] * real[n] - x[m, n] * imag[n]
                    a += re
                    b += im
                    re *= time[n]
                    im *= time[n]
                    c += re
                    d += im
                    e += re * time[n]
                    f += im * time[n]
                out[0, p, m, k] = complex(a, b)
                out[1, p, m, k] = complex(c, d)
                out[2, p, m, k] = complex(e, f)
    return out


@reordered
def _subtract(  # pragma: no cover - compiled
    samples: Any, present: Any, phases: Any, polynomial: Any, counts: Any, rate: float
) -> None:
    channels, ramps, fast = samples.shape
    points = phases.shape[0]
    real, imag, time = np.empty(fast), np.empty(fast), np.empty(fast)
    x, y = np.empty((channels, fast)), np.empty((channels, fast))
    for k in range(ramps):
        count = counts[k]
        for n in range(count):
            time[n] = n - 0.5 * (count - 1)
        x[:] = 0.0
        y[:] = 0.0
        for p in range(points):
            _unit_signal_into(real[:count], imag[:count], phases[p, k], rate)
            for m in range(channels):
                q = polynomial[p, m, k]
                a, b, c, d, e, f = q[0].real, q[0].imag, q[1].real, q[1].imag, q[2].real, q[2].imag
                for n in range(count):
                    t = time[n]
                    g, h = a + t * (c + t * e), b + t * (d + t * f)
                    x[m, n] += g * real[n] - h * imag[n]
                    y[m, n] += g * imag[n] + h * real[n]
        for m in range(channels):
            for n in range(count):
                if present[k, n]:
                    samples[m, k, n] -= complex(x[m, n], y[m, n])
