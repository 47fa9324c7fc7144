"""`Study`: a whole experiment as one frozen value; its scene, ramp schedules and targets."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.channel.base import AtFrequency, refuse_no_tracer
from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.channel.tracers.composite import Composite
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.channel.tracers.sionna import SionnaRt
from polychirp.errors import InputError, no_such
from polychirp.field_types import need_field_types
from polychirp.model.antenna import ArrayErrors
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.receiver.selection import AnyReceiver, AutoReceiver
from polychirp.rng import Streams
from polychirp.spec import ByKind, Spec
from polychirp.study.traffic import StudyTraffic
from polychirp.traffic.street import Street
from polychirp.units import Between, Fraction, FractionPerSecond, Seconds
from polychirp.waveform import AnyAccess, AnyCoding, AnyWaveform, Turn, coded

GREATEST_DRIFT: Final = 10e-6
"""Greatest drift of a clock, 1/s; chosen: the cubic phase that `RampSchedule.as_clocked` neglects
is then 0.005 cycles at the end of a ramp of 1 GHz and 1 ms."""

MOST_SNAPSHOTS: Final = 20_000
"""Greatest number of times at which a scene is traced for one trial; chosen: they are
20 s of simulated time at the default refresh interval of 1 ms."""

AnyTracer = Annotated[Composite | FreeSpace | PointVehicles | SionnaRt, ByKind(method="trace")]


@dataclass(frozen=True, kw_only=True)
class StudyRadar(Radar):
    """A radar with its vehicle, its waveform and the errors of its clock.

    Parameters
    ----------
    vehicle : name of the vehicle that carries the radar
    waveform : frequency and timing of its ramps
    coding : weights of the transmitting elements from sweep to sweep; if not given, only the first
        element transmits
    array_errors : rms values from which errors of its array are drawn; the drawn errors replace
        any errors that `array` lists
    num_sweeps : sweeps that it transmits in a frame; None for those of the study. An interferer
        whose sweeps are shorter than the victim's needs more of them to transmit as long
    start_time : s, start of its first ramp
    start_spread : s; its first ramp starts up to this later, drawn uniformly for every seed
    clock_offset : relative error of its oscillator at its start, positive for a fast clock
    clock_spread : that error is up to this larger or smaller, drawn uniformly for every seed
    clock_drift : growth of that error, 1/s
    start_jitter : s, rms error of the start of every sweep, drawn independently

    Examples
    --------
    >>> from polychirp.waveform import Sawtooth
    >>> radar = StudyRadar(name="front", vehicle="car", waveform=Sawtooth(), start_time=1e-3)
    >>> radar.array.num_channels, radar.converter.sample_rate
    (4, 1000000.0)
    """

    vehicle: str
    waveform: AnyWaveform
    coding: AnyCoding | None = None
    array_errors: ArrayErrors | None = None
    num_sweeps: Annotated[int, Between(greatest=1_000_000)] | None = None
    start_time: Seconds = 0.0
    start_spread: Seconds = 0.0
    clock_offset: Fraction = 0.0
    clock_spread: Fraction = 0.0
    clock_drift: FractionPerSecond = 0.0
    start_jitter: Seconds = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not abs(self.clock_offset) < 0.01:
            raise InputError(
                f"radar '{self.name}' has a clock offset of {self.clock_offset * 1e6:g} ppm; "
                "use a value between −10 000 and 10 000 ppm"
            )
        if not 0 <= self.clock_spread < 0.01:
            raise InputError(
                f"radar '{self.name}' has a clock spread of {self.clock_spread * 1e6:g} ppm; "
                "use a value from 0 to below 10 000 ppm"
            )
        if not abs(self.clock_drift) <= GREATEST_DRIFT:
            raise InputError(
                f"radar '{self.name}' has a clock that drifts by {self.clock_drift * 1e6:g} ppm in "
                f"a second; use at most {GREATEST_DRIFT * 1e6:g} ppm, up to which its ramps stay "
                "straight"
            )
        if not (self.start_jitter >= 0 and self.start_spread >= 0):
            raise InputError(
                f"radar '{self.name}' has a negative start jitter or spread; use 0 s or more"
            )
        if self.num_sweeps is not None and self.num_sweeps < 1:
            raise InputError(f"radar '{self.name}' has no sweeps; use a num_sweeps of 1 or more")


@dataclass(frozen=True, slots=True, kw_only=True)
class Study(Spec):
    """One experiment: a street with radars, a tracer and a receiver.

    Parameters
    ----------
    name : name of the experiment; results are stored under it
    seed : seed of all random streams, 0 or more
    num_sweeps : sweeps in a frame
    street : road, vehicles and what stands beside the road, at 0 s
    radars : all radars of the street; each of them interferes with all others
    traffic : further vehicles and radars, drawn anew for every seed (`sample_street`)
    victims : names of the radars whose frames are computed; all if empty
    targets : names of the vehicles and points that count as targets; if empty, all but the
        radar's own vehicle
    tracer : finds the propagation paths
    access : rule by which all radars share time and band; None for none, so that starts and bands
        are those of each radar
    refresh_interval : s, greatest interval at which the scene is traced again
    least_traced_time : s, for which paths are traced at least, from the first start on: with a time
        that no frame exceeds, studies whose frames differ in length have the same paths
    receiver : receiver of every victim

    Examples
    --------
    >>> from polychirp.traffic.street import Street, Vehicle
    >>> from polychirp.waveform import Triangular
    >>> street = Street(vehicles=(Vehicle(name="car", x=0.0, y=0.0),))
    >>> radar = StudyRadar(name="front", vehicle="car", waveform=Triangular())
    >>> study = Study(name="alone", street=street, radars=(radar,))
    >>> schedules_of(study)[0].num_ramps
    32
    """

    name: str
    seed: Annotated[int, Between(greatest=2**63 - 1)] = 1
    num_sweeps: Annotated[int, Between(greatest=1_000_000)] = 16
    street: Street
    radars: tuple[StudyRadar, ...]
    traffic: StudyTraffic | None = None
    victims: tuple[str, ...] = ()
    targets: tuple[str, ...] = ()
    access: AnyAccess | None = None
    tracer: AnyTracer = field(default_factory=Composite)
    refresh_interval: Seconds = 1e-3
    least_traced_time: Seconds = 0.0
    receiver: AnyReceiver = field(default_factory=AutoReceiver)

    def __post_init__(self) -> None:
        refuse_no_tracer(self.tracer)
        need_field_types(self)


def tracer_of(study: Study, schedules: Sequence[RampSchedule]) -> AnyTracer:
    """The study's tracer; without a frequency of its own, at that of its radars' ``schedules``.

    Random values of vehicles are drawn anew for every seed of the study, and thus in every trial.
    The frequency is the mean of their centre frequencies, rounded so that drawn ramps of the same
    band share their paths: from 50 GHz on to a whole GHz, where powers are then wrong by 0.1 dB at
    most (0.06 dB at 76 GHz), below to a hundredth of the power of ten, 0.1 GHz at 24 GHz (0.05 dB
    at most). Up to 0.55 of a step is rounded down: radars from 79 to 80 GHz have 79 GHz.

    >>> from polychirp.waveform import Sawtooth
    >>> radar = StudyRadar(name="r", vehicle="car", waveform=Sawtooth(start_frequency=76e9))
    >>> study = Study(name="s", street=Street(), radars=(radar,))
    >>> tracer_of(study, schedules_of(study)).frequency
    76000000000.0
    """
    tracer = study.tracer
    if isinstance(tracer, PointVehicles):
        drawn = np.random.SeedSequence([tracer.seed, study.seed]).generate_state(1)
        tracer = replace(tracer, seed=int(drawn[0]))
    if not isinstance(tracer, AtFrequency) or tracer.frequency is not None or not schedules:
        return tracer
    mean = float(np.mean([np.mean(one.centre_frequency) for one in schedules]))
    step = 1e9 if mean >= 50e9 else 10.0 ** (math.floor(math.log10(mean)) - 2)
    return replace(tracer, frequency=round(step * math.floor(mean / step + 0.45), 0))


def schedule_of(study: Study, radar: StudyRadar) -> RampSchedule:
    """Ramps of one radar, with the errors of its clock, in the true time of the scene.

    Under a rule that acts from frame to frame they are those of the first frame.
    """
    return schedule_in_turn(study, radar, first_turn(study, radar))


def schedule_in_turn(
    study: Study, radar: StudyRadar, turn: Turn, *, begin: float = 0.0
) -> RampSchedule:
    """Ramps of one radar in one turn, whose frame begins at ``begin``, s, of the radar's clock."""
    num_sweeps = radar.num_sweeps or study.num_sweeps
    streams = Streams(seed=study.seed)
    own = streams.of("radar", radar.name)
    if turn.draw:
        own = own.of("draw", turn.draw)
    given: Any = radar.waveform.schedule(num_sweeps=num_sweeps, streams=own)
    if not isinstance(given, RampSchedule):  # a waveform of another package may return anything
        raise InputError(
            f"'schedule' of {type(radar.waveform).__name__}, the waveform of '{radar.name}', "
            f"returns {type(given).__name__}; return polychirp.RampSchedule"
        )
    schedule = given
    if radar.coding is not None:
        schedule = coded(schedule, radar.coding, num_elements=radar.array.num_transmitters)
    schedule = replace(
        schedule,
        start_time=schedule.start_time + begin,
        start_frequency=schedule.start_frequency + turn.shift,
    )
    late = turn.delay + float(streams["start", radar.name].uniform(0.0, radar.start_spread))
    fast = float(streams["clock", radar.name].uniform(-1.0, 1.0)) * radar.clock_spread
    clocked = schedule.as_clocked(
        start_time=radar.start_time + late,
        clock_offset=radar.clock_offset + fast,
        clock_drift=radar.clock_drift,
    )
    if radar.start_jitter == 0.0:
        return clocked
    draws = streams["jitter", radar.name].standard_normal(num_sweeps)
    return clocked.with_late_sweeps(radar.start_jitter * draws)


