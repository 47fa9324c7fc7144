"""What mitigation leaves of a frame: cleaner samples, and how present each of them is."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Protocol

import numpy as np

from polychirp.axes import Axes, BoolArray, ComplexArray, FloatArray, seal
from polychirp.model.if_frame import IfFrame

Repair = Callable[[ComplexArray], ComplexArray]
"""A linear map of samples ``(…, channel, ramp, fast)`` onto such samples."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mitigated:
    """A frame's samples after mitigation.

    What to do is chosen by looking at the whole frame; what is then done is linear. So ``repair``
    applied to each part of the frame (echo, interference, noise) gives parts that still sum to
    ``samples``, and a ratio of signal to interference after mitigation is exact.

    Parameters
    ----------
    samples : V, ``(channel, ramp, fast)``, zero where nothing is present
    weight : ``(ramp, fast)``, 0 … 1, how far each sample counts; 0 in the padding
    repair : what was done to the samples
    """

    samples: Annotated[ComplexArray, Axes("channel", "ramp", "fast", dtype=np.complex128)]
    weight: Annotated[FloatArray, Axes("ramp", "fast")]
    repair: Repair

    def __post_init__(self) -> None:
        seal(self)


class Mitigation(Hashable, Protocol):
    """What a receiver may do to a frame's samples before it looks at them: a spec."""

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples without what interference did to them, as far as possible."""
        ...


def mitigated(mitigation: Mitigation | None, frame: IfFrame) -> Mitigated:
    """What a receiver works on: the frame as it is where there is no mitigation.

    Who detects in a frame and who takes it apart ask for the same: the last two are kept.
    """
    if mitigation is None:
        present = frame.times.is_sample.astype(np.float64)
        return Mitigated(samples=frame.samples, weight=present, repair=lambda samples: samples)
    return _mitigated(mitigation, frame)


@lru_cache(maxsize=2)
def _mitigated(mitigation: Mitigation, frame: IfFrame) -> Mitigated:
    return mitigation.mitigate(frame)


def kept(frame: IfFrame, weight: BoolArray | FloatArray) -> Mitigated:
    """The frame with weights ``(ramp, fast)``, its samples unchanged where they are present."""
    present = weight > 0

    def repair(samples: ComplexArray) -> ComplexArray:
        return np.asarray(samples * present)

    return Mitigated(samples=repair(frame.samples), weight=weight.astype(np.float64), repair=repair)
