"""Frames made by hand: points in noise, without channel or synthesis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame, sample_times
from polychirp.model.radar import Converter
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.estimation.azimuth_rate import sine_basis
from polychirp.receiver.signal_model.point_signal import path_of, replica
from polychirp.receiver.signal_model.transmit_codes import virtual_position


@dataclass(frozen=True, slots=True, kw_only=True)
class HandPoint:
    """A point: m, m/s, m/s², rad, and its power at the start relative to unit noise per sample.

    ``sine_rate``, 1/s, is the rate of the sine of its azimuth at the start. The point's amplitude
    follows R to the power ``-spreading`` over the frame. `coded_frame` alone reads ``elevation``;
    its points have steady amplitudes and azimuths.
    """

    range: float
    range_rate: float = 0.0
    acceleration: float = 0.0
    azimuth: float = 0.0
    elevation: float = 0.0
    sine_rate: float = 0.0
    power: float = 1.0
    spreading: float = 2.0


def frame_of(
    schedule: RampSchedule,
    points: Sequence[HandPoint],
    *,
    noise: float = 1.0,
    seed: int = 0,
    converter: Converter | None = None,
) -> IfFrame:
    """A frame of points at the schedule's start, in white noise of power ``noise`` per sample."""
    draw = np.random.default_rng(seed)
    array = AntennaArray()
    times = sample_times(schedule, converter or Converter())
    into = times.time - schedule.start_time[:, None]
    frequency = schedule.start_frequency[:, None] + schedule.slope[:, None] * into
    wavelength = SPEED_OF_LIGHT / frequency
    shape = (array.num_channels, schedule.num_ramps, times.most_samples)
    samples = np.sqrt(0.5 * noise) * (draw.normal(size=shape) + 1j * draw.normal(size=shape))
    for point in points:
        motion = np.array([point.range, point.range_rate, point.acceleration])
        signal = replica(schedule, times, motion=motion, time=float(schedule.start_time[0]))
        straight, turned = sine_basis(motion[None], times.time - schedule.start_time[0])[:, 0]
        sine = np.sin(point.azimuth) * straight + point.sine_rate * turned
        cycles = array.position[:, 1, None, None] * sine / wavelength + draw.random()
        distance, _, _ = path_of(motion[None], times.time - schedule.start_time[0])[:, 0]
        growth = (point.range / distance) ** point.spreading
        signal = signal * np.conj(sent_chips(schedule, into - 2.0 * distance / SPEED_OF_LIGHT))
        samples += np.sqrt(point.power) * growth * np.exp(-2j * np.pi * cycles) * signal
    return IfFrame(samples=samples * times.is_sample, times=times, schedule=schedule, array=array)


def sent_chips(schedule: RampSchedule, into: FloatArray) -> ComplexArray:
    """Chips that are sent at times from the starts of the ramps, s ``(ramp, fast)``."""
    code = schedule.code
    if code is None:
        return np.ones(into.shape, dtype=np.complex128)
    number = np.floor(into / code.chip_duration[:, None]).astype(np.int64)
    chips = np.take_along_axis(code.value[code.row], number % code.num_chips, axis=1)
    return chips * (number >= 0)


def true_motions(schedule: RampSchedule, points: Sequence[HandPoint]) -> FloatArray:
    """Range, range rate, acceleration and azimuth of points in the middle of a frame.

    The unit is m, s and rad; the shape is ``(point, 4)``.
    """
    start = np.array([[one.range, one.range_rate, one.acceleration] for one in points])
    late = np.array(0.5 * (schedule.end_time.max() - schedule.start_time.min()))
    straight, turned = sine_basis(start, late[None])[..., 0]
    sine = np.sin([one.azimuth for one in points]) * straight
    sine += np.array([one.sine_rate for one in points]) * turned
    return np.column_stack([path_of(start, late).T, np.arcsin(sine)])


def coded_frame(
    schedule: RampSchedule,
    points: Sequence[HandPoint],
    *,
    array: AntennaArray,
    converter: Converter,
    errors: FloatArray | float = 0.0,
    seed: int = 0,
) -> IfFrame:
    """A frame of points seen by coded transmitting elements, in noise of power 1 per sample.

    Points are at the schedule's start. ``power`` is that of one element in one channel, and
    ``errors`` are added to the phases of virtual channels, rad ``(element, channel)``.
    """
    draw = np.random.default_rng(seed)
    times = sample_times(schedule, converter)
    shape = (array.num_channels, schedule.num_ramps, times.most_samples)
    samples = np.sqrt(0.5) * (draw.normal(size=shape) + 1j * draw.normal(size=shape))
    place = virtual_position(array)[: schedule.num_elements]
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    for point in points:
        motion = np.array([point.range, point.range_rate, point.acceleration])
        signal = replica(schedule, times, motion=motion, time=float(schedule.start_time[0]))
        level = np.cos(point.elevation)
        to_it = [
            level * np.cos(point.azimuth),
            level * np.sin(point.azimuth),
            np.sin(point.elevation),
        ]
        cycles = place @ np.array(to_it) / wavelength + draw.random()
        each = np.exp(-2j * np.pi * cycles + 1j * np.asarray(errors))
        by_ramp = schedule.transmit_weight.conj() @ each
        samples += np.sqrt(point.power) * by_ramp.T[:, :, None] * signal
    return IfFrame(samples=samples, times=times, schedule=schedule, array=array)
