"""Detection of interference bursts by mean amplitudes and mean steps, with hysteresis."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.axes import BoolArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.burst_detectors.base import guard_time, widened
from polychirp.receiver.mitigation.prediction import rms
from polychirp.spec import Spec
from polychirp.units import Seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class AmplitudeSteps(Spec):
    r"""Detector of bursts by :math:`|y_n|` and :math:`|y_n - y_{n-1}|` over their means.

    A sample begins a burst if its amplitude or its step exceeds ``factor`` times the ramp's mean of
    that quantity; the burst goes on in both directions as long as either exceeds ``release`` times
    the mean. Means need neither sorting nor memory, so that hardware of radar chips does it in one
    pass (TI 2020); they rise with the bursts themselves, so that a ramp of which much is hit shows
    less of them than `MedianThreshold` does. It takes 5 real multiplications per sample and
    channel.

    Parameters
    ----------
    factor : ratio to the mean above which a burst begins
    release : ratio to the mean below which it ends; at most ``factor``
    guard : s, before and after a burst; None for `GUARD_SAMPLES` intervals of the samples
    """

    kind: Literal["amplitude-steps"] = "amplitude-steps"
    factor: float = 4.0
    release: float = 2.5
    guard: Seconds | None = None

    def __post_init__(self) -> None:
        if not self.factor > 1.0:
            raise InputError("a detector's factor must be above 1, or it hits every sample")
        if not 0.0 < self.release <= self.factor:
            raise InputError("a detector's release must lie between 0 and its factor")
        if self.guard is not None and self.guard < 0:
            raise InputError("a detector's guard cannot be negative")

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples that are hit, ``(ramp, fast)``; False in the padding of a ramp."""
        present = frame.times.is_sample
        step = np.diff(frame.samples, axis=-1, prepend=frame.samples[..., :1])
        begins = np.zeros(present.shape, dtype=np.bool_)
        goes_on = begins.copy()
        for amplitude in (rms(frame.samples), rms(step)):
            ratio = amplitude / np.maximum(_mean_of(amplitude, present), 1e-300)
            begins |= present & (ratio > self.factor)
            goes_on |= present & (ratio > self.release)
        rate = frame.times.rate
        return widened(connected(begins, goes_on), guard_time(self.guard, rate) * rate) & present


def connected(begins: BoolArray, goes_on: BoolArray) -> BoolArray:
    """Runs of ``goes_on`` ``(ramp, fast)`` with at least one sample in ``begins``.

    >>> text = np.array([[False, True, False, False, False]])
    >>> connected(text, np.array([[True, True, False, True, True]]))
    array([[ True,  True, False, False, False]])
    """
    starts = goes_on & ~np.pad(goes_on, ((0, 0), (1, 0)))[:, :-1]
    run = np.cumsum(starts, axis=None).reshape(goes_on.shape)
    has_begun = np.zeros(int(run[-1, -1]) + 1, dtype=np.bool_)
    has_begun[run[begins & goes_on]] = True
    return np.asarray(goes_on & has_begun[run])


def _mean_of(values: FloatArray, present: BoolArray) -> FloatArray:
    total = np.sum(values * present, axis=-1, keepdims=True)
    return np.asarray(total / np.maximum(present.sum(axis=-1, keepdims=True), 1))
