"""Bands that resolve ranges: that of each ramp, and that of all ramps together."""

from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.selection import FrameReceiver

_WIDER: Final = 1.05
"""Ratio of the band of all ramps to the widest of one above which it is a frame's. Chosen: rising
and falling ramps are sampled in bands that are up to some percent apart."""


def sampled_band(schedule: RampSchedule, times: SampleTimes) -> FloatArray:
    """Width of the band over which each ramp is sampled, Hz ``(ramp,)``.

    Of a coded carrier, it is the band of the chips, or that of the samples if that is less; of
    steps, the band of all.
    """
    if schedule.is_stepped:
        return schedule.resolving_bandwidth
    swept = np.abs(schedule.slope) * times.num_samples / times.rate
    is_flat = schedule.slope == 0.0
    return np.where(is_flat, np.minimum(schedule.bandwidth, times.rate), swept)


def joint_band(receiver: FrameReceiver, schedule: RampSchedule, times: SampleTimes) -> float | None:
    r"""Band that the samples of all ramps together cover, Hz: √12 times their spread.

    None if it is not wider than the band of every ramp, if ramps carry a code, or if the receiver
    does not add ramps of different bands in phase: the coherent receiver alone does.

    The spread is the standard deviation of the frequencies at which samples are taken, so that B is
    the width of the band if they fill it evenly. Half of a point's power is then at
    :math:`0.443\,c/2B` to either side of it, to a few percent also where they do not.
    """
    if not isinstance(receiver, CoherentReceiver) or schedule.code is not None:
        return None
    share = times.num_samples / times.num_samples.sum()
    last = times.first + (times.num_samples - 1) / times.rate
    middle = schedule.start_frequency + schedule.slope * (
        0.5 * (times.first + last) - schedule.start_time
    )
    swept = schedule.slope * times.num_samples / times.rate
    apart = middle - share @ middle
    joint = float(np.sqrt(share @ (swept**2 + 12.0 * apart**2)))
    return joint if joint > _WIDER * float(sampled_band(schedule, times).max()) else None
