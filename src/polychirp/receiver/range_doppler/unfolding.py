r"""Range rates beyond the span of a code, and the channels of the virtual array.

A code of K sweeps is read at each range rate once every K sweeps, so that all rates that differ by
:math:`\lambda/2KT` fall into one cell. The sweeps of a block see the target at different times,
kT late, with the phase :math:`2\pi f_d\,kT`. Once this phase is removed with the right
:math:`f_d = 2 f_m v/c`, the elements are separated by their code,

.. math:: \hat x_l = \frac{\sum_k w_{kl}\,e^{-j2\pi f_d kT}\,Y_k}{\sum_k |w_{kl}|^2},

and the virtual array has the phases of one plane wave. Two properties tell the K range rates apart:

- **Empty bands.** A code of fewer elements than sweeps leaves a part of the block's K dimensions
  empty; with Doppler division they are the bands that no element uses. With the right range rate
  this part holds noise alone, with a wrong one it holds elements (Texas Instruments, TIDUF01,
  §2.4.8, of the AWR2944). No phase between channels needs to be known.
- **The strongest beam.** With a wrong range rate, phases jump from element to element, and no beam
  collects them all. Of the range rates that the empty bands admit, the one is taken at which the
  strongest beam is strongest.

If the empty bands admit no range rate, two targets of this range share the cell, at two of its K
range rates. They are then the two plane waves that explain most of the cell's power
(`overlapping`). This needs virtual elements on one line; with elements in a plane, the two targets
remain one detection, with the range rate of the strongest beam.
"""

from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.angle.beams import strongest_beam
from polychirp.receiver.angle.elements import Elements, Line
from polychirp.receiver.range_doppler.overlapping import two_waves
from polychirp.receiver.range_doppler.transforms import middle_frequency, repetition_interval
from polychirp.receiver.signal_model.transmit_codes import CodeBlocks, virtual_channels

EQUAL_BEAMS = 1e-6
"""Relative difference below which two beams count as equal, and the lower speed is taken: with one
receiving channel, every range rate gives some plane wave. Chosen: above the rounding errors."""

FALSE_REFUSAL: Final = 1e-4
"""Probability that noise in the empty bands refuses the right range rate. Chosen: one target in ten
thousand is tested for a second one without need."""

LEAKED: Final = 1e-4
"""Share of a target's power that may be in the empty bands although it is alone. Chosen: range
migration and the error of the interpolated range rate leave 1e-5 at 70 m/s."""


class Unfolded(NamedTuple):
    """Range rates, m/s ``(target,)``, and the virtual array's amplitudes, V.

    Most detections are one target, and a few are two. ``detection`` is the number of the detection
    of each target, and ``share`` its share of that detection's power. The amplitudes
    ``(target, virtual channel)`` are in the order of `virtual_channels`, and refer to the middle of
    the block's first sweeps.
    """

    detection: IntArray
    range_rate: FloatArray
    amplitude: ComplexArray
    share: FloatArray


class _Folds(NamedTuple):
    """The range rates that a cell may mean, lowest first, and the cell decoded with each.

    range_rate : m/s ``(detection, fold)``
    cell : the samples of the block without the phase of the motion, V
        ``(detection, fold, channel, sweep of the block)``
    virtual : V ``(detection, fold, virtual channel)``
    """

    range_rate: FloatArray
    cell: ComplexArray
    virtual: ComplexArray


def has_empty_bands(blocks: CodeBlocks) -> bool:
    """True if the code's block has more sweeps than elements, so that range rates show in it."""
    return bool(len(blocks.weight) > blocks.weight.shape[1] > 1)


def unfolded(
    frame: IfFrame,
    blocks: CodeBlocks,
    amplitude: ComplexArray,
    range_rate: FloatArray,
    *,
    floor: FloatArray,
    by_beams: bool,
    equal_beams: float = EQUAL_BEAMS,
) -> Unfolded:
    """Range rates among the K that a code's cell may mean, and the channels decoded with them.

    Without beams, the empty bands alone decide; a code without them leaves the lowest speed.

    Parameters
    ----------
    amplitude : of each detection's cell, V ``(detection, channel, sweep of the block)``
    range_rate : of each detection in the span of the code, m/s ``(detection,)``
    floor : noise power of one channel in each detection's cell, W ``(detection,)``
    by_beams : True if phases between channels are known, so that beams may be compared
    equal_beams : relative difference below which two beams count as equal, and the lower speed is
        taken
    """
    folds = _folds(frame, blocks, amplitude, range_rate)
    power = np.sum(np.abs(folds.virtual) ** 2, axis=-1) * energy(blocks)
    count = folds.range_rate.shape[1]
    is_admitted = np.ones((range_rate.size, count), dtype=np.bool_)
    quality = power
    if has_empty_bands(blocks):
        is_admitted = _is_admitted(blocks, amplitude, power, floor)
    elif not by_beams:
        quality = -np.abs(folds.range_rate)
    if by_beams:
        quality = strongest_beam(folds.virtual, _elements(frame))
    is_crowded = np.asarray(~is_admitted.any(axis=1))
    allowed = np.where(is_admitted | is_crowded[:, None], quality, -np.inf)
    best = _first_of_the_best(allowed, equal_beams)
    number = np.arange(range_rate.size)
    alone = Unfolded(
        detection=number,
        range_rate=folds.range_rate[number, best],
        amplitude=folds.virtual[number, best],
        share=np.ones(number.size),
    )
    if not (by_beams and np.any(is_crowded)):
        return alone
    return _with_pairs(frame, blocks, folds, alone, number[is_crowded], floor)