def first_turn(study: Study, radar: StudyRadar) -> Turn:
    """Turn that the study's rule gives a radar in its only frame, or in the first one."""
    if study.access is None:
        return Turn()
    names = [one.name for one in study.radars]
    streams = Streams(seed=study.seed)
    given = study.access.assign(names=names, heading=headings(study), streams=streams)
    number = names.index(radar.name)
    return Turn(delay=float(given.delay[number]), shift=float(given.shift[number]))


def headings(study: Study) -> FloatArray:
    """Direction of each radar's axis in the world, rad, ``(radar,)``."""
    of_vehicle = {vehicle.name: vehicle.heading for vehicle in study.street.vehicles}
    return np.array([of_vehicle.get(one.vehicle, 0.0) + one.mount.yaw for one in study.radars])


def schedules_of(study: Study) -> tuple[RampSchedule, ...]:
    """Ramps of every radar, in the order of the radars."""
    return tuple(schedule_of(study, radar) for radar in study.radars)


def scene_of(study: Study) -> Scene:
    """Street with its radars at 0 s.

    Raises
    ------
    InputError
        The street lacks the vehicle of a radar, or a mesh file cannot be used.
    """
    return study.street.scene([(as_built(study, radar), radar.vehicle) for radar in study.radars])


def as_built(study: Study, radar: StudyRadar) -> StudyRadar:
    """The radar with drawn errors in its array; unchanged if it has no ``array_errors``."""
    if radar.array_errors is None:
        return radar
    streams = Streams(seed=study.seed).of("radar", radar.name)
    return replace(radar, array=radar.array_errors.draw_array(radar.array, streams=streams))


