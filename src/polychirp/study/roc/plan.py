"""`RocPlan`: the radar, the receivers and the points of a measurement of detection."""

import math
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from typing import Final, cast

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.errors import (
    CapabilityError,
    InputError,
    ModelWarning,
    PhysicsError,
    no_such,
)
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame, SampleTimes, sample_times
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mimo import virtual_array
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.subframes import has_subframes
from polychirp.receiver.selection import (
    AnyReceiver,
    FrameReceiver,
    decodes_elements,
    receiver_for,
    receiver_of_kind,
)
from polychirp.receiver.settings import DetectorSettings
from polychirp.rng import Streams
from polychirp.study.check import check
from polychirp.study.limits.targets import greatest_speed
from polychirp.study.monte_carlo.grid import trial_seed
from polychirp.study.provenance import Provenance, canonical_json, provenance
from polychirp.study.roc.yardsticks import Extent, error_limits, resolution
from polychirp.study.spec import Study, headings, schedule_of
from polychirp.waveform import AnyAccess, FrameRule
from polychirp.waveform.access import Assignment

MOST_CASES: Final = 1000
"""Greatest number of SNRs; chosen."""

SNR_DIGITS: Final = 6
"""Number of decimals of an SNR in dB that count; chosen: steps of 0.1 dB then meet again."""

STRONG_CELLS: Final = 4.0
"""Distance of a strong point from the tested one, range cells, if none is given; chosen: beyond the
main lobes of all receivers, of which the one with the widest cell counts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Strong:
    """A second point beside the tested one.

    Parameters
    ----------
    ratio : power over that of the tested point
    apart : distance from the tested point in range and range rate, m and m/s; the sign of both is
        drawn
    """

    ratio: float
    apart: Extent


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """One curve: a receiver with one false-alarm probability.

    Parameters
    ----------
    receiver : as it is run; "auto" is resolved already
    """

    receiver: FrameReceiver

    @property
    def kind(self) -> str:
        """Kind of the receiver."""
        return self.receiver.kind

    @property
    def probability(self) -> float:
        """False-alarm probability of the receiver; NaN if it has none."""
        if isinstance(self.receiver, DetectorSettings):
            return self.receiver.false_alarm_probability
        return math.nan

    @property
    def label(self) -> str:
        """Receiver and false-alarm probability as text."""
        if math.isnan(self.probability):
            return self.kind
        shown = np.format_float_scientific(self.probability, trim="-", exp_digits=1)
        return f"{self.kind}, {shown}"


@dataclass(frozen=True, slots=True, kw_only=True)
class AmongAll:
    """The rule of a study for some of its radars, which it gives time and band as among all.

    Parameters
    ----------
    rule : rule of the study
    names, heading : names of all radars of the study, and directions of their axes, rad
    """

    rule: AnyAccess
    names: tuple[str, ...]
    heading: tuple[float, ...]

    def assign(self, *, names: Sequence[str], heading: FloatArray, streams: Streams) -> Assignment:
        """See `Access.assign`."""
        del heading
        given = self.rule.assign(names=self.names, heading=np.array(self.heading), streams=streams)
        numbers = [self.names.index(name) for name in names]
        return Assignment(delay=given.delay[numbers], shift=given.shift[numbers])


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """Limits from which points are drawn, in the middle of the frame.

    Parameters
    ----------
    least_range, greatest_range : m, which a point does not leave during the frame
    greatest_speed : m/s, greatest magnitude of its range rate
    half_frame : s, half the duration of the frame
    """

    least_range: float
    greatest_range: float
    greatest_speed: float
    half_frame: float


@dataclass(frozen=True, kw_only=True)
class RocPlan:
    """A measurement of detection, ready to run.

    `roc_plan` makes it, and `run_roc` measures it.

    Parameters
    ----------
    study : the tested radar, first, and its interferers, on a street without anything else
    curves : receivers, all of which read the same frames
    snrs_db : coherent SNRs of the tested point, dB
    trials, noise_trials : number of frames at each SNR, and of frames without a point
    strong : second point; None for none
    window : limits of the points
    """

    study: Study
    curves: tuple[Curve, ...]
    snrs_db: tuple[float, ...]
    trials: int
    noise_trials: int
    strong: Strong | None
    window: Window

    @property
    def radar(self) -> str:
        """Name of the tested radar."""
        return self.study.radars[0].name

    @property
    def cases(self) -> tuple[float | None, ...]:
        """SNR of the point in each case, dB; None, the first, for frames without a point."""
        return (None, *self.snrs_db)

    def num_trials(self, case: int) -> int:
        """Number of frames of a case."""
        return self.noise_trials if self.cases[case] is None else self.trials

    @cached_property
    def origin(self) -> Provenance:
        """Provenance of the plan's study."""
        return provenance(self.study)

    @cached_property
    def limits(self) -> tuple[Extent, ...]:
        """Errors up to which a detection is that of a point, for each curve, in the first trial."""
        study = of_trial(self.study, 0)
        schedule = schedule_of(study, study.radars[0])
        times = sample_times(schedule, study.radars[0].converter)
        return tuple(error_limits(curve.receiver, schedule, times) for curve in self.curves)

    @cached_property
    def key(self) -> str:
        """Hash of all that a frame and its detections depend on, but not of SNRs and numbers."""
        receivers = [canonical_json(curve.receiver) for curve in self.curves]
        limits = [repr(tuple(each)) for each in self.limits]
        parts = [self.origin.study_hash, *receivers, repr(self.strong), repr(self.window), *limits]
        return sha256("\n".join(parts).encode()).hexdigest()


