"""Check of a study before it runs: its problems, and the resolution of its radars."""

import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.base import AtFrequency
from polychirp.channel.materials.library import check_materials, material_table
from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.channel.scene.ground_truth import refuse_radar_inside_body
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.sionna import SionnaRt, refuse_untraceable
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import (
    CapabilityError,
    InputError,
    ModelWarning,
    PhysicsError,
    did_you_mean,
)
from polychirp.model.if_frame import SampleTimes, parts_of, sample_times
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.angle.ambiguity import Window, ambiguities, unambiguous_window
from polychirp.receiver.angle.beams import too_large
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.mitigation.base import refuse_unfit
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.subframes import (
    has_subframes,
    ramps_of,
    subframes,
    unambiguous_span,
)
from polychirp.receiver.range_doppler.transforms import MOST_UNEVEN
from polychirp.receiver.selection import (
    AnyReceiver,
    FrameReceiver,
    angle_estimator,
    readable_elements,
    reason_of_choice,
    receiver_for,
    refuse_real_samples,
    refuse_unreadable,
    refuse_unsampled,
)
from polychirp.receiver.signal_model.equal_ramps import unequal
from polychirp.receiver.signal_model.transmit_codes import code_blocks, virtual_channels
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.receiver.stepped.staircase import unreadable as unstepped
from polychirp.study.access_limits import access_in_vain, refuse_long_frames
from polychirp.study.random_draw import sample_street
from polychirp.study.size import refuse_too_large
from polychirp.study.spec import (
    Study,
    StudyRadar,
    body_names,
    refresh_times,
    scene_of,
    schedule_of,
    schedules_of,
    target_names,
    tracer_of,
    victim_indices,
)
from polychirp.study.target_limits import targets_out_of_reach
from polychirp.synthesis.impairments.high_pass import refuse_unfollowed

Limits = tuple[float, float]
"""Least and greatest value over the ramps of a frame."""

FARTHEST_MOUNT: Final = 1.0
"""Greatest distance of a radar from its vehicle, m, without a warning; chosen."""

FARTHEST_CARRIER: Final = 0.04
"""Greatest difference of a carrier from the tracer's frequency, relative, without a warning.
Chosen: powers of points are then right to 0.35 dB."""

CARRIERS: Final = (10e9, 300e9)
"""Least and greatest carrier, Hz, without a warning; chosen."""

GREATEST_GUARD: Final = 0.1
"""Greatest guard of a mitigation, as a share of the shortest ramp, without a warning. Chosen: with
a longer guard on either side, each burst removes more than a fifth of a ramp."""

