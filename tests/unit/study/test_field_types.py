"""Values of wrong types in studies made in Python are refused by their declared types."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest

from polychirp.channel.tracers.composite import Composite
from polychirp.errors import InputError
from polychirp.field_types import ENDLESS
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.radar import Radar
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.study.spec import Study, StudyRadar, schedules_of
from polychirp.traffic.random_traffic import RandomTraffic
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.units import Unit
from polychirp.waveform import Sawtooth, Triangular

CAR = Vehicle(name="car", x=0.0, y=0.0)
RADAR = StudyRadar(name="front", vehicle="car", waveform=Triangular())
STUDY = Study(name="alone", street=Street(vehicles=(CAR,)), radars=(RADAR,))


@pytest.mark.parametrize(
    ("owner", "wrong", "sentence"),
    [
        (STUDY, {"radars": RADAR}, "Study.radars: a StudyRadar is no tuple; write it like (Study"),
        (STUDY, {"radars": {"front": RADAR}}, "is no tuple"),
        (STUDY, {"radars": (Radar(name="bare"),)}, "Study.radars[0]: a Radar is no StudyRadar"),
        (STUDY, {"num_sweeps": 4.0}, "Study.num_sweeps: 4.0 is no whole number; write it like 4"),
        (STUDY, {"num_sweeps": True}, "Study.num_sweeps: True is no whole number"),
        (STUDY, {"receiver": "coherent"}, "Study.receiver: 'coherent' is no AutoReceiver, "),
        (STUDY, {"receiver": "coherent"}, "write CoherentReceiver()"),
        (STUDY, {"receiver": CoherentReceiver}, "the class CoherentReceiver is no AutoReceiver"),
        (STUDY, {"receiver": None}, "Study.receiver: None is no AutoReceiver"),
        (STUDY, {"targets": "post"}, "Study.targets: 'post' is no tuple; write it like ('post',)"),
        (STUDY, {"victims": ("front", 1)}, "Study.victims[1]: 1 is no text"),
        (STUDY, {"seed": "3"}, "Study.seed: '3' is no whole number"),
        (STUDY, {"name": 3}, "Study.name: 3 is no text"),
        (STUDY, {"street": (CAR,)}, "is no Street; write Street()"),
        (STUDY, {"traffic": 5}, "Study.traffic: 5 is no StudyTraffic; write StudyTraffic(…), or N"),
        (STUDY, {"access": "slots"}, "Study.access: 'slots' is no RandomStarts"),
        (STUDY, {"refresh_interval": "1 ms"}, "in Python write 0.001, which is in SI units"),
        (STUDY, {"least_traced_time": np.nan}, "Study.least_traced_time: is NaN"),
        (RADAR, {"waveform": "triangular"}, "StudyRadar.waveform: 'triangular' is no Sawtooth"),
        (RADAR, {"waveform": "triangular"}, "write Triangular()"),
        (RADAR, {"num_sweeps": 2.5}, "2.5 is no whole number; write it like 4 or None"),
        (RADAR, {"coding": Triangular()}, "StudyRadar.coding: a Triangular is no TimeDivision"),
        (RADAR, {"converter": 1e6}, "StudyRadar.converter: 1000000.0 is no Converter"),
        (RADAR, {"leakage": -20.0}, "StudyRadar.leakage: -20.0 is no tuple; write it like (…,)"),
        (RADAR, {"mount": Pose(yaw="90 deg")}, "StudyRadar.mount.yaw: '90 deg' is no number"),  # type: ignore[arg-type]
        (RADAR, {"vehicle": CAR}, "StudyRadar.vehicle: a Vehicle is no text"),
        (
            RADAR,
            {"waveform": Sawtooth(direction="upwards")},  # type: ignore[arg-type]
            "StudyRadar.waveform.direction: cannot be 'upwards'; write one of 'up', 'down'",
        ),
        (STUDY.street, {"vehicles": CAR}, "Street.vehicles: a Vehicle is no tuple"),
        (CAR, {"body": "sedann"}, "Vehicle.body: cannot be 'sedann'; write one of 'sedan', "),
        (
            RandomTraffic(seen_from="front"),
            {"num_targets": "3"},
            "RandomTraffic.num_targets: '3' is no whole",
        ),
    ],
)
def test_a_value_of_a_wrong_type_is_refused_with_its_place(
    owner: Any, wrong: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        replace(owner, **wrong)


POST = Point(name="post", x=12.0, y=0.0, z=0.5, rcs=1.0)


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"x": np.nan}, "Point.x: is NaN, which is no number"),
        ({"z": np.inf}, "Point.z: is inf; give a finite number"),
        ({"rcs": np.nan}, "Point.rcs: is NaN"),
        ({"velocity": (0.0, np.nan, 0.0)}, "Point.velocity[1]: is NaN"),
        ({"velocity": 3.0}, "Point.velocity: 3.0 is no tuple; write it like (…, …, …)"),
        ({"velocity": (3.0, 0.0)}, "Point.velocity: has 2 entries; it needs 3"),
        ({"y": "3 m"}, "Point.y: '3 m' is no number; in Python write 3.0"),
    ],
)
def test_a_point_has_a_finite_place(wrong: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        replace(POST, **wrong)


def test_numbers_of_numpy_lists_and_whole_numbers_are_taken() -> None:
    """They are what calculations give, and mean what the declared types mean."""
    given: dict[str, Any] = {
        "num_sweeps": np.int64(4),
        "refresh_interval": np.float32(1e-3),
        "least_traced_time": 0,
        "radars": [RADAR],
    }
    assert schedules_of(replace(STUDY, **given))[0].num_ramps == 8


@dataclass(frozen=True, kw_only=True)
class OwnWaveform:
    """A waveform that no union names."""

    def schedule(self, **given: Any) -> Any:
        return Triangular().schedule(**given)


def test_a_waveform_of_ones_own_needs_its_method_alone() -> None:
    own: Any = OwnWaveform()
    assert schedules_of(replace(STUDY, radars=(replace(RADAR, waveform=own),)))[0].num_ramps == 32


def quantities(spec: Any, place: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Place of every number with a unit in a dataclass, at any depth."""
    hints = get_type_hints(type(spec), include_extras=True)
    for field in fields(spec):
        value, where = getattr(spec, field.name), (*place, field.name)
        if is_dataclass(value):
            yield from quantities(value, where)
        elif isinstance(value, float) and any(
            isinstance(note, Unit) for note in get_args(hints[field.name])
        ):
            yield where


