"""Filling of what is missing of ramps, from the few lines of their spectra."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, IntArray
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.mitigation.prediction import rms

LEAST_LINE_FACTOR: Final = 3.0
"""Multiple of the spectrum's median amplitude below which a line may be noise and is not used.
Chosen."""

BATCH: Final = 32
"""Number of ramps that are filled at once; chosen, so that their planes fit into the memory."""

Missing = Callable[[ComplexArray], ComplexArray]
"""Linear map of samples ``(…, ramp, fast)`` of one length to the part of them that is missing."""


class Filling(NamedTuple):
    """Filling of ramps of one length.

    ramps : indices
    missing : part of their samples that is missing
    chosen : lines that each iteration keeps, ``(iteration, ramp, frequency)``
    """

    ramps: IntArray
    missing: Missing
    chosen: BoolArray


def filled_from_lines(
    frame: IfFrame, missing: Iterable[tuple[IntArray, Missing]], *, iterations: int, depth: float
) -> Mitigated:
    """The frame with what is missing of some ramps filled from the lines of their spectra.

    Parameters
    ----------
    missing : ramps of one length, and the part of their samples that is missing
    iterations, depth : see `sparse_lines`
    """
    present = frame.times.is_sample
    fillings = []
    for ramps, part in missing:
        length = int(frame.times.num_samples[ramps[0]])
        of_ramps = frame.samples[:, ramps, :length]
        chosen = sparse_lines(of_ramps, part, iterations=iterations, depth=depth)
        fillings.append(Filling(ramps, part, chosen))

    def repair(samples: ComplexArray) -> ComplexArray:
        out = samples * present
        for ramps, part, chosen in fillings:
            length = chosen.shape[-1]
            out[..., ramps, :length] = filled(samples[..., ramps, :length], part, chosen)
        return np.asarray(out)

    weight = present.astype(np.float64)
    return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)


def batches_of_one_length(frame: IfFrame, chosen: BoolArray) -> Iterator[IntArray]:
    """Indices of the chosen ramps, of which those with equally many samples come together.

    Parameters
    ----------
    chosen : mask of ramps, ``(ramp,)``
    """
    lengths = frame.times.num_samples
    for length in np.unique(lengths[chosen]):
        ramps = np.flatnonzero(chosen & (lengths == length))
        for first in range(0, len(ramps), BATCH):
            yield ramps[first : first + BATCH]


def samples_at(hit: BoolArray) -> Missing:
    """Map of samples to those of a mask ``(ramp, fast)``."""
    return partial(np.multiply, hit)


def sparse_lines(
    samples: ComplexArray, missing: Missing, *, iterations: int, depth: float
) -> BoolArray:
    r"""Lines of spectra that iterations with falling thresholds keep.

    With the samples y, the map M to their missing part and the Fourier transform F over the ramp,
    the iteration is

    .. math:: z \leftarrow (1 - M)\,y + M F^{-1}\,T_k\{F z\},

    where :math:`T_k` keeps the lines above a threshold that falls from the strongest line by
    equal factors to ``depth`` below it, but not below three times the spectrum's median amplitude
    (Marvasti et al. 2012). All channels keep the same lines, chosen by their mean power.

    Parameters
    ----------
    samples : ramps of one length, ``(channel, ramp, fast)``
    missing : map to the missing part
    iterations : number of thresholds, 2 or more
    depth : power ratio of the first threshold to the last

    Returns
    -------
    chosen : ``(iteration, ramp, frequency)``

    Examples
    --------
    A tone of which ten samples are missing:

    >>> tone = np.exp(2j * np.pi * 5 * np.arange(64) / 64)[None, None]
    >>> gap = samples_at((np.arange(64) < 10)[None])
    >>> lines = sparse_lines(tone, gap, iterations=10, depth=1e4)
    >>> np.flatnonzero(lines[-1, 0])
    array([5])
    >>> bool(np.abs(filled(tone - gap(tone), gap, lines) - tone).max() < 1e-6)
    True
    """
    from scipy import fft

    known = samples - missing(samples)
    z = known
    strongest = rms(fft.fft(known, axis=-1)).max(axis=-1, keepdims=True)
    chosen = np.zeros((iterations, *samples.shape[1:]), dtype=np.bool_)
    for k in range(iterations):
        spectrum = fft.fft(z, axis=-1)
        level = rms(spectrum)
        threshold = strongest * depth ** (-0.5 * k / (iterations - 1))
        least = LEAST_LINE_FACTOR * np.median(level, axis=-1, keepdims=True)
        chosen[k] = level > np.maximum(threshold, least)
        z = known + missing(fft.ifft(spectrum * chosen[k], axis=-1))
    return chosen


def filled(samples: ComplexArray, missing: Missing, chosen: BoolArray) -> ComplexArray:
    """Samples ``(…, ramp, fast)`` whose missing part comes from the chosen lines of their spectrum.

    Parameters
    ----------
    missing : map to the missing part
    chosen : lines that each iteration keeps, ``(iteration, ramp, frequency)``
    """
    from scipy import fft

    known = samples - missing(samples)
    z = known
    for lines in chosen:
        z = known + missing(fft.ifft(lines * fft.fft(z, axis=-1), axis=-1))
    return np.asarray(z)
