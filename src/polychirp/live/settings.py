"""`LiveSettings`: values of the controls of the live page, and the study that they make."""

import math
from dataclasses import dataclass, field, replace
from typing import Final, Literal

from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.radar import Converter
from polychirp.receiver.mitigation import AnyMitigation, Blanking, StftExcision
from polychirp.receiver.selection import AutoReceiver
from polychirp.study.spec import Study, StudyRadar
from polychirp.traffic.mounting import bumper_mount
from polychirp.traffic.shapes import Body
from polychirp.traffic.street import Road, Street, Vehicle
from polychirp.units import from_db
from polychirp.waveform import AnyWaveform, DiverseTriangular, Sawtooth, Triangular

WaveformKind = Literal["triangular", "diverse-triangular", "sawtooth"]
MitigationKind = Literal["none", "blanking", "excision"]

VICTIM, OTHER = "front", "other"
"""Names of the two radars."""

LOOP_REFRESH: Final = 1.0
"""Refresh interval of the study in the loop, s: longer than any frame, so that it is traced once,
and delays go on with their rates and accelerations."""

DIVERSITY: Final = 0.2
"""Share by which bandwidth and duration of diverse ramps vary; chosen: as in the paper."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Car:
    """A car of the street: its body, the place of its middle, m, its heading, and speed, m/s."""

    name: str
    body: Body
    x: float
    y: float
    oncoming: bool = False
    speed: float = 0.0

    def vehicle(self) -> Vehicle:
        """The car as a study has it."""
        return Vehicle(
            name=self.name,
            body=self.body,
            x=self.x,
            y=self.y,
            heading=math.pi if self.oncoming else 0.0,
            speed=self.speed,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RadarControls:
    """Values of the controls of one radar, in SI.

    Parameters
    ----------
    waveform : kind of its ramps
    bandwidth, ramp_duration : Hz, s; the greatest ones of diverse ramps
    start_time : s, of its first ramp
    clock_offset : relative error of its clock
    power : W, transmitted
    gain : power ratio of its front end when it transmits
    is_on : false if it does not transmit
    """

    waveform: WaveformKind = "triangular"
    bandwidth: float = 1e9
    ramp_duration: float = 1e-3
    start_time: float = 0.0
    clock_offset: float = 0.0
    power: float = 10e-3
    gain: float = from_db(9.0)
    is_on: bool = True

    @property
    def slope(self) -> float:
        """Slope of its ramps, Hz/s; the greatest one that diverse ramps can have."""
        return self.bandwidth / self.least_duration

    @property
    def least_duration(self) -> float:
        """Duration of its shortest ramp, s."""
        is_diverse = self.waveform == "diverse-triangular"
        return self.ramp_duration * (1.0 - DIVERSITY if is_diverse else 1.0)

    def made(self) -> AnyWaveform:
        """The waveform."""
        if self.waveform == "sawtooth":
            return Sawtooth(bandwidth=self.bandwidth, ramp_duration=self.ramp_duration)
        if self.waveform == "triangular":
            return Triangular(bandwidth=self.bandwidth, ramp_duration=self.ramp_duration)
        return DiverseTriangular(
            bandwidth=((1.0 - DIVERSITY) * self.bandwidth, self.bandwidth),
            ramp_duration=((1.0 - DIVERSITY) * self.ramp_duration, self.ramp_duration),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveSettings:
    """Values of all controls.

    Parameters
    ----------
    title : name of the preset
    ego, carrier : the cars that carry the victim and the other radar
    looks_back : true if the victim looks out of the rear of its car
    cars : further cars, which are targets as well
    distance : m, by which the carrier is moved away from its place
    victim, other : the radars
    num_sweeps : sweeps of the frame
    mitigation : of the victim's samples
    seed : of noise and drawn ramps
    """

    title: str
    ego: Car
    carrier: Car
    looks_back: bool = False
    carrier_looks_back: bool = False
    cars: tuple[Car, ...] = ()
    distance: float = 0.0
    victim: RadarControls = field(default_factory=RadarControls)
    other: RadarControls = field(default_factory=RadarControls)
    num_sweeps: int = 8
    mitigation: MitigationKind = "none"
    seed: int = 1

    @property
    def moved_carrier(self) -> Car:
        """The other radar's car at its distance."""
        way = self.distance if self.carrier.x >= self.ego.x else -self.distance
        return replace(self.carrier, x=self.carrier.x + way)


