r"""From a MIMO frame to the frame of a virtual array, where every pair of elements is a channel.

A wave that leaves element l at :math:`y_l` towards azimuth θ, and returns from there to channel m
at :math:`y_m`, is ahead of a wave from and to the origin by :math:`(y_l + y_m)\sin\theta/c`, as if
an element at the origin had sent it, and an element at :math:`y_l + y_m` received it.

The beat :math:`y_k` of ramp k is the sum over elements of :math:`\overline{w_{kl}}\,x_l`, with
:math:`x_l` the beat of element l alone and the known weights, which the mixer conjugates. Over a
*block* of K sweeps on which the codes are orthogonal, the elements are separated by

.. math:: \hat x_l = \frac{\sum_k w_{kl}\, y_k}{\sum_k |w_{kl}|^2} .

The noise power of a virtual channel is that of a ramp divided by :math:`\sum_k |w_{kl}|^2`, which
is 1 for elements that take turns, and K for elements that all send on every sweep.

The cost is that a frame has K times fewer sweeps, and so a K times smaller span of unambiguous
range rates. The phase of a moving target grows by :math:`2\pi\,2vT/\lambda` from sweep to sweep, T
apart. With time division the channels of element l are therefore ahead by l times this phase, and
azimuths are wrong; with codes on all elements, energy leaks between them. Both errors vanish for
targets with the ``range_rate`` for which a frame is decoded; `azimuths_in_motion` decodes for the
range rate of each detection.

`element_streams` keeps all sweeps; every element's stream then contains echoes of the others too.
"""

from dataclasses import dataclass, replace

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray, axes_of
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError
from polychirp.model.antenna import AntennaArray
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.angle.doa import root_music
from polychirp.receiver.chain import Receiver
from polychirp.receiver.estimation.azimuth_rate import snapshots_at_start
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.signal_model.point_signal import beat_phase, fit_amplitudes, hann_weights


def virtual_array(frame: IfFrame, *, range_rate: float = 0.0) -> IfFrame:
    r"""The frame that a virtual array would have received from one transmitting element.

    Its ramps are those of the first sweep of every block, and all phases refer to that sweep. Its
    channels run from right to left, as all estimators expect. With a range rate v, the phase
    :math:`2\pi f(t)\,2v\Delta t/c` is removed from sweeps :math:`\Delta t` after the first one,
    where f is the instantaneous frequency, so that range migration within the block is removed as
    well.

    Parameters
    ----------
    range_rate : range rate of the targets for which all channels shall agree in phase, m/s

    Raises
    ------
    CapabilityError
        The codes are not orthogonal over any block into which the frame divides, the sweeps of a
        block differ, weights change within a sweep, or virtual elements are unequally spaced.

    Examples
    --------
    Two elements that take turns, and one channel: each ramp becomes a channel.

    >>> from polychirp.model.if_frame import SampleTimes
    >>> ramps = RampSchedule(start_time=[0.0, 1e-4], duration=[9e-5, 9e-5],
    ...     start_frequency=[77e9, 77e9], slope=[1e12, 1e12], start_phase=[0, 0], sweep=[0, 1],
    ...     transmit_weight=[[1, 0], [0, 1]])
    >>> times = SampleTimes(first=ramps.start_time, num_samples=[2, 2], rate=1e6)
    >>> frame = IfFrame(samples=[[[1, 1], [1j, 1j]]], times=times, schedule=ramps,
    ...     array=AntennaArray(num_channels=1, num_transmitters=2))
    >>> virtual = virtual_array(frame)
    >>> virtual.samples[:, 0, 0], virtual.array.num_channels
    (array([1.+0.j, 0.+1.j]), 2)
    """
    array, order = _virtual_line(frame.array, frame.schedule.num_elements)
    blocks = code_blocks(frame.schedule)
    first = blocks.ramps[:, 0].ravel()
    turned = frame.samples * _motion_correction(frame, blocks, range_rate)
    split = turned[:, blocks.ramps]
    weight = blocks.weight / np.sum(np.abs(blocks.weight) ** 2, axis=0)
    apart = np.einsum("kl,cbkrn->lcbrn", weight, split)
    samples = apart.reshape(-1, first.size, frame.times.most_samples)
    return IfFrame(
        samples=samples[order],
        times=replace(
            frame.times,
            first=frame.times.first[first],
            num_samples=frame.times.num_samples[first],
        ),
        schedule=_first_sweeps(frame.schedule, first),
        array=array,
        high_pass=frame.high_pass,
    )


def virtual_parts(frame: IfFrame, parts: IfParts, *, range_rate: float = 0.0) -> IfParts:
    """The parts of ``virtual_array(frame)``: decoding is linear, so they sum to its samples."""
    decoded = [
        virtual_array(frame.with_samples(part), range_rate=range_rate).samples
        for part in parts.samples
    ]
    return replace(parts, samples=np.stack(decoded))


