"""Paths of a tracer without parts that cannot be are refused with the number of the path."""

import re
from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.base import path_table
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.channel.tracers.path_interpolation import interpolate_paths
from polychirp.channel.tracers.ray_check import checked
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.paths import Bounce
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.study.kernel_parts import parts_of
from polychirp.study.limits.targets import targets_without_echo
from polychirp.study.spec import Study, StudyRadar
from polychirp.traffic.street import Street, Vehicle
from polychirp.waveform import Triangular

SCENE = Scene(
    time=0.0,
    actors=(
        Actor(name="car", kind="vehicle"),
        Actor(
            name="target",
            kind="object",
            pose=Pose(x=20.0),
            points=(PointScatterer(position=(0.0, 0.0, 0.0), rcs=1.0),),
        ),
    ),
    radars=(Radar(name="front"),),
    carriers=(0,),
)


def changed(**columns):
    paths = FreeSpace().trace(SCENE)
    return replace(
        paths, **{name: change(getattr(paths, name)) for name, change in columns.items()}
    )


def test_true_paths_stay_as_they_are():
    paths = FreeSpace().trace(SCENE)
    assert paths.num_paths == 1
    assert checked(paths, SCENE) is paths


@pytest.mark.parametrize(
    ("columns", "sentence"),
    [
        ({"delay": lambda d: -d}, "path 0 has a delay of -1.3"),
        ({"delay": lambda d: 1e9 * d}, "delays are in seconds, and at most 0.01 s"),
        ({"transfer": lambda a: a - 80.0}, "an amplitude of 80 times .* not in dB"),
        ({"delay_rate": lambda d: d - 3.0}, "path 0 has a delay rate of -3"),
        ({"arrival": lambda d: 2 * d}, "a direction of arrival of the length 2; use unit"),
        ({"departure": lambda d: 0 * d}, "a direction of departure of the length 0"),
        ({"transmitter": lambda n: n + 1}, "path 0 has the transmitter 1, and .* has 1 radars"),
        ({"receiver": lambda n: n - 1}, "path 0 has the receiver -1"),
        (
            {"bounce_actor": lambda n: n + 5},
            "path 0 has a bounce at the body 6, and the scene has 2 bodies",
        ),
    ],
)
def test_what_cannot_be_is_refused(columns, sentence):
    with pytest.raises(InputError, match=sentence):
        checked(changed(**columns), SCENE)


def test_a_mean_of_many_contributions_may_have_any_length():
    paths = changed(arrival=lambda d: 1.01 * d, coherence_time=np.zeros_like)
    assert checked(paths, SCENE) is paths


def test_a_frame_of_a_tracer_without_parts_is_checked():
    class Wrong:
        capabilities = frozenset({"points"})

        def trace(self, scene):
            return replace(FreeSpace().trace(scene), delay=np.array([-1.0]))

    with pytest.raises(InputError, match="path 0 has a delay of -1 s"):
        interpolate_paths(Wrong(), SCENE, np.array([0.0, 1e-3]))


def test_what_is_no_table_of_paths_is_refused():
    with pytest.raises(InputError, match="trace gives a list; let it give PropagationPaths"):
        checked([], SCENE)


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("delay_acceleration", [np.nan]),
        ("transfer_drift", [np.inf]),
        ("arrival_rate", [[np.nan] * 3]),
    ],
)
def test_columns_that_may_be_left_out_are_finite(column, value):
    with pytest.raises(InputError, match=f"{column} of path 0 is not finite"):
        changed(**{column: lambda _: np.array(value)})


def test_arrays_of_wrong_shapes_are_refused_with_the_right_ones():
    good = {
        "scene": SCENE,
        "frequency": 79e9,
        "pair": np.zeros((1, 2), dtype=int),
        "delay": np.array([1e-7]),
        "delay_rate": np.zeros(1),
        "transfer": np.zeros((1, 2, 2)),
        "departure": np.array([[1.0, 0.0, 0.0]]),
        "arrival": np.array([[1.0, 0.0, 0.0]]),
    }
    assert path_table(**{**good, "pair": [[0, 0]]}).num_paths == 1
    with pytest.raises(InputError, match=r"pair has the shape \(2,\); it needs \(path, 2\)"):
        path_table(**{**good, "pair": np.zeros(2, dtype=int)})
    one_point = (Bounce.SCATTERING, np.array([1]), np.zeros(3))
    with pytest.raises(InputError, match=r"points of the shape \(3,\); 1 paths need"):
        path_table(**good, bounces=[one_point])


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"pair": [[0, 0.5]]}, "receiver has the entry 0.5; it needs whole numbers"),
        ({"pair": [[np.nan, 0]]}, "transmitter has the entry nan; it needs whole numbers"),
        ({"delay": np.array([1e-7 + 1e-9j])}, "delay has complex numbers; it needs real ones"),
        ({"delay": np.array(["100 ns"])}, "delay holds <U6 instead of numbers"),
        ({"bounces": [(7, [0], [[1.0, 0, 0]])]}, "bounce_kind of bounce 0 is 7; a value of Bounce"),
        ({"bounces": [(0, [0.5], [[1.0, 0, 0]])]}, "bounce_actor has the entry 0.5; it needs w"),
        ({"bounces": [(0.5, [0], [[1.0, 0, 0]])]}, "bounce_kind has the entry 0.5; it needs who"),
    ],
)
def test_numbers_that_a_table_would_truncate_are_refused(wrong, sentence):
    good = {
        "scene": SCENE,
        "frequency": 79e9,
        "pair": [[0, 0]],
        "delay": np.array([1e-7]),
        "delay_rate": np.zeros(1),
        "transfer": np.zeros((1, 2, 2)),
        "departure": np.array([[1.0, 0.0, 0.0]]),
        "arrival": np.array([[1.0, 0.0, 0.0]]),
    }
    whole = {"pair": [[0.0, 0.0]], "bounces": [(0.0, [0.0], [[1.0, 0.0, 0.0]])]}
    assert path_table(**{**good, **whole}).bounce_actor.tolist() == [0]
    with pytest.raises(InputError, match=re.escape(f"PropagationPaths.{sentence}")):
        path_table(**{**good, **wrong})


class Least:
    """What the guide to own tracers asks for, and no more."""

    capabilities = frozenset({"points"})

    def trace(self, scene):
        return FreeSpace().trace(scene)


def study_with(tracer):
    radar = StudyRadar(name="front", vehicle="ego", waveform=Triangular())
    street = Street(vehicles=(Vehicle(name="ego", x=0.0, y=0.0), Vehicle(name="car", x=9.0, y=0.0)))
    return Study(name="own", street=street, radars=(radar,), tracer=tracer)


def test_a_tracer_needs_no_kind():
    study = study_with(Least())
    assert set(parts_of(study)) >= set(parts_of(replace(study, tracer=FreeSpace())))
    assert "the tracer 'Least' computes" in next(targets_without_echo(study))


class NoSet(Least):
    capabilities = "points"


@pytest.mark.parametrize(
    ("tracer", "sentence"),
    [
        ("free-space", "'free-space' is no ray tracer; it needs the method trace"),
        (FreeSpace, "is no ray tracer"),
        (None, "None is no ray tracer"),
        (NoSet(), "are no set; make them a property"),
    ],
)
def test_what_is_no_tracer_is_refused_by_the_study(tracer, sentence):
    with pytest.raises(InputError, match=sentence):
        study_with(tracer)
