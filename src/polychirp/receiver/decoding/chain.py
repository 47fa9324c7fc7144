"""`Decoding`: the receiver of ramps and carriers with a code."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.decoding.alignment import decoded_chirps
from polychirp.receiver.decoding.code_limits import (
    refuse_prediction,
    refuse_samples,
    refuse_undecodable,
)
from polychirp.receiver.decoding.correlation import (
    added_time,
    correlated,
    decoded_ramps,
    line_power,
    mean_of_periods,
    present_share,
)
from polychirp.receiver.decoding.reading import Reading
from polychirp.receiver.mitigation import AnyMitigation
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.mitigation.burst_detectors import MedianThreshold
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.receiver.range_doppler.chain import SAME_RANGE, RangeDoppler, tapered_mean
from polychirp.receiver.range_doppler.transforms import taper
from polychirp.receiver.settings import DetectorSettings
from polychirp.receiver.signal_model.transmit_codes import code_blocks
from polychirp.receiver.signal_model.turning import turning_loss
from polychirp.threads import one_blas_thread


@dataclass(frozen=True, slots=True, kw_only=True)
class Decoding(DetectorSettings):
    """Receiver of ramps with a code: it removes the code, and reads the frame as `RangeDoppler`.

    The samples are mitigated first; what mitigation takes of an echo is made up for, over the whole
    frame, so that a ramp counts by what is left of it. Bursts are
    found by their amplitude alone, as chips cannot be predicted from their neighbours. On a
    carrier of constant frequency (PMCW, noise) the samples are then correlated with the code over
    the whole periods that the converter takes of a sweep (`decoding.correlation`). Side lobes of
    the code are no detections, and powers have what motion takes from the sum. Samples of
    chirps are aligned and multiplied by the code (`decoding.alignment`). Both are linear. The
    result is a frame of chirps without a code, whose range rates, CFAR, azimuths and codes of
    several transmitting elements are those of `RangeDoppler`.

    Examples
    --------
    A point at 12 m, as strong as the noise of a sample, whose delay is 40 chips of 2 ns:

    >>> from polychirp.model.antenna import AntennaArray
    >>> from polychirp.rng import Streams
    >>> from polychirp.waveform import Pmcw
    >>> sent = Pmcw(order=7).schedule(num_sweeps=32, streams=Streams(seed=1))
    >>> chips = np.roll(sent.code.value[0].real, 40)
    >>> samples = np.tile(np.repeat(chips, 2), (1, 32, 2))
    >>> noise = np.random.default_rng(1).normal(scale=0.7, size=(2, *samples.shape))
    >>> first, count = sent.start_time + 254.5e-9, np.full(32, 508)
    >>> times = SampleTimes(first=first, num_samples=count, rate=1e9)
    >>> frame = IfFrame(samples=samples + noise[0] + 1j * noise[1], times=times, schedule=sent,
    ...     array=AntennaArray(num_channels=1))
    >>> Decoding().detect(frame).range.round(1)
    array([12.])
    """

    kind: Literal["decoding"] = "decoding"

    def reading(self, frame: IfFrame) -> Reading:
        """The decoded frame and its receiver.

        Raises
        ------
        CapabilityError, PhysicsError
            The frame cannot be decoded, or the mitigation is not for codes (`code_limits`).
        """
        schedule, times = frame.schedule, frame.times
        refuse_undecodable(schedule)
        refuse_prediction(self.mitigation)
        refuse_samples(schedule, times, greatest_range=self.greatest_range)
        ramps, moments = read_ramps(schedule, times)
        cleaned = mitigated(_without_prediction(self.mitigation), frame)
        is_carrier = bool(np.all(schedule.slope == 0.0))
        weight, of_echo = cleaned.weight, None
        if is_carrier:
            weight = weight / np.maximum(present_share(weight, schedule, times), 1e-300)
            of_echo = line_power(schedule, times, if_filter=frame.if_filter)
        left = np.ones(schedule.num_ramps)
        if self.mitigation is not None:
            gaps = mean_of_periods(weight, schedule, times) if is_carrier else weight
            left = gaps @ taper(gaps.shape[1])
            of_echo = gaps if of_echo is None else of_echo * gaps
            weight = weight / max(tapered_mean(gaps, code_blocks(ramps)), 1e-300)

        def decode(samples: ComplexArray) -> ComplexArray:
            kept = cleaned.repair(samples) * weight
            if is_carrier:
                return correlated(kept, schedule, times, if_filter=frame.if_filter)
            return decoded_chirps(kept, schedule, times)

        return Reading(
            receiver=self.reader(),
            weight=of_echo,
            left=left,
            frame=replace(
                frame, samples=decode(frame.samples), times=moments, schedule=ramps, high_pass=None
            ),
            decode=decode,
        )

    def reader(self) -> RangeDoppler:
        """The receiver of decoded frames."""
        return RangeDoppler(
            least_range=self.least_range,
            greatest_range=self.greatest_range,
            grouping=self.grouping,
            false_alarm_probability=self.false_alarm_probability,
            angle=self.angle,
            window=SAME_RANGE,  # signals without the code are spread over all range rates
        )

    @one_blas_thread()
    def detect(self, frame: IfFrame) -> Detections:
        """Detections of one frame, as of `RangeDoppler.detect`; errors as of `reading`."""
        return self.detect_in(self.reading(frame), frame)

    def detect_in(self, read: Reading, frame: IfFrame) -> Detections:
        """Detections of one frame, as of `detect`, from its `reading`."""
        seen = read.receiver.detect(read.frame, weight=read.weight)
        if np.any(frame.schedule.slope != 0.0):  # samples of chirps are not added before
            return seen
        loss = turning_loss(
            seen.range_rate,
            frequency=float(frame.schedule.centre_frequency[0]),
            duration=added_time(frame.schedule, frame.times),
        )
        return replace(seen, power=seen.power / loss)


def _without_prediction(mitigation: AnyMitigation | None) -> AnyMitigation | None:
    """The mitigation, whose detector of bursts does without prediction errors."""
    if not isinstance(mitigation, BurstRepair):
        return mitigation
    if isinstance(mitigation.detector, MedianThreshold):
        return replace(mitigation, detector=replace(mitigation.detector, whitening=0))
    return replace(mitigation, whitening=0) if mitigation.detector is None else mitigation


def read_ramps(schedule: RampSchedule, times: SampleTimes) -> tuple[RampSchedule, SampleTimes]:
    """Ramps and times of the samples of a decoded frame."""
    if np.all(schedule.slope == 0.0):
        return decoded_ramps(schedule, times)
    return replace(schedule, code=None), times
