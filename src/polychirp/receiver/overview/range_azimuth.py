"""Power over range and azimuth: beams of the channels' amplitudes in the strongest cells."""

from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.if_frame import IfFrame
from polychirp.model.spectra import RangeAzimuthMap
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.overview.sums import sums_of
from polychirp.receiver.selection import FrameReceiver

NUM_BEAMS: Final = 181
"""Number of beams beside each other, equally spaced in the direction cosine to the left; chosen:
eight per beam width of an array of 44 half wavelengths."""

CELLS_PER_RANGE: Final = 16
"""Number of range rates whose amplitudes are beamed at each range, the strongest ones; chosen: they
cover a few bodies at one range."""

ELEVATIONS_PER_CELL: Final = 4
"""Number of beams above each other per cell 1/H of the sine of the elevation, H the height of the
array in wavelengths. Chosen: half a beam of two rows, a quarter of one of many. Between two beams,
0.7 dB are lost at most with two rows and 0.2 dB with many. With twice as many, it would be 0.2 dB
at twice the time, and with half of them, 3 dB with two rows."""


def range_azimuth_map(receiver: FrameReceiver, frame: IfFrame) -> RangeAzimuthMap:
    r"""Greatest power over range rates and elevations of beams to the sides, W.

    A plane wave has the power that it has in one channel, at the direction cosine
    :math:`u = \cos\varepsilon \sin\varphi` of its azimuth φ and elevation ε. Elements on one
    horizontal line do not tell elevations apart: their beams are at zero elevation. Of elements at
    several heights, each u has the strongest of the beams at `elevation_sines`. At each range, the
    `CELLS_PER_RANGE` strongest range rates count. A code of transmitting elements is decoded for
    each of them, as it is folded into the span of the code.
    """
    sums = sums_of(receiver, frame)
    map_ = sums.map
    count = min(CELLS_PER_RANGE, map_.range_rate.size)
    row = np.argpartition(-map_.power, count - 1, axis=0)[:count]  # (strongest, range)
    column = np.broadcast_to(np.arange(map_.range.size), row.shape)
    cell = np.stack([row.ravel(), column.ravel()], axis=1)
    elements = Elements.of(sums.place, frequency=float(np.mean(frame.schedule.centre_frequency)))
    left = np.linspace(-1.0, 1.0, NUM_BEAMS)
    up = elevation_sines(elements)
    number, height = np.nonzero(left[:, None] ** 2 + up**2 <= 1.0 + 1e-9)
    beams = elements.steering(np.stack([left[number], up[height]], axis=1)).conj()
    first = np.searchsorted(number, np.arange(left.size))  # of the beams of each cosine
    parts = np.array_split(cell, min(up.size, len(cell)))  # as many powers at a time as of a line
    power = [
        np.maximum.reduceat(sums.beam_power(some, beams / len(sums.place)), first, axis=0)
        for some in parts
    ]
    strongest = np.concatenate(power, axis=1).reshape(left.size, count, map_.range.size).max(axis=1)
    return RangeAzimuthMap(power=strongest, sine=left, range=map_.range)


def elevation_sines(elements: Elements) -> FloatArray:
    """Sines of the elevations of the map's beams, from −1 to 1, and 0 alone of a horizontal line.

    They are `ELEVATIONS_PER_CELL` to a cell of the array.

    >>> elevation_sines(Elements(place=[[0.0, 0.0], [0.5, 0.0]]))
    array([0.])
    >>> elevation_sines(Elements(place=[[0.0, 0.0], [0.0, 0.5]]))
    array([-1. , -0.5,  0. ,  0.5,  1. ])
    """
    if 1 not in elements.axes:
        return np.zeros(1)
    half = int(np.ceil(ELEVATIONS_PER_CELL * elements.extent[1]))
    return np.linspace(-1.0, 1.0, 2 * half + 1)
