"""Measures of a receiver: resolution, looks, cells, and the ideal detector that is beside it."""

from typing import Final, NamedTuple

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.false_alarms import threshold_of
from polychirp.receiver.decoding.alignment import noise_gain
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.decoding.correlation import matched_share
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.transforms import taper
from polychirp.receiver.selection import FrameReceiver, decodes_elements
from polychirp.receiver.settings import DetectorSettings
from polychirp.receiver.signal_model.transmit_codes import code_blocks
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.receiver.stepped.solution import solved
from polychirp.receiver.stepped.staircase import Staircase
from polychirp.receiver.stepped.steps import SEQUENCES
from polychirp.scoring.ideal_detector import cell_threshold
from polychirp.study.limits.bands import joint_band

PHASE_LIMIT: Final = 0.1
"""Greatest error of the phase between two sequences of steps, cycles. Chosen: three standard
deviations at an SNR of 14 dB in a cell, about the threshold at a probability of 1e-6."""


class Extent(NamedTuple):
    """A distance in range, m, and in range rate, m/s."""

    range: float
    range_rate: float


def resolution(receiver: FrameReceiver, schedule: RampSchedule, times: SampleTimes) -> Extent:
    r"""Resolution cell of the frame: :math:`c/2B` of the largest bandwidth, :math:`\lambda/2T`.

    B is the band of all ramps together if the receiver adds them in phase (`bands.joint_band`), and
    otherwise that of the widest ramp.
    """
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    duration = float(schedule.end_time.max() - schedule.start_time.min())
    band = joint_band(receiver, schedule, times) or float(np.max(schedule.resolving_bandwidth))
    return Extent(
        range=SPEED_OF_LIGHT / (2.0 * band),
        range_rate=wavelength / (2.0 * duration),
    )


def error_limits(receiver: FrameReceiver, schedule: RampSchedule, times: SampleTimes) -> Extent:
    r"""Greatest errors of a detection that counts as that of a point.

    They are chosen above the errors of each receiver at its threshold, and small beside the map:

    - coherent: one cell of `resolution`, less than the distance of the first side lobe;
    - range-Doppler, also after decoding: one and a half cells, the width of its tapered main lobe;
    - MFSK: one cell, and what a phase that is wrong by `PHASE_LIMIT` adds;
    - paper: one cell in range and half a cell of a ramp, :math:`\lambda/4T_{ramp}`, in range rate.
    """
    cell = resolution(receiver, schedule, times)
    match receiver:
        case CoherentReceiver():
            return cell
        case RangeDoppler() | Decoding():
            return Extent(1.5 * cell.range, 1.5 * cell.range_rate)
        case MfskReceiver():
            wrong = solved(Staircase.of(schedule), beat=0.0, phase=PHASE_LIMIT)
            return Extent(
                cell.range + abs(float(wrong.range)),
                cell.range_rate + abs(float(wrong.range_rate)),
            )
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    return Extent(cell.range, wavelength / (4.0 * float(np.max(schedule.duration))))


def num_looks(receiver: FrameReceiver, frame: IfFrame) -> int:
    """Number of channels whose powers the ideal detector adds.

    They are the receiving channels; with several transmitting elements those of the virtual array,
    and for the range-Doppler receiver one for each channel and sweep of the code. The receiver of
    MFSK adds the powers of both sequences of each channel.
    """
    if isinstance(receiver, MfskReceiver):
        return SEQUENCES * frame.array.num_channels
    if decodes_elements(receiver):
        return frame.array.num_channels * len(code_blocks(frame.schedule).weight)
    return frame.array.num_channels


def num_cells(receiver: FrameReceiver, frame: IfFrame) -> float:
    """Number of cells of the frame to which a false-alarm probability refers.

    They are the cells of the receiver's map within its limits. The receiver of MFSK has those of
    one spectrum, times the share of all pairs of beat and phase that are within its limits. The
    coherent receiver counts
    resolution cells, whatever its map's steps; they are used for the paper's receiver and for those
    of plug-ins too.
    """
    match receiver:
        case Decoding():
            read = receiver.reading(frame)
            return num_cells(read.receiver, read.frame)
        case CoherentReceiver():
            expected = receiver.expected_false_detections(frame)
            return float(expected / receiver.false_alarm_probability)
        case RangeDoppler():
            return float(receiver.num_cells(receiver.spectra(frame).mean_power))
        case MfskReceiver():
            return _num_beats_within(receiver, Staircase.of(frame.schedule))
    cell = resolution(receiver, frame.schedule, frame.times)
    span = receiver.greatest_range - receiver.least_range
    return span / cell.range * 2.0 * receiver.greatest_speed / cell.range_rate


def _num_beats_within(receiver: MfskReceiver, stairs: Staircase) -> float:
    """Number of beats N, times the share of the receiver's limits of range and range rate.

    All beats and phases have an area in the plane of range and range rate, that of the two motions
    that change one of them alone by its period.
    """
    one = solved(stairs, beat=1.0 / stairs.interval, phase=0.0)
    other = solved(stairs, beat=0.0, phase=1.0)
    area = abs(float(one.range * other.range_rate - one.range_rate * other.range))
    span = receiver.greatest_range - receiver.least_range
    return stairs.num_steps * min(1.0, span * 2.0 * receiver.greatest_speed / area)


def stated_threshold(receiver: FrameReceiver, *, looks: int) -> float | None:
    """Threshold of the ideal detector at the receiver's false-alarm probability.

    That of the coherent receiver counts peaks per resolution cell, those of others single cells.
    None for the paper's receiver, which states no false-alarm probability.
    """
    if not isinstance(receiver, DetectorSettings):
        return None
    if isinstance(receiver, CoherentReceiver):
        return threshold_of(receiver.false_alarm_probability, num_channels=looks)
    return cell_threshold(receiver.false_alarm_probability, num_channels=looks)


def window_share(receiver: FrameReceiver, frame: IfFrame) -> float:
    r"""Greatest SNR in a cell of the receiver's map over the coherent SNR, a ratio.

    For weights w it is :math:`(\sum w)^2 / (N \sum w^2)`, for the range-Doppler receiver times that
    of its other transform. With a code, it is `matched_share` on a carrier, and less by the noise
    that the code's removal adds on chirps. The receiver of MFSK has one, over each sequence. The
    coherent receiver has no windows: 1. The paper's receiver averages ramps without their
    phases, and has no such cell: NaN.
    """
    if isinstance(receiver, CoherentReceiver):
        return 1.0
    if isinstance(receiver, Decoding):
        return _decoded_share(frame)
    if isinstance(receiver, MfskReceiver):
        size = frame.schedule.num_ramps // SEQUENCES
        return _share_of_taper(size)
    if not isinstance(receiver, RangeDoppler):
        return float("nan")
    sizes = (frame.times.most_samples, len(code_blocks(frame.schedule).ramps))
    return float(np.prod([_share_of_taper(size) for size in sizes]))


def _share_of_taper(size: int) -> float:
    return float(1.0 / (size * np.sum(taper(size) ** 2)))


def _decoded_share(frame: IfFrame) -> float:
    """`window_share` of a frame with a code, without mitigation.

    On a carrier the lines of the code are tapered and not the samples; on chirps, the removal of
    the code amplifies the noise.
    """
    schedule, times = frame.schedule, frame.times
    over_ramps = _share_of_taper(len(code_blocks(schedule).ramps))
    if np.all(schedule.slope == 0.0):
        return over_ramps * matched_share(schedule, times, if_filter=frame.if_filter)
    return over_ramps * _share_of_taper(times.most_samples) / noise_gain(schedule, times)