# a complex128 sample; the sources of the times are in `Derived.cost`
_BYTES_OF_A_SAMPLE = 16
_SECONDS_TO_BEGIN = 2.0
_SECONDS_OF_KERNELS = 5.0
_SECONDS_OF_A_VEHICLE = 1.0
_SECONDS_OF_A_TRACE = 0.08
_SECONDS_OF_A_SAMPLE = 1e-6
_SECONDS_OF_A_RECEIVER = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class DerivedRadar:
    r"""Resolution, limits and size of the frame of one radar.

    Parameters
    ----------
    name : name of the radar
    range_resolution : m, :math:`c/2B` with the bandwidth B of the sampled part of each ramp
    speed_resolution : m/s, :math:`\lambda/2T_{frame}`
    unambiguous_speed : m/s, greatest speed, approaching or receding, that a Doppler transform over
        equal sweeps of the same transmitting elements gives without ambiguity:
        :math:`\lambda/4NT`. T is the interval from sweep to sweep, and N the number of sweeps after
        which the elements' code repeats, so that NT is the repetition interval of one transmitter;
        in subframes, it is the greatest speed that all of them tell apart together; of the
        receiver of MFSK, the speed up to which no two targets within its ranges look alike
    unfolded_speed : m/s, greatest speed that the receiver reports as it is: that with N = 1 if it
        is the range-Doppler receiver and tells the speeds that a code leaves open apart, by empty
        bands of the code or by the beams of the virtual array, else ``unambiguous_speed``
    code : number of sweeps after which the code of the transmitting elements repeats, and number of
        the elements; with Doppler division, the bands that their difference leaves are empty
    has_subframes : True if the range-Doppler receiver reads the frame in subframes, which tell
        speeds up to ``unambiguous_speed`` together
    has_equal_sweeps : True if all sweeps are equal; with different sweeps, speeds above
        ``unambiguous_speed`` can be told apart
    greatest_range : m, range whose beat on the steepest ramp is at the edge of the IF filter's pass
        band; of a coded carrier, the range after which echoes repeat; of steps, the range whose
        echo of a step arrives when the converter starts
    beat_band : Hz, beats of echoes from 0 m and from the receiver's greatest range, on the steepest
        ramp
    ramp_duration : s
    frame_duration : s, from the first ramp's start to the last one's end
    azimuth_window, elevation_window : rad, greatest azimuth and elevation to either side that the
        virtual array tells apart (`angle.ambiguity.unambiguous_window`); None if it does not
        measure them
    chips_per_ramp : number of chips within a ramp, with repetitions; 0 without a code
    peak_to_average : ratio of the greatest to the mean power while a ramp lasts
    receiver : kind of the receiver of its frame
    receiver_reason : why `AutoReceiver` chose it, as the end of a sentence
    num_ramps : in a frame
    samples_per_ramp : number, of one channel
    samples_per_frame : number, of one channel
    sampling : "complex" or "real" samples
    memory : bytes of the samples of the frame and of its parts (echo, noise and so on), in all
        channels
    """

    name: str
    range_resolution: Limits
    speed_resolution: float
    unambiguous_speed: float
    unfolded_speed: float
    code: tuple[int, int]
    has_equal_sweeps: bool
    has_subframes: bool
    greatest_range: float
    beat_band: Limits
    ramp_duration: Limits
    frame_duration: float
    azimuth_window: float | None
    elevation_window: float | None
    chips_per_ramp: int
    peak_to_average: float
    receiver: str
    receiver_reason: str
    num_ramps: int
    samples_per_ramp: tuple[int, int]
    samples_per_frame: int
    sampling: str
    memory: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Derived:
    """Resolution, size and cost of a study that can run.

    `check` returns it.

    Parameters
    ----------
    radars : every radar, victim or not
    victims : names of the radars whose frames are computed
    targets : names of the targets of each victim
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
        every problem is listed with its place. Or the study needs too much memory (`study.size`).
    PhysicsError
        The beats of echoes from the receiver's greatest range are above the edge of the IF filter's
        stop band, or above half the sample rate.
    CapabilityError
        The elements of a victim's array cannot be told apart, or its receiver cannot read its ramps
        or real samples, or its receiver or estimator of angles cannot read the array.

    Warns
    -----
    ModelWarning
        The tracer gives targets no echo, a material is used outside its band, ramps are too short
        for the guard of the receiver's mitigation, an array is ambiguous
        in its elements' beam, transmitting elements are idle, a rule of access does not keep
        radars apart, a target is out of reach or too fast for the receiver, beats that
        real samples fold are not filtered out, or a carrier or a mount is implausible.
    """
    try:
        if study.seed >= 0:  # `_problems` reports a negative seed
            study = sample_street(study)
    except InputError as error:
        raise InputError(f"this study cannot run: {study.name}\n  traffic: {error}") from None
    problems = list(_problems(study))
    if problems:
        lines = "\n".join(f"  {place}: {sentence}" for place, sentence in problems)
        raise InputError(f"this study cannot run: {study.name}\n{lines}")
    schedules = schedules_of(study)
    refuse_too_large(study, schedules)
    refuse_long_frames(study, schedules)
    radars = tuple(
        _derived(radar, schedule, study.receiver)
        for radar, schedule in zip(study.radars, schedules, strict=True)
    )
    for number, (radar, derived) in enumerate(zip(study.radars, radars, strict=True)):
        _need_audible(radar, derived, number=number, study=study)
        refuse_unfollowed(radar)
    for number in victim_indices(study):
        _need_readable(study, schedules[number], number=number)
        radar = study.radars[number]
        refuse_unfit(
            study.receiver.mitigation,
            schedules[number],
            is_real=radar.converter.is_real,
            num_channels=radar.array.num_channels,
        )
        if radar.converter.is_real:
            refuse_real_samples(study.receiver, schedules[number], radar=radar.name)
            _warn_of_folded_beats(radar, radars[number])
    _warn_of_carriers(study, schedules)
    _warn_of_mounts(study)
    _warn_of_targets_without_echo(study)
    _warn_of_receiver(study, schedules)
    _warn_of_ambiguity(study, schedules)
    _warn_of_open_speeds(study, schedules)
    _warn_of_settings_in_vain(study, schedules)
    victims = [radars[i] for i in victim_indices(study)]
    frames = [schedules[i] for i in victim_indices(study)]
    times = refresh_times(frames, study.refresh_interval, least=study.least_traced_time)
    snapshots = int(times.size)
    return Derived(
        radars=radars,
        victims=tuple(victim.name for victim in victims),
        targets=tuple(target_names(study, study.radars[i]) for i in victim_indices(study)),
        num_snapshots=snapshots,
        is_receiver_chosen=study.receiver.kind == "auto",
        memory=sum(victim.memory for victim in victims),
        cost=_SECONDS_TO_BEGIN
        + _preparation(study)
        + _SECONDS_OF_A_TRACE * snapshots * len(radars) ** 2
        + sum(
            _SECONDS_OF_A_SAMPLE * victim.memory / _BYTES_OF_A_SAMPLE + _SECONDS_OF_A_RECEIVER
            for victim in victims
        ),
    )


