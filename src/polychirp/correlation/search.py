r"""Search for a short reference in a long recording, block by block (overlap and save).

.. math:: \rho(\tau) = \frac{|\int a(t+\tau)\,\bar b(t)\,dt|}{\sqrt{E_b\,E_a(\tau)}}

with the energy :math:`E_a(\tau)` of the recording's samples under the reference. :math:`\rho` is 1
where these are a multiple of the reference, whatever the samples before and after are.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, IntArray, Sealed
from polychirp.errors import InputError
from polychirp.model.baseband import Baseband, Progress, SampleSource, no_progress

PerPeak = Annotated[FloatArray, Axes("peak")]
PerBin = Annotated[FloatArray, Axes("bin")]

NUM_BINS: Final = 2000
"""Greatest number of bins of the envelope. Chosen: more than a picture has columns."""

LEAST_BLOCK: Final = 1 << 20
"""Default number of samples that are read at once. Chosen: more take more memory, but less time."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found(Sealed):
    """Places of a reference in a recording.

    Parameters
    ----------
    peak : ρ at every place where the reference is found, ``(peak,)``
    lag : s, from the recording's first sample to that of the reference, ``(peak,)``, growing
    envelope : greatest ρ in every bin of lags, ``(bin,)``
    bin_start : s, first lag of every bin, ``(bin,)``
    """

    peak: PerPeak
    lag: PerPeak
    envelope: PerBin
    bin_start: PerBin


def search(
    recording: SampleSource,
    reference: Baseband,
    *,
    threshold: float = 0.5,
    block: int = LEAST_BLOCK,
    progress: Progress = no_progress,
) -> Found:
    """Search for ``reference`` at every sample of ``recording`` at which it fits completely.

    Memory holds one block of the recording and its transforms, for recordings of any length, and
    the maxima of ρ above the threshold. The greatest ρ is kept, and no other within half the
    reference's length of it; then the greatest of the others, and so on.

    Parameters
    ----------
    threshold : least ρ of a place that is kept
    block : number of samples to read at once; at least four times the reference's are read

    Raises
    ------
    InputError
        Rates differ, the recording is shorter than the reference, or that has no energy.

    Examples
    --------
    >>> draw = np.random.default_rng(1).standard_normal(3000)
    >>> recording = Baseband(samples=draw, sample_rate=1.0)
    >>> reference = Baseband(samples=draw[700:800], sample_rate=1.0)
    >>> found = search(recording, reference, threshold=0.9)
    >>> found.lag, found.peak.round(6)
    (array([700.]), array([1.]))
    """
    from scipy.fft import fft, next_fast_len

    _check(recording, reference)
    length, rate = reference.num_samples, recording.sample_rate
    total = recording.num_samples - length + 1
    step = max(block, 4 * length)
    size = next_fast_len(min(step + length - 1, recording.num_samples))
    step = size - length + 1
    spectrum = np.conj(fft(reference.samples, size))
    energy = float(np.vdot(reference.samples, reference.samples).real)
    width = -(-total // min(NUM_BINS, total))
    envelope = np.zeros(-(-total // width))
    places: list[IntArray] = []
    peaks: list[FloatArray] = []
    for first in range(0, total, step):
        progress("samples", first, total)
        piece = recording.read(first, min(first + size, recording.num_samples))
        height = _heights(piece, spectrum, size, length, energy)
        _into_bins(envelope, height, first, width)
        maxima = _maxima(height, threshold)
        places.append(first + maxima)
        peaks.append(height[maxima])
    progress("samples", total, total)
    place, peak = np.concatenate(places), np.concatenate(peaks)
    kept = _greatest_apart(place, peak, length // 2)
    return Found(
        peak=peak[kept],
        lag=place[kept] / rate,
        envelope=envelope,
        bin_start=np.asarray(np.arange(envelope.size) * (width / rate)),
    )


def _check(recording: SampleSource, reference: Baseband) -> None:
    if not math.isclose(recording.sample_rate, reference.sample_rate, rel_tol=1e-12):
        raise InputError(
            f"the recording has {recording.sample_rate / 1e6:g} MS/s and the reference "
            f"{reference.sample_rate / 1e6:g} MS/s; resample the reference to the recording's rate"
        )
    if recording.num_samples < reference.num_samples:
        raise InputError(
            f"the recording has {recording.num_samples} samples, fewer than the reference's "
            f"{reference.num_samples}; record for longer"
        )
    if not reference.energy > 0:
        raise InputError("the reference has no energy; check that its samples are not all zero")


def _heights(
    piece: ComplexArray, spectrum: ComplexArray, size: int, length: int, energy: float
) -> FloatArray:
    """Values of ρ at every sample of a piece at which the whole reference fits."""
    from scipy.fft import fft, ifft

    count = piece.size - length + 1
    product = fft(piece, size)
    product *= spectrum
    values = np.abs(ifft(product, overwrite_x=True)[:count])
    power = piece.real**2 + piece.imag**2
    running = np.cumsum(np.concatenate([[0.0], power]))
    under = running[length:] - running[:count]
    # a difference of sums below 1e-12 of the piece's energy may be a rounding error
    floor = 1e-12 * running[-1]
    has_energy = under > floor
    out = np.zeros(count)
    out[has_energy] = values[has_energy] / np.sqrt(energy * under[has_energy])
    return out


def _into_bins(envelope: FloatArray, height: FloatArray, first: int, width: int) -> None:
    number = (first + np.arange(height.size)) // width
    starts = np.flatnonzero(np.concatenate([[True], np.diff(number) > 0]))
    highest = np.maximum.reduceat(height, starts)
    envelope[number[starts]] = np.maximum(envelope[number[starts]], highest)


def _maxima(height: FloatArray, threshold: float) -> IntArray:
    """Places of a block with ρ of at least the threshold, and of at least their neighbours'."""
    around = np.concatenate([[0.0], height, [0.0]])
    is_maximum = (height >= around[:-2]) & (height >= around[2:]) & (height >= threshold)
    return np.flatnonzero(is_maximum)


def _greatest_apart(place: IntArray, peak: FloatArray, apart: int) -> IntArray:
    """Indices, growing, of peaks that have no greater kept one at a distance of ``apart`` or less.

    ``place`` grows. Of equal peaks, the first is kept.
    """
    is_open = np.ones(place.size, dtype=np.bool_)
    kept = []
    for n in np.argsort(-peak, kind="stable"):
        if is_open[n]:
            kept.append(n)
            low, high = np.searchsorted(place, [place[n] - apart, place[n] + apart + 1])
            is_open[low:high] = False
    return np.sort(np.array(kept, dtype=np.intp))
