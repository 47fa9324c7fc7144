r"""`Baseband`: complex samples about a carrier, which radios send and record."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Final, Protocol, Self, runtime_checkable

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, seal
from polychirp.errors import InputError

GRID_POINTS_PER_SAMPLE: Final = 4
"""Grid points per sample interval of the grid from which `Baseband.at` interpolates. Chosen."""

KERNEL_HALF_LENGTH: Final = 6
"""Grid points on each side of a time from which its value is interpolated. Chosen."""

KERNEL_KAISER_BETA: Final = 12.27
"""Kaiser's β of the interpolation's window: 0.1102 (A − 8.7) for a stop band of A = 120 dB."""

MOST_RESAMPLED: Final = 1 << 26
"""Greatest number of samples that `Baseband.resampled` makes. Chosen: they take 1 GB, and their
computation takes several times as much memory."""

Progress = Callable[[str, int, int], None]
"""Callback with the name of a task, the number of its steps done, and their total."""


def no_progress(what: str, done: int, total: int) -> None:
    """Progress callback that does nothing."""
    del what, done, total


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Baseband:
    r"""Complex samples s of the radio signal Re s(t) exp(j2πf_c t).

    Parameters
    ----------
    samples : V, ``(time,)``
    sample_rate : 1/s
    centre_frequency : Hz, f_c; zero if the signal has no carrier
    start_time : s, time of the first sample

    Raises
    ------
    InputError
        There is no sample, or the sample rate is not positive.

    Examples
    --------
    >>> tone = Baseband(samples=np.ones(8), sample_rate=8.0, centre_frequency=100.0)
    >>> tone.duration, tone.energy
    (1.0, 1.0)
    """

    samples: Annotated[ComplexArray, Axes("time", dtype=np.complex128)]
    sample_rate: float
    centre_frequency: float = 0.0
    start_time: float = 0.0

    def __post_init__(self) -> None:
        seal(self)
        if self.samples.size == 0:
            raise InputError("a signal needs at least one sample")
        if not self.sample_rate > 0:
            raise InputError("a signal's sample rate must be positive")

    @property
    def num_samples(self) -> int:
        """Number of samples."""
        return int(self.samples.size)

    @property
    def duration(self) -> float:
        """Number of samples times the sample interval, s."""
        return self.num_samples / self.sample_rate

    @property
    def time(self) -> FloatArray:
        """Times of the samples, s, ``(time,)``."""
        return np.asarray(self.start_time + np.arange(self.num_samples) / self.sample_rate)

    @property
    def power(self) -> float:
        """Mean power of all samples into 1 Ω, W."""
        return float(np.vdot(self.samples, self.samples).real) / self.num_samples

    @property
    def energy(self) -> float:
        """Energy of all samples into 1 Ω, J."""
        return self.power * self.duration

    def read(self, first: int, last: int) -> ComplexArray:
        """Samples ``first`` to ``last`` − 1, V ``(time,)``."""
        return self.samples[first:last]

    def at(self, time: FloatArray) -> ComplexArray:
        """The signal at other times ``(…,)`` in s; it is zero outside its samples.

        Band-limited interpolation: a Fourier transform gives the signal on a finer grid, and a sinc
        with Kaiser's window interpolates between its points with an error of 1e-6 of the signal.
        The steps from and to zero at the ends ring as they do after an ideal low-pass filter.

        >>> tone = Baseband(samples=np.exp(2j * np.pi * 0.4 * np.arange(200)), sample_rate=1.0)
        >>> between = tone.at(np.array([100.25]))[0] / np.exp(2j * np.pi * 0.4 * 100.25)
        >>> round(float(abs(between - 1)), 2)  # the ends are a hundred samples away
        0.0
        """
        grid, lead = _refined(self.samples)
        place = (np.asarray(time) - self.start_time) * (
            self.sample_rate * GRID_POINTS_PER_SAMPLE
        ) + lead
        first = np.floor(place).astype(np.int64)
        fraction = place - first
        out = np.zeros(place.shape, dtype=np.complex128)
        for step in range(1 - KERNEL_HALF_LENGTH, KERNEL_HALF_LENGTH + 1):
            index = first + step
            inside = (index >= 0) & (index < grid.size)
            distance = fraction - step
            reach = np.sqrt(np.maximum(1.0 - (distance / KERNEL_HALF_LENGTH) ** 2, 0.0))
            weight = (
                np.sinc(distance) * np.i0(KERNEL_KAISER_BETA * reach) / np.i0(KERNEL_KAISER_BETA)
            )
            out += np.where(inside, weight * grid[np.where(inside, index, 0)], 0.0)
        return out

    def retuned(self, centre_frequency: float) -> Self:
        """The same radio signal about another carrier; parts beyond ± half the rate are aliased."""
        shift = self.centre_frequency - centre_frequency
        turned = self.samples * np.exp(2j * np.pi * ((shift * self.time) % 1.0))
        return replace(self, samples=turned, centre_frequency=centre_frequency)

    def resampled(self, sample_rate: float) -> Self:
        """The same signal at another rate; for a lower rate its band is limited first.

        `InputError` is raised if there would be more than `MOST_RESAMPLED` samples.
        """
        if sample_rate == self.sample_rate:
            return self
        if self.duration * sample_rate > MOST_RESAMPLED:
            raise InputError(
                f"{self.duration:.4g} s at {sample_rate / 1e6:.4g} MS/s are "
                f"{self.duration * sample_rate:.3g} samples, more than {MOST_RESAMPLED}; use a "
                "lower rate or a shorter signal"
            )
        source = self
        if sample_rate < self.sample_rate:
            source = replace(self, samples=_limited(self, 0.5 * sample_rate))
        count = max(1, int(np.floor(self.duration * sample_rate * (1 + 1e-12))))
        time = self.start_time + np.arange(count) / sample_rate
        return replace(self, samples=source.at(time), sample_rate=sample_rate)


@runtime_checkable
class SampleSource(Protocol):
    """Samples that are read in pieces: a recording on disk, or a `Baseband`."""

    @property
    def num_samples(self) -> int:
        """Number of samples."""

    @property
    def sample_rate(self) -> float:
        """Sample rate, 1/s."""

    @property
    def centre_frequency(self) -> float:
        """Carrier, Hz."""

    def read(self, first: int, last: int) -> ComplexArray:
        """Samples ``first`` to ``last`` − 1, V ``(time,)``."""


def _refined(samples: ComplexArray) -> tuple[ComplexArray, int]:
    """The signal on the finer grid, and the grid index of sample 0.

    Zeros before and after the samples separate their two ends in the periodic transform.
    """
    from scipy.fft import fft, ifft, next_fast_len

    lead = 64
    size = next_fast_len(samples.size + 2 * lead)
    padded = np.zeros(size, dtype=np.complex128)
    padded[lead : lead + samples.size] = samples
    spectrum = fft(padded)
    wide = np.zeros(GRID_POINTS_PER_SAMPLE * size, dtype=np.complex128)
    half = (size + 1) // 2
    wide[:half] = spectrum[:half]
    wide[half - size :] = spectrum[half:]
    return np.asarray(ifft(wide) * GRID_POINTS_PER_SAMPLE), GRID_POINTS_PER_SAMPLE * lead


def _limited(signal: Baseband, edge: float) -> ComplexArray:
    """Samples of the signal without its frequencies at and beyond ±``edge`` Hz."""
    from scipy.fft import fft, fftfreq, ifft, next_fast_len

    size = next_fast_len(2 * signal.num_samples)
    spectrum = fft(signal.samples, size)
    spectrum[np.abs(fftfreq(size, 1.0 / signal.sample_rate)) >= edge] = 0.0
    return np.asarray(ifft(spectrum)[: signal.num_samples])
