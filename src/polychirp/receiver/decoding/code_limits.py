"""Frames that cannot be decoded, with the reason and what would work."""

import math
from typing import get_args

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError, PhysicsError
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation import AnyMitigation, Blanking, Nulling
from polychirp.receiver.mitigation.burst_detectors import AmplitudeSteps, StftCfar
from polychirp.receiver.range_doppler.transforms import unfit
from polychirp.receiver.signal_model.equal_ramps import LARGEST_DIFFERENCE

MOST_UNEVEN_PERIOD = 1e-2
"""Greatest distance of a period of the code from a whole number of samples, in samples. Chosen: the
last sample of a period is then wrong by 1 % of a chip, and a clock of 20 ppm remains below it."""

NEEDED_SHARE = 0.8
"""Share of half the band of a carrier's chips that the IF filter must pass. Chosen: with it, an
echo loses 0.1 dB and its peak is 2 % wider than with all of it; with half, 1.2 dB and 26 %."""


def undecodable(schedule: RampSchedule) -> str:
    """Reason why a schedule cannot be decoded, as the end of a sentence; empty if it can.

    >>> from polychirp.rng import Streams
    >>> from polychirp.waveform import Sawtooth
    >>> undecodable(Sawtooth().schedule(num_sweeps=4, streams=Streams(seed=1)))
    'its ramps carry no code'
    """
    code = schedule.code
    if code is None:
        return "its ramps carry no code"
    if not np.allclose(
        code.chip_duration, code.chip_duration[0], rtol=LARGEST_DIFFERENCE, atol=0.0
    ):
        return "its ramps differ in the duration of their chips"
    return unfit(schedule)


def refuse_undecodable(schedule: RampSchedule) -> None:
    """Refuse a schedule that cannot be decoded, with a `CapabilityError` that says why."""
    reason = undecodable(schedule)
    if not reason:
        return
    if schedule.code is None:
        raise CapabilityError(
            f"the decoding receiver needs ramps with a code, and of this schedule {reason}; the "
            "receiver 'auto' reads it"
        )
    raise CapabilityError(
        "the decoding receiver needs equal ramps at equal intervals, and of this schedule "
        f"{reason}; use a coded waveform without changes from sweep to sweep"
    )


def refuse_samples(schedule: RampSchedule, times: SampleTimes, *, greatest_range: float) -> None:
    """Refuse samples from which a carrier's code cannot be decoded up to ``greatest_range``, m.

    Raises
    ------
    CapabilityError
        A period of the code is no whole number of samples, or a sweep has no whole period of them.
    PhysicsError
        The converter starts before the echoes from the greatest range arrive, or these are so late
        that they look like near ones.
    """
    code = schedule.code
    if code is None or np.any(schedule.slope != 0.0):
        return
    period = float(code.period[0])
    count = period * times.rate
    if abs(count - round(count)) > MOST_UNEVEN_PERIOD or round(count) < 2:
        better = max(round(count), 2) / period
        raise CapabilityError(
            f"a code of {period * 1e9:.6g} ns has {count:.6g} samples at "
            f"{times.rate / 1e6:.6g} MS/s, and correlation needs a whole number of two or more; "
            f"set converter.sample_rate to '{better / 1e6:.9g} MS/s', or to one sample for each "
            "chip or two"
        )
    if times.num_samples.min() < round(count):
        raise CapabilityError(
            f"a sweep has {int(times.num_samples.min())} samples, fewer than the "
            f"{round(count)} of a period of its code; use more periods, or a smaller "
            "converter.start or converter.margin"
        )
    delay = 2.0 * greatest_range / SPEED_OF_LIGHT
    alike = float(code.repetition[0])
    if delay > alike:
        raise PhysicsError(
            f"echoes repeat after {0.5 * SPEED_OF_LIGHT * alike:.4g} m with a code of "
            f"{period * 1e6:.4g} µs, nearer than the receiver's greatest range of "
            f"{greatest_range:g} m; use a longer code or lower receiver.greatest_range"
        )
    start = float(np.min(times.first - schedule.start_time))
    if start < delay * (1 - 1e-9):
        raise PhysicsError(
            f"the converter starts {start * 1e6:.4g} µs after a sweep's start, before echoes from "
            f"the receiver's greatest range of {greatest_range:g} m arrive; set converter.start to "
            f"'{math.ceil(delay * 1e9)} ns' or more"
        )


def refuse_filter(schedule: RampSchedule, passband: float, *, greatest_range: float) -> None:
    """Refuse an IF filter that takes the code from the samples; ``passband`` is its edge, Hz.

    The samples of a carrier are chips, which need `NEEDED_SHARE` of half their band on either side.
    Those of a chirp are beats with the code beside them, the first zero of its spectrum included.

    Raises
    ------
    PhysicsError
        The pass band is narrower.
    """
    code = schedule.code
    if code is None:
        return
    needed, what = NEEDED_SHARE * 0.5 * float(np.max(code.bandwidth)), "the chips of its carrier"
    if np.any(schedule.slope != 0.0):
        steepest = float(np.max(np.abs(schedule.slope)))
        beat = 2.0 * steepest * greatest_range / SPEED_OF_LIGHT
        needed, what = beat + 1.0 / float(np.min(code.chip_duration)), "its beats with their code"
    if passband < needed:
        raise PhysicsError(
            f"its IF filter passes {passband / 1e6:.4g} MHz, and {what} need {needed / 1e6:.4g} "
            f"MHz on either side; set if_filter.passband to '{math.ceil(needed / 1e5) / 10:g} MHz' "
            "or more"
        )


def refuse_prediction(mitigation: AnyMitigation | None) -> None:
    """Refuse, with a `CapabilityError`, a mitigation that takes echoes for tones or smooth signals.

    The received chips of a code are neither, and a step from chip to chip is no burst. Weights of
    samples and combinations of channels are right for all signals; what methods and detectors of
    plug-ins need is not known here.

    >>> refuse_prediction(Blanking())
    """
    known = get_args(get_args(AnyMitigation)[0])
    if isinstance(mitigation, known) and not isinstance(mitigation, Blanking | Nulling):
        raise CapabilityError(
            f"the mitigation '{mitigation.kind}' takes echoes for tones, and those of ramps with a "
            "code are none; use 'blanking' or 'nulling'"
        )
    detector = getattr(mitigation, "detector", None)
    if isinstance(detector, AmplitudeSteps | StftCfar):
        raise CapabilityError(
            f"the detector '{detector.kind}' takes steps and spectra of chips for bursts, and "
            "would find these in echoes of ramps with a code; leave receiver.mitigation.detector "
            "out, or use 'median-threshold'"
        )
