"""Detection of interference bursts by their amplitude and by their prediction error."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.burst_detectors.base import guard_time, median_of, widened
from polychirp.receiver.mitigation.prediction import prediction_error, rms
from polychirp.spec import Spec
from polychirp.units import Between, Seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class MedianThreshold(Spec):
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
    (docs/validation/mitigation.md). With P = ``whitening`` it takes some 4 P² + 8 P real
    multiplications per sample and channel.

    Parameters
    ----------
    factor : ratio to the ramp's median amplitude or median error, above which a sample is hit
    guard : s, before and after a sample above that limit; None for `GUARD_SAMPLES` intervals of
        the converter's samples
    whitening : number of samples from which each one is predicted; 0: amplitudes alone decide
    """

    kind: Literal["median-threshold"] = "median-threshold"
    factor: float = 3.0
    guard: Seconds | None = None
    whitening: Annotated[int, Between(greatest=1024)] = 8

    def __post_init__(self) -> None:
        check_median_settings(self.factor, self.guard, self.whitening)

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples that are hit, ``(ramp, fast)``; False in the padding of a ramp."""
        present = frame.times.is_sample
        above = self._stands_out(rms(frame.samples), present)
        if self.whitening:
            error = np.zeros(present.shape)
            for k, length in enumerate(frame.times.num_samples):
                error[k, :length] = prediction_error(frame.samples[:, k, :length], self.whitening)
            above |= self._stands_out(error, present)
        rate = frame.times.rate
        return widened(above, guard_time(self.guard, rate) * rate) & present

    def _stands_out(self, amplitude: FloatArray, present: BoolArray) -> BoolArray:
        """Mask of the samples above ``factor`` times their ramp's median, ``(ramp, fast)``."""
        return np.asarray(present & (amplitude > self.factor * median_of(amplitude, present)))


def check_median_settings(factor: float, guard: float | None, whitening: int) -> None:
    """Refuse settings that no threshold over the median can have.

    Raises
    ------
    InputError
        The factor is 1 or less, or the guard or the whitening is negative.
    """
    if not factor > 1.0:
        raise InputError("a mitigation's factor must be above 1, or it hits every sample")
    if guard is not None and guard < 0:
        raise InputError("a mitigation's guard cannot be negative")
    if whitening < 0:
        raise InputError("a mitigation's whitening cannot be negative; 0 is none")