def azimuths_in_motion(receiver: Receiver, frame: IfFrame, detections: Detections) -> Detections:
    """The detections of ``virtual_array(frame)`` with azimuths that are right for moving targets.

    A point of every detection's range and range rate is fitted to every ramp as it was received,
    and its amplitudes are decoded. The fitted phase includes the motion within a block, so that
    elements that take turns agree at any range rate; an error δ of the range rate causes a phase
    error of 2π·2δT/λ from sweep to sweep.

    Parameters
    ----------
    receiver : receiver whose mitigation is applied
    frame : frame as it was received, before `virtual_array`
    """
    array, order = _virtual_line(frame.array, frame.schedule.num_elements)
    blocks = code_blocks(frame.schedule)
    motion = np.stack([detections.range, detections.range_rate, 0.0 * detections.range], axis=-1)
    cleaned = mitigated(receiver.mitigation, frame)
    weight = hann_weights(cleaned.weight)
    phases = beat_phase(frame.schedule, frame.times, motion=motion, time=detections.time)
    amplitude, _ = fit_amplitudes(cleaned.samples, weight, phases, frame.times.rate)
    apart = np.einsum("kl,pcbkr->plcbr", blocks.weight, amplitude[:, :, blocks.ramps])
    snapshots = apart.reshape(len(motion), order.size, blocks.ramps[:, 0].size)[:, order]
    first = blocks.ramps[:, 0].ravel()
    centre = frame.schedule.centre_frequency
    still = snapshots_at_start(
        snapshots,
        motion=motion,
        channel_y=array.position[:, 1],
        frequency=centre[first],
        elapsed=(frame.schedule.start_time + 0.5 * frame.schedule.duration)[first]
        - detections.time,
    )
    spacing = array.spacing * float(np.mean(centre[first])) / SPEED_OF_LIGHT
    sines = root_music(still, spacing=spacing)
    return replace(detections, azimuth=np.arcsin(np.clip(sines, -1.0, 1.0)))


def element_streams(frame: IfFrame) -> ComplexArray:
    r"""All ramps times every element's code: ``(element, channel, ramp, fast)``.

    Stream l has :math:`w_{kl}\,y_k` on ramp k. Its echoes of element l are at their own Doppler
    frequency. Its echoes of another element i keep the factor :math:`w_{kl}\overline{w_{ki}}`: with
    time division they vanish, as do all ramps that element l does not send; with Doppler division
    in N bands they are (l − i)/N cycles per sweep higher; with N signs they spread over N lines.
    """
    return np.asarray(np.einsum("kl,ckn->lckn", frame.schedule.transmit_weight, frame.samples))


def virtual_position(array: AntennaArray) -> FloatArray:
    """Positions of the virtual elements in the radar's frame, m, ``(element, channel, xyz)``."""
    return np.asarray(array.transmit_position[:, None] + array.position)


def _virtual_line(array: AntennaArray, num_elements: int) -> tuple[AntennaArray, IntArray]:
    """The virtual array, and for each of its channels the flat index into (element, channel)."""
    y = virtual_position(array)[:num_elements, :, 1].ravel()
    order = np.argsort(y, kind="stable")
    gap = np.diff(y[order])
    spacing = float(gap.mean()) if gap.size else array.spacing
    if not np.allclose(gap, spacing, rtol=1e-6, atol=0.0) or spacing == 0.0:
        raise CapabilityError(
            "the virtual elements are not at equal distances, as these estimators need; "
            f"a transmit_spacing of {array.num_channels * array.spacing:.4g} m would do"
        )
    gains, phases = _virtual_errors(array, num_elements, order)
    line = AntennaArray(
        num_channels=y.size,
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


@dataclass(frozen=True, slots=True, kw_only=True)
class CodeBlocks:
    """Numbers of the ramps ``(block, sweep of the block, ramp of the sweep)``, and the code.

    The code is ``weight``, the elements' weights on a block, ``(sweep of the block, element)``.
    """

    ramps: IntArray
    weight: ComplexArray


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


def _motion_correction(frame: IfFrame, blocks: CodeBlocks, range_rate: float) -> ComplexArray:
    """Factors ``(ramp, fast)`` that give a target the phase it has on its block's first sweep."""
    start = frame.schedule.start_time
    first = np.broadcast_to(blocks.ramps[:, :1], blocks.ramps.shape).ravel()
    late = (start - start[first])[:, None]
    into = frame.times.time - start[:, None]
    frequency = frame.schedule.start_frequency[:, None] + frame.schedule.slope[:, None] * into
    return np.asarray(np.exp(-4j * np.pi * frequency * range_rate * late / SPEED_OF_LIGHT))


def _first_sweeps(schedule: RampSchedule, ramps: IntArray) -> RampSchedule:
    """Schedule of the ramps with these numbers, sent by one element; sweeps count from 0 again."""
    kept = {
        name: getattr(schedule, name)[ramps]
        for name in axes_of(RampSchedule)
        if name not in ("sweep", "transmit_weight")
    }
    _, sweep = np.unique(schedule.sweep[ramps], return_inverse=True)
    return RampSchedule(**kept, sweep=sweep)
