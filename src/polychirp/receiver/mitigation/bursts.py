"""Bursts of crossing interferers, found by their amplitude and by their prediction error."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.prediction import prediction_error, rms
from polychirp.spec import Spec
from polychirp.units import Between, Seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class BurstDetector(Spec):
    """Detector of bursts, samples far above a ramp's median amplitude.

    The IF signal of a crossing interferer is a burst; echoes fill the whole ramp. On each ramp,
    samples whose amplitude (root of the mean power over channels) exceeds ``factor`` times the
    ramp's median are hit, and so are those within ``guard`` of them, where the IF filter still
    rings. A synchronous interferer fills the ramp like an echo and is *not* detected.

    A burst weaker than the echoes does not show in the amplitude, but in the error of predicting
    each sample from ``whitening`` others (`prediction_error`), which removes most of the echoes. A
    strong burst of a slow crossing can be predicted, but shows in the amplitude. Either is enough.

    Parameters
    ----------
    factor : of a ramp's median amplitude, above which a sample is hit
    guard : s, on either side of a sample that is hit
    whitening : number of samples from which each one is predicted; 0: amplitudes alone decide
    """

    factor: float = 3.0
    guard: Seconds = 8e-6
    whitening: Annotated[int, Between(greatest=1024)] = 8

    def __post_init__(self) -> None:
        if not self.factor > 1.0:
            raise InputError("a mitigation's factor must be above 1, or it hits every sample")
        if self.guard < 0:
            raise InputError("a mitigation's guard cannot be negative")
        if self.whitening < 0:
            raise InputError("a mitigation's whitening cannot be negative; 0 is none")

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples that are hit, ``(ramp, fast)``; never the padding."""
        above = self._stands_out(rms(frame.samples), frame.times.is_sample)
        if self.whitening:
            error = np.zeros(frame.times.is_sample.shape)
            for k, length in enumerate(frame.times.num_samples):
                error[k, :length] = prediction_error(frame.samples[:, k, :length], self.whitening)
            above |= self._stands_out(error, frame.times.is_sample)
        # beyond the whole ramp there is nothing left to hit
        reach = round(min(self.guard * frame.times.rate, above.shape[1]))
        count = np.cumsum(np.pad(above, ((0, 0), (reach + 1, reach))), axis=-1)
        near = count[:, 2 * reach + 1 :] - count[:, : -2 * reach - 1] > 0
        return np.asarray(near & frame.times.is_sample)

    def _stands_out(self, amplitude: FloatArray, present: BoolArray) -> BoolArray:
        """Mask of the samples above ``factor`` times their ramp's median, ``(ramp, fast)``."""
        median = np.nanmedian(np.where(present, amplitude, np.nan), axis=-1, keepdims=True)
        return np.asarray(present & (amplitude > self.factor * median))
