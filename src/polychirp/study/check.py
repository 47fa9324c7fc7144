"""Check of a study before it runs: its problems, and the resolution of its radars."""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from polychirp.errors import InputError, ModelWarning
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.selection import refuse_real_samples
from polychirp.study.limits.access import access_in_vain, refuse_long_frames
from polychirp.study.limits.beams import gains_beyond_beams
from polychirp.study.limits.derived_radar import DerivedRadar, derived_radar
from polychirp.study.limits.frames import refuse_undersampled, refuse_unread, refuse_unrepaired
from polychirp.study.limits.interferers import silent_radars
from polychirp.study.limits.power import PointEcho, point_echoes
from polychirp.study.limits.problems import problems
from polychirp.study.limits.radios import (
    excessive_powers,
    folded_beats,
    idle_elements,
    implausible_carriers,
    implausible_mounts,
    implausible_noise,
)
from polychirp.study.limits.receivers import (
    ambiguous_arrays,
    limits_of_paper_receiver,
    long_guards,
    motion_within_blocks,
    open_speeds,
)
from polychirp.study.limits.size import SAMPLE_BYTES, refuse_too_large
from polychirp.study.limits.targets import targets_out_of_reach, targets_without_echo
from polychirp.study.random_draw import sample_street
from polychirp.study.spec import Study, refresh_times, schedules_of, target_names, victim_indices
from polychirp.synthesis.impairments.high_pass import refuse_unfollowed

# the sources of the times are in `Derived.cost`
_SECONDS_TO_BEGIN = 2.0
_SECONDS_OF_KERNELS = 5.0
_SECONDS_OF_A_VEHICLE = 1.0
_SECONDS_OF_A_TRACE = 0.08
_SECONDS_OF_A_SAMPLE = 1e-6
_SECONDS_OF_A_RECEIVER = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Derived:
    """Resolution, size and cost of a study that can run.

    `check` returns it.

    Parameters
    ----------
    radars : every radar, victim or not
    victims : names of the radars whose frames are computed
    targets : names of the targets of each victim
    echoes : SNRs of the points that are targets of each victim, by the radar equation
    notes : sentences about values that are used as they are, such as gains that an antenna of the
        given beam cannot have
    num_snapshots : number of times for which the paths are computed
    is_receiver_chosen : True if the receiver "auto" chose the kind of every radar's receiver
    memory : bytes of the samples of all victims' frames and of their parts
    cost : s on one core, a rough estimate: 2 s to begin; with a tracer of facets 5 s for its
        kernels and 1 s for each vehicle; 0.08 s for each snapshot and pair of radars, as measured
        on the paper's street of eight vehicles; 1 µs for each sample; 2 s for each victim's
        receiver. A street with more bodies takes longer, and so does the first run, which compiles
        the kernels
    """

    radars: tuple[DerivedRadar, ...]
    victims: tuple[str, ...]
    targets: tuple[tuple[str, ...], ...]
    echoes: tuple[PointEcho, ...]
    notes: tuple[str, ...]
    num_snapshots: int
    is_receiver_chosen: bool
    memory: int
    cost: float


def check(study: Study) -> Derived:
    """Refuse a study that cannot run; return what its radars resolve and what it costs.

    Nothing is traced or synthesised.

    `run_trial` runs the study.

    Raises
    ------
    InputError
        Names do not agree, a ramp is too short for its converter, a radar sits inside a body…;
        every problem is listed with its place. Or the study needs too much memory (`limits.size`).
    PhysicsError
        The beats of a victim's echoes from the receiver's greatest range are above the edge of the
        IF filter's stop band, or above half the sample rate.
    CapabilityError
        The elements of a victim's array cannot be told apart, or its receiver cannot read its ramps
        or real samples, or its receiver or estimator of angles cannot read the array.

    Warns
    -----
    ModelWarning
        The tracer gives targets no echo, a material is used outside its band, ramps are too short
        for the guard of the receiver's mitigation, an array is ambiguous in its elements' beam,
        transmitting elements are idle, or separated as if targets were at rest, a rule of access
        does not keep radars apart, a radar cannot disturb a victim, a target is out of reach,
        behind the radar or too fast for the receiver, beats that real samples fold are not filtered
        out, or a carrier, a power, a noise figure or a mount is implausible.
    """
    try:
        if study.seed >= 0:  # `problems` reports a negative seed
            study = sample_street(study)
    except InputError as error:
        raise InputError(f"this study cannot run: {study.name}\n  traffic: {error}") from None
    found = list(problems(study))
    if found:
        lines = "\n".join(f"  {place}: {sentence}" for place, sentence in found)
        raise InputError(f"this study cannot run: {study.name}\n{lines}")
    schedules = schedules_of(study)
    refuse_too_large(study, schedules)
    refuse_long_frames(study, schedules)
    radars = tuple(
        derived_radar(radar, schedule, study.receiver)
        for radar, schedule in zip(study.radars, schedules, strict=True)
    )
    _refuse_frames(study, schedules, radars)
    for sentence in _cautions(study, schedules, radars):
        warnings.warn(sentence, ModelWarning, stacklevel=2)
    return _derived(study, schedules, radars)


