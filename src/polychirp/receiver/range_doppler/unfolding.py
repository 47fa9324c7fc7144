r"""Range rates beyond the span of a code, and the channels of the virtual array.

A code of K sweeps is read at each range rate once every K sweeps, so that all rates that differ by
:math:`\lambda/2KT` fall into one cell. The sweeps of a block see the target at different times,
kT late, with the phase :math:`2\pi f_d\,kT`. Once this phase is removed with the right
:math:`f_d = 2 f_m v/c`, the elements are separated by their code,

.. math:: \hat x_l = \frac{\sum_k w_{kl}\,e^{-j2\pi f_d kT}\,Y_k}{\sum_k |w_{kl}|^2},

and the virtual array has the phases of one plane wave. With another of the K range rates, phases
jump from element to element, and no beam collects them all. So the range rate is taken at which
the strongest beam is strongest.
"""

from typing import NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.angle.beams import strongest_beam
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.range_doppler.transforms import middle_frequency, repetition_interval
from polychirp.receiver.signal_model.transmit_codes import CodeBlocks, virtual_channels

EQUAL_BEAMS = 1e-6
"""Relative difference below which two beams count as equal, and the lower speed is taken: with one
receiving channel, every range rate gives some plane wave. Chosen: above the rounding errors."""


class Unfolded(NamedTuple):
    """Range rates, m/s ``(detection,)``, and the virtual array's amplitudes, V.

    The amplitudes ``(detection, virtual channel)`` are in the order of `virtual_channels`, and
    refer to the middle of the block's first sweeps.
    """

    range_rate: FloatArray
    amplitude: ComplexArray


def unfolded(
    frame: IfFrame,
    blocks: CodeBlocks,
    amplitude: ComplexArray,
    range_rate: FloatArray,
    *,
    num_rates: int,
) -> Unfolded:
    """Range rates among the K that a code's cell may mean, and the channels decoded with them.

    Parameters
    ----------
    amplitude : of each detection's cell, V ``(detection, channel, sweep of the block)``
    range_rate : of each detection in the span of the code, m/s ``(detection,)``
    num_rates : number of range rates that are tried, the lowest ones; K for all, 1 for the lowest
    """
    length = len(blocks.weight)
    interval = repetition_interval(frame.schedule)
    wavelength = SPEED_OF_LIGHT / middle_frequency(frame.schedule, frame.times)
    span = wavelength / (2.0 * length * interval)
    every = range_rate[:, None] + span * np.arange(-(length // 2), length // 2 + 1)
    rates = np.take_along_axis(every, np.argsort(np.abs(every), axis=1)[:, :num_rates], axis=1)
    late = interval * np.arange(length)
    turn = np.exp(-4j * np.pi * rates[..., None] * late / wavelength)
    weight = blocks.weight / np.sum(np.abs(blocks.weight) ** 2, axis=0)
    place, order = virtual_channels(frame.array, frame.schedule.num_elements)
    apart = np.einsum("kl,dnk,dck->dnlc", weight, turn, amplitude)
    virtual = apart.reshape(*rates.shape, order.size)[..., order]
    strongest = strongest_beam(virtual, Elements.of(place, frequency=SPEED_OF_LIGHT / wavelength))
    is_best = strongest >= (1.0 - EQUAL_BEAMS) * strongest.max(axis=1, keepdims=True)
    best = np.argmax(is_best, axis=1)
    number = np.arange(len(best))
    return Unfolded(range_rate=rates[number, best], amplitude=virtual[number, best])
