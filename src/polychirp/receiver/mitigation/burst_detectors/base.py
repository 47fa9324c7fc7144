"""Detector of bursts, the first step of a repair, and what all detectors share."""

from typing import Final, Protocol

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.model.if_frame import IfFrame

GUARD_SAMPLES: Final = 8.0
"""Default guard of a burst, sample intervals. Chosen: at the paper's sample rate of 1 MS/s it is
8 µs, the half length of the default IF filter's response, 7.1 µs, in whole samples. A converter's
rate grows with the IF bandwidth, and the response's duration falls with it."""


class BurstDetection(Protocol):
    """Step that says which samples interference hits; every repair of bursts begins with one.

    A burst arises while an interferer's frequency crosses the band that the victim receives.
    """

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples that are hit, ``(ramp, fast)``; False in the padding of a ramp."""


def guard_time(guard: float | None, sample_rate: float) -> float:
    """The guard, s; None is `GUARD_SAMPLES` intervals at ``sample_rate`` samples per second.

    >>> guard_time(None, 20e6)
    4e-07
    """
    return GUARD_SAMPLES / sample_rate if guard is None else guard


def widened(mask: BoolArray, reach: float) -> BoolArray:
    """Mask ``(ramp, fast)`` of all samples at most ``reach`` samples from one in ``mask``.

    >>> widened(np.array([[False, False, False, True, False]]), 1.0)
    array([[False, False,  True,  True,  True]])
    """
    # a reach beyond the ramp hits the whole ramp, so that it is limited to the ramp
    by = round(min(reach, mask.shape[1]))
    count = np.cumsum(np.pad(mask, ((0, 0), (by + 1, by))), axis=-1)
    return np.asarray(count[:, 2 * by + 1 :] > count[:, : -2 * by - 1])


def median_of(values: FloatArray, present: BoolArray) -> FloatArray:
    """Median of every ramp's values ``(ramp, fast)`` without the padding, ``(ramp, 1)``.

    >>> median_of(np.array([[1.0, 3.0, 9.0, 0.0]]), np.array([[True, True, True, False]]))
    array([[3.]])
    """
    return np.asarray(np.nanmedian(np.where(present, values, np.nan), axis=-1, keepdims=True))
