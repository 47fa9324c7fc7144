"""Blanking: samples that interference hits are set to zero before the range transform."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.axes import BoolArray
from polychirp.errors import InputError
from polychirp.frames import Spec
from polychirp.model.if_frame import IfFrame
from polychirp.units import Seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class Blanking(Spec):
    """Zero what stands out of a ramp's median amplitude.

    A crossing interferer is a burst; echoes fill the whole ramp. On each ramp, samples whose
    amplitude (root of the mean power over channels) exceeds ``factor`` times the ramp's median
    are hit, and so are those within ``guard`` of them, where the IF filter still rings.
    A synchronous interferer fills the ramp like an echo and is *not* touched.
    """

    kind: Literal["blanking"] = "blanking"
    factor: float = 3.0
    guard: Seconds = 8e-6

    def __post_init__(self) -> None:
        if not self.factor > 1.0:
            raise InputError("a blanking factor must be above 1, or every sample goes")
        if self.guard < 0:
            raise InputError("a blanking guard cannot be negative")

    def hit(self, frame: IfFrame) -> BoolArray:
        """Which samples are hit, ``(ramp, fast)``; never the padding."""
        present = frame.times.is_sample
        amplitude = np.sqrt(np.mean(np.abs(frame.samples) ** 2, axis=0))
        median = np.nanmedian(np.where(present, amplitude, np.nan), axis=-1, keepdims=True)
        above = present & (amplitude > self.factor * median)
        reach = round(self.guard * frame.times.rate)
        count = np.cumsum(np.pad(above, ((0, 0), (reach + 1, reach))), axis=-1)
        near = count[:, 2 * reach + 1 :] - count[:, : -2 * reach - 1] > 0
        return np.asarray(near & present)

    def apply(self, frame: IfFrame) -> IfFrame:
        """The frame with its hit samples zeroed."""
        return frame.with_samples(np.where(self.hit(frame), 0.0, frame.samples))
