"""`Observation`: what the coherent receiver knows about one frame before it looks for points."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.coherent.ramps import ELAPSED, FREQUENCY, HALF_LENGTH, USED, Ramps
from polychirp.receiver.estimation.azimuth_rate import sine_basis
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.signal_model.equal_ramps import refuse_code, refuse_steps
from polychirp.receiver.signal_model.frame_model import FrameModel
from polychirp.receiver.signal_model.point_signal import path_of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Observation:
    """Samples of a frame after mitigation, and the model of a point's signal in them.

    Parameters
    ----------
    samples : V, ``(channel, ramp, fast)``; zero where no sample is present
    present : mask of the samples that are used, ``(ramp, fast)``
    ramps : what kernels need of the ramps and of these samples
    model : beats and phases of points; motions (R, v, a) refer to the middle of the frame
    weight : of the ramps at the frequencies of a transform, ``(ramp, bin)`` (`noise.ramp_weights`)
    mixing : matrix that makes the channels' noise white, ``(channel, channel)``
    """

    samples: ComplexArray
    present: BoolArray
    ramps: Ramps
    model: FrameModel
    weight: FloatArray
    mixing: ComplexArray

    @classmethod
    def of(cls, frame: IfFrame, cleaned: Mitigated) -> Self:
        """The observation of a frame after mitigation; its noise is taken as white.

        `CapabilityError` is raised if the ramps carry a code.
        """
        schedule = frame.schedule
        refuse_code(schedule, "the receiver 'coherent' does not remove")
        refuse_steps(schedule, "coherent")
        middle = float(0.5 * (schedule.start_time.min() + schedule.end_time.max()))
        channels, ramps, fast = cleaned.samples.shape
        model, present = replace(FrameModel.of(frame), time=middle), cleaned.weight > 0
        return cls(
            samples=np.ascontiguousarray(cleaned.samples),
            present=present,
            ramps=Ramps.of(model, present),
            model=model,
            weight=np.ones((ramps, fast)),
            mixing=np.eye(channels, dtype=np.complex128),
        )

    @property
    def count(self) -> FloatArray:
        """Number of samples of every ramp that are used, ``(ramp,)``."""
        return np.asarray(self.ramps.table[USED])

    @property
    def num_used(self) -> int:
        """Number of ramps of which any sample is used."""
        return int(np.count_nonzero(self.count))

    @property
    def middle(self) -> FloatArray:
        """Middle of every ramp's sampling window, s, ``(ramp,)``."""
        return np.asarray(self.model.time + self.ramps.table[ELAPSED])

    @property
    def reach(self) -> FloatArray:
        """Half the length of every ramp's sampling window, s, ``(ramp,)``."""
        return np.asarray(self.ramps.table[HALF_LENGTH])

    @property
    def frequency(self) -> FloatArray:
        """Transmitted frequency in the middle of every ramp's sampling window, Hz, ``(ramp,)``."""
        return np.asarray(self.ramps.table[FREQUENCY])

    @property
    def bandwidth(self) -> float:
        """Span of the frequencies of all samples, Hz."""
        times = self.model.times
        reach = 0.5 * self.model.schedule.slope * (times.num_samples - 1) / times.rate
        return float(np.ptp(np.concatenate([self.frequency - reach, self.frequency + reach])))

    @property
    def duration(self) -> float:
        """Time from the start of the first ramp to the end of the last, s."""
        schedule = self.model.schedule
        return float(schedule.end_time.max() - schedule.start_time.min())

    @property
    def wavelength(self) -> float:
        """Wavelength at the mean frequency λ, m."""
        return SPEED_OF_LIGHT / float(self.frequency.mean())

    @property
    def range_cell(self) -> float:
        """Resolution c/2B of the whole frame, m."""
        return SPEED_OF_LIGHT / (2.0 * self.bandwidth)

    @property
    def range_rate_cell(self) -> float:
        """Resolution λ/2T of the whole frame, m/s."""
        return self.wavelength / (2.0 * self.duration)

    @property
    def num_bins(self) -> int:
        """Length of the transform to which `weight` refers."""
        return int(self.weight.shape[-1])

    def weights(self, motion: FloatArray) -> FloatArray:
        """Weights of the ramps at the points' beats, ``(point, ramp)``."""
        return self.weight_at(self.model.beats(motion[:, 0], motion[:, 1]))

    def weight_at(self, beat: FloatArray) -> FloatArray:
        """Weights of the ramps at beats, Hz, ``(…, ramp)``."""
        place = np.rint(beat * (self.num_bins / self.model.times.rate)).astype(np.int64)
        return np.asarray(self.weight[np.arange(beat.shape[-1]), place % self.num_bins])

    def phases(self, motion: FloatArray) -> FloatArray:
        """`beat_phase` of the motions, ``(point, ramp, 3)``."""
        return self.model.phases(motion[:, :3])

    def shape(self, motion: FloatArray, sine: FloatArray, growth: FloatArray) -> ComplexArray:
        """Amplitude of a point's signal over each ramp, relative to that of the point.

        It is a polynomial of second degree in the time from the middle of the ramp's window,
        ``(point, channel, ramp, 3)`` in 1, 1/s and 1/s². It holds the response of the high-pass
        filter at the beat, the growth with 1/R² of an echo that comes nearer, a growth of the
        point's own, and the phases that come from the delays of the array's elements. These delays
        change with the azimuth, and their phases with the frequency. Their phase in the middle of
        the frame at the mean frequency is left out: it belongs to the amplitude of the point on
        each channel.

        Parameters
        ----------
        motion : R, m, v, m/s, a, m/s², and the rate of the azimuth's sine, 1/s, in the middle of
            the frame, ``(point, 4)``
        sine : sine of the azimuth then, ``(point,)``
        growth : rate of the logarithm of the amplitude beyond that of 1/R², 1/s, ``(point,)``
        """
        model, slope = self.model, self.model.schedule.slope
        elapsed = self.middle - model.time
        distance, rate, _ = path_of(motion, elapsed)
        spreading = (motion[:, :1] / distance) ** 2 * np.exp(growth[:, None] * elapsed)
        straight, turned = sine_basis(motion, elapsed)
        now = sine[:, None] * straight + motion[:, 3:4] * turned
        by_sine = -2.0 * np.pi / SPEED_OF_LIGHT * model.channel_y[:, None]
        phase = by_sine * (self.frequency * now - self.frequency.mean() * sine[:, None])[:, None]
        beat = by_sine * (slope * now + self.frequency * motion[:, 3:4])[:, None]
        size = (model.response(motion)[:, 0] * spreading)[:, None] * np.exp(1j * phase)
        rise = (growth[:, None] - 2.0 * rate / distance)[:, None] + 1j * beat
        return np.stack([size, size * rise, 0.5 * size * rise**2], axis=-1)
