r"""Arrays and codes that tell the range rates apart that fall into one cell.

`unfolding` takes the fold whose elements leave the empty bands empty, and whose strongest beam is
strongest. Neither need be the true one alone: decoded with a wrong range rate, a plane wave may
look like another plane wave. Transmitting elements in a row and receiving ones in a column are
an example, as the wrong fold turns the row to another azimuth, which the column does not see.

This module decodes noise-free waves of many directions with every fold, and says in which share of
the directions the right one alone is best.
"""

from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.model.antenna import AntennaArray
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.angle.beams import strongest_beam
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.range_doppler.unfolding import decoded, energy
from polychirp.receiver.signal_model.transmit_codes import (
    CodeBlocks,
    code_blocks,
    virtual_channels,
)
from polychirp.units import from_db

DIRECTIONS: Final = 48
"""Number of directions that are tried; chosen: a share is then known to 0.07."""

WIDEST_AZIMUTH, WIDEST_ELEVATION = np.radians([50.0, 10.0])
"""Azimuths and elevations to either side that are tried; chosen, as a car radar's field of view."""

EQUAL_POWER: Final = from_db(-0.2)
"""Least power of a wrong fold's strongest beam over the right one's at which both count as equal.
Chosen: beams on a grid may be 0.1 dB too weak, and with less, noise takes one for the other in one
of ten cases at an SNR of 18 dB in all channels together, in one of a thousand at 26 dB."""

ADMITTED_SHARE: Final = 0.9
"""Least share of the power within the elements of a fold that empty bands do not refuse. Chosen:
the tenth that is outside is as strong as the noise of ten channels where the SNR is 20 dB."""

TOLD_SHARE: Final = 0.95
"""Least share of the directions in which the right fold must be best alone; chosen."""


def folds_are_told_apart(schedule: RampSchedule, array: AntennaArray, *, by_beams: bool) -> bool:
    """True if range rates beyond the span of a schedule's code are told apart nearly everywhere.

    Everywhere is `TOLD_SHARE` of the directions. A schedule without a code has nothing to tell.

    Parameters
    ----------
    by_beams : True if beams of the array are compared, else only the code's empty bands
    """
    blocks = code_blocks(schedule)
    if len(blocks.weight) == 1:
        return True
    frequency = float(np.mean(schedule.centre_frequency))
    code = tuple(map(tuple, blocks.weight.tolist()))
    return _share_of(code, array, frequency, by_beams=by_beams) >= TOLD_SHARE


@lru_cache(maxsize=8)
def _share_of(
    code: tuple[tuple[complex, ...], ...], array: AntennaArray, frequency: float, *, by_beams: bool
) -> float:
    """`share_told_apart` of a code ``(sweep, element)``.

    It takes up to 40 ms, and so is kept for the next frames of the same radar.
    """
    ramps = np.zeros((1, len(code), 1), dtype=np.int64)
    blocks = CodeBlocks(ramps=ramps, weight=np.array(code, dtype=np.complex128))
    place, _ = virtual_channels(array, blocks.weight.shape[1])
    elements = Elements.of(place, frequency=frequency)
    return share_told_apart(blocks, array, elements, by_beams=by_beams)


def share_told_apart(
    blocks: CodeBlocks, array: AntennaArray, elements: Elements, *, by_beams: bool
) -> float:
    """Share of the directions in which no wrong fold is as good as the right one.

    ``elements`` are the virtual ones, in the order of `virtual_channels`.

    Examples
    --------
    Three elements that take turns and four receiving ones, in one line, and in row and column:

    >>> blocks = CodeBlocks(ramps=np.zeros((1, 3, 1), dtype=np.int64), weight=np.eye(3))
    >>> line = AntennaArray(num_channels=4, num_transmitters=3)
    >>> column = tuple((0, place) for place in range(4))
    >>> plane = AntennaArray(num_channels=4, num_transmitters=3, channel_positions=column)
    >>> for array in (line, plane):
    ...     place, _ = virtual_channels(array, 3)
    ...     elements = Elements.of(place, frequency=77e9)
    ...     print(share_told_apart(blocks, array, elements, by_beams=True))
    1.0
    0.0
    """
    _, order = virtual_channels(array, blocks.weight.shape[1])
    # virtual channels have the order of their places, and waves that of (element, channel)
    waves = np.empty((DIRECTIONS, order.size), dtype=np.complex128)
    waves[:, order] = elements.steering(_cosines(elements))
    by_element = waves.reshape(DIRECTIONS, blocks.weight.shape[1], -1)
    cell = np.einsum("kl,nlc->nck", blocks.weight.conj(), by_element)
    length = len(blocks.weight)
    turn = np.exp(-2j * np.pi * np.outer(np.arange(length), np.arange(length)) / length)
    virtual = decoded(array, blocks, turn[:, None] * cell[:, None])
    power = np.sum(np.abs(virtual) ** 2, axis=-1) * energy(blocks)
    is_as_good = power >= ADMITTED_SHARE * power[:, :1]
    if by_beams:
        beam = strongest_beam(virtual, elements)
        is_as_good &= beam >= EQUAL_POWER * beam[:, :1]
    return float(np.mean(~is_as_good[:, 1:].any(axis=1)))


def _cosines(elements: Elements) -> FloatArray:
    """Direction cosines to the left and up of the tried directions, ``(direction, 2)``.

    Azimuths are evenly spaced; elevations, of an array that measures them, are spread by steps of
    the golden ratio.
    """
    number = np.arange(DIRECTIONS)
    azimuth = WIDEST_AZIMUTH * (2.0 * (number + 0.5) / DIRECTIONS - 1.0)
    spread = 2.0 * np.mod(number * 0.5 * (np.sqrt(5.0) - 1.0), 1.0) - 1.0
    elevation = WIDEST_ELEVATION * spread * (1 in elements.axes)
    left = np.cos(elevation) * np.sin(azimuth)
    return np.stack([left, np.sin(elevation)], axis=-1)