def study_of(settings: LiveSettings, *, is_traced: bool = False) -> Study:
    """The study that the controls describe, with vehicles as points, or ray-traced."""
    carrier = settings.moved_carrier
    cars = (settings.ego, carrier, *settings.cars)
    others = [_radar(settings, OTHER, carrier, settings.other, settings.carrier_looks_back)]
    victim = _radar(settings, VICTIM, settings.ego, settings.victim, settings.looks_back)
    places = [car.x for car in cars]
    return Study(
        name="live",
        seed=settings.seed,
        num_sweeps=settings.num_sweeps,
        street=Street(
            road=Road(
                length=max(places) - min(places) + 60.0,
                width=8.0,
                x=0.5 * (max(places) + min(places)),
            ),
            vehicles=tuple(car.vehicle() for car in cars),
        ),
        radars=(victim, *(others if settings.other.is_on else ())),
        victims=(VICTIM,),
        tracer=Composite() if is_traced else PointVehicles(),
        refresh_interval=1e-3 if is_traced else LOOP_REFRESH,
        receiver=AutoReceiver(
            mitigation=_mitigation(settings),
            greatest_range=_reach(settings),
            greatest_speed=_greatest_speed(settings),
        ),
    )


def _radar(
    settings: LiveSettings, name: str, car: Car, controls: RadarControls, looks_back: bool
) -> StudyRadar:
    sample_rate = _sample_rate(settings)
    rest = 10e-6 if controls.ramp_duration >= 2e-4 else 0.05 * controls.ramp_duration
    return StudyRadar(
        name=name,
        vehicle=car.name,
        mount=bumper_mount(car.body, "rear" if looks_back else "front"),
        waveform=controls.made(),
        num_sweeps=_sweeps_of(settings, controls),
        start_time=controls.start_time,
        clock_offset=controls.clock_offset,
        transmit_power=controls.power,
        transmit_gain=controls.gain,
        array=AntennaArray(num_channels=4),
        converter=Converter(sample_rate=sample_rate, start=rest, margin=rest),
        if_filter=IfFilter(passband=0.35 * sample_rate, stopband=0.65 * sample_rate),
    )


def _sweeps_of(settings: LiveSettings, controls: RadarControls) -> int:
    """Sweeps with which a radar transmits for as long as the victim listens."""
    own = 1 if settings.victim.waveform == "sawtooth" else 2
    its = 1 if controls.waveform == "sawtooth" else 2
    time = settings.num_sweeps * own * settings.victim.ramp_duration
    needed = (time - min(0.0, controls.start_time)) / (its * controls.least_duration)
    return settings.num_sweeps if controls is settings.victim else max(1, math.ceil(needed))


def _sample_rate(settings: LiveSettings) -> float:
    """Samples per second of the victim, with which its farthest beat is within the passband."""
    beat = 2.0 * settings.victim.slope * _reach(settings) / SPEED_OF_LIGHT
    return max(1e6, 1e5 * math.ceil(beat / 0.35 / 1e5))


def _reach(settings: LiveSettings) -> float:
    """Greatest range of the receiver, m: beyond the farthest car."""
    cars = (settings.moved_carrier, *settings.cars)
    farthest = max(abs(car.x - settings.ego.x) for car in cars)
    return max(30.0, 10.0 * math.ceil((farthest + 5.0) / 10.0))


def _greatest_speed(settings: LiveSettings) -> float:
    """Greatest range rate that any car can have, and some more, m/s."""
    cars = (settings.ego, settings.carrier, *settings.cars)
    speeds = [-car.speed if car.oncoming else car.speed for car in cars]
    return max(max(speeds) - min(speeds) + 3.0, 32.0)


def _mitigation(settings: LiveSettings) -> AnyMitigation | None:
    made: dict[MitigationKind, AnyMitigation | None] = {
        "none": None,
        "blanking": Blanking(),
        "excision": StftExcision(),
    }
    return made[settings.mitigation]
