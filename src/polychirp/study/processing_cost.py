"""Cost of reading one frame: multiplications, memory, and the peak power of the signal sent."""

import math
from dataclasses import dataclass

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import SampleTimes, sample_times
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import FrameReceiver, receiver_for
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.study.random_draw import sample_street
from polychirp.study.spec import Study, schedule_of, victim_indices


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessingCost:
    r"""Cost of one frame of a radar besides its hardware.

    Counted are complex multiplications of the map in which detections are looked for, before angles
    and fits. Two Fourier transforms of M ramps of N samples take, in each channel,

    .. math:: M\,\tfrac N2\log_2 N + N\,\tfrac M2\log_2 M + 2 M N

    with two windows. For ramps that differ, each cell of the coherent map needs one multiplication
    for each ramp and channel after the M transforms. The receiver of MFSK has a window and a
    transform of each of two sequences of steps, whose samples are added. A fit of points comes on
    top, with as many multiplications as samples for each point and step.

    Parameters
    ----------
    receiver : kind of the receiver
    multiplications : complex multiplications of the map of one frame
    memory : bytes of the samples and the map of one frame, with 8 bytes for a complex value
    peak_to_average : power ratio of the greatest power sent to its mean while ramps last
    duty : share of the frame in which the radar sends
    """

    receiver: str
    multiplications: float
    memory: float
    peak_to_average: float
    duty: float


def processing_cost(study: Study) -> ProcessingCost:
    """Cost of the first victim of a study.

    >>> from polychirp.study.spec import StudyRadar
    >>> from polychirp.traffic.street import Street, Vehicle
    >>> from polychirp.waveform import Sawtooth
    >>> street = Street(vehicles=(Vehicle(name="car", x=0.0, y=0.0),))
    >>> radar = StudyRadar(name="front", vehicle="car", waveform=Sawtooth())
    >>> processing_cost(Study(name="one", street=street, radars=(radar,))).receiver
    'range-doppler'
    """
    study = sample_street(study)
    radar = study.radars[victim_indices(study)[0]]
    schedule = schedule_of(study, radar)
    times = sample_times(schedule, radar.converter)
    channels = radar.array.num_channels * schedule.num_elements
    receiver = receiver_for(study.receiver, schedule)
    samples = float(times.num_samples.sum()) * radar.array.num_channels
    if isinstance(receiver, RangeDoppler):
        count, cells = _two_transforms(times) * channels, samples
    elif isinstance(receiver, Decoding):
        count = (_two_transforms(times) + _removal(schedule, times)) * channels
        cells = samples
    elif isinstance(receiver, MfskReceiver):
        count = (schedule.num_ramps + 2.0 * _transform(schedule.num_ramps // 2)) * channels
        cells = float(schedule.num_ramps * channels)
    else:
        count, cells = _coherent_map(receiver, schedule, times, channels)
    frame = float(schedule.end_time[-1] - schedule.start_time[0])
    weight = np.sum(np.abs(schedule.transmit_weight) ** 2, axis=1)
    peak = float(weight.max() / np.average(weight, weights=schedule.duration))
    peak /= 1.0 if schedule.code is None else schedule.code.mean_power
    return ProcessingCost(
        receiver=receiver.kind,
        multiplications=count,
        memory=8.0 * (samples + cells),
        peak_to_average=peak,
        duty=float(schedule.duration.sum()) / frame,
    )


def _transform(size: int) -> float:
    """Complex multiplications of a Fourier transform of the next power of two."""
    length = 2 ** max(1, math.ceil(math.log2(max(size, 2))))
    return float(0.5 * length * math.log2(length))


def _two_transforms(times: SampleTimes) -> float:
    ramps, fast = times.num_samples.size, times.most_samples
    return ramps * _transform(fast) + fast * _transform(ramps) + 2.0 * ramps * fast


def _removal(schedule: RampSchedule, times: SampleTimes) -> float:
    """Multiplications that remove the code of every ramp: transforms, and products with the code.

    Chirps have four transforms, and products between them. Carriers have one: the inverse one is
    the receiver's transform over range.
    """
    is_carrier = bool(np.all(schedule.slope == 0.0))
    fast = times.most_samples
    each = _transform(fast) + fast if is_carrier else 4.0 * _transform(fast) + 3.0 * fast
    return float(schedule.num_ramps * each)


def _coherent_map(
    receiver: FrameReceiver, schedule: RampSchedule, times: SampleTimes, channels: int
) -> tuple[float, float]:
    """Multiplications of the map over range and range rate, and its number of cells."""
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    span = float(schedule.end_time[-1] - schedule.start_time[0])
    band = schedule.start_frequency, schedule.stop_frequency
    width = float(np.maximum(*band).max() - np.minimum(*band).min())
    ranges = (receiver.greatest_range - receiver.least_range) / (SPEED_OF_LIGHT / (2.0 * width))
    speed = getattr(receiver, "greatest_speed", 0.0)
    rates = 2.0 * speed / (wavelength / (2.0 * span))
    cells = ranges * rates
    ramps = times.num_samples.size
    return (ramps * _transform(times.most_samples) + cells * ramps) * channels, cells
