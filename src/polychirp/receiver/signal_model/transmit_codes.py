"""Codes of the transmitting elements over a frame's sweeps, and the virtual array they give."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.errors import CapabilityError
from polychirp.model.antenna import AntennaArray
from polychirp.model.ramp import RampSchedule


@dataclass(frozen=True, slots=True, kw_only=True)
class CodeBlocks:
    """Numbers of the ramps ``(block, sweep of the block, ramp of the sweep)``, and the code.

    The code is ``weight``, the elements' weights on a block, ``(sweep of the block, element)``.
    """

    ramps: IntArray
    weight: ComplexArray


@lru_cache(maxsize=64)
def code_blocks(schedule: RampSchedule) -> CodeBlocks:
    """The shortest blocks after which the codes repeat, and over which the elements are orthogonal.

    Every element sends the same energy in a block, so that all channels have the same noise.

    Raises
    ------
    CapabilityError
        No such block divides the schedule, sweeps of a block differ, or weights change in a sweep.
    """
    num_sweeps = np.unique(schedule.sweep).size
    ramps_each, rest = divmod(schedule.num_ramps, num_sweeps)
    weight = schedule.transmit_weight[::ramps_each]
    if rest or not np.array_equal(np.repeat(weight, ramps_each, axis=0), schedule.transmit_weight):
        raise CapabilityError("the weights of the transmitting elements change within a sweep")
    for length in range(schedule.num_elements, num_sweeps + 1):
        block = weight[:length]
        if num_sweeps % length == 0 and _is_code(block, weight):
            ramps = np.arange(schedule.num_ramps).reshape(-1, length, ramps_each)
            _check_equal(schedule, ramps)
            return CodeBlocks(ramps=ramps, weight=block)
    raise CapabilityError(
        f"the codes of {schedule.num_elements} transmitting elements are not orthogonal over any "
        f"block that divides {num_sweeps} sweeps; choose a num_sweeps that their code divides"
    )


def _is_code(block: ComplexArray, weight: ComplexArray) -> bool:
    """True if ``weight`` repeats ``block``, whose elements are orthogonal and of equal energy."""
    repeated = np.tile(block, (weight.shape[0] // block.shape[0], 1))
    products = block.conj().T @ block
    power = products[0, 0].real
    return bool(
        power > 0.0
        and np.allclose(repeated, weight, rtol=0.0, atol=1e-6)
        and np.allclose(products, power * np.eye(block.shape[1]), rtol=0.0, atol=1e-6 * power)
    )


def _check_equal(schedule: RampSchedule, ramps: IntArray) -> None:
    for values in (schedule.slope, schedule.start_frequency, schedule.duration):
        each = values[ramps]
        if not np.allclose(each, each[:, :1], rtol=1e-9, atol=0.0):
            raise CapabilityError(
                "the sweeps of a code's block differ from each other, so its elements' signals "
                "cannot be told apart; choose a waveform whose sweeps are equal"
            )


def virtual_position(array: AntennaArray) -> FloatArray:
    """Positions of the virtual elements in the radar's frame, m, ``(element, channel, xyz)``."""
    return np.asarray(array.transmit_position[:, None] + array.position)


def virtual_channels(array: AntennaArray, num_elements: int) -> tuple[FloatArray, IntArray]:
    """Positions of the virtual channels, m, ``(virtual channel, xyz)``, and their order.

    They run from right to left in rows from bottom to top. Their order ``(virtual channel,)`` holds
    the flat index of each into (element, channel).
    """
    place = virtual_position(array)[:num_elements].reshape(-1, 3)
    # rows are at one height in spite of rounding
    order = np.lexsort((place[:, 1], place[:, 2].round(9)))
    return np.asarray(place[order]), np.asarray(order)


def need_own_line(array: AntennaArray) -> None:
    """Refuse receiving elements that are not the line of their ``spacing``, from right to left.

    Raises
    ------
    CapabilityError
        ``channel_positions`` place them elsewhere.
    """
    if not np.allclose(array.position, replace(array, channel_positions=()).position, atol=1e-9):
        raise CapabilityError(
            "this receiver needs receiving elements on a horizontal line, one at every 'spacing' "
            "from right to left, and channel_positions places them elsewhere; the receiver "
            "'range-doppler' reads any array, from equal chirps"
        )


def virtual_line(array: AntennaArray, num_elements: int) -> tuple[AntennaArray, IntArray]:
    """The virtual array, and for each of its channels the flat index into (element, channel).

    Raises
    ------
    CapabilityError
        The virtual elements are not on one horizontal line at equal distances.
    """
    place, order = virtual_channels(array, num_elements)
    gap = np.diff(place[:, 1])
    if np.ptp(place[:, 2]) > 1e-9:
        raise CapabilityError(
            "the virtual elements are not at one height, as this receiver needs; the receiver "
            "'range-doppler' reads any array, from equal chirps"
        )
    spacing = float(gap.mean()) if gap.size else array.spacing
    if not np.allclose(gap, spacing, rtol=1e-6, atol=0.0) or spacing == 0.0:
        raise CapabilityError(
            "the virtual elements are not at equal distances, as this receiver needs; "
            f"a transmit_spacing of {array.num_channels * array.spacing:.4g} m would do, and the "
            "receiver 'range-doppler' reads any array, from equal chirps"
        )
    gains, phases = _virtual_errors(array, num_elements, order)
    line = AntennaArray(
        num_channels=order.size,
        spacing=spacing,
        pattern=array.pattern,
        channel_gains=gains,
        channel_phases=phases,
    )
    return line, order


def _virtual_errors(
    array: AntennaArray, num_elements: int, order: IntArray
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Gains (power ratios) and phases (rad) of the virtual channels, empty if all are ideal."""
    response = np.outer(array.transmitter_response[:num_elements], array.channel_response)
    if np.all(response == 1.0):
        return (), ()
    chosen = response.ravel()[order]
    return tuple(np.abs(chosen) ** 2), tuple(np.angle(chosen))
