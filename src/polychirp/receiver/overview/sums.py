"""Power of a frame over range and range rate, and of beams in some of its cells.

Each class has a ``map``, the ``place`` of its channels, and ``beam_power`` of cells.
"""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfFrame
from polychirp.model.ramp import RampSchedule
from polychirp.model.spectra import RangeRateMap, RangeRateSpectra
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.coherent_map import MapLimits, map_axes
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.profiles import Profiles
from polychirp.receiver.coherent.rate_blocks import powers
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.overview.range_response import log_range_rate_map
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.transforms import middle_frequency, unfit
from polychirp.receiver.selection import FrameReceiver, receiver_of_kind
from polychirp.receiver.settings import range_axis
from polychirp.receiver.signal_model.equal_ramps import refuse_code, refuse_steps
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.point_signal import beat_frequency, hann_weights
from polychirp.receiver.signal_model.power_spectra import spectrum_size
from polychirp.receiver.signal_model.transmit_codes import code_blocks, virtual_channels
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.receiver.stepped.solution import beat_and_phase
from polychirp.receiver.stepped.staircase import Staircase
from polychirp.receiver.stepped.steps import middle_time

GREATEST_RATE_CELL: Final = 3.0
"""Greatest cell λ/2T of range rates, m/s, with which one ramp counts as long; chosen: ramps of some
0.6 ms at 77 GHz, on which the beats of two cars of different speeds differ."""

RATES_PER_CELL: Final = 3
"""Range rates of the map of long ramps per cell; chosen: the nearest loses 0.3 dB."""

STEP_PADDING: Final = 16
"""Padding of the spectra of steps; chosen: the nearest bin loses 0.01 dB."""