def _preparation(study: Study) -> float:
    """Time in which a tracer of facets loads its kernels and prepares the vehicles, s."""
    if "facets" not in study.tracer.capabilities:
        return 0.0
    return _SECONDS_OF_KERNELS + _SECONDS_OF_A_VEHICLE * len(study.street.vehicles)


def _warn_of_settings_in_vain(study: Study, schedules: Sequence[RampSchedule]) -> None:
    """Warn of elements that never send, rules that keep nobody apart, and targets out of reach."""
    for sentence in (
        *_idle_elements(study, schedules),
        *access_in_vain(study, schedules),
        *targets_out_of_reach(study, schedules),
    ):
        warnings.warn(sentence, ModelWarning, stacklevel=3)


def _idle_elements(study: Study, schedules: Sequence[RampSchedule]) -> Iterator[str]:
    """A sentence for each radar of whose transmitting elements the waveform drives only some."""
    for radar, schedule in zip(study.radars, schedules, strict=True):
        number, driven = radar.array.num_transmitters, schedule.num_elements
        if driven < number:
            yield (
                f"'{radar.name}' has {number} transmitting elements, of which {driven} "
                f"{'sends' if driven == 1 else 'send'}; give it a coding, such as coding.kind = "
                "'time-division', or fewer elements"
            )


def _warn_of_carriers(study: Study, schedules: Sequence[RampSchedule]) -> None:
    """Warn of a carrier far from those of automotive radars, or from the tracer's frequency."""
    (least, most), tracer = CARRIERS, tracer_of(study, schedules)
    # a tracer of the caller's own may have no frequency
    traced = tracer.carrier if isinstance(tracer, AtFrequency) else math.nan
    for radar, schedule in zip(study.radars, schedules, strict=True):
        carrier = float(np.mean(schedule.centre_frequency))
        if not least <= carrier <= most:
            warnings.warn(
                f"'{radar.name}' transmits at {1e-9 * carrier:.3g} GHz, and radars on the road at "
                "24 to 81 GHz; check the unit of its start_frequency",
                ModelWarning,
                stacklevel=3,
            )
        elif abs(carrier / traced - 1.0) > FARTHEST_CARRIER:
            level = 20.0 * math.log10(carrier / traced)
            warnings.warn(
                f"'{radar.name}' transmits at {1e-9 * carrier:.3g} GHz, and powers are those at "
                f"{1e-9 * traced:.3g} GHz: echoes of points are wrong by {level:+.1f} dB; set "
                "tracer.frequency to the carrier of the radars that matter",
                ModelWarning,
                stacklevel=3,
            )


def _warn_of_mounts(study: Study) -> None:
    """Warn of a radar far from its vehicle, such as one at 20 m instead of 2.0 m."""
    vehicles = {vehicle.name: vehicle for vehicle in study.street.vehicles}
    for radar in study.radars:
        vertex, place = vehicles[radar.vehicle].surface().vertex, radar.mount.position
        gap = float(np.linalg.norm(np.clip(place, vertex.min(axis=0), vertex.max(axis=0)) - place))
        if gap > FARTHEST_MOUNT:
            warnings.warn(
                f"'{radar.name}' is {gap:.3g} m away from '{radar.vehicle}', on which it rides; "
                "check its mount",
                ModelWarning,
                stacklevel=3,
            )