def case_name(snr_db: float | None) -> str:
    """Name of a case, by which its records and random streams are found.

    >>> case_name(12.0), case_name(None)
    ('12.0 dB', 'noise')
    """
    return "noise" if snr_db is None else f"{snr_db} dB"


def roc_plan(
    study: Study,
    *,
    radar: str | None = None,
    kinds: Sequence[str] = (),
    probabilities: Sequence[float] = (),
    snrs_db: Sequence[float],
    trials: int,
    noise_trials: int,
    interferers: Sequence[str] = (),
    strong: float | None = None,
    apart: tuple[float | None, float | None] = (None, None),
) -> RocPlan:
    """Plan of a measurement with a study's radar and receiver; everything is checked here.

    `run_roc` measures it.

    Parameters
    ----------
    radar : name of the tested radar; None for the study's first victim
    kinds : kinds of receivers, with the settings of the study's one; none for that receiver itself
    probabilities : false-alarm probabilities; none for that of the study's receiver
    interferers : names of radars of the study that transmit as well
    strong : power of a second point over that of the tested one, a ratio; None for no such point
    apart : its distance in range, m, and in range rate, m/s; None for `STRONG_CELLS` range cells
        and 0 m/s

    Raises
    ------
    InputError
        A name is unknown, a number is out of bounds, or the receivers' limits leave no room.
    CapabilityError
        A receiver cannot read the radar's ramps.
    PhysicsError
        The radar cannot sample echoes from the receiver's greatest range.
    """
    _need_numbers(snrs_db, trials, noise_trials)
    bare = _bare_study(study, radar, interferers)
    curves: list[Curve] = []
    first = of_trial(bare, 0)
    schedule = schedule_of(first, first.radars[0])
    with _places_of(study, bare):
        _check_interferers(bare)
    for kind in kinds or (study.receiver.kind,):
        receiver = receiver_of_kind(kind, study.receiver)
        with _places_of(study, bare):
            check(replace(_alone(bare), receiver=receiver))
        curves += [Curve(receiver=one) for one in _settings(receiver, schedule, probabilities)]
    if probabilities and not any(math.isfinite(curve.probability) for curve in curves):
        raise InputError(
            f"the receiver '{curves[0].kind}' has no false-alarm probability; leave --pfa out, or "
            "name another receiver"
        )
    _need_different(curves)
    times = sample_times(schedule, bare.radars[0].converter)
    second = None
    if strong is not None:
        cell = max(resolution(curve.receiver, schedule, times).range for curve in curves)
        distance, rate = apart
        second = Strong(
            ratio=strong,
            apart=Extent(STRONG_CELLS * cell if distance is None else distance, rate or 0.0),
        )
    receivers = [curve.receiver for curve in curves]
    window = _window(receivers, schedule, times, array=bare.radars[0].array)
    if second is not None:
        _need_room(second, window)
    return RocPlan(
        study=bare,
        curves=tuple(curves),
        snrs_db=tuple(sorted({round(float(snr), SNR_DIGITS) + 0.0 for snr in snrs_db})),
        trials=trials,
        noise_trials=noise_trials,
        strong=second,
        window=window,
    )


