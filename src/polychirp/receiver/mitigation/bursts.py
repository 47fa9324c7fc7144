"""Detection of interference bursts by their amplitude and by their prediction error.

A burst arises while an interferer's frequency crosses the band that the victim receives.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.prediction import prediction_error, rms
from polychirp.spec import Spec
from polychirp.units import Between, Seconds

GUARD_SAMPLES = 8.0
"""Default guard of a burst, sample intervals. Chosen: at the paper's sample rate of 1 MS/s it is
8 µs, the half length of the default IF filter's response, 7.1 µs, in whole samples. A converter's
rate grows with the IF bandwidth, and the response's duration falls with it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BurstDetector(Spec):
    """Detector of bursts, which are short, whereas echoes fill the whole ramp.

    On each ramp, samples whose amplitude (root of the mean power over channels) exceeds ``factor``
    times the ramp's median amplitude are hit. Samples whose prediction error exceeds ``factor``
    times the ramp's median error are hit too. So are all samples within ``guard`` of these, where
    the IF filter still rings. A synchronous interferer with the same slope fills the ramp like an
    echo, and is *not* detected.

    The prediction error is that of each sample predicted from ``whitening`` others
    (`prediction_error`). Echoes are predicted well, so that it shows bursts that are weaker than
    the echoes. The amplitude is needed as well: a strong burst is predicted well if its frequency
    changes slowly.

    The defaults are chosen: on the paper's frames they remove the rise of the floor
    (docs/validation/mitigation.md).

    Parameters
    ----------
    factor : ratio to the ramp's median amplitude or median error, above which a sample is hit
    guard : s, before and after a sample above that limit; None for `GUARD_SAMPLES` intervals of
        the converter's samples
    whitening : number of samples from which each one is predicted; 0: amplitudes alone decide
    """

    factor: float = 3.0
    guard: Seconds | None = None
    whitening: Annotated[int, Between(greatest=1024)] = 8

    def __post_init__(self) -> None:
        if not self.factor > 1.0:
            raise InputError("a mitigation's factor must be above 1, or it hits every sample")
        if self.guard is not None and self.guard < 0:
            raise InputError("a mitigation's guard cannot be negative")
        if self.whitening < 0:
            raise InputError("a mitigation's whitening cannot be negative; 0 is none")

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples that are hit, ``(ramp, fast)``; False in the padding of a ramp."""
        above = self._stands_out(rms(frame.samples), frame.times.is_sample)
        if self.whitening:
            error = np.zeros(frame.times.is_sample.shape)
            for k, length in enumerate(frame.times.num_samples):
                error[k, :length] = prediction_error(frame.samples[:, k, :length], self.whitening)
            above |= self._stands_out(error, frame.times.is_sample)
        # a guard longer than the ramp hits the whole ramp, so that its reach is limited to the ramp
        rate = frame.times.rate
        reach = round(min(self.guard_time(rate) * rate, above.shape[1]))
        count = np.cumsum(np.pad(above, ((0, 0), (reach + 1, reach))), axis=-1)
        near = count[:, 2 * reach + 1 :] - count[:, : -2 * reach - 1] > 0
        return np.asarray(near & frame.times.is_sample)

    def guard_time(self, sample_rate: float) -> float:
        """The guard, s, if the converter takes ``sample_rate`` samples per second.

        >>> BurstDetector().guard_time(20e6)
        4e-07
        """
        return GUARD_SAMPLES / sample_rate if self.guard is None else self.guard

    def _stands_out(self, amplitude: FloatArray, present: BoolArray) -> BoolArray:
        """Mask of the samples above ``factor`` times their ramp's median, ``(ramp, fast)``."""
        median = np.nanmedian(np.where(present, amplitude, np.nan), axis=-1, keepdims=True)
        return np.asarray(present & (amplitude > self.factor * median))
