r"""Noise that differs between ramps, frequencies and channels, as interference makes it.

An interferer of another slope crosses a ramp's beats as a burst: on some ramps it raises some
frequencies by tens of dB, and it arrives from one direction. An echo is on all ramps alike. Sums of
measurements of unequal variance :math:`\sigma_k^2` are least noisy with the weights
:math:`1/\sigma_k^2`, and channels with the covariance matrix :math:`C` are made white by
:math:`C^{-1/2}` (Kay 1998, Fundamentals of Statistical Signal Processing II, 4.5).
"""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.spectra import BINS_PER_SAMPLE, Spectra

LEAST_RAMPS = 5
"""Least number of ramps of one direction of which a median tells the usual level; chosen."""

LEAST_CELLS = 32.0
"""Least width over which a level is the median, in resolution cells of a ramp; chosen: many times
as wide as an echo, which does not count then."""

LEAST_VALUES = 128
"""Least number of values, over cells and channels, from which a level is taken; chosen: noise makes
differences of some 15 % then."""

LEVELS_PER_WIDTH = 4
"""Number of levels in the width over which each is a median; chosen: bursts are wider."""

LEAST_EXCESS = 2.0
"""Level of a ramp over the median from which it counts less; chosen: 6 deviations in noise."""

LEAST_EIGENVALUE = 1e-6
"""Least eigenvalue of a channel covariance over its mean; chosen: it bounds what is made white."""

Real = TypeVar("Real", np.float32, np.float64)


def ramp_weights(seen: Observation, residual: Spectra) -> FloatArray:
    """Weight of every ramp at every frequency: the median level over its own, or 1.

    The median is taken over the ramps of the same direction, at frequencies of the same range: the
    beats of echoes in motion are lower or higher on rising ramps than on falling ones.

    Returns
    -------
    ``(ramp, bin)``; the bins divide the sample rate evenly
    """
    slope = seen.model.schedule.slope
    level = _levels(seen, residual)
    frequency = np.fft.fftshift(np.fft.fftfreq(level.shape[1]))
    weight = np.ones_like(level)
    for direction in (1.0, -1.0):
        ramps = np.flatnonzero((np.sign(slope) == direction) & (seen.count > 0))
        if ramps.size >= LEAST_RAMPS:
            usual = _usual(level[ramps], frequency, slope[ramps] / slope[ramps].mean())
            excess = level[ramps] / np.maximum(usual, np.finfo(np.float64).tiny)
            weight[ramps] = np.where(excess > LEAST_EXCESS, 1.0 / np.fmax(excess, 1.0), 1.0)
    return np.asarray(np.fft.ifftshift(weight, axes=-1))


def _levels(seen: Observation, residual: Spectra) -> FloatArray:
    """Median power of every ramp near frequencies from the lowest to the highest, ``(ramp, bin)``.

    There are `LEVELS_PER_WIDTH` bins in each width over which the median is taken.
    """
    power = residual.hann_power(seen, BINS_PER_SAMPLE)
    size = power.shape[1]
    cells = max(LEAST_CELLS, LEAST_VALUES / len(seen.samples))
    width = round(cells * size / float(np.median(seen.model.times.num_samples)))
    bins = max(1, LEVELS_PER_WIDTH * size // width)
    middle = np.rint(np.fft.fftshift(np.fft.fftfreq(bins)) * size).astype(np.int64)
    near = (middle[:, None] + np.arange(width) - width // 2) % size
    return medians_of_copy(power[:, near]).astype(np.float64)


def medians(value: NDArray[Real]) -> NDArray[Real]:
    """Medians along the last axis.

    They are those of `numpy.median`, which takes some times longer: it selects two values and
    looks for NaN, and a selection of one value uses vector instructions.
    """
    return medians_of_copy(value.copy())


def medians_of_copy(value: NDArray[Real]) -> NDArray[Real]:
    """The same of values that are not needed any more: they are put in another order."""
    half = value.shape[-1] // 2
    value.partition(half, axis=-1)
    upper = value[..., half]
    if value.shape[-1] % 2:
        return upper.copy()
    return np.asarray((np.max(value[..., :half], axis=-1) + upper) / 2, dtype=value.dtype)


def _usual(level: FloatArray, frequency: FloatArray, stretch: FloatArray) -> FloatArray:
    """Median of the levels at frequencies of the same range, at those of each ramp."""
    rows = zip(level, stretch, strict=True)
    aligned = np.array([np.interp(frequency * factor, frequency, row) for row, factor in rows])
    median = np.median(aligned, axis=0)
    return np.array([np.interp(frequency / factor, frequency, median) for factor in stretch])


def whitening(covariance: ComplexArray) -> ComplexArray:
    """The matrix that makes channels of this covariance white, ``(channel, channel)``.

    The mean of their powers stays.
    """
    value, vector = np.linalg.eigh(covariance)
    if value.mean() <= 0.0:  # of a frame without noise
        return np.eye(len(covariance), dtype=np.complex128)
    value = np.maximum(value / value.mean(), LEAST_EIGENVALUE)
    return np.asarray((vector / np.sqrt(value)) @ vector.conj().T)
