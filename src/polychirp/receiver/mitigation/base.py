"""The result of mitigation: samples with less interference, and a weight for each sample."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Protocol

import numpy as np

from polychirp.axes import Axes, BoolArray, ComplexArray, FloatArray, Sealed
from polychirp.model.if_frame import IfFrame

Repair = Callable[[ComplexArray], ComplexArray]
"""A linear map of samples ``(…, channel, ramp, fast)`` onto samples of the same shape."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mitigated(Sealed):
    """A frame's samples after mitigation.

    The operation is chosen from the whole frame and is then linear. So ``repair`` applied to each
    part of the frame (echo, interference, noise) gives parts that still sum to ``samples``, from
    which the ratio of signal to interference after mitigation follows exactly.

    Parameters
    ----------
    samples : V, ``(channel, ramp, fast)``, zero where no sample is present
    weight : weight of each sample, ``(ramp, fast)``, 0 … 1; 0 in the padding
    repair : linear operation that makes ``samples`` from the frame's samples
    """

    samples: Annotated[ComplexArray, Axes("channel", "ramp", "fast", dtype=np.complex128)]
    weight: Annotated[FloatArray, Axes("ramp", "fast")]
    repair: Repair


class Mitigation(Hashable, Protocol):
    """Spec of an operation on a frame's samples that reduces interference before detection.

    `Blanking` is an example.
    """

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples with less interference."""


def mitigated(mitigation: Mitigation | None, frame: IfFrame) -> Mitigated:
    """The frame after mitigation; unchanged if ``mitigation`` is None.

    Detection and attribution need the same result. Therefore the last two results are cached.
    """
    if mitigation is None:
        present = frame.times.is_sample.astype(np.float64)
        return Mitigated(samples=frame.samples, weight=present, repair=lambda samples: samples)
    return _mitigated(mitigation, frame)


@lru_cache(maxsize=2)
def _mitigated(mitigation: Mitigation, frame: IfFrame) -> Mitigated:
    return mitigation.mitigate(frame)


def with_weights(frame: IfFrame, weight: BoolArray | FloatArray) -> Mitigated:
    """The frame with weights ``(ramp, fast)``; its samples are zero where their weight is."""
    present = weight > 0

    def repair(samples: ComplexArray) -> ComplexArray:
        return np.asarray(samples * present)

    return Mitigated(samples=repair(frame.samples), weight=weight.astype(np.float64), repair=repair)