def _need_room(strong: Strong, window: Window) -> None:
    """Refuse a strong point for which some tested points have no room on either side."""
    most = 0.5 * (window.greatest_range - window.least_range)
    if strong.apart.range > most:
        raise InputError(
            f"a strong point {strong.apart.range:.3g} m beside has no room within the receivers' "
            f"range limits; use {most:.3g} m or less, or raise receiver.greatest_range"
        )


def _need_numbers(snrs_db: Sequence[float], trials: int, noise_trials: int) -> None:
    if not 1 <= len(snrs_db) <= MOST_CASES:
        raise InputError(f"there are {len(snrs_db)} SNRs; use 1 to {MOST_CASES}")
    if not all(-100.0 <= snr <= 200.0 for snr in snrs_db):
        raise InputError("an SNR is outside of -100 dB to 200 dB; give a value between them")
    if trials < 1 or noise_trials < 1:
        raise InputError("the number of trials must be 1 or more")


def _need_different(curves: Sequence[Curve]) -> None:
    twice = [curve.label for n, curve in enumerate(curves) if curve in curves[:n]]
    if twice:
        raise InputError(f"the receiver '{twice[0]}' is asked for twice; name it once")


def _bare_study(study: Study, radar: str | None, interferers: Sequence[str]) -> Study:
    """The study with the tested radar first, then the interferers, and with their vehicles only."""
    names = [one.name for one in study.radars]
    tested = radar or (study.victims or names)[0] if names else ""
    for name in (tested, *interferers):
        if name not in names:
            raise InputError(no_such("radar", name, names))
    if tested in interferers or len(set(interferers)) < len(interferers):
        raise InputError(
            f"interferers are other radars than '{tested}', each named once; the study has "
            f"{', '.join(names)}"
        )
    if interferers and isinstance(study.access, FrameRule):
        raise CapabilityError(
            f"access: '{study.access.kind}' acts from frame to frame, and roc measures single "
            "frames; leave --interferer out, or measure detection with 'polychirp study'"
        )
    radars = tuple(study.radars[names.index(name)] for name in (tested, *interferers))
    carriers = {one.vehicle for one in radars}
    vehicles = [one.name for one in study.street.vehicles]
    for carrier in sorted(carriers.difference(vehicles)):
        raise InputError(no_such("vehicle", carrier, vehicles))
    street = replace(
        study.street,
        road=None,
        vehicles=tuple(one for one in study.street.vehicles if one.name in carriers),
        buildings=(),
        trees=(),
        points=(),
    )
    return replace(
        study,
        street=street,
        radars=radars,
        traffic=None,
        victims=(tested,),
        targets=(),
        tracer=FreeSpace(),
        access=_among_all(study),
    )


def _among_all(study: Study) -> AnyAccess | None:
    """The study's rule of access, which gives a radar the same among fewer radars."""
    if study.access is None:
        return None
    names = tuple(one.name for one in study.radars)
    rule = AmongAll(rule=study.access, names=names, heading=tuple(headings(study).tolist()))
    return cast("AnyAccess", rule)


def _alone(study: Study) -> Study:
    """The first trial's study with the tested radar only."""
    tested = study.radars[0]
    vehicles = tuple(one for one in study.street.vehicles if one.name == tested.vehicle)
    street = replace(study.street, vehicles=vehicles)
    return replace(of_trial(study, 0), street=street, radars=(tested,))


