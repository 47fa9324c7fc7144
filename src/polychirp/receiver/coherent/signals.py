"""Compiled sums over samples of signals with quadratic phases, as points have on every ramp."""

from typing import Any

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.jit import reordered
from polychirp.model.if_frame import SampleTimes
from polychirp.receiver.signal_model.unit_signal import unit_signal_into


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
def _moments(  # pragma: no cover - compiled
    samples: Any, present: Any, phases: Any, counts: Any, rate: float
) -> Any:
    channels, ramps, fast = samples.shape
    points = phases.shape[0]
    out = np.zeros((3, points, channels, ramps), dtype=np.complex128)
    real, imag = np.empty(fast), np.empty(fast)
    x, y = np.empty((channels, fast)), np.empty((channels, fast))
    for k in range(ramps):
        count = counts[k]
        time = np.arange(count) - 0.5 * (count - 1)
        for m in range(channels):
            for n in range(count):
                x[m, n] = samples[m, k, n].real if present[k, n] else 0.0
                y[m, n] = samples[m, k, n].imag if present[k, n] else 0.0
        for p in range(points):
            unit_signal_into(real[:count], imag[:count], phases[p, k], rate)
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
    real, imag = np.empty(fast), np.empty(fast)
    x, y = np.empty((channels, fast)), np.empty((channels, fast))
    for k in range(ramps):
        count = counts[k]
        time = np.arange(count) - 0.5 * (count - 1)
        x[:] = 0.0
        y[:] = 0.0
        for p in range(points):
            unit_signal_into(real[:count], imag[:count], phases[p, k], rate)
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
