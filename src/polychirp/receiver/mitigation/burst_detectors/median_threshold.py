"""Detection of interference bursts by their amplitude and by their prediction error."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Final, Literal

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.detection.cfar import ordered_statistic_factor
from polychirp.receiver.mitigation.burst_detectors.base import guard_time, median_of, widened
from polychirp.receiver.mitigation.prediction import prediction_errors, rms
from polychirp.spec import Spec
from polychirp.units import Between, Seconds

FALSE_MITIGATION: Final = 1e-3
"""Default share of the samples of noise alone that are hit. Chosen: blanking them costs 0.004 dB.
At ten times as much, some 3 % more of the samples of weak bursts are found."""

LEAST_SAMPLES: Final = 3
"""Least number of samples that have a median with a sample on either side."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MedianThreshold(Spec):
    r"""Detector of bursts, which are short, whereas echoes fill the whole ramp.

    On each ramp, samples whose amplitude (root of the mean power over channels) exceeds a multiple
    of the ramp's median amplitude are hit. Samples whose prediction error exceeds a multiple of the
    ramp's median error are hit too. So are all samples within ``guard`` of these, where the IF
    filter still rings. A synchronous interferer with the same slope fills the ramp like an echo,
    and is *not* detected.

    The prediction error is that of each sample predicted from ``whitening`` others, the smaller one
    of the forward and the backward prediction (`prediction_errors`). Echoes are predicted well, so
    that it shows bursts that are weaker than the echoes. The amplitude is needed as well: a strong
    burst is predicted well if its frequency changes slowly.

    The multiples follow the number of channels and of samples (`median_factor`), so that of white
    noise alone at most the share ``false_mitigation`` is hit. With a guard of g samples and two
    tests, each test exceeds its multiple with the probability

    .. math:: p = \frac{F}{2\,(2 g + 1)}

    in a sample of noise. The prediction error is noise, which differs from channel to channel, and
    its multiple is that of all channels. The amplitude is mostly that of echoes, which all channels
    share, and which beat: its multiple is that of one channel.

    The other defaults are chosen: on the paper's frames they remove the rise of the floor
    (docs/validation/mitigation.md). With P = ``whitening`` it takes some 4 P² + 8 P real
    multiplications per sample and channel.

    Parameters
    ----------
    factor : one multiple of both medians, whatever the number of channels; None: they follow
        ``false_mitigation``
    false_mitigation : greatest share of the samples of noise alone that are hit, the guard included
    guard : s, before and after a sample above that limit; None for `GUARD_SAMPLES` intervals of
        the converter's samples
    whitening : number of samples from which each one is predicted; 0: amplitudes alone decide
    """

    kind: Literal["median-threshold"] = "median-threshold"
    factor: float | None = None
    false_mitigation: float = FALSE_MITIGATION
    guard: Seconds | None = None
    whitening: Annotated[int, Between(greatest=1024)] = 8

    def __post_init__(self) -> None:
        check_median_settings(self.factor, self.false_mitigation, self.guard, self.whitening)

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples that are hit, ``(ramp, fast)``; False in the padding of a ramp."""
        present = frame.times.is_sample
        guard = guard_time(self.guard, frame.times.rate) * frame.times.rate
        looks = 1.0 if np.any(frame.samples.imag) else 0.5
        multiple = self._multiples(frame, guard, looks=looks, left_out=0)
        amplitude = rms(frame.samples)
        above = amplitude > multiple[:, None] * median_of(amplitude, present)
        if self.whitening:
            multiple = self._multiples(
                frame, guard, looks=looks * len(frame.samples), left_out=self.whitening
            )
            for k, length in enumerate(frame.times.num_samples):
                error = prediction_errors(frame.samples[:, k, :length], self.whitening)
                # of both directions: the smaller one of two errors has a lower median
                level = np.median(error[np.isfinite(error)])
                above[k, :length] |= error.min(axis=0) > multiple[k] * level
        return widened(above & present, guard) & present

    def _multiples(
        self, frame: IfFrame, guard: float, *, looks: float, left_out: int
    ) -> FloatArray:
        """Multiple of every ramp's median, ``(ramp,)``, of all samples but ``left_out``."""
        lengths = frame.times.num_samples
        if self.factor is not None:
            return np.full(lengths.size, self.factor)
        reach = 2.0 * min(round(guard), frame.times.most_samples) + 1.0
        tests = 2.0 if self.whitening else 1.0
        probability = self.false_mitigation / (tests * reach)
        counts = np.maximum(lengths - left_out, LEAST_SAMPLES)
        kinds, of_ramp = np.unique(counts, return_inverse=True)
        factors = [median_factor(looks, probability, num_samples=n) for n in kinds.tolist()]
        return np.array(factors)[of_ramp]


@lru_cache(maxsize=64)
def median_factor(looks: float, probability: float, *, num_samples: int) -> float:
    r"""Amplitude that noise exceeds with a probability, over the median of a ramp's amplitudes.

    The power of Gaussian noise, a mean over L complex channels, is gamma distributed with the shape
    L, and over C real channels with the shape C/2. The median of few samples is not that of the
    distribution: above it, a sample is compared with an ordered statistic of the other samples
    (`ordered_statistic_factor`). With the regularised upper incomplete gamma function Q, the
    amplitude of many samples is

    .. math:: \kappa = \sqrt{Q^{-1}(L, p) \,/\, Q^{-1}(L, \tfrac12)} .

    Parameters
    ----------
    looks : L: 1 for each complex channel, one half for each real one
    probability : p
    num_samples : number of independent samples of which the median is taken, 3 or more

    Examples
    --------
    For one complex channel and many samples it is the root of the binary logarithm of 1/p.

    >>> round(median_factor(1.0, 2.0**-16, num_samples=10**6), 3)
    4.0
    >>> round(median_factor(1.0, 2.0**-16, num_samples=32), 3)
    4.775
    """
    rank = (num_samples + 1) // 2
    return math.sqrt(
        ordered_statistic_factor(
            num_samples - 1, rank, false_alarm_probability=probability, num_looks=looks
        )
    )


def check_median_settings(
    factor: float | None, false_mitigation: float, guard: float | None, whitening: int
) -> None:
    """Refuse settings that no threshold over the median can have.

    Raises
    ------
    InputError
        The factor is 1 or less, the false mitigation no share below a half, or the guard or the
        whitening negative.
    """
    if factor is not None and not factor > 1.0:
        raise InputError("a mitigation's factor must be above 1, or it hits every sample")
    if not 0.0 < false_mitigation < 0.5:
        raise InputError("a mitigation's false_mitigation is a share between 0 and 0.5")
    if factor is not None and false_mitigation != FALSE_MITIGATION:
        raise InputError("a factor decides the false mitigation; give one of both")
    if guard is not None and guard < 0:
        raise InputError("a mitigation's guard cannot be negative")
    if whitening < 0:
        raise InputError("a mitigation's whitening cannot be negative; 0 is none")
