r"""Measures of the detection of bursts: which samples were hit, and which the detector found.

A sample is hit in truth if the power of the interference in it, a mean over the channels, exceeds
``level`` times that of the noise over the frame. `IfParts` has both.
"""

from dataclasses import dataclass

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.model.if_frame import IfParts


@dataclass(frozen=True, slots=True, kw_only=True)
class BurstCounts:
    """Numbers of samples, which add up over frames.

    Parameters
    ----------
    both : hit, and found
    missed : hit, and not found
    false : found, and not hit
    neither : not hit, and not found

    Examples
    --------
    >>> counts = BurstCounts(both=90, missed=10, false=30, neither=870)
    >>> counts.precision, counts.recall, round(counts.false_mitigation, 3)
    (0.75, 0.9, 0.033)
    >>> round(counts.f_score, 3)
    0.818
    """

    both: int
    missed: int
    false: int
    neither: int

    def __add__(self, other: "BurstCounts") -> "BurstCounts":
        return BurstCounts(
            both=self.both + other.both,
            missed=self.missed + other.missed,
            false=self.false + other.false,
            neither=self.neither + other.neither,
        )

    @property
    def precision(self) -> float:
        """Share of the samples found that are hit; NaN if none is found."""
        return _share(self.both, self.false)

    @property
    def recall(self) -> float:
        """Share of the samples hit that are found; NaN if none is hit."""
        return _share(self.both, self.missed)

    @property
    def f_score(self) -> float:
        """Harmonic mean of precision and recall; NaN if none is hit and none found."""
        return _share(2 * self.both, self.missed + self.false)

    @property
    def false_mitigation(self) -> float:
        """Share of the samples not hit that are found, and so changed for nothing."""
        return _share(self.false, self.neither)


def burst_counts(found: BoolArray, hit: BoolArray, present: BoolArray) -> BurstCounts:
    """Counts of a frame from the masks ``(ramp, fast)`` of samples found, hit and present."""
    return BurstCounts(
        both=int(np.count_nonzero(found & hit & present)),
        missed=int(np.count_nonzero(~found & hit & present)),
        false=int(np.count_nonzero(found & ~hit & present)),
        neither=int(np.count_nonzero(~found & ~hit & present)),
    )


def hit_in_truth(parts: IfParts, present: BoolArray, *, level: float = 1.0) -> BoolArray:
    """Mask of the samples in which interference exceeds noise by ``level``, ``(ramp, fast)``.

    Parameters
    ----------
    parts : of the frame
    present : False in the padding of short ramps, ``(ramp, fast)``
    level : ratio of the powers
    """
    noise = float(np.mean(_power(parts.noise)[present]))
    return np.asarray(present & (_power(parts.interference) > level * noise))


def _power(samples: ComplexArray) -> FloatArray:
    return np.asarray(np.mean(samples.real**2 + samples.imag**2, axis=0))


def _share(some: int, others: int) -> float:
    return some / (some + others) if some + others else float("nan")