def _warn_of_targets_without_echo(study: Study) -> None:
    vehicles = {vehicle.name for vehicle in study.street.vehicles}
    names = sorted(
        vehicles.intersection(
            name for i in victim_indices(study) for name in target_names(study, study.radars[i])
        )
    )
    if names and not {"facets", "vehicle-points"} & study.tracer.capabilities:
        warnings.warn(
            f"the tracer '{study.tracer.kind}' computes no reliable echo of vehicles, so "
            f"'{names[0]}' may not be found; use the tracer 'composite' or 'point-vehicles', or "
            "name points as targets if it has them",
            ModelWarning,
            stacklevel=3,
        )


def _warn_of_receiver(study: Study, schedules: Sequence[RampSchedule]) -> None:
    """Warn of victims whose ramps do not suit the receiver or its mitigation."""
    for number in victim_indices(study):
        radar, schedule = study.radars[number], schedules[number]
        receiver = receiver_for(study.receiver, schedule)
        if isinstance(receiver, PaperReceiver):
            warnings.warn(_limits_of_paper_receiver(schedule), ModelWarning, stacklevel=3)
        mitigation = study.receiver.mitigation
        shortest = float(schedule.duration.min())
        if not isinstance(mitigation, BurstRepair):
            continue
        guard = mitigation.guard_time(radar.converter.sample_rate)
        if guard > GREATEST_GUARD * shortest:
            warnings.warn(
                f"the guard of the mitigation '{mitigation.kind}' is {1e6 * guard:.3g} µs, and "
                f"the shortest ramp of '{radar.name}' lasts {1e6 * shortest:.3g} µs, so that "
                "each burst takes much of a ramp; set receiver.mitigation.guard to "
                f"'{1e6 * GREATEST_GUARD * shortest:.2g} us' or less",
                ModelWarning,
                stacklevel=3,
            )


def _warn_of_folded_beats(radar: StudyRadar, derived: DerivedRadar) -> None:
    """Warn of real samples in which echoes from beyond the receiver's ranges appear within them."""
    rate, stopband = radar.converter.sample_rate, radar.if_filter.stopband
    needed = stopband + derived.beat_band[1]
    if rate < needed:
        warnings.warn(
            f"'{radar.name}' takes {rate / 1e6:.4g} million real samples per second, so that beats "
            f"above {rate / 2e6:.4g} MHz, which its IF filter passes up to {stopband / 1e6:.4g} "
            "MHz, fold on those of nearer echoes; set its converter.sample_rate to "
            f"'{math.ceil(needed / 1e5) / 10:g} MS/s' or more, or lower if_filter.stopband",
            ModelWarning,
            stacklevel=3,
        )


def _limits_of_paper_receiver(schedule: RampSchedule) -> str:
    r"""A sentence on what the paper's receiver does with these ramps.

    A target at range rate v appears :math:`v f/b` away from its range, on ramps of different f/b at
    different places, and moves by v T during the frame. Averaged, it is spread over more than the
    cell c/2B if v exceeds :math:`(c/2B)/(\max f/b - \min f/b + T)`.
    """
    coupling = schedule.centre_frequency / np.abs(schedule.slope)
    frame = float(schedule.end_time[-1] - schedule.start_time[0])
    cell = SPEED_OF_LIGHT / (2.0 * float(np.max(schedule.bandwidth)))
    speed = cell / (float(np.ptp(coupling)) + frame)
    return (
        "the receiver 'paper' serves for comparison: noise alone exceeds its threshold, the mean "
        "of the profile, in every frame, and it spreads a target faster than "
        f"{_kmh(speed)} over several range cells, as it averages over sweeps; "
        "'coherent' does neither"
    )


def _kmh(speed: float) -> str:
    """The speed to two digits in km/h."""
    return f"{float(f'{3.6 * speed:.2g}'):g} km/h"


def _doppler_cell(schedule: RampSchedule) -> float:
    """Speed at which an echo's phase changes by one cycle over the frame, m/s."""
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    return wavelength / (2.0 * float(schedule.end_time[-1] - schedule.start_time[0]))


def _speed_resolution(schedule: RampSchedule, reader: object) -> float:
    """Doppler cell, m/s, of the ramps that the receiver transforms together."""
    if isinstance(reader, RangeDoppler) and has_subframes(schedule):
        return min(_doppler_cell(ramps_of(schedule, part)) for part in subframes(schedule))
    return _doppler_cell(schedule)