def _first_of_the_best(quality: FloatArray, equal: float) -> IntArray:
    """Number of the first fold whose quality is equal to the best one ``(detection,)``."""
    greatest = quality.max(axis=1, keepdims=True, initial=-np.inf)
    is_best = quality >= greatest - equal * np.abs(greatest)
    return np.asarray(np.argmax(is_best, axis=1))


def energy(blocks: CodeBlocks) -> FloatArray:
    """Energy of every element's code, equal for all elements."""
    return np.asarray(np.sum(np.abs(blocks.weight[:, 0]) ** 2))


def _folds(
    frame: IfFrame, blocks: CodeBlocks, amplitude: ComplexArray, range_rate: FloatArray
) -> _Folds:
    length = len(blocks.weight)
    interval = repetition_interval(frame.schedule)
    wavelength = SPEED_OF_LIGHT / middle_frequency(frame.schedule, frame.times)
    span = wavelength / (2.0 * length * interval)
    # a peak between the last cell and the first one is half a cell beyond the span
    every = range_rate[:, None] + span * np.arange(-(length // 2) - 1, length // 2 + 2)
    rates = np.take_along_axis(every, np.argsort(np.abs(every), axis=1)[:, :length], axis=1)
    late = interval * np.arange(length)
    turn = np.exp(-4j * np.pi * rates[..., None] * late / wavelength)
    cell = turn[:, :, None, :] * amplitude[:, None]
    return _Folds(range_rate=rates, cell=cell, virtual=decoded(frame.array, blocks, cell))


def decoded(array: AntennaArray, blocks: CodeBlocks, cell: ComplexArray) -> ComplexArray:
    """The virtual array ``(…, virtual channel)`` of cells ``(…, channel, sweep of the block)``.

    The cells have no phase of a motion.
    """
    _, order = virtual_channels(array, blocks.weight.shape[1])
    apart = np.einsum("kl,...ck->...lc", blocks.weight / energy(blocks), cell)
    return np.asarray(apart.reshape(*cell.shape[:-2], order.size)[..., order])


def _elements(frame: IfFrame) -> Elements:
    """The virtual elements, in the order of `virtual_channels`."""
    place, _ = virtual_channels(frame.array, frame.schedule.num_elements)
    return Elements.of(place, frequency=middle_frequency(frame.schedule, frame.times))


def _is_admitted(
    blocks: CodeBlocks, amplitude: ComplexArray, power: FloatArray, floor: FloatArray
) -> BoolArray:
    r"""True for each range rate that leaves no more than noise outside of the code's elements.

    With noise alone, the power outside, M(K − L) dimensions of M channels, K sweeps and L elements,
    is Gamma distributed. Parameters: ``power`` within the elements, W ``(detection, fold)``.
    """
    from scipy.special import gammainccinv

    length, elements = blocks.weight.shape
    outside = np.sum(np.abs(amplitude) ** 2, axis=(1, 2))[:, None] - power
    most = gammainccinv(amplitude.shape[1] * (length - elements), FALSE_REFUSAL)
    return np.asarray(outside <= most * floor[:, None] + LEAKED * power)


def _with_pairs(
    frame: IfFrame,
    blocks: CodeBlocks,
    folds: _Folds,
    alone: Unfolded,
    crowded: IntArray,
    floor: FloatArray,
) -> Unfolded:
    """The targets, with two in place of one at those ``crowded`` detections that hold two."""
    line = _elements(frame).line()
    if line is None:
        return alone
    pairs = [_pair(frame, blocks, folds, line, int(k), float(floor[k])) for k in crowded]
    found = [pair for pair in pairs if pair is not None]
    replaced = [int(pair.detection[0]) for pair in found]
    kept = np.flatnonzero(~np.isin(alone.detection, replaced))
    single = Unfolded(
        detection=alone.detection[kept],
        range_rate=alone.range_rate[kept],
        amplitude=alone.amplitude[kept],
        share=alone.share[kept],
    )
    targets = [single, *found]
    return Unfolded(
        detection=np.concatenate([one.detection for one in targets]),
        range_rate=np.concatenate([one.range_rate for one in targets]),
        amplitude=np.concatenate([one.amplitude for one in targets]),
        share=np.concatenate([one.share for one in targets]),
    )


def _pair(
    frame: IfFrame, blocks: CodeBlocks, folds: _Folds, line: Line, number: int, noise: float
) -> Unfolded | None:
    """The two targets of the detection with this number; None if it holds one."""
    _, order = virtual_channels(frame.array, frame.schedule.num_elements)
    # the other folds of a cell are whole cycles per block away from the first
    cell = folds.cell[number, 0]
    waves = two_waves(cell, code=blocks.weight, order=order, steps=line.steps, noise=noise)
    if waves is None:
        return None
    length = len(blocks.weight)
    turn = np.exp(-2j * np.pi * np.outer(waves.shift, np.arange(length)) / length)
    of_one = turn[:, None] * (cell - waves.cell[::-1])
    return Unfolded(
        detection=np.array([number, number]),
        range_rate=_shifted(folds.range_rate[number], waves.shift),
        amplitude=decoded(frame.array, blocks, of_one),
        share=waves.share,
    )


def _shifted(range_rate: FloatArray, shift: IntArray) -> FloatArray:
    """Those of the K folds that are ``shift`` spans above the first, modulo all K spans."""
    ordered = np.sort(range_rate)
    spans = np.rint((range_rate - range_rate[0]) / (ordered[1] - ordered[0])).astype(np.int64)
    place = {int(number) % range_rate.size: k for k, number in enumerate(spans)}
    return np.array([range_rate[place[int(one)]] for one in shift])
