"""`MfskReceiver`: the receiver of two interleaved sequences of steps."""

from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame
from polychirp.model.ramp import RampSchedule
from polychirp.model.spectra import RangeRateMap
from polychirp.receiver.angle.ambiguity import beam_of
from polychirp.receiver.angle.directions import directions
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.clustering import merged
from polychirp.receiver.detection.cfar import CfarWindow, Crossings, ordered_statistic
from polychirp.receiver.detection.looks import looks_of_a_spectrum
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.range_doppler.peaks import is_local_maximum
from polychirp.receiver.range_doppler.side_lobes import stands_out
from polychirp.receiver.range_doppler.transforms import taper
from polychirp.receiver.settings import DetectorSettings, need_speed
from polychirp.receiver.signal_model.transmit_codes import virtual_channels
from polychirp.receiver.signal_model.turning import turning_loss
from polychirp.receiver.stepped.solution import slowest, unambiguous_speed
from polychirp.receiver.stepped.staircase import Staircase
from polychirp.receiver.stepped.step_limits import refuse_high_pass, warn_of_motion
from polychirp.receiver.stepped.steps import SEQUENCES, Steps, middle_time
from polychirp.threads import one_blas_thread
from polychirp.units import MetresPerSecond

PHASE_CYCLE: Final = 2.0 * np.pi


@dataclass(frozen=True, slots=True, kw_only=True)
class MfskReceiver(DetectorSettings):
    r"""Receiver of MFSK: one spectrum of each sequence of steps, and the phase between both.

    The steps: mitigation, the mean of the samples of every step, tapered Fourier transforms of the
    sequences A and B, power summed over channels and sequences, ordered-statistic CFAR along the
    beats with as many looks as channels are independent (`looks_of_a_spectrum`), for each sequence,
    peaks that are no side lobes placed between cells, phase between A and B summed over channels,
    range and range rate from beat and phase (`solution`), azimuths and elevations from both
    amplitudes of the channels, which are two snapshots.

    **Accuracy.** The phase tells the range to :math:`N\Delta R\,\sigma_\delta` with N steps and
    :math:`\sigma_\delta = 1/(2\pi\sqrt{\mathrm{SNR}})` cycles, 8 cells with 512 steps at 20 dB in a
    cell of one sequence and all channels. A greater shift is more accurate, and less unambiguous.
    The taper makes errors 1.26 times those of equal weights: its noise bandwidth is 1.58 cells. The
    Cramér–Rao bound is lower than those, by 7 % with 256 steps of 600 MHz and by 19 % with 512: the
    turning of an echo within steps, and the curvature :math:`b v t^2` of its phase along a sweep,
    tell the range rate as well, and neither is used.

    **Limits.** Two targets with one beat are one detection, whose range and range rate are those of
    neither. Of the motions that have one beat and phase, the slowest within the ranges is taken;
    `polychirp check` prints the speed up to which it is the only one. A target that moves several
    range cells in a sweep spreads over several beats: `ModelWarning`.

    Parameters
    ----------
    greatest_speed : m/s, greatest magnitude of the range rates that are reported
    window : training cells of the CFAR, over (beat, 1); made smaller on a short spectrum
    quantile : rank of the training cell that gives the floor, as a share of their number

    Examples
    --------
    A point at 12 m that recedes at 3 m/s, ten times as strong as the noise of a sample:

    >>> import numpy as np
    >>> from polychirp.constants import SPEED_OF_LIGHT
    >>> from polychirp.model.antenna import AntennaArray
    >>> from polychirp.model.if_frame import IfFrame, SampleTimes
    >>> from polychirp.receiver.stepped.chain import MfskReceiver
    >>> from polychirp.rng import Streams
    >>> from polychirp.waveform import Mfsk
    >>> sent = Mfsk(num_steps=256).schedule(num_sweeps=1, streams=Streams(seed=1))
    >>> times = SampleTimes(first=sent.start_time + 3e-6, num_samples=np.full(512, 8), rate=1e6)
    >>> delay = 2 * (12.0 + 3.0 * times.time) / SPEED_OF_LIGHT
    >>> samples = np.exp(2j * np.pi * sent.start_frequency[:, None] * delay)
    >>> noise = np.random.default_rng(1).normal(scale=0.07, size=(2, *samples.shape))
    >>> frame = IfFrame(samples=(samples + noise[0] + 1j * noise[1])[None], times=times,
    ...     schedule=sent, array=AntennaArray(num_channels=1))
    >>> found = MfskReceiver().detect(frame)
    >>> found.range.round(1), found.range_rate.round(1)
    (array([12.]), array([3.]))
    """

    greatest_speed: MetresPerSecond = 32.0
    window: CfarWindow = field(
        default_factory=lambda: CfarWindow(
            guard=(3, 0), training=(24, 0), step=(2, 1), is_circular=(True, False)
        )
    )
    quantile: float = 0.6
    kind: Literal["mfsk"] = "mfsk"

    def __post_init__(self) -> None:
        super(MfskReceiver, self).__post_init__()
        need_speed(self.greatest_speed)

    @one_blas_thread()
    def detect(self, frame: IfFrame) -> Detections:
        """Detections of one frame, strongest first; all values are those of the frame's middle.

        Raises
        ------
        CapabilityError
            The frame is no sweep of two sequences of steps from one element, or has a high pass.
        """
        stairs = Staircase.of(frame.schedule)
        refuse_high_pass(has_high_pass=frame.high_pass is not None)
        steps = self.steps(frame)
        power = steps.power[:, None]
        found = ordered_statistic(
            power,
            window=self.window.fitted(power.shape),
            false_alarm_probability=self.false_alarm_probability,
            quantile=self.quantile,
            num_looks=SEQUENCES * looks_of_a_spectrum(steps.cells),
        )
        found = found.chosen(is_local_maximum(power, row=found.row, column=found.column))
        beat = steps.peaks(steps.beat[found.row])
        is_point = _stands_out(found, steps, beat)
        found, beat = found.chosen(is_point), beat[is_point]
        amplitude = steps.amplitude(beat)
        between = np.sum(amplitude[:, 1] * np.conj(amplitude[:, 0]), axis=0)
        motion = slowest(
            stairs,
            beat=beat,
            phase=np.angle(between) / PHASE_CYCLE,
            least_range=self.least_range,
            greatest_range=self.greatest_range,
            greatest_speed=self.greatest_speed,
        )
        level = np.mean(np.abs(amplitude) ** 2, axis=(0, 1))
        level /= turning_loss(
            np.nan_to_num(motion.range_rate),
            frequency=stairs.frequency,
            duration=frame.times.most_samples / frame.times.rate,
        )
        order = np.argsort(-level, kind="stable")
        order = order[np.isfinite(motion.range[order])]
        warn_of_motion(stairs, motion.range_rate[order])
        place, channel = virtual_channels(frame.array, 1)
        azimuth, elevation = directions(
            np.moveaxis(amplitude[channel][:, :, order], 2, 0),
            Elements.of(place, frequency=stairs.frequency),
            estimator=self.angle,
            beam=beam_of(frame.array.pattern),
        )
        seen = Detections(
            time=middle_time(frame.times),
            range=motion.range[order],
            range_rate=motion.range_rate[order],
            azimuth=azimuth,
            elevation=elevation,
            power=level[order],
            snr=(found.power / found.floor)[order],
        )
        return seen if self.grouping is None else merged(seen, self.grouping)

    def steps(self, frame: IfFrame) -> Steps:
        """The steps of a frame after mitigation."""
        return self.steps_of(frame, frame.samples)

    def steps_of(self, frame: IfFrame, samples: ComplexArray) -> Steps:
        """The steps of a part of a frame, V ``(channel, ramp, fast)``, mitigated as the frame."""
        cleaned = mitigated(self.mitigation, frame)
        interval = Staircase.of(frame.schedule).interval
        return Steps.of(cleaned.repair(samples), cleaned.weight, interval=interval)

    def combined_power(self, amplitude: ComplexArray, schedule: RampSchedule) -> FloatArray:
        """Power, W, of amplitudes ``(…, ramp)``: the mean of both sequences, each in phase."""
        del schedule
        return np.asarray(np.mean(np.abs(in_sequences(amplitude)) ** 2, axis=-1))

    def unambiguous_speed(self, schedule: RampSchedule) -> float:
        """Speed, m/s, up to which the motions within the receiver's limits differ."""
        return unambiguous_speed(
            Staircase.of(schedule),
            least_range=self.least_range,
            greatest_range=self.greatest_range,
            greatest_speed=self.greatest_speed,
        )


