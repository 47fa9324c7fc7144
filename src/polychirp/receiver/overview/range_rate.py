"""Power over range and range rate, and over range alone, for ramps of any kind."""

from polychirp.model.if_frame import IfFrame
from polychirp.model.spectra import RangePower, RangeRateMap
from polychirp.receiver.overview.sums import sums_of
from polychirp.receiver.selection import FrameReceiver


def range_rate_map(receiver: FrameReceiver, frame: IfFrame) -> RangeRateMap:
    """Mean power of the channels, W, with the receiver's mitigation and limits.

    A point has about its power. Over equal chirps, and over short ramps that differ, all samples
    add up in phase; over long ramps that rise and fall it is a geometric mean (`sums.sums_of`).
    """
    return sums_of(receiver, frame).map


def range_profile(receiver: FrameReceiver, frame: IfFrame) -> RangePower:
    """The greatest value of `range_rate_map` over range rates, at every range."""
    map_ = range_rate_map(receiver, frame)
    return RangePower(power=map_.power.max(axis=0), range=map_.range)
