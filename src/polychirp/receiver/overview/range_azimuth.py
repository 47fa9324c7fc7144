"""Power over range and azimuth: beams of the channels' amplitudes in the strongest cells."""

from typing import Final

import numpy as np

from polychirp.model.if_frame import IfFrame
from polychirp.model.spectra import RangeAzimuthMap
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.overview.sums import sums_of
from polychirp.receiver.selection import FrameReceiver

NUM_BEAMS: Final = 181
"""Number of beams, equally spaced in the sine of the azimuth; chosen: eight per beam width of an
array of 44 half wavelengths."""

CELLS_PER_RANGE: Final = 16
"""Number of range rates whose amplitudes are beamed at each range, the strongest ones; chosen: they
cover a few bodies at one range."""


def range_azimuth_map(receiver: FrameReceiver, frame: IfFrame) -> RangeAzimuthMap:
    """Greatest power over range rates of beams at zero elevation, W.

    A plane wave has the power that it has in one channel. At each range, the `CELLS_PER_RANGE`
    strongest range rates count. A code of transmitting elements is decoded for each of them, as it
    is folded into the span of the code.
    """
    sums = sums_of(receiver, frame)
    map_ = sums.map
    count = min(CELLS_PER_RANGE, map_.range_rate.size)
    row = np.argpartition(-map_.power, count - 1, axis=0)[:count]  # (strongest, range)
    column = np.broadcast_to(np.arange(map_.range.size), row.shape)
    cell = np.stack([row.ravel(), column.ravel()], axis=1)
    elements = Elements.of(sums.place, frequency=float(np.mean(frame.schedule.centre_frequency)))
    sine = np.linspace(-1.0, 1.0, NUM_BEAMS)
    beams = elements.steering(np.stack([sine, np.zeros(sine.size)], axis=1)).conj()
    power = sums.beam_power(cell, beams / len(sums.place))
    strongest = power.reshape(sine.size, count, map_.range.size).max(axis=1)
    return RangeAzimuthMap(power=strongest, sine=sine, range=map_.range)