def changed(spec: Any, place: tuple[str, ...], value: Any) -> Any:
    """The dataclass with another value at a place within it."""
    name, *inner = place
    return replace(
        spec, **{name: changed(getattr(spec, name), tuple(inner), value) if inner else value}
    )


WHOLE = replace(STUDY, tracer=Composite(frequency=79e9))
QUANTITIES = [(owner, place) for owner in (WHOLE, RADAR, CAR, POST) for place in quantities(owner)]


@pytest.mark.parametrize(
    ("owner", "place"), QUANTITIES, ids=[".".join(place) for _, place in QUANTITIES]
)
def test_infinite_quantities_are_refused(owner: Any, place: tuple[str, ...]) -> None:
    """They gave samples of NaN, tracebacks of NumPy, or a run that ignored them."""
    for value in (np.inf, -np.inf):
        if value == np.inf and place[-1] in ENDLESS:
            changed(owner, place, value)
            continue
        with pytest.raises(InputError):
            changed(owner, place, value)


@pytest.mark.parametrize(
    ("owner", "wrong", "sentence"),
    [
        (RADAR, {"mount": Pose(yaw=np.inf)}, "StudyRadar.mount.yaw: is inf; give a finite number"),
        (RADAR, {"noise_figure": np.inf}, "StudyRadar.noise_figure: is inf; give a finite number"),
        (CAR, {"speed": -np.inf}, "Vehicle.speed: is -inf; give a finite number"),
    ],
)
def test_an_infinite_quantity_is_refused_with_its_place(
    owner: Any, wrong: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        replace(owner, **wrong)


@pytest.mark.parametrize(
    "owner",
    [
        replace(RADAR, array=AntennaArray(pattern=ISOTROPIC)),
        replace(STUDY, refresh_interval=np.inf, tracer=Composite(max_length=np.inf)),
        replace(RADAR, transmit_power=0.0),
        replace(RADAR, mount=Pose(y=12.2e6), array=AntennaArray(num_channels=2000)),
    ],
    ids=["isotropic", "traced once", "silent", "far and wide"],
)
def test_infinity_zero_and_great_numbers_are_taken_where_they_mean_something(owner: Any) -> None:
    assert replace(owner) == owner