def _problems(study: Study) -> Iterator[tuple[str, str]]:
    """Place and description of every problem that prevents a study from running."""
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
    if not study.least_traced_time >= 0:
        yield "least_traced_time", f"is {study.least_traced_time:g} s; use 0 s or more"


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
    """Problems of bodies and positions, for a study whose names agree."""
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
    for number, (radar, carrier) in enumerate(zip(scene.radars, scene.carriers, strict=True)):
        try:
            refuse_radar_inside_body(replace(scene, radars=(radar,), carriers=(carrier,)))
        except InputError as error:
            yield f"radars.{number}.mount", str(error)
    try:
        tracer = tracer_of(study, schedules_of(study))
    except InputError:  # ramps that cannot be are told by their radars' problems
        return
    if isinstance(tracer, Composite | PointVehicles | SionnaRt):
        yield from _material_problems(scene, tracer)
    if isinstance(tracer, SionnaRt):
        try:
            refuse_untraceable(scene)
        except CapabilityError as error:
            yield "tracer", str(error)


def _material_problems(
    scene: Scene, tracer: Composite | PointVehicles | SionnaRt
) -> Iterator[tuple[str, str]]:
    table = material_table({row.name: row for row in tracer.materials})
    for actor in scene.actors:
        names = {*actor.mesh.materials, *(plate.material for plate in actor.plates)}
        try:
            check_materials(names, table, tracer.carrier)
        except InputError as error:
            yield "street", f"'{actor.name}' cannot be traced: {error}"


def _derived(radar: StudyRadar, schedule: RampSchedule, receiver: AnyReceiver) -> DerivedRadar:
    times = sample_times(schedule, radar.converter)
    chosen = receiver_for(receiver, schedule)
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    frame_duration = float(schedule.end_time[-1] - schedule.start_time[0])
    num_sweeps = int(schedule.sweep[-1]) + 1
    steepest = float(np.max(np.abs(schedule.slope)))
    resolution = SPEED_OF_LIGHT / (2.0 * _sampled_band(schedule, times))
    reader = chosen.reader() if isinstance(chosen, Decoding) else chosen
    code = _code_length(schedule), schedule.num_elements
    is_unfolded = isinstance(reader, RangeDoppler) and _tells_folds(reader, schedule, radar)
    place, _ = virtual_channels(radar.array, schedule.num_elements)
    elements = Elements.of(place, frequency=SPEED_OF_LIGHT / wavelength)
    window = Window(None, None)  # of an array whose lobes would take too long to find
    if not too_large(elements):
        window = unambiguous_window(elements, estimator=angle_estimator(chosen))
    return DerivedRadar(
        name=radar.name,
        range_resolution=(float(resolution.min()), float(resolution.max())),
        speed_resolution=_speed_resolution(schedule, reader),
        unambiguous_speed=_unambiguous_speed(schedule, reader, code[0]),
        unfolded_speed=_unambiguous_speed(schedule, reader, 1 if is_unfolded else code[0]),
        code=code,
        has_equal_sweeps=_has_equal_sweeps(schedule, num_sweeps),
        has_subframes=isinstance(reader, RangeDoppler) and has_subframes(schedule),
        greatest_range=_greatest_range(radar, schedule),
        beat_band=(0.0, 2.0 * steepest * receiver.greatest_range / SPEED_OF_LIGHT),
        ramp_duration=(float(schedule.duration.min()), float(schedule.duration.max())),
        frame_duration=frame_duration,
        azimuth_window=window.azimuth,
        elevation_window=window.elevation,
        chips_per_ramp=_num_chips(schedule),
        peak_to_average=1.0 if schedule.code is None else 1.0 / schedule.code.mean_power,
        receiver=chosen.kind,
        receiver_reason=reason_of_choice(schedule),
        num_ramps=schedule.num_ramps,
        samples_per_ramp=(int(times.num_samples.min()), times.most_samples),
        samples_per_frame=int(times.num_samples.sum()),
        sampling=radar.converter.sampling,
        memory=_memory(times, radar),
    )


def _sampled_band(schedule: RampSchedule, times: SampleTimes) -> FloatArray:
    """Width of the band over which each ramp is sampled, Hz ``(ramp,)``.

    Of a coded carrier, it is the band of the chips, or that of the samples if that is less; of
    steps, the band of all.
    """
    if schedule.is_stepped:
        return schedule.resolving_bandwidth
    swept = np.abs(schedule.slope) * times.num_samples / times.rate
    is_flat = schedule.slope == 0.0
    return np.where(is_flat, np.minimum(schedule.bandwidth, times.rate), swept)