def _check_interferers(study: Study) -> None:
    """Refuse radars that `check` refuses; what it notes on targets is not of interest here."""
    if len(study.radars) == 1:
        return
    readable = receiver_of_kind("auto", study.receiver)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        check(replace(of_trial(study, 0), receiver=readable))


@contextmanager
def _places_of(study: Study, bare: Study) -> Iterator[None]:
    """Give the radars in messages the numbers that they have in the study's file."""
    names = [one.name for one in study.radars]
    numbers = [names.index(one.name) for one in bare.radars]
    try:
        yield
    except (InputError, CapabilityError, PhysicsError) as error:
        place = re.compile(r"\bradars\.(\d+)")
        text = place.sub(lambda found: f"radars.{numbers[int(found[1])]}", str(error))
        raise type(error)(text) from None


def of_trial(study: Study, trial: int) -> Study:
    """The study with the seed of a trial."""
    return replace(study, seed=trial_seed(study.seed, trial))


def _settings(
    receiver: AnyReceiver, schedule: RampSchedule, probabilities: Sequence[float]
) -> list[FrameReceiver]:
    """The receiver for these ramps, once for each false-alarm probability if it has one.

    Raises
    ------
    CapabilityError
        The receiver reads subframes one by one, for which there is no ideal detector here.
    """
    chosen = receiver_for(receiver, schedule)
    if isinstance(chosen, RangeDoppler) and has_subframes(schedule):
        raise CapabilityError(
            f"roc does not know the ideal detector of '{chosen.kind}' on subframes, which that "
            "receiver reads one by one; give the waveform equal intervals, or measure detection "
            "with 'polychirp study'"
        )
    if not isinstance(chosen, DetectorSettings):
        return [chosen]
    return [
        replace(chosen, false_alarm_probability=probability)
        for probability in probabilities or (chosen.false_alarm_probability,)
    ]


def _window(
    receivers: Sequence[FrameReceiver],
    schedule: RampSchedule,
    times: SampleTimes,
    *,
    array: AntennaArray,
) -> Window:
    """Limits that all receivers share, less twice their error limits at either end."""
    limits = [error_limits(receiver, schedule, times) for receiver in receivers]
    margin = Extent(*(2.0 * max(values) for values in zip(*limits, strict=True)))
    speed = min(greatest_speed(receiver, schedule, array)[0] for receiver in receivers)
    half = 0.5 * float(schedule.end_time.max() - schedule.start_time.min())
    least = max(receiver.least_range for receiver in receivers) + margin.range
    greatest = min(receiver.greatest_range for receiver in receivers) - margin.range
    if speed <= margin.range_rate:
        raise InputError(
            f"the receivers tell range rates to {speed:.3g} m/s, too few cells for a point; raise "
            "receiver.greatest_speed, or use shorter ramps"
        )
    speed -= margin.range_rate
    if greatest - least <= 2.0 * speed * half:
        raise InputError(
            "the receivers' range limits leave no room for points, which move by up to "
            f"{2.0 * speed * half:.3g} m in a frame; raise receiver.greatest_range"
        )
    return Window(least_range=least, greatest_range=greatest, greatest_speed=speed, half_frame=half)


def as_read(receiver: FrameReceiver, frame: IfFrame) -> IfFrame:
    """The frame as the receiver reads it: decoded if several elements transmit.

    A receiver that separates the elements itself has the frame as it is.
    """
    is_coded = frame.schedule.num_elements > 1 and not decodes_elements(receiver)
    return virtual_array(frame) if is_coded else frame


def silent_frame(plan: RocPlan) -> IfFrame:
    """A frame of the tested radar, in the first trial, whose samples are zero."""
    study = of_trial(plan.study, 0)
    radar = study.radars[0]
    schedule = schedule_of(study, radar)
    times = sample_times(schedule, radar.converter)
    shape = (radar.array.num_channels, schedule.num_ramps, times.most_samples)
    return IfFrame(
        samples=np.zeros(shape, dtype=np.complex128),
        times=times,
        schedule=schedule,
        array=radar.array,
        high_pass=radar.front_end.high_pass,
        if_filter=radar.if_filter,
    )
