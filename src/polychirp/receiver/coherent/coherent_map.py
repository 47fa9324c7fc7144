r"""The coherent range-rate map of a frame whose ramps may differ: all samples add up in phase.

A sample that is taken at time t, while the radar transmits the frequency f, measures a point at
range R and range rate v at :math:`t_0` with the phase

.. math:: \varphi = 2\pi\,[f\,\tau - b\,\tau^2/2],\qquad \tau = 2\,[R + v\,(t-t_0)]/c,

on whatever ramp of slope b it lies. The map is :math:`|\sum y\,e^{-j\varphi}|^2` summed over
channels, divided by the number of samples: in white noise its mean is the noise power of a sample
times the number of channels.

On each ramp a range transform comes first. A point at (R, v) then stands at the range
:math:`R + v\,(t_k - t_0 + f_k/b_k)` of ramp k, with :math:`t_k` the middle of the ramp's window and
:math:`f_k` the frequency then, and the profiles of all ramps are shifted, turned in phase and
added for each range rate.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.jit import reordered
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.settings import SearchSettings
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.point_signal import replica

FINE_PER_CELL = 4
"""Steps of the profiles per range cell; chosen: the nearest step loses 0.2 dB at most."""

RATES_PER_CELL = 2
"""Range rates of the map per cell λ/2T; chosen: the nearest one loses 0.9 dB at most."""

BINS_PER_STEP = 4
"""Length of a ramp's Fourier transform over its number of samples; chosen for the interpolation."""


def map_axes(seen: Observation, limits: SearchSettings) -> Grid:
    """Axes in steps of half a cell of the whole frame, at the middle of the frame.

    Raises
    ------
    InputError
        The limits leave no range cell between them.
    """
    cell = seen.range_cell
    distance = np.arange(limits.least_range, limits.greatest_range + 0.5 * cell, 0.5 * cell)
    if distance.size < 3:
        raise InputError(
            f"the receiver's map reaches from {limits.least_range:g} m to "
            f"{limits.greatest_range:g} m, less than a range cell of {cell:.3g} m; lower its least "
            "range or raise its greatest range"
        )
    step = seen.range_rate_cell / RATES_PER_CELL
    count = int(np.ceil(limits.greatest_speed / step))
    return Grid(
        range=distance,
        range_rate=step * np.arange(-count, count + 1, dtype=np.float64),
        time=seen.model.time,
    )


def coherent_map(seen: Observation, residual: ComplexArray, axes: Grid) -> NDArray[np.float32]:
    """The map of ``residual`` ``(channel, ramp, fast)``: W, ``(range rate, range)``."""
    shift = _shifts(seen, axes.range_rate)
    fine = axes.range_step * 2 / FINE_PER_CELL
    steps = np.rint(shift / fine).astype(np.int64)
    low, high = int(steps.min()), int(steps.max())
    profile = _profiles(
        seen, residual, axes.range[0] + fine * np.arange(low, high + 2 * axes.range.size + 2)
    )
    # phases of ramps relative to each other: range is counted from the profile's own place
    elapsed = seen.middle - seen.model.time
    away = axes.range_rate[:, None]
    centre = seen.frequency.mean()
    cycles = (
        2.0
        / SPEED_OF_LIGHT
        * (seen.frequency * away * elapsed - (seen.frequency - centre) * fine * steps)
    )
    turn = np.exp(-2j * np.pi * (cycles % 1.0))
    split = np.stack([profile[..., 0::2], profile[..., 1::2]], axis=2)
    power = _sum_of_powers(
        np.ascontiguousarray(split.real),
        np.ascontiguousarray(split.imag),
        steps - low,
        turn.real.astype(np.float32),
        turn.imag.astype(np.float32),
        axes.range.size,
    )
    return np.asarray(power / np.float32(seen.count.sum()), dtype=np.float32)