LEAST_POWER: Final = 1e-300
"""Power below which logarithms are not taken, W; chosen: far below all noise."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChirpSums:
    """Sums over equal chirps: the spectra of the range-Doppler receiver."""

    frame: IfFrame
    spectra: RangeRateSpectra

    @classmethod
    def of(cls, receiver: RangeDoppler, frame: IfFrame) -> Self:
        """The sums of a frame, after the receiver's mitigation."""
        return cls(frame=frame, spectra=receiver.spectra(frame))

    @property
    def map(self) -> RangeRateMap:
        """Mean power of the channels."""
        return self.spectra.mean_power

    @property
    def place(self) -> FloatArray:
        """Places of the virtual channels in the radar's frame, m, ``(channel, xyz)``."""
        return virtual_channels(self.frame.array, self.frame.schedule.num_elements)[0]

    def beam_power(self, cell: IntArray, beams: ComplexArray) -> FloatArray:
        """Power of beams ``(beam, channel)`` in cells ``(cell, 2)``, W, ``(beam, cell)``.

        A code of transmitting elements is decoded for the range rate of each cell.
        """
        return np.asarray(np.abs(beams @ self._amplitude(cell).T) ** 2)

    def _amplitude(self, cell: IntArray) -> ComplexArray:
        """Amplitudes of the virtual channels, V, ``(cell, channel)``."""
        frame, spectra = self.frame, self.spectra
        blocks = code_blocks(frame.schedule)
        start = frame.schedule.start_time[blocks.ramps[0, :, 0]]
        doppler = 2.0 * middle_frequency(frame.schedule, frame.times) / SPEED_OF_LIGHT
        cycles = doppler * spectra.range_rate[cell[:, 0], None] * (start - start[0])
        value = spectra.amplitude[:, cell[:, 0], cell[:, 1]].T
        value = value.reshape(len(cell), frame.array.num_channels, start.size)
        value = value * np.exp(-2j * np.pi * cycles)[:, None]
        weight = blocks.weight / np.sum(np.abs(blocks.weight) ** 2, axis=0)
        apart = np.einsum("kl,pck->plc", weight, value).reshape(len(cell), -1)
        _, order = virtual_channels(frame.array, frame.schedule.num_elements)
        return np.asarray(apart[:, order])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RampSums:
    """Sums of all samples in phase: the map of the coherent receiver, all ramps of equal weight."""

    frame: IfFrame
    seen: Observation
    profiles: Profiles

    @classmethod
    def of(cls, receiver: CoherentReceiver, frame: IfFrame) -> Self:
        """The sums of a frame, after the receiver's mitigation."""
        seen = Observation.of(frame, mitigated(receiver.mitigation, frame))
        spectra = Residual.of(seen, Points.none(frame.array.num_channels)).spectra
        profiles = Profiles.of(seen, spectra, map_axes(seen, MapLimits.of(receiver)))
        return cls(frame=frame, seen=seen, profiles=profiles)

    @property
    def map(self) -> RangeRateMap:
        """Mean power of the channels: a point that does not accelerate has its power."""
        samples = float(self.seen.count.sum())
        power = powers(self.seen, self.profiles) / (samples * self.frame.array.num_channels)
        axes = self.profiles.axes
        return RangeRateMap(
            power=power.astype(np.float64), range_rate=axes.range_rate, range=axes.range
        )

    @property
    def place(self) -> FloatArray:
        """Places of the channels in the radar's frame, m, ``(channel, xyz)``."""
        return self.frame.array.position

    def beam_power(self, cell: IntArray, beams: ComplexArray) -> FloatArray:
        """Power of beams ``(beam, channel)`` in cells ``(cell, 2)``, W, ``(beam, cell)``."""
        value, _ = self.profiles.at(self.seen, cell)
        amplitude = value.sum(axis=2) / self.seen.count.sum()
        return np.asarray(np.abs(beams @ amplitude.T) ** 2)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LongRampMeans:
    """Geometric means over long ramps of the power at a point's beats.

    A mean of logarithms is high only where all ramps have power: the beats of other points on
    rising or on falling ramps alone, and bursts on single ramps, stay low. The range rates are as
    far apart as one ramp tells them.

    Parameters
    ----------
    frame : the frame
    spectra : of every ramp, V, in which a tone has its amplitude, ``(channel, ramp, bin)``
    axes : of the map
    """

    frame: IfFrame
    spectra: ComplexArray
    axes: Grid

    @classmethod
    def of(cls, receiver: CoherentReceiver, frame: IfFrame) -> Self:
        """The means of a frame, after the receiver's mitigation."""
        schedule, times = frame.schedule, frame.times
        cleaned = mitigated(receiver.mitigation, frame)
        window = hann_weights(cleaned.weight)
        window = window / np.maximum(window.sum(axis=1, keepdims=True), 1e-30)
        step = rate_cell(schedule) / RATES_PER_CELL
        count = int(np.ceil(receiver.greatest_speed / step))
        return cls(
            frame=frame,
            spectra=np.fft.fft(cleaned.samples * window, spectrum_size(times), axis=-1),
            axes=Grid(
                range=range_axis(receiver, schedule),
                range_rate=step * np.arange(-count, count + 1, dtype=np.float64),
                time=float(0.5 * (schedule.start_time[0] + schedule.end_time[-1])),
            ),
        )

    @property
    def map(self) -> RangeRateMap:
        """Mean over channels of the geometric means."""
        logs = np.log(np.maximum(np.abs(self.spectra) ** 2, LEAST_POWER))
        means = log_range_rate_map(logs, self.frame.schedule, self.frame.times, self.axes)
        return RangeRateMap(
            power=np.exp(means).mean(axis=0),
            range_rate=self.axes.range_rate,
            range=self.axes.range,
        )

    @property
    def place(self) -> FloatArray:
        """Places of the channels in the radar's frame, m, ``(channel, xyz)``."""
        return self.frame.array.position

    def beam_power(self, cell: IntArray, beams: ComplexArray) -> FloatArray:
        """Power of beams ``(beam, channel)`` in cells ``(cell, 2)``, W, ``(beam, cell)``."""
        beat = beat_frequency(
            self.frame.schedule,
            self.frame.times,
            distance=self.axes.range[cell[:, 1]],
            range_rate=self.axes.range_rate[cell[:, 0]],
            time=self.axes.time,
        )
        size = self.spectra.shape[-1]
        number = np.rint(beat * size / self.frame.times.rate).astype(np.int64) % size
        total = np.zeros((len(beams), len(cell)))
        for ramp in range(self.spectra.shape[1]):
            power = np.abs(beams @ self.spectra[:, ramp, number[:, ramp]]) ** 2
            total += np.log(np.maximum(power, LEAST_POWER))
        return np.asarray(np.exp(total / self.spectra.shape[1]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StepSums:
    """Sums of two sequences of steps in phase, at the beat and the phase of each motion.

    A target is a ridge along the motions of one beat, whose power falls with the cosine of the
    phase between both sequences.

    Parameters
    ----------
    frame : the frame
    spectra : of both sequences, V, ``(channel, sequence, bin)``
    axes : of the map
    """

    frame: IfFrame
    spectra: ComplexArray
    axes: Grid

    @classmethod
    def of(cls, receiver: MfskReceiver, frame: IfFrame) -> Self:
        """The sums of a frame, after the receiver's mitigation and within its limits."""
        stairs = Staircase.of(frame.schedule)
        count = int(np.ceil(2.0 * receiver.greatest_speed / stairs.rate_cell))
        return cls(
            frame=frame,
            spectra=receiver.steps(frame).spectrum(padding=STEP_PADDING),
            axes=Grid(
                range=np.arange(
                    receiver.least_range, receiver.greatest_range, 0.5 * stairs.range_cell
                ),
                range_rate=0.5 * stairs.rate_cell * np.arange(-count, count + 1.0),
                time=middle_time(frame.times),
            ),
        )

    @property
    def map(self) -> RangeRateMap:
        """Mean power of the channels."""
        power = np.stack(
            [
                np.mean(np.abs(self._amplitude(self.axes.range, rate)) ** 2, axis=0)
                for rate in self.axes.range_rate
            ]
        )
        return RangeRateMap(power=power, range_rate=self.axes.range_rate, range=self.axes.range)

    @property
    def place(self) -> FloatArray:
        """Places of the channels in the radar's frame, m, ``(channel, xyz)``."""
        return self.frame.array.position

    def beam_power(self, cell: IntArray, beams: ComplexArray) -> FloatArray:
        """Power of beams ``(beam, channel)`` in cells ``(cell, 2)``, W, ``(beam, cell)``."""
        amplitude = self._amplitude(self.axes.range[cell[:, 1]], self.axes.range_rate[cell[:, 0]])
        return np.asarray(np.abs(beams @ amplitude) ** 2)

    def _amplitude(self, distance: FloatArray, rate: FloatArray | float) -> ComplexArray:
        """Sum of both sequences, V, ``(channel, motion)``."""
        stairs = Staircase.of(self.frame.schedule)
        beat, phase = beat_and_phase(stairs, distance=distance, range_rate=rate)
        size = self.spectra.shape[2]
        number = np.rint(beat * stairs.interval * size).astype(np.int64) % size
        first, second = self.spectra[:, 0, number], self.spectra[:, 1, number]
        return np.asarray(0.5 * (first + second * np.exp(-2j * np.pi * phase)))


def rate_cell(schedule: RampSchedule) -> float:
    """Range rates λ/2T that the longest ramp resolves by its beat, m/s."""
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    return wavelength / (2.0 * float(np.max(schedule.duration)))


Sums = ChirpSums | LongRampMeans | RampSums | StepSums
"""Sums of any frame."""


def sums_of(receiver: FrameReceiver, frame: IfFrame) -> Sums:
    """Powers of a frame with the receiver's mitigation and limits.

    Equal chirps at equal intervals have `ChirpSums`, ramps that rise and fall and resolve range
    rates by their beats have `LongRampMeans`, and all others, also those in subframes, `RampSums`.
    A code is removed first by the receiver that decodes it; others refuse it. Two sequences of
    steps have `StepSums`.
    """
    if isinstance(receiver, MfskReceiver):
        return StepSums.of(receiver, frame)
    if isinstance(receiver, Decoding):
        read = receiver.reading(frame)
        return sums_of(read.receiver, read.frame)
    schedule = frame.schedule
    refuse_steps(schedule, receiver.kind)
    refuse_code(schedule, f"the receiver '{receiver.kind}' does not remove")
    kind = "coherent" if unfit(schedule) else "range-doppler"
    reader = receiver_of_kind(kind, receiver)
    if isinstance(reader, RangeDoppler):
        return ChirpSums.of(reader, frame)
    assert isinstance(reader, CoherentReceiver)
    has_both = bool(np.ptp(np.sign(schedule.slope)) > 0)
    is_long = has_both and rate_cell(schedule) <= GREATEST_RATE_CELL
    return LongRampMeans.of(reader, frame) if is_long else RampSums.of(reader, frame)
