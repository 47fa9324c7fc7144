"""What can be said of a study before it runs: whether it can, and what its radars resolve."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from polychirp.channel.materials.library import check_materials, material_table
from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.channel.scene.ground_truth import refuse_radar_inside_body
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.sionna import SionnaRt
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError, ModelWarning, PhysicsError, did_you_mean
from polychirp.model.if_frame import SampleTimes, parts_of, sample_times
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.study.random_draw import drawn
from polychirp.study.size import refuse_too_large
from polychirp.study.spec import (
    Study,
    StudyRadar,
    body_names,
    refresh_times,
    scene_of,
    schedule_of,
    schedules,
    target_names,
    victim_indices,
)
from polychirp.synthesis.impairments.high_pass import refuse_unfollowed

Limits = tuple[float, float]
"""Least and greatest value over the ramps of a frame."""

_BYTES_OF_A_SAMPLE = 16
_SECONDS_OF_A_TRACE = 0.08
_SECONDS_OF_A_SAMPLE = 1e-6
_SECONDS_OF_A_RECEIVER = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class DerivedRadar:
    r"""What follows from one radar's ramps, converter and filter.

    Parameters
    ----------
    name : of the radar
    range_resolution : m, :math:`c/2B` over the ramps
    speed_resolution : m/s, :math:`\lambda/2T_{frame}`
    unambiguous_speed : m/s, :math:`\lambda/4T_{sweep}`, either way, for a transform over equal
        sweeps; sweeps of different length lift this ambiguity
    greatest_range : m, whose beat on the steepest ramp is still in the filter's pass band
    beat_band : Hz, from 0 m to the receiver's greatest range on the steepest ramp
    ramp_duration : s
    frame_duration : s, from the first ramp's start to the last one's end
    num_ramps : in a frame
    samples_per_ramp : number
    samples_per_frame : number, of one channel
    memory : bytes, of the frame and its parts, all channels
    """

    name: str
    range_resolution: Limits
    speed_resolution: float
    unambiguous_speed: float
    greatest_range: float
    beat_band: Limits
    ramp_duration: Limits
    frame_duration: float
    num_ramps: int
    samples_per_ramp: tuple[int, int]
    samples_per_frame: int
    memory: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Derived:
    """What follows from a study that can run.

    Parameters
    ----------
    radars : each, victim or not
    victims : names of the radars whose frames are computed
    targets : names of the targets of each victim
    num_snapshots : how often the scene is traced
    memory : bytes, of all victims' frames and parts
    cost : s on one core, a rough guess: 0.08 s for each snapshot and pair of radars, as measured
        on the paper's street of eight vehicles; 1 µs for each sample; 2 s for each victim's
        receiver. More bodies cost more, and the first run compiles
    """

    radars: tuple[DerivedRadar, ...]
    victims: tuple[str, ...]
    targets: tuple[tuple[str, ...], ...]
    num_snapshots: int
    memory: int
    cost: float


def check(study: Study) -> Derived:
    """Refuse a study that cannot run; say what its radars resolve and what it will cost.

    Nothing is traced or synthesised.

    Raises
    ------
    InputError
        Names do not agree, a ramp is too short for its converter, a radar sits inside a body…;
        every problem is listed with its place. Or the study needs too much memory (`size`).
    PhysicsError
        A receiver asks for ranges whose beats its radar cannot sample.

    Warns
    -----
    ModelWarning
        The tracer gives targets no echo, or a material is used outside its band.
    """
    try:
        if study.seed >= 0:  # others are refused below
            study = drawn(study)
    except InputError as error:
        raise InputError(f"this study cannot run: {study.name}\n  traffic: {error}") from None
    problems = list(_problems(study))
    if problems:
        lines = "\n".join(f"  {place}: {sentence}" for place, sentence in problems)
        raise InputError(f"this study cannot run: {study.name}\n{lines}")
    plans = schedules(study)
    refuse_too_large(study, plans)
    radars = tuple(
        _derived(radar, plan, greatest_range=study.receiver.greatest_range)
        for radar, plan in zip(study.radars, plans, strict=True)
    )
    for number, (radar, derived) in enumerate(zip(study.radars, radars, strict=True)):
        _need_audible(radar, derived, number=number, study=study)
        refuse_unfollowed(radar)
    _warn_of_silent_targets(study)
    victims = [radars[i] for i in victim_indices(study)]
    frames = [plans[i] for i in victim_indices(study)]
    snapshots = int(refresh_times(frames, study.refresh_interval).size)
    return Derived(
        radars=radars,
        victims=tuple(victim.name for victim in victims),
        targets=tuple(target_names(study, study.radars[i]) for i in victim_indices(study)),
        num_snapshots=snapshots,
        memory=sum(victim.memory for victim in victims),
        cost=_SECONDS_OF_A_TRACE * snapshots * len(radars) ** 2
        + sum(
            _SECONDS_OF_A_SAMPLE * victim.memory / _BYTES_OF_A_SAMPLE + _SECONDS_OF_A_RECEIVER
            for victim in victims
        ),
    )


def _warn_of_silent_targets(study: Study) -> None:
    vehicles = {vehicle.name for vehicle in study.street.vehicles}
    silent = sorted(
        vehicles.intersection(
            name for i in victim_indices(study) for name in target_names(study, study.radars[i])
        )
    )
    if silent and not {"facets", "vehicle-points"} & study.tracer.capabilities:
        warnings.warn(
            f"the tracer '{study.tracer.kind}' gives vehicles no echo to rely on, so '{silent[0]}' "
            "may not be found; use the tracer 'composite' or 'point-vehicles', or name points as "
            "targets if it has them",
            ModelWarning,
            stacklevel=3,
        )


def _problems(study: Study) -> Iterator[tuple[str, str]]:
    """Place and sentence of everything that keeps a study from running."""
    yield from _plain_problems(study)
    names_agree = True
    for problem in _name_problems(study):
        names_agree = False
        yield problem
    if study.num_sweeps >= 1 and study.seed >= 0:
        for number, radar in enumerate(study.radars):
            yield from _ramp_problems(study, radar, number=number)
    if names_agree:
        yield from _street_problems(study)


def _plain_problems(study: Study) -> Iterator[tuple[str, str]]:
    if not study.name.strip() or set(study.name) & set("/\\\0"):
        yield "name", "must have a character, and no slash: results are stored under it"
    if study.seed < 0:
        yield "seed", f"is {study.seed}; use 0 or more"
    if study.num_sweeps < 1:
        yield "num_sweeps", f"is {study.num_sweeps}, so the frame is empty; use 1 or more"
    if not study.refresh_interval > 0:
        yield "refresh_interval", f"is {study.refresh_interval:g} s; use more than 0 s"


def _name_problems(study: Study) -> Iterator[tuple[str, str]]:
    vehicles = [vehicle.name for vehicle in study.street.vehicles]
    bodies = list(body_names(study.street))
    radars = [radar.name for radar in study.radars]
    if not radars:
        yield "radars", "there is none; write at least one [[radars]] table"
        return
    yield from _twice(radars, "radars.{}.name", "another radar has")
    for number, radar in enumerate(study.radars):
        yield from _unknown([radar.vehicle], vehicles, f"radars.{number}.vehicle", "vehicle")
    for number, name in enumerate(study.victims):
        yield from _unknown([name], radars, f"victims.{number}", "radar")
    for number, name in enumerate(study.targets):
        yield from _unknown([name], bodies, f"targets.{number}", "vehicle or point")
    yield from _twice(study.victims, "victims.{}", "the list already has")
    yield from _twice(study.targets, "targets.{}", "the list already has")


def _twice(names: list[str] | tuple[str, ...], place: str, who: str) -> Iterator[tuple[str, str]]:
    for number, name in enumerate(names):
        if name in names[:number]:
            yield place.format(number), f"{who} the name '{name}'; give each its own"


def _unknown(
    names: list[str], known: list[str], place: str, what: str
) -> Iterator[tuple[str, str]]:
    for name in names:
        if name not in known:
            hint = did_you_mean(name, known) if known else "the street has none"
            yield place, f"there is no {what} '{name}'; {hint}"


def _ramp_problems(study: Study, radar: StudyRadar, *, number: int) -> Iterator[tuple[str, str]]:
    try:
        sample_times(schedule_of(study, radar), radar.converter)
    except InputError as error:
        yield f"radars.{number}.waveform", str(error)


def _street_problems(study: Study) -> Iterator[tuple[str, str]]:
    """What is wrong with bodies and places, once all names agree."""
    is_built = True
    for number, vehicle in enumerate(study.street.vehicles):
        try:
            vehicle.surface()
        except InputError as error:
            is_built = False
            field = "" if vehicle.mesh is None else ".mesh"
            yield f"street.vehicles.{number}{field}", str(error)
    if not is_built:
        return
    try:
        scene = scene_of(study)
    except InputError as error:
        yield "street", str(error)
        return
    for number in range(len(scene.radars)):
        try:
            refuse_radar_inside_body(_with_only_radar(scene, number))
        except InputError as error:
            yield f"radars.{number}.mount", str(error)
    if isinstance(study.tracer, Composite | PointVehicles | SionnaRt):
        yield from _material_problems(scene, study.tracer)


def _with_only_radar(scene: Scene, number: int) -> Scene:
    return replace(scene, radars=(scene.radars[number],), carriers=(scene.carriers[number],))


def _material_problems(
    scene: Scene, tracer: Composite | PointVehicles | SionnaRt
) -> Iterator[tuple[str, str]]:
    table = material_table({row.name: row for row in tracer.materials})
    for actor in scene.actors:
        names = {*actor.mesh.materials, *(plate.material for plate in actor.plates)}
        try:
            check_materials(names, table, tracer.frequency)
        except InputError as error:
            yield "street", f"'{actor.name}' cannot be traced: {error}"


def _derived(radar: StudyRadar, plan: RampSchedule, *, greatest_range: float) -> DerivedRadar:
    times = sample_times(plan, radar.converter)
    wavelength = SPEED_OF_LIGHT / float(np.mean(plan.centre_frequency))
    frame_duration = float(plan.end_time[-1] - plan.start_time[0])
    num_sweeps = int(plan.sweep[-1]) + 1
    steepest = float(np.max(np.abs(plan.slope)))
    resolution = SPEED_OF_LIGHT / (2.0 * plan.bandwidth)
    return DerivedRadar(
        name=radar.name,
        range_resolution=(float(resolution.min()), float(resolution.max())),
        speed_resolution=wavelength / (2.0 * frame_duration),
        unambiguous_speed=wavelength * num_sweeps / (4.0 * frame_duration),
        greatest_range=SPEED_OF_LIGHT * radar.if_filter.passband / (2.0 * steepest),
        beat_band=(0.0, 2.0 * steepest * greatest_range / SPEED_OF_LIGHT),
        ramp_duration=(float(plan.duration.min()), float(plan.duration.max())),
        frame_duration=frame_duration,
        num_ramps=plan.num_ramps,
        samples_per_ramp=(int(times.num_samples.min()), times.most_samples),
        samples_per_frame=int(times.num_samples.sum()),
        memory=_memory(times, radar),
    )


def _memory(times: SampleTimes, radar: StudyRadar) -> int:
    """Bytes of samples and parts, padding included."""
    padded = radar.array.num_channels * times.num_samples.size * times.most_samples
    return padded * (1 + len(parts_of(radar))) * _BYTES_OF_A_SAMPLE


def _need_audible(radar: StudyRadar, derived: DerivedRadar, *, number: int, study: Study) -> None:
    limit = min(radar.if_filter.stopband, 0.5 * radar.converter.sample_rate)
    if derived.beat_band[1] > limit:
        raise PhysicsError(
            f"radars.{number}: echoes from {study.receiver.greatest_range:g} m, the receiver's "
            f"greatest range, beat at {derived.beat_band[1] / 1e3:.4g} kHz on the steepest ramp, "
            f"and '{radar.name}' samples no more than {limit / 1e3:.4g} kHz; use slower ramps, "
            "less bandwidth, a smaller range or a faster converter"
        )