def victim_indices(study: Study) -> tuple[int, ...]:
    """Numbers of the radars whose frames are computed, in the order of the radars.

    Raises
    ------
    InputError
        A victim is no radar of the study.
    """
    names = [radar.name for radar in study.radars]
    wanted = study.victims or tuple(names)
    for name in wanted:
        if name not in names:
            raise InputError(f"victims: {no_such('radar', name, names)}")
    return tuple(i for i, radar in enumerate(study.radars) if radar.name in wanted)


def body_names(street: Street) -> tuple[str, ...]:
    """Names of all possible targets: vehicles, points and road users."""
    names = [vehicle.name for vehicle in street.vehicles]
    names += [point.name for point in street.points]
    names += [user.name for user in street.road_users]
    return tuple(names)


def target_names(study: Study, radar: StudyRadar) -> tuple[str, ...]:
    """Names of the targets of ``radar``, without the vehicle that carries it."""
    wanted = study.targets or body_names(study.street)
    return tuple(name for name in wanted if name != radar.vehicle)


def refresh_times(
    schedules: Sequence[RampSchedule], refresh_interval: float, *, least: float = 0.0
) -> FloatArray:
    """Times at which the scene is traced, s: the middles of equal parts of the simulated time.

    That time lasts from the first start to the last end of any radar's ramps, and for ``least`` s.
    No part is longer than ``refresh_interval``.

    Raises
    ------
    InputError
        ``refresh_interval`` is not positive, or there are more than `MOST_SNAPSHOTS` parts.
    """
    if not refresh_interval > 0:
        raise InputError(f"refresh_interval: is {refresh_interval:g} s; use more than 0 s")
    first = min(float(schedule.start_time[0]) for schedule in schedules)
    last = max(first + least, *(float(schedule.end_time[-1]) for schedule in schedules))
    wanted = (last - first) / refresh_interval
    if not wanted <= MOST_SNAPSHOTS:
        raise InputError(
            f"refresh_interval: every {refresh_interval:g} s is {wanted:.3g} times in "
            f"{last - first:g} s, more than {MOST_SNAPSHOTS}; use a longer one, shorter frames "
            "that start together, or a shorter least_traced_time"
        )
    count = max(1, int(np.ceil(wanted * (1 - 1e-12))))
    return first + (np.arange(count) + 0.5) * (last - first) / count