def _stands_out(found: Crossings, steps: Steps, beat: FloatArray) -> BoolArray:
    """True for each peak that is neither a side lobe of stronger ones nor noise on it.

    The map of `side_lobes` has the beats as its circular axis, and one column.
    """
    map_ = RangeRateMap(power=steps.power[:, None], range_rate=steps.beat, range=np.zeros(1))
    level = np.mean(np.abs(steps.amplitude(beat)) ** 2, axis=(0, 1))
    return stands_out(found, map_, (beat, np.zeros(beat.size), level), num_samples=1)


def in_sequences(amplitude: ComplexArray) -> ComplexArray:
    """Tapered means of both sequences of amplitudes of steps ``(…, ramp)``: ``(…, sequence)``.

    Only they tell echoes of different ranges apart: on a single step, all echoes are one amplitude.
    """
    window = taper(amplitude.shape[-1] // SEQUENCES)
    each = [amplitude[..., first::SEQUENCES] @ window for first in range(SEQUENCES)]
    return np.stack(each, axis=-1)


def noise_of_sequences(noise: FloatArray) -> FloatArray:
    """Mean power of `in_sequences` of noise, from that on single steps, W ``(…, ramp)``."""
    window = taper(noise.shape[-1] // SEQUENCES)
    return np.asarray(np.mean(noise, axis=-1) * np.sum(window**2))
