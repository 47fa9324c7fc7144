"""Laws that waveforms, rules from frame to frame and receivers keep, for tests of plug-ins too."""

from collections.abc import Iterator
from dataclasses import fields
from typing import Any, Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.antenna import AntennaArray
from polychirp.model.detection import Detections
from polychirp.model.if_frame import IfFrame, sample_times
from polychirp.model.radar import Converter
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.settings import SearchSettings
from polychirp.receiver.signal_model.point_signal import path_of, replica
from polychirp.rng import Streams
from polychirp.waveform.access import Access
from polychirp.waveform.base import Waveform
from polychirp.waveform.frame_rules import FrameRule, Listening, MeasuredInterference, Turn
from polychirp.waveform.sawtooth import Sawtooth

FIELDS = ("start_time", "duration", "start_frequency", "slope", "start_phase", "sweep")
"""Columns of a schedule that are compared."""


def check_waveform(waveform: Waveform, *, num_sweeps: int = 16) -> None:
    """Refuse a waveform that breaks a law on which the rest of polychirp rests.

    - The first ramp starts at 0 s, and sweeps are counted from 0 without a hole.
    - Equal streams give equal ramps: nothing is drawn from elsewhere, and nothing is remembered.
    - A longer schedule begins with the ramps of a shorter one.
    - A schedule without sweeps is refused with an `InputError`.

    Raises
    ------
    InputError
        A law is broken; the message has one sentence for each.

    Examples
    --------
    >>> from polychirp.waveform import Triangular
    >>> check_waveform(Triangular())
    """
    if not isinstance(waveform, Waveform):
        raise InputError(f"{waveform!r} has no method 'schedule'; add it")
    faults = _faults(waveform, num_sweeps)
    if faults:
        lines = "\n".join(f"  {fault}" for fault in faults)
        raise InputError(f"{type(waveform).__name__} is no waveform for polychirp:\n{lines}")


