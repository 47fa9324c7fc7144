"""`Reading`: a frame as it is read after its code has been removed."""

from collections.abc import Callable
from dataclasses import dataclass

from polychirp.axes import ComplexArray, FloatArray
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.range_doppler.chain import RangeDoppler


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A decoded frame and the receiver that reads it.

    Parameters
    ----------
    receiver : receiver of the decoded frame, without mitigation
    frame : the decoded frame, of ramps without a code
    decode : linear map of samples, V ``(…, channel, ramp, fast)``, that makes the decoded frame's
        from those of the original; parts of the samples still sum to the whole after it
    left : share of an echo's amplitude that mitigation leaves on each ramp, ``(ramp,)``
    weight : weights of the decoded samples of any echo, ``(ramp, fast)``; None if all are equal
    """

    receiver: RangeDoppler
    frame: IfFrame
    decode: Callable[[ComplexArray], ComplexArray]
    left: FloatArray
    weight: FloatArray | None = None