def _greatest_range(radar: StudyRadar, schedule: RampSchedule) -> float:
    """See `DerivedRadar.greatest_range`."""
    steepest = float(np.max(np.abs(schedule.slope)))
    if steepest == 0.0 and schedule.code is not None:
        return 0.5 * SPEED_OF_LIGHT * float(np.min(schedule.code.repetition))
    if schedule.is_stepped:
        return 0.5 * SPEED_OF_LIGHT * radar.converter.start
    return SPEED_OF_LIGHT * radar.if_filter.passband / (2.0 * steepest)


def _num_chips(schedule: RampSchedule) -> int:
    """Greatest number of chips within a ramp, 0 without a code."""
    if schedule.code is None:
        return 0
    return round(float(np.max(schedule.duration / schedule.code.chip_duration)))


def _unambiguous_speed(schedule: RampSchedule, receiver: FrameReceiver, code_length: int) -> float:
    """See `DerivedRadar`; ``code_length`` is that of a code whose folds are not told apart."""
    if isinstance(receiver, MfskReceiver):
        return 0.0 if unstepped(schedule) else receiver.unambiguous_speed(schedule)
    if isinstance(receiver, RangeDoppler) and has_subframes(schedule):
        return 0.5 * unambiguous_span(schedule, code_length=code_length)
    wavelength = SPEED_OF_LIGHT / float(np.mean(schedule.centre_frequency))
    return wavelength / (4.0 * _sweep_interval(schedule) * code_length)


def _sweep_interval(schedule: RampSchedule) -> float:
    """Mean time from the start of a sweep to that of the next one, s; a lone sweep's duration."""
    first_ramp = np.searchsorted(schedule.sweep, np.unique(schedule.sweep))
    starts = schedule.start_time[first_ramp]
    if starts.size == 1:
        return float(schedule.end_time[-1] - starts[0])
    return float(starts[-1] - starts[0]) / (starts.size - 1)


