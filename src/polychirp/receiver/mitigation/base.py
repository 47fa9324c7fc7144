"""The result of mitigation: samples with less interference, and a weight for each sample."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Protocol, runtime_checkable

import numpy as np

from polychirp.axes import Axes, BoolArray, ComplexArray, FloatArray, Sealed
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule

Repair = Callable[[ComplexArray], ComplexArray]
"""A linear map of samples ``(…, channel, ramp, fast)`` onto samples of the same shape."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mitigated(Sealed):
    """A frame's samples after mitigation.

    The operation is chosen from the whole frame and is then linear, or at least additive. So
    ``repair`` applied to each part of the frame (echo, interference, noise) gives parts that still
    sum to ``samples``, from which the ratio of signal to interference after mitigation follows
    exactly. Methods that choose by iteration, such as `Imat`, keep the masks, poles or filters that
    they chose, and apply these to the parts.

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


@runtime_checkable
class Detecting(Protocol):
    """Mitigation that first detects which samples are hit."""

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples that are hit, ``(ramp, fast)``."""


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
    found: Any = mitigation.mitigate(frame)
    if not isinstance(found, Mitigated):  # a method of another package may return anything
        raise InputError(
            f"'mitigate' of {type(mitigation).__name__} returns {type(found).__name__}; "
            "return polychirp.receiver.mitigation.base.Mitigated"
        )
    return found


class Refusing(Protocol):
    """Mitigation, or its detector, that cannot read all frames, and says so before a long run."""

    def refuse(
        self, schedule: RampSchedule, *, times: SampleTimes, is_real: bool, num_channels: int
    ) -> None:
        """Raise `CapabilityError` if it cannot repair frames of these ramps, samples, channels."""


def refuse_unfit(
    method: object,
    schedule: RampSchedule,
    *,
    times: SampleTimes,
    is_real: bool,
    num_channels: int,
) -> None:
    """Refuse ramps, samples or an array that a mitigation or its detector cannot read.

    A ``method`` that is no `Refusing`, such as None, reads all.

    Raises
    ------
    CapabilityError
        The method needs equal or longer ramps, complex samples or several channels.
    """
    refuse = getattr(method, "refuse", None)
    if refuse is not None:
        refuse(schedule, times=times, is_real=is_real, num_channels=num_channels)


def refuse_frame(mitigation: Refusing, frame: IfFrame) -> None:
    """`Refusing.refuse` for a frame."""
    is_real = not np.any(frame.samples.imag)
    mitigation.refuse(
        frame.schedule, times=frame.times, is_real=is_real, num_channels=len(frame.samples)
    )


def with_weights(frame: IfFrame, weight: BoolArray | FloatArray) -> Mitigated:
    """The frame with weights ``(ramp, fast)``; its samples are zero where their weight is."""
    present = weight > 0

    def repair(samples: ComplexArray) -> ComplexArray:
        return np.asarray(samples * present)

    return Mitigated(samples=repair(frame.samples), weight=weight.astype(np.float64), repair=repair)