def _shifts(seen: Observation, range_rate: FloatArray) -> FloatArray:
    """Range of a point on each ramp's profile less its range in mid-frame, ``(rate, ramp)``."""
    schedule = seen.model.schedule
    return range_rate[:, None] * (seen.middle - seen.model.time + seen.frequency / schedule.slope)


def _profiles(
    seen: Observation, residual: ComplexArray, ranges: FloatArray
) -> NDArray[np.complex64]:
    """Range transforms of all ramps on one axis, ``(channel, ramp, range)``, complex64.

    Their phases refer to the middle of the sampling window; those of a point at rest are removed,
    except that of the mean frequency.
    """
    from scipy.fft import fft, next_fast_len

    times, slope = seen.model.times, seen.model.schedule.slope
    channels, ramps, fast = residual.shape
    size = next_fast_len(BINS_PER_STEP * fast)
    out = np.empty((channels, ramps, ranges.size), dtype=np.complex64)
    buffer = np.zeros((channels, size), dtype=np.complex64)
    delay = 2.0 * ranges / SPEED_OF_LIGHT
    for k in range(ramps):
        count = int(times.num_samples[k])
        half = (count - 1) // 2
        buffer[:] = 0.0
        buffer[:, : count - half] = residual[:, k, half:count]
        buffer[:, size - half :] = residual[:, k, :half]
        spectrum = fft(buffer, axis=1)
        beat = slope[k] * delay
        place = (beat * size / times.rate) % size
        low = place.astype(np.int64) % size
        share = (place - np.floor(place)).astype(np.float32)
        value = spectrum[:, low] * (1 - share) + spectrum[:, (low + 1) % size] * share
        offset = 0.5 * (count - 1) - half  # the middle of the window lies between two samples
        cycles = (
            (seen.frequency[k] - seen.frequency.mean()) * delay
            - 0.5 * slope[k] * delay**2
            - beat * offset / times.rate
        )
        phase = -2.0 * np.pi * (cycles % 1.0)
        if seen.model.high_pass is not None:
            phase = phase - np.angle(seen.model.high_pass.response(beat))
        out[:, k] = value * np.exp(1j * phase)
    return out


@reordered
def _sum_of_powers(  # pragma: no cover - compiled
    real: Any, imag: Any, steps: Any, cosine: Any, sine: Any, num_ranges: int
) -> Any:
    """Sum over channels of the power of the shifted, turned and added profiles."""
    channels, ramps = real.shape[:2]
    out = np.zeros((steps.shape[0], num_ranges), dtype=np.float32)
    a = np.empty(num_ranges, dtype=np.float32)
    b = np.empty(num_ranges, dtype=np.float32)
    for v in range(steps.shape[0]):
        for m in range(channels):
            a[:] = np.float32(0.0)
            b[:] = np.float32(0.0)
            for k in range(ramps):
                step = steps[v, k]
                x = real[m, k, step & 1, step >> 1 :]
                y = imag[m, k, step & 1, step >> 1 :]
                c, s = cosine[v, k], sine[v, k]
                for i in range(num_ranges):
                    a[i] += x[i] * c - y[i] * s
                    b[i] += x[i] * s + y[i] * c
            for i in range(num_ranges):
                out[v, i] += a[i] * a[i] + b[i] * b[i]
    return out


def coherent_power(seen: Observation, residual: ComplexArray, motion: FloatArray) -> FloatArray:
    """The map's value at exact motions (R, v, a) ``(point, 3)``: the slow twin, ``(point,)``."""
    out = np.empty(len(motion))
    for n, one in enumerate(motion):
        signal = replica(seen.model.schedule, seen.model.times, motion=one, time=seen.model.time)
        phase = np.exp(1j * np.angle(seen.model.response(one[None])[0, 0]))
        mean = np.sum(residual * seen.present * (signal * phase[:, None]).conj(), axis=(1, 2))
        out[n] = np.sum(np.abs(mean) ** 2) / seen.count.sum()
    return out