def _code_length(schedule: RampSchedule) -> int:
    """Number of sweeps after which the weights of the transmitting elements repeat."""
    num_sweeps = int(schedule.sweep[-1]) + 1
    weight = schedule.transmit_weight[:: schedule.num_ramps // num_sweeps]
    lengths = range(1, len(weight))
    return next((n for n in lengths if np.allclose(weight[n:], weight[:-n])), len(weight))


def _tells_folds(reader: RangeDoppler, schedule: RampSchedule, radar: StudyRadar) -> bool:
    """True if the receiver tells the speeds apart that a code leaves open."""
    try:
        return reader.tells_folds_apart(schedule, radar.array)
    except CapabilityError:  # a code that cannot be read is told by its radar's problems
        return False


def _has_equal_sweeps(schedule: RampSchedule, num_sweeps: int) -> bool:
    """True if all sweeps have the same ramps, at equal intervals."""
    if schedule.num_ramps % num_sweeps:
        return False
    starts = schedule.start_time.reshape(num_sweeps, -1)
    interval = np.diff(starts, axis=0)
    return all(
        np.allclose(values, values[:1], rtol=1e-6, atol=0.0)
        for values in (
            interval,
            *(
                each.reshape(num_sweeps, -1)
                for each in (schedule.duration, schedule.slope, schedule.start_frequency)
            ),
        )
    )


def _memory(times: SampleTimes, radar: StudyRadar) -> int:
    """Bytes of a frame's samples and of its parts; all ramps are padded to the longest."""
    padded = radar.array.num_channels * times.num_samples.size * times.most_samples
    return padded * (1 + len(parts_of(radar))) * _BYTES_OF_A_SAMPLE


def _need_readable(study: Study, schedule: RampSchedule, *, number: int) -> None:
    """Refuse a victim whose ramps, or whose array and its coding, its receiver cannot read."""
    try:
        refuse_unreadable(study.receiver, schedule)
    except CapabilityError as error:
        raise CapabilityError(f"radars.{number}.waveform: {error}") from None
    if schedule.num_elements > 1:
        try:
            code_blocks(schedule)
        except CapabilityError as error:
            raise CapabilityError(f"radars.{number}.coding: {error}") from None
    try:
        refuse_unsampled(study.receiver, schedule, study.radars[number])
    except (CapabilityError, PhysicsError) as error:
        raise type(error)(f"radars.{number}: {error}") from None
    try:
        readable_elements(
            receiver_for(study.receiver, schedule), study.radars[number].array, schedule
        )
    except CapabilityError as error:
        raise CapabilityError(f"radars.{number}.array: {error}") from None


def _warn_of_ambiguity(study: Study, schedules: Sequence[RampSchedule]) -> None:
    """Warn of victims with directions in their field of view that their arrays cannot tell apart.

    The field of view is that of the elements' 3-dB beam.
    """
    for number in victim_indices(study):
        radar, schedule = study.radars[number], schedules[number]
        receiver = receiver_for(study.receiver, schedule)
        elements = readable_elements(receiver, radar.array, schedule)
        pattern = radar.array.pattern
        half = [
            min(0.5 * width, 0.5 * np.pi)
            for width in (pattern.azimuth_beamwidth, pattern.elevation_beamwidth)
        ]
        lobes = np.abs(ambiguities(elements, estimator=angle_estimator(receiver)))
        inside = lobes[np.all(lobes < 2.0 * np.sin(half) - 1e-6, axis=1)]
        if not len(inside):
            continue
        left, up = inside[np.argmin(np.linalg.norm(inside, axis=1))]
        warnings.warn(
            f"the array of '{radar.name}' cannot tell apart directions in its elements' beam of "
            f"±{np.degrees(half[0]):.3g}° by ±{np.degrees(half[1]):.3g}°, such as two whose sines "
            f"differ by {left:.3g} in azimuth and {up:.3g} in elevation: a target may appear in a "
            "wrong direction; place elements closer together, or unevenly",
            ModelWarning,
            stacklevel=3,
        )


def _warn_of_open_speeds(study: Study, schedules: Sequence[RampSchedule]) -> None:
    """Warn of victims whose equal ramps leave the range rate open to the coherent receiver.

    The migration λN/2 over N ramps by which two folds differ is then less than a range cell.
    """
    for number in victim_indices(study):
        radar, schedule = study.radars[number], schedules[number]
        receiver = receiver_for(study.receiver, schedule)
        count, centre = schedule.num_ramps, float(schedule.centre_frequency[0])
        if not isinstance(receiver, CoherentReceiver) or (count > 1 and unequal(schedule)):
            continue
        interval = np.diff(schedule.start_time)
        is_even = count < 3 or float(np.ptp(interval)) < MOST_UNEVEN * float(interval.mean())
        if not is_even or count * float(schedule.bandwidth[0]) > centre:
            continue
        searched = f"±{3.6 * receiver.greatest_speed:.0f} km/h"
        if count == 1:
            shift = receiver.greatest_speed * centre / abs(float(schedule.slope[0]))
            text = (
                f"'{radar.name}' has a single ramp, on which range and range rate have one beat: a "
                f"detection may have any range rate within {searched}, receiver.greatest_speed, "
                f"and a range that is wrong by up to {shift:.3g} m with it; use ramps of two "
                "slopes, or many equal ones"
            )
        else:
            fold = 0.5 * SPEED_OF_LIGHT / (centre * float(interval.mean()))
            if 0.5 * fold >= receiver.greatest_speed:
                continue
            text = (
                f"the {count} equal ramps of '{radar.name}' do not tell range rates "
                f"{3.6 * fold:.3g} km/h apart, and its receiver 'coherent' searches {searched}: a "
                "detection may have a wrong one; lower receiver.greatest_speed, or use ramps of "
                "two slopes or drawn intervals"
            )
        warnings.warn(text, ModelWarning, stacklevel=3)


def _need_audible(radar: StudyRadar, derived: DerivedRadar, *, number: int, study: Study) -> None:
    """Refuse a radar that cannot sample the beats of echoes from the receiver's greatest range."""
    limit = min(radar.if_filter.stopband, 0.5 * radar.converter.sample_rate)
    if derived.beat_band[1] > limit:
        raise PhysicsError(
            f"radars.{number}: echoes from {study.receiver.greatest_range:g} m, the receiver's "
            f"greatest range, beat at {derived.beat_band[1] / 1e3:.4g} kHz on the steepest ramp, "
            f"and '{radar.name}' samples no more than {limit / 1e3:.4g} kHz; use slower ramps, "
            "less bandwidth, a smaller range or a faster converter"
        )
