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
        from scipy.fft import fft, next_fast_len

        counts = seen.model.times.num_samples
        size = next_fast_len(BINS_PER_SAMPLE * samples.shape[2])
        value = fft(_from_middle(samples, counts, size), axis=1, overwrite_x=True)
        half_step = np.exp(1j * np.pi * np.fft.fftfreq(size)).astype(np.complex64)
        for k in np.flatnonzero(counts % 2 == 0):  # the middle lies between two samples
            value[k] *= half_step[:, None]
        return cls(value=value)

    def at(
        self, seen: Observation, first: FloatArray, step: FloatArray, size: int
    ) -> NDArray[np.complex64]:
        """Values at ``size`` evenly spaced beats, ``(channel, ramp, step)``, right to 1 %.

        Parameters
        ----------
        first, step : the first beat of every ramp, and the distance of beats, Hz, ``(ramp,)``
        """
        per_bin = self.value.shape[1] / seen.model.times.rate
        table = lagrange(4)[0].astype(np.float32)
        return np.asarray(_values(self.value, first * per_bin, step * per_bin, size, table))


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


@reordered
def _from_middle(samples: Any, counts: Any, size: int) -> Any:  # pragma: no cover - compiled
    """Samples of every ramp from the middle to its end, zeros, and those before the middle.

    They are ``(ramp, size, channel)``.
    """
    channels, ramps = samples.shape[:2]
    out = np.zeros((ramps, size, channels), dtype=np.complex64)
    for k in range(ramps):
        half = (counts[k] - 1) // 2
        for m in range(channels):
            for n in range(half):
                out[k, size - half + n, m] = samples[m, k, n]
            for n in range(counts[k] - half):
                out[k, n, m] = samples[m, k, half + n]
    return out


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
    value: Any, first: Any, step: Any, size: int, table: Any
) -> Any:  # pragma: no cover - compiled
    """Interpolated values at evenly spaced places, in bins: ``(channel, ramp, step)``."""
    ramps, bins, channels = value.shape
    taps, powers = table.shape
    out = np.zeros((channels, ramps, size), dtype=np.complex64)
    for k in range(ramps):
        for i in range(size):
            place = first[k] + i * step[k]
            low = int(np.floor(place))
            x = np.float32(place - low)
            b = (low - (taps // 2 - 1)) % bins
            for t in range(taps):
                share = np.float32(0.0)
                for n in range(powers - 1, -1, -1):
                    share = share * x + table[t, n]
                for m in range(channels):
                    out[m, k, i] += share * value[k, b, m]
                b = b + 1 if b + 1 < bins else 0
    return out
