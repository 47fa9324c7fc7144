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

from dataclasses import replace

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray, axes_of
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.angle.doa import root_music
from polychirp.receiver.estimation.azimuth_rate import snapshots_at_start
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.settings import ReceiverSettings
from polychirp.receiver.signal_model.point_signal import beat_phase, fit_amplitudes, hann_weights
from polychirp.receiver.signal_model.transmit_codes import CodeBlocks, code_blocks, virtual_line


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

    >>> from polychirp.model.antenna import AntennaArray
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
    array, order = virtual_line(frame.array, frame.schedule.num_elements)
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
        if_filter=frame.if_filter,
    )


def virtual_parts(frame: IfFrame, parts: IfParts, *, range_rate: float = 0.0) -> IfParts:
    """The parts of ``virtual_array(frame)``: decoding is linear, so they sum to its samples."""
    decoded = [
        virtual_array(frame.with_samples(part), range_rate=range_rate).samples
        for part in parts.samples
    ]
    return replace(parts, samples=np.stack(decoded))


def phases_in_motion(frame: IfFrame, range_rates: FloatArray) -> ComplexArray:
    """Factors ``(target, channel)`` that motion gives to the channels of ``virtual_array(frame)``.

    They are phase factors relative to a target at rest: elements that take turns are ahead by the
    phase of the motion since the first sweep of their block. Of codes on all elements it is the
    phase of the mean over the block.

    Parameters
    ----------
    frame : frame as it was received, before `virtual_array`
    range_rates : of the targets, m/s, ``(target,)``
    """
    _, order = virtual_line(frame.array, frame.schedule.num_elements)
    blocks = code_blocks(frame.schedule)
    start = frame.schedule.start_time[blocks.ramps[0, :, 0]]
    cycles = 2.0 * np.outer(range_rates, start - start[0]) / SPEED_OF_LIGHT
    turn = np.exp(2j * np.pi * float(np.mean(frame.schedule.centre_frequency)) * cycles)
    of_element = np.angle(turn @ np.abs(blocks.weight) ** 2)
    num_channels = frame.array.num_channels
    return np.asarray(np.exp(1j * np.repeat(of_element, num_channels, axis=1)[:, order]))


def azimuths_in_motion(
    receiver: ReceiverSettings, frame: IfFrame, detections: Detections
) -> Detections:
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
    array, order = virtual_line(frame.array, frame.schedule.num_elements)
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