def _refuse_frames(
    study: Study, schedules: Sequence[RampSchedule], radars: Sequence[DerivedRadar]
) -> None:
    """Refuse victims that cannot sample their echoes, or whose frames cannot be read.

    Nothing is asked of the converters of other radars, whose samples nobody computes.
    """
    for number in victim_indices(study):
        radar, schedule = study.radars[number], schedules[number]
        is_real = radar.converter.is_real
        refuse_undersampled(study, radar, radars[number], number=number)
        refuse_unfollowed(radar)
        refuse_unread(study, schedule, number=number)
        refuse_unrepaired(study, schedule, number=number)
        if is_real:
            refuse_real_samples(study.receiver, schedule, radar=radar.name)


def _cautions(
    study: Study, schedules: Sequence[RampSchedule], radars: Sequence[DerivedRadar]
) -> Iterator[str]:
    """Sentences about what runs, but hardly is meant, or is computed in part only."""
    for number in victim_indices(study):
        yield from folded_beats(study.radars[number], radars[number])
    yield from implausible_carriers(study, schedules)
    yield from excessive_powers(study)
    yield from implausible_mounts(study)
    yield from implausible_noise(study)
    yield from targets_without_echo(study)
    yield from limits_of_paper_receiver(study, schedules)
    yield from long_guards(study, schedules)
    yield from ambiguous_arrays(study, schedules)
    yield from motion_within_blocks(study, schedules)
    yield from open_speeds(study, schedules)
    yield from idle_elements(study, schedules)
    yield from access_in_vain(study, schedules)
    yield from silent_radars(study, schedules)
    yield from targets_out_of_reach(study, schedules)


def _derived(
    study: Study, schedules: Sequence[RampSchedule], radars: tuple[DerivedRadar, ...]
) -> Derived:
    victims = [radars[i] for i in victim_indices(study)]
    frames = [schedules[i] for i in victim_indices(study)]
    times = refresh_times(frames, study.refresh_interval, least=study.least_traced_time)
    return Derived(
        radars=radars,
        victims=tuple(victim.name for victim in victims),
        targets=tuple(target_names(study, study.radars[i]) for i in victim_indices(study)),
        echoes=tuple(
            echo
            for i in victim_indices(study)
            for echo in point_echoes(study, schedules[i], number=i)
        ),
        notes=tuple(gains_beyond_beams(study)),
        num_snapshots=int(times.size),
        is_receiver_chosen=study.receiver.kind == "auto",
        memory=sum(victim.memory for victim in victims),
        cost=_SECONDS_TO_BEGIN
        + _preparation(study)
        + _SECONDS_OF_A_TRACE * times.size * len(radars) ** 2
        + sum(
            _SECONDS_OF_A_SAMPLE * victim.memory / SAMPLE_BYTES + _SECONDS_OF_A_RECEIVER
            for victim in victims
        ),
    )


def _preparation(study: Study) -> float:
    """Time in which a tracer of facets loads its kernels and prepares the vehicles, s."""
    if "facets" not in study.tracer.capabilities:
        return 0.0
    return _SECONDS_OF_KERNELS + _SECONDS_OF_A_VEHICLE * len(study.street.vehicles)
