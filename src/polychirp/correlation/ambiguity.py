r"""Ambiguity function: correlation over delay and Doppler shift, in bounded memory.

.. math:: \chi(\tau, \nu) =
          \frac{\int a(t+\tau)\,\overline{b(t)}\,e^{-j2\pi\nu t}\,dt}{\sqrt{E_a E_b}}

The form is narrow-band: one Doppler shift holds for the whole band. t is 0 at b's first sample.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, Sealed
from polychirp.correlation.base import need_comparable
from polychirp.errors import InputError
from polychirp.model.baseband import Baseband, Progress, no_progress

LEAST_BLOCK: Final = 1 << 16
"""Least number of samples of b in a block. Chosen: longer blocks take more memory, less time."""

MOST_CELLS: Final = 1 << 26
"""Greatest number of cells of one ambiguity function. Chosen: they take 1 GB."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ambiguity(Sealed):
    """Normalised ambiguity function.

    Parameters
    ----------
    amplitude : ``(doppler, lag)``
    doppler : Hz, ``(doppler,)``; positive where the first signal is higher in frequency
    lag : s, ``(lag,)``; positive where the first signal is later
    """

    amplitude: Annotated[ComplexArray, Axes("doppler", "lag", dtype=np.complex128)]
    doppler: Annotated[FloatArray, Axes("doppler")]
    lag: Annotated[FloatArray, Axes("lag")]


def ambiguity(
    a: Baseband,
    b: Baseband,
    *,
    doppler: FloatArray,
    greatest_lag: float,
    progress: Progress = no_progress,
) -> Ambiguity:
    """Ambiguity function at Doppler shifts in Hz and lags of up to ± ``greatest_lag`` s.

    The second signal is divided into blocks. Each block is transformed once for every Doppler
    shift, and multiplied with the transform of the samples of the first signal within its lags.
    Besides the result, memory holds one block, of a few times the lags, for signals of any length.
    `InputError` is raised if `need_comparable` refuses the signals, or the result has more cells
    than `MOST_CELLS`.

    >>> tone = Baseband(samples=np.ones(100), sample_rate=100.0)
    >>> found = ambiguity(tone, tone, doppler=np.array([0.0, 1.0]), greatest_lag=0.5)
    >>> abs(found.amplitude[:, found.lag == 0.0]).round(6).T
    array([[1., 0.]])
    """
    from scipy.fft import fft, ifft, next_fast_len

    need_comparable(a, b)
    doppler = np.asarray(doppler, dtype=np.float64)
    offset = round((b.start_time - a.start_time) * a.sample_rate)
    reach = max(1, int(greatest_lag * a.sample_rate * (1 + 1e-12)))
    if doppler.size * (2 * reach + 1) > MOST_CELLS:
        raise InputError(
            f"{doppler.size} Doppler shifts and {2 * reach + 1} lags are too many for memory; "
            f"keep their product below {MOST_CELLS:.2g}"
        )
    length = min(max(LEAST_BLOCK, 4 * reach), b.num_samples)
    size = next_fast_len(length + 2 * reach)
    out = np.zeros((doppler.size, 2 * reach + 1), dtype=np.complex128)
    firsts = range(0, b.num_samples, length)
    for number, first in enumerate(firsts):
        progress("blocks", number, len(firsts))
        piece = b.samples[first : first + length]
        time = np.arange(first, first + piece.size) / b.sample_rate
        spectrum = fft(_piece(a.samples, first + offset - reach, length + 2 * reach), size)
        for row, shift in enumerate(doppler):
            turned = piece * np.exp(2j * np.pi * shift * time)
            product = spectrum * np.conj(fft(turned, size))
            out[row] += ifft(product, overwrite_x=True)[: 2 * reach + 1]
    progress("blocks", len(firsts), len(firsts))
    out /= a.sample_rate * math.sqrt(a.energy * b.energy)
    lag = np.arange(-reach, reach + 1) / a.sample_rate
    rest = (a.start_time - b.start_time) + offset / a.sample_rate
    return Ambiguity(amplitude=out, doppler=doppler, lag=lag + rest)


def _piece(samples: ComplexArray, first: int, length: int) -> ComplexArray:
    """Samples from ``first``, which may be negative, with zeros where there are none."""
    out = np.zeros(length, dtype=np.complex128)
    begin, end = max(first, 0), min(first + length, samples.size)
    if begin < end:
        out[begin - first : end - first] = samples[begin:end]
    return out
