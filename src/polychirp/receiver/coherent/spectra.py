r"""Fourier transforms of all ramps, and sums over samples that follow from them.

Correlations of the samples with the signals of points are values of their Fourier transforms
between two bins, and sums with powers of the time are derivatives there. They are interpolated, so
that a point costs as much on long ramps as on short ones:

.. math:: \sum_n y_n u_n^j\,e^{-j2\pi f u_n} = \Big(\frac{j}{2\pi}\frac{d}{df}\Big)^j
          \sum_n y_n\,e^{-j2\pi f u_n}

with the time u from the middle of the ramp's sampling window.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray
from polychirp.jit import reordered, reordered_inner
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.replicas import BEAT, DRIFT, WEIGHT

BINS_PER_SAMPLE = 4
"""Length of a ramp's Fourier transform over its number of samples; chosen for interpolation."""

TAPS, ORDERS = 8, 5
"""Number of bins from which sums are interpolated, as the kernel is written, and of derivatives."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spectra:
    """Fourier transforms of the samples of all ramps.

    Parameters
    ----------
    value : V, with the phase that refers to the middle of each ramp's sampling window,
        ``(ramp, bin, channel)``
    """

    value: NDArray[np.complex64]

    @classmethod
    def of(cls, seen: Observation, samples: ComplexArray) -> Self:
        """Transforms of ``samples`` ``(channel, ramp, fast)``, zero where none is present."""
        counts = seen.model.times.num_samples
        return cls.of_turned(seen, _from_middle(samples, counts, transform_size(seen)))

    @classmethod
    def of_turned(cls, seen: Observation, samples: NDArray[np.complex64]) -> Self:
        """Transforms of samples in the order of `from_middle_into`, which are overwritten."""
        from scipy.fft import fft

        value = fft(samples, axis=1, overwrite_x=True)
        _half_step(value, np.asarray(seen.model.times.num_samples))
        return cls(value=value)

    def hann_power(self, seen: Observation, step: int) -> NDArray[np.float32]:
        """Power of every ramp with Hann's window, a mean over channels, ``(ramp, bin // step)``.

        White noise of power σ² per sample has the mean power σ² in every bin. The window is made of
        shifts by whole bins, so that it ends within some per cent of the ramp's end.

        Parameters
        ----------
        step : number of this transform's bins in one of the result; it divides their number
        """
        counts = np.asarray(seen.model.times.num_samples)
        reach = np.rint(self.value.shape[1] / np.maximum(counts, 1)).astype(np.int64)
        return np.asarray(_hann_power(self._floats, reach, seen.present, counts, step))

    def power(self, seen: Observation) -> float:
        """Power of all samples of white channels, V², with the weights of ramps and frequencies."""
        size = self.value.shape[1] // BINS_PER_SAMPLE
        place = np.rint(np.arange(size) * (seen.num_bins / size)).astype(np.int64) % seen.num_bins
        mixing = seen.mixing.astype(np.complex64)
        total = _weighted_power(self._floats, seen.weight, place, mixing.real, mixing.imag)
        return float(total / size)

    @property
    def _floats(self) -> NDArray[np.float32]:
        """Real and imaginary parts in turn, ``(ramp, bin, 2 channels)``."""
        return self.value.view(np.float32)

    def at(
        self,
        seen: Observation,
        first: FloatArray,
        step: FloatArray,
        size: int,
        num_channels: int | None = None,
    ) -> NDArray[np.float32]:
        """Values at ``size`` evenly spaced beats, right to 1 %.

        They are real and imaginary parts of the channels in turn, ``(2 channels, ramp, step)``.

        Parameters
        ----------
        first, step : the first beat of every ramp, and the distance of beats, Hz, ``(ramp,)``
        num_channels : number of the first channels that are read; None for all
        """
        per_bin = self.value.shape[1] / seen.model.times.rate
        width = 2 * (self.value.shape[2] if num_channels is None else num_channels)
        return np.asarray(_values(self._floats, first * per_bin, step * per_bin, size, width))


@lru_cache
def lagrange(taps: int) -> FloatArray:
    """Coefficients of Lagrange's interpolation between bins and its four derivatives.

    The polynomials are those of the distance from the bin below, ``(derivative, tap, power)``.
    """
    nodes = np.arange(taps) - (taps // 2 - 1)
    power = np.arange(taps)
    rows = [np.linalg.inv(nodes[:, None].astype(np.float64) ** power).T]
    for _ in range(4):
        rows.append(np.roll(rows[-1] * power, -1, axis=1))
    return np.stack(rows)


def transform_size(seen: Observation) -> int:
    """Number of bins of the transforms: a multiple of `BINS_PER_SAMPLE`."""
    from scipy.fft import next_fast_len

    # of powers of 2, 3 and 5, as for real signals: transforms of 7 and 11 take longer
    return BINS_PER_SAMPLE * int(next_fast_len(seen.present.shape[1], real=True))


@reordered
def _from_middle(samples: Any, counts: Any, size: int) -> Any:  # pragma: no cover - compiled
    """Samples ``(channel, ramp, fast)`` as of `from_middle_into`, ``(ramp, size, channel)``."""
    out = np.empty((samples.shape[1], size, samples.shape[0]), dtype=np.complex64)
    for k in range(samples.shape[1]):
        from_middle_into(samples[:, k], counts[k], out[k])
    return out


@reordered_inner
def from_middle_into(samples: Any, count: int, out: Any) -> None:  # pragma: no cover - compiled
    """Samples of a ramp from the middle to its end, zeros, and those before the middle, in place.

    Parameters
    ----------
    samples : ``(channel, fast)``, of which the first ``count`` count
    out : ``(size, channel)``
    """
    size, channels = out.shape
    half = (count - 1) // 2
    for n in range(count - half):
        for m in range(channels):
            out[n, m] = samples[m, half + n]
    for n in range(count - half, size - half):
        for m in range(channels):
            out[n, m] = 0.0
    for n in range(half):
        for m in range(channels):
            out[size - half + n, m] = samples[m, n]


@reordered
def _half_step(value: Any, counts: Any) -> None:  # pragma: no cover - compiled
    """Turn transforms of an even number of samples, whose middle is between two, in place."""
    ramps, bins, channels = value.shape
    turn = np.empty(bins, dtype=np.complex64)
    for b in range(bins):
        angle = np.pi * (b if b < bins - bins // 2 else b - bins) / bins
        turn[b] = complex(np.cos(angle), np.sin(angle))
    for k in range(ramps):
        if counts[k] % 2 == 0:
            for b in range(bins):
                for m in range(channels):
                    value[k, b, m] *= turn[b]


@reordered
def _hann_power(
    value: Any, reach: Any, present: Any, counts: Any, step: int
) -> Any:  # pragma: no cover - compiled
    ramps, bins, width = value.shape
    out = np.empty((ramps, bins // step), dtype=np.float32)
    for k in range(ramps):
        energy = _hann_energy(present[k], counts[k], reach[k] / bins)
        scale = np.float32(2.0 / (width * max(energy, 1e-30)))
        half, quarter = np.float32(0.5), np.float32(0.25)
        # transforms of an even number of samples change their sign from the last bin to the first
        beyond = quarter if counts[k] % 2 else -quarter
        for b in range(bins // step):
            here = b * step
            low, high = here - reach[k], here + reach[k]
            if here >= bins - bins // 2:
                low, high = low - bins, high - bins
            p = quarter if low >= -(bins // 2) else beyond
            q = quarter if high < bins - bins // 2 else beyond
            low, high = low % bins, high % bins
            total = np.float32(0.0)
            for i in range(width):
                one = half * value[k, here, i] + p * value[k, low, i] + q * value[k, high, i]
                total += one * one
            out[k, b] = scale * total
    return out


@reordered_inner
def _hann_energy(
    present: Any, count: int, per_sample: float
) -> float:  # pragma: no cover - compiled
    """Sum of the squares of the window over the samples that are present."""
    angle = 2.0 * np.pi * per_sample
    start = -0.5 * (count - 1) * angle
    x, y, c, s = np.cos(start), np.sin(start), np.cos(angle), np.sin(angle)
    total = 0.0
    for n in range(count):
        if present[n]:
            total += (0.5 + 0.5 * x) ** 2
        x, y = x * c - y * s, x * s + y * c
    return total


@reordered
def _weighted_power(
    value: Any, weight: Any, place: Any, real: Any, imag: Any
) -> Any:  # pragma: no cover - compiled
    """Power of every `BINS_PER_SAMPLE`-th bin after mixing, times the weights at their places."""
    ramps, width = len(value), value.shape[2]
    channels, count = width // 2, place.size
    x, y = np.empty((channels, count), dtype=np.float32), np.empty((channels, count), np.float32)
    u, v = np.empty(count, dtype=np.float32), np.empty(count, dtype=np.float32)
    total = 0.0
    for k in range(ramps):
        for b in range(count):
            for m in range(channels):
                x[m, b] = value[k, BINS_PER_SAMPLE * b, 2 * m]
                y[m, b] = value[k, BINS_PER_SAMPLE * b, 2 * m + 1]
        for n in range(channels):
            for i in range(count):
                u[i], v[i] = np.float32(0.0), np.float32(0.0)
            for m in range(channels):
                c, s = real[n, m], imag[n, m]
                for i in range(count):
                    u[i] += c * x[m, i] - s * y[m, i]
                    v[i] += c * y[m, i] + s * x[m, i]
            for i in range(count):
                total += weight[k, place[i]] * (u[i] * u[i] + v[i] * v[i])
    return total


@reordered_inner
def interpolated_into(  # pragma: no cover - compiled
    ramps: Any, value: Any, table: Any, track: Any, k: int, work: Any, sums: Any
) -> None:
    r"""Sums over samples of ramp k without a tone, times powers 0, 1 and 2 of the time.

    They hold the root of the weight. With d the rate of the beat, the phase :math:`\pi d u^2` on a
    ramp is expanded: :math:`S_j = D_j - j\pi d\,D_{j+2} - \tfrac12(\pi d)^2 D_{j+4}` of the
    derivatives D, as far as the fourth. `signals.moments` is the exact twin.

    Parameters
    ----------
    value : of `Spectra`, their real and imaginary parts in turn, ``(ramp, bin, 2 channels)``
    table : coefficients of `lagrange`, ``(power, derivative, tap)``
    track : of the tone, as of `Replicas`, ``(6, ramp)``
    work : memory, ``(TAPS + 2 ORDERS, TAPS or 2 channels, whichever is more)``
    sums : result, its real and imaginary parts, ``(3, 2, channel, ramp)``
    """
    bins, width = value.shape[1:]
    share, near, found = work[:ORDERS], work[ORDERS : ORDERS + TAPS], work[ORDERS + TAPS :]
    scale = bins / ramps.rate
    place = track[BEAT, k] * scale
    low = int(np.floor(place))
    x = place - low
    for d in range(ORDERS):
        for t in range(TAPS):
            one = table[TAPS - 1, d, t]
            for n in range(TAPS - 2, -1, -1):
                one = one * x + table[n, d, t]
            share[d, t] = one
    b = (low - (TAPS // 2 - 1)) % bins
    for t in range(TAPS):
        for i in range(width):
            near[t, i] = value[k, b, i]
        b = b + 1 if b + 1 < bins else 0
    root, bend = np.sqrt(track[WEIGHT, k]), np.pi * track[DRIFT, k]
    factor = root
    for d in range(ORDERS):
        s0, s1, s2, s3 = share[d, 0], share[d, 1], share[d, 2], share[d, 3]
        s4, s5, s6, s7 = share[d, 4], share[d, 5], share[d, 6], share[d, 7]
        for i in range(width):
            low_half = s0 * near[0, i] + s1 * near[1, i] + s2 * near[2, i] + s3 * near[3, i]
            high_half = s4 * near[4, i] + s5 * near[5, i] + s6 * near[6, i] + s7 * near[7, i]
            found[d, i] = factor * (low_half + high_half)
        factor *= 0.5 * scale / np.pi
    for m in range(width // 2):
        i, j = 2 * m, 2 * m + 1
        # the derivative of order d is times j to the power of d
        sums[0, 0, m, k] = found[0, i] - bend * found[2, j] - 0.5 * bend * bend * found[4, i]
        sums[0, 1, m, k] = found[0, j] + bend * found[2, i] - 0.5 * bend * bend * found[4, j]
        sums[1, 0, m, k] = -found[1, j] - bend * found[3, i]
        sums[1, 1, m, k] = found[1, i] - bend * found[3, j]
        sums[2, 0, m, k] = -found[2, i] + bend * found[4, j]
        sums[2, 1, m, k] = -found[2, j] - bend * found[4, i]


@reordered
def _values(
    value: Any, first: Any, step: Any, size: int, width: int
) -> Any:  # pragma: no cover - compiled
    """Values at evenly spaced places, in bins, by Lagrange's polynomials of four bins."""
    ramps, bins = value.shape[:2]
    out = np.empty((width, ramps, size), dtype=np.float32)
    low, share = np.empty(size, dtype=np.int64), np.empty((4, size), dtype=np.float32)
    half, sixth = np.float32(0.5), np.float32(1.0 / 6.0)
    for k in range(ramps):
        for i in range(size):
            place = first[k] + i * step[k]
            below = np.floor(place)
            low[i] = int(below)
            here = np.float32(place - below)
            before, after, far = (
                here + np.float32(1.0),
                here - np.float32(1.0),
                here - np.float32(2.0),
            )
            share[0, i] = -sixth * here * after * far
            share[1, i] = half * before * after * far
            share[2, i] = -half * before * here * far
            share[3, i] = sixth * before * here * after
        for i in range(size):
            b = (low[i] - 1) % bins
            c = b + 1 if b + 1 < bins else 0
            d = c + 1 if c + 1 < bins else 0
            e = d + 1 if d + 1 < bins else 0
            p, q, r, s = share[0, i], share[1, i], share[2, i], share[3, i]
            for m in range(width):
                one = p * value[k, b, m] + q * value[k, c, m]
                out[m, k, i] = one + r * value[k, d, m] + s * value[k, e, m]
    return out