def _faults(waveform: Waveform, num_sweeps: int) -> list[str]:
    def schedule(number: int) -> RampSchedule:
        return waveform.schedule(num_sweeps=number, streams=Streams(seed=1).of("front"))

    faults = []
    ramps = schedule(num_sweeps)
    if ramps.start_time[0] != 0.0:
        faults.append(
            f"its first ramp starts at {ramps.start_time[0]:g} s; start at 0 s, since a study adds "
            "the start of the radar"
        )
    if not np.array_equal(np.unique(ramps.sweep), np.arange(num_sweeps)):
        faults.append(f"{num_sweeps} sweeps are not numbered from 0 to {num_sweeps - 1}")
    if np.any(np.diff(ramps.sweep) < 0):
        faults.append("the numbers of its sweeps fall from one ramp to the next")
    again, short = schedule(num_sweeps), schedule(max(1, num_sweeps // 3))
    for name in FIELDS:
        column = getattr(ramps, name)
        if not np.array_equal(column, getattr(again, name)):
            faults.append(f"equal streams give another {name}; draw from the streams alone")
        begin = getattr(short, name)
        if not np.array_equal(column[: begin.size], begin):
            faults.append(
                f"a longer schedule has another {name} on its first ramps; draw from one stream "
                "for each quantity, one value for each sweep in order"
            )
    try:
        schedule(0)
    except InputError:
        pass
    except Exception as error:  # any other error is the fault that is reported
        faults.append(f"num_sweeps = 0 raises {type(error).__name__}; raise an InputError")
    else:
        faults.append("num_sweeps = 0 is accepted; raise an InputError")
    return faults


# ── rules by which radars share time and band ────────────────────────────────


def check_access(rule: Access, *, num_radars: int = 12) -> None:
    """Refuse a rule of ``[access]`` that breaks a law on which studies rest.

    - It gives every radar a delay, 0 or more, and a shift, both finite.
    - Equal streams give equal turns: nothing is drawn from elsewhere, and nothing is remembered.
    - Of a rule from frame to frame: its settings are positive, and equal streams give equal next
      turns, whose delay is 0 or more.
    - Of one that listens: it waits 0 s at some attempt, however busy the band is.

    Raises
    ------
    InputError
        A law is broken; the message has one sentence for each.

    Examples
    --------
    >>> from polychirp.waveform import HopAfterHit
    >>> check_access(HopAfterHit(num_slots=10, slot=2e-6))
    """
    if not isinstance(rule, Access):
        raise InputError(f"{rule!r} has no method 'assign'; add it")
    faults = [*_faults_of_assignment(rule, num_radars)]
    if isinstance(rule, FrameRule):
        faults += _faults_of_turns(rule)
    if isinstance(rule, Listening):
        faults += _faults_of_waiting(rule)
    if faults:
        lines = "\n".join(f"  {fault}" for fault in faults)
        raise InputError(f"{type(rule).__name__} is no rule for polychirp:\n{lines}")


def _faults_of_assignment(rule: Access, count: int) -> Iterator[str]:
    names = [f"radar {n}" for n in range(count)]
    heading = np.linspace(-3.0, 3.0, count)
    one, again = (
        rule.assign(names=names, heading=heading, streams=Streams(seed=1)) for _ in range(2)
    )
    for name in ("delay", "shift"):
        column = np.asarray(getattr(one, name))
        if column.shape != (count,):
            yield f"its {name} has the shape {column.shape} for {count} radars; give each one"
        elif not np.all(np.isfinite(column)):
            yield f"its {name} is not finite for every radar"
        elif not np.array_equal(column, getattr(again, name)):
            yield f"equal streams give another {name}; draw from the streams alone"
    if np.any(np.asarray(one.delay) < 0.0):
        yield "a delay is negative; a radar cannot start before its frame"


def _faults_of_turns(rule: FrameRule) -> Iterator[str]:
    for name in ("num_frames", "frame_interval", "tolerated"):
        if not getattr(rule, name) > 0:
            yield f"its {name} is {getattr(rule, name)!r}; give it a positive value"
    for measured in (
        MeasuredInterference(inr=0.0, hit_ramps=0.0),
        MeasuredInterference(inr=1e3, hit_ramps=1.0),
    ):
        last = Turn(delay=1e-6, draw=3)
        one, again = (rule.next_turn(last, measured, streams=Streams(seed=2)) for _ in range(2))
        if one != again:
            yield "equal streams give another next turn; draw from the streams alone"
        if not one.delay >= 0.0:
            yield f"a next turn has the delay {one.delay!r} s; give it 0 or more"


def _faults_of_waiting(rule: Listening) -> Iterator[str]:
    if not rule.listening > 0:
        yield f"its listening lasts {rule.listening!r} s; give it a positive time"
    waits = (
        rule.wait(1e6, samples=1e4, attempt=n, streams=Streams(seed=3))
        for n in range(GREATEST_ATTEMPTS)
    )
    if not any(wait <= 0.0 for wait in waits):
        yield f"it still waits after {GREATEST_ATTEMPTS} attempts; send in the end"


GREATEST_ATTEMPTS: Final = 1000
"""Number of times of listening after which a rule must send; chosen: more would be no radar."""


# ── receivers ─────────────────────────────────────────────────────────────────

POINT_RANGE, POINT_RATE, POINT_POWER = 9.0, -3.0, 100.0
"""Place, m and m/s, of the point that a receiver must find, and its power over the noise of a
sample. Chosen: far above any threshold, and far from the edges of a receiver's map."""

NOISE_FRAMES: Final = 10
"""Number of frames of noise that are read; chosen: at the default false-alarm probability there is
hardly a detection in them."""


def check_receiver(
    receiver: Any,
    *,
    schedule: RampSchedule | None = None,
    converter: Converter | None = None,
) -> None:
    """Refuse a receiver that breaks a law on which the rest of polychirp rests.

    - It inherits from `polychirp.receiver.settings.SearchSettings`, which has the limits, the
      false-alarm probability and the mitigation that studies set.
    - A frame is not changed, and equal frames give equal detections.
    - A point 20 dB over the noise of a sample is the strongest detection, within a resolution cell
      of its range and range rate at the time of the detections, with its power within 2 dB.
    - Detections are strongest first, within the limits in range, and finite but for angles.
    - Noise has few detections, and a frame of zeros none.

    Parameters
    ----------
    schedule : ramps that it reads; by default 64 equal chirps of 300 MHz and 40 µs
    converter : that takes samples of them; by default of 20 MS/s

    Raises
    ------
    InputError
        A law is broken; the message has one sentence for each.

    Examples
    --------
    >>> from polychirp.receiver.range_doppler.chain import RangeDoppler
    >>> check_receiver(RangeDoppler())
    """
    if not (isinstance(receiver, SearchSettings) or _is_alike(receiver)):
        raise InputError(
            f"{receiver!r} has no method 'detect' or lacks settings of a receiver; inherit from "
            "polychirp.receiver.settings.SearchSettings and add 'detect'"
        )
    faults = [*_faults_of_detections(receiver, schedule, converter)]
    if faults:
        lines = "\n".join(f"  {fault}" for fault in faults)
        raise InputError(f"{type(receiver).__name__} is no receiver for polychirp:\n{lines}")


def _is_alike(receiver: Any) -> bool:
    """True if an object has the method and the settings of a receiver."""
    names = ("detect", "mitigation", "least_range", "greatest_range", "false_alarm_probability")
    return all(hasattr(receiver, name) for name in names)


def _faults_of_detections(
    receiver: Any, schedule: RampSchedule | None, converter: Converter | None
) -> Iterator[str]:
    if schedule is None:
        schedule = Sawtooth(bandwidth=300e6, ramp_duration=40e-6, idle=10e-6).schedule(
            num_sweeps=64, streams=Streams(seed=1)
        )
    converter = converter or Converter(sample_rate=20e6, start=1e-6, margin=0.0)
    frame = point_frame(schedule, converter, power=POINT_POWER, seed=1)
    before = frame.samples.copy()
    found, again = receiver.detect(frame), receiver.detect(frame)
    if not isinstance(found, Detections):
        yield f"'detect' returns {type(found).__name__}; return polychirp.Detections"
        return
    if not np.array_equal(before, frame.samples):
        yield "it changes the samples of its frame; work on a copy"
    for field in fields(found):
        if not np.array_equal(
            getattr(found, field.name), getattr(again, field.name), equal_nan=True
        ):
            yield f"equal frames give another {field.name}; draw nothing, and remember nothing"
    yield from _faults_of_columns(receiver, found)
    yield from _faults_of_the_point(found, schedule)
    noise = [
        receiver.detect(point_frame(schedule, converter, power=0.0, seed=10 + n)).num_detections
        for n in range(NOISE_FRAMES)
    ]
    if sum(noise) > NOISE_FRAMES:
        yield (
            f"{NOISE_FRAMES} frames of noise have {sum(noise)} detections; raise the threshold to "
            "that of its false_alarm_probability"
        )
    if receiver.detect(frame.with_samples(0.0 * frame.samples)).num_detections:
        yield "a frame of zeros has detections; there is nothing to detect"


def _faults_of_columns(receiver: Any, found: Detections) -> Iterator[str]:
    if np.any(np.diff(found.power) > 0):
        yield "its detections are not in the order of their powers; put the strongest first"
    for name in ("range", "range_rate", "power", "snr"):
        if not np.all(np.isfinite(getattr(found, name))):
            yield f"the {name} of a detection is not finite"
    slack = 0.3  # m, of ranges at another time than the limits are meant for
    is_outside = (found.range < receiver.least_range - slack) | (
        found.range > receiver.greatest_range + slack
    )
    if np.any(is_outside):
        yield "a detection is outside of least_range to greatest_range"


def _faults_of_the_point(found: Detections, schedule: RampSchedule) -> Iterator[str]:
    if not found.num_detections:
        yield f"a point {POINT_POWER:g} times as strong as the noise of a sample is not detected"
        return
    motion = np.array([[POINT_RANGE, POINT_RATE, 0.0]])
    distance, rate, _ = path_of(motion, np.array(found.time - schedule.start_time[0]))[:, 0]
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    span = float(schedule.end_time[-1] - schedule.start_time[0])
    cells = (SPEED_OF_LIGHT / (2.0 * float(np.max(schedule.bandwidth))), wavelength / (2.0 * span))
    for name, true, cell in zip(("range", "range_rate"), (distance, rate), cells, strict=True):
        value = float(getattr(found, name)[0])
        if abs(value - float(true)) > cell:
            yield (
                f"the strongest detection has the {name} {value:.4g} where a point has "
                f"{float(true):.4g}, more than a cell of {cell:.3g} away"
            )
    if not found.power[0] > 0:
        yield "the power of that point is not positive"
        return
    error = 10.0 * np.log10(float(found.power[0]) / POINT_POWER)
    if abs(error) > 2.0:
        yield (
            f"the power of that point is {error:+.1f} dB of its squared amplitude in a channel; "
            "divide by the gain of the processing"
        )


def point_frame(
    schedule: RampSchedule, converter: Converter, *, power: float, seed: int
) -> IfFrame:
    """A frame of one point at `POINT_RANGE` and `POINT_RATE`, in noise of power 1 per sample.

    The point is straight ahead of an array of four channels, and has the power ``power``, W.
    """
    draw = np.random.default_rng(seed)
    array = AntennaArray()
    times = sample_times(schedule, converter)
    shape = (array.num_channels, schedule.num_ramps, times.most_samples)
    samples = (draw.normal(size=shape) + 1j * draw.normal(size=shape)) * np.sqrt(0.5)
    motion: FloatArray = np.array([POINT_RANGE, POINT_RATE, 0.0])
    signal = replica(schedule, times, motion=motion, time=float(schedule.start_time[0]))
    samples = (samples + np.sqrt(power) * signal) * times.is_sample
    return IfFrame(samples=samples, times=times, schedule=schedule, array=array)
