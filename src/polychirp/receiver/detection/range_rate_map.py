"""The range-rate map: mean over ramps, of any slopes, of ln(power) at a point's beats."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.jit import compiled
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.point_signal import beat_frequency
from polychirp.threads import in_ranges


def spectrum_size(times: SampleTimes) -> int:
    """Length of the zero-padded transforms: at least two bins per resolution cell of every ramp."""
    return int(2 ** np.ceil(np.log2(2 * times.most_samples)))


def log_spectra(samples: ComplexArray, weight: FloatArray, size: int) -> FloatArray:
    """Natural logarithm of every ramp's windowed power spectrum, ``(beam, ramp, frequency)``.

    ``samples`` are ``(beam, ramp, fast)``; ``weight`` is the window, ``(ramp, fast)``. White noise
    of power σ² per sample has the mean power σ² in every bin before the logarithm, for any window.
    """
    energy = np.sum(weight**2, axis=-1)
    scale = 1.0 / np.sqrt(np.maximum(energy, 1e-30))
    spectrum = np.fft.fft(samples * (weight * scale[:, None]), size, axis=-1)
    power = spectrum.real**2 + spectrum.imag**2
    return np.log(np.maximum(power, 1e-300))


def noise_share(cells: FloatArray) -> FloatArray:
    r"""Share of the noise power, 0 … 1, that subtraction of a point removes near its beat.

    ``cells`` is the distance x of a frequency from the beat, in resolution cells. The amplitude
    that is fitted to the spectrum of each ramp (`spectral_fit.Band.fit`) includes noise near the
    beat, so subtraction removes this share of it, with W the transform of the window w, here sin²,
    and :math:`W_n` that of :math:`w^n`:

    .. math:: \frac{2 W(x) W_3(x)}{W_2(0)^2} - \frac{W(x)^2\,W_4(0)}{W_2(0)^3}
    """
    own = cosine_sum(cells, (0.5, -0.25))  # sin²: 1/2 − 1/2 cos
    cubed = cosine_sum(cells, (5 / 16, -15 / 64, 3 / 32, -1 / 64))  # sin⁶
    second, fourth = 3 / 8, 35 / 128  # ∫ sin⁴, ∫ sin⁸
    return np.clip(2.0 * own * cubed / second**2 - own**2 * fourth / second**3, 0.0, 1.0)


def cosine_sum(cells: FloatArray, coefficients: tuple[float, ...]) -> FloatArray:
    """Transform of a window c₀ + 2 Σ c_m cos(2πmx), 0 ≤ x ≤ 1, at frequencies ``cells``.

    The unit of frequency is the resolution cell, 1 over the window's length. Phases refer to the
    middle, x = 1/2, where cos(2πmx) = (−1)^m; hence this factor.
    """
    out = coefficients[0] * np.sinc(cells)
    for m, c in enumerate(coefficients[1:], start=1):
        out = out + c * (-1.0) ** m * (np.sinc(cells - m) + np.sinc(cells + m))
    return np.asarray(out)


def log_range_rate_map(
    logs: FloatArray, schedule: RampSchedule, times: SampleTimes, grid: Grid
) -> FloatArray:
    r"""Mean over ramps of ln(power) at the beats of a point at every range and range rate.

    .. math:: S(R, v) = \frac1K \sum_k \ln \left|X_k\big(f_{b,k}(R, v)\big)\right|^2

    The point's beat follows from the slope, carrier and time of each ramp, range migration
    included, so ramps may differ. The mean of the logarithm (a geometric mean of power) is high
    only if every ramp has power at its beat; it stays low at a cross-pairing
    ridge, and for interference on single ramps. The bin nearest to the beat is read: a mean of two
    bins would change the distribution of the noise. The shape is ``(beam, range_rate, range)``.
    """
    line = beat_lines(schedule, times, grid, logs.shape[-1])
    out = np.zeros((len(logs), grid.range_rate.size, grid.range.size))
    in_ranges(_read_along, grid.range_rate.size, logs, line.first, line.step, out)
    return out


class BeatLines(NamedTuple):
    """Beats, linear in range: ``first``, the bin at ``grid.range[0]``; ``step``, bins per cell."""

    first: FloatArray
    step: FloatArray


def beat_lines(
    schedule: RampSchedule, times: SampleTimes, grid: Grid, size: int | IntArray
) -> BeatLines:
    """`BeatLines` ``(range_rate, ramp)``; ``size``: length of all transforms, or of each ramp's."""
    ends = [
        beat_frequency(
            schedule,
            times,
            distance=np.full(grid.range_rate.shape, distance),
            range_rate=grid.range_rate,
            time=grid.time,
        )
        * (size / times.rate)
        for distance in (grid.range[0], grid.range[-1])
    ]
    return BeatLines(ends[0], (ends[1] - ends[0]) / (grid.range.size - 1))


@compiled
def _read_along(  # pragma: no cover
    begin: int, end: int, logs: Any, first: Any, step: Any, out: Any
) -> None:
    beams, ramps, size = logs.shape
    num_ranges = out.shape[2]
    for i in range(begin, end):
        for b in range(beams):
            for k in range(ramps):
                place = first[i, k]
                for j in range(num_ranges):
                    out[b, i, j] += logs[b, k, int(np.floor(place + 0.5)) & (size - 1)]
                    place += step[i, k]
            for j in range(num_ranges):
                out[b, i, j] /= ramps


def floor_over_range(statistic: FloatArray, block: int) -> FloatArray:
    """Floor of the map: its level without targets, ``(beam, 1, range)``.

    The level is the median over all range rates and about ``block`` range cells, interpolated
    linearly between the middles of blocks. A target, its cross-pairing ridges and the notch that
    its subtraction leaves fill few of those cells, so the median hardly changes; a mean would
    change, and with it the probability of false alarm.
    """
    beams, _, ranges = statistic.shape
    edges = np.linspace(0, ranges, max(1, round(ranges / block)) + 1).astype(np.int64)
    spans = list(pairwise(edges))
    level = np.array([medians(statistic[:, :, a:b].reshape(beams, -1)) for a, b in spans])
    middle = 0.5 * (edges[:-1] + edges[1:] - 1)
    cells = np.arange(ranges)
    floor = [np.interp(cells, middle, level[:, beam]) for beam in range(beams)]
    return np.array(floor)[:, None, :]


def medians(values: FloatArray) -> FloatArray:
    """Medians along the last axis, in single precision: sorting is then vectorised and fast."""
    ordered = np.sort(values.astype(np.float32), axis=-1)
    size = ordered.shape[-1]
    low, high = ordered[..., (size - 1) // 2], ordered[..., size // 2]
    return np.asarray(0.5 * (low + high), dtype=np.float64)
