"""Paths of a tracer without parts that cannot be are refused with the number of the path."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.channel.tracers.path_interpolation import interpolate_paths
from polychirp.channel.tracers.ray_check import checked
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, PointScatterer, Scene

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
        ({"delay_rate": lambda d: d - 3.0}, "path 0 has a delay rate of -3"),
        ({"arrival": lambda d: 2 * d}, "a direction of arrival of the length 2; use unit"),
        ({"departure": lambda d: 0 * d}, "a direction of departure of the length 0"),
        ({"transmitter": lambda n: n + 1}, "path 0 has the transmitter 1, and .* has 1 radars"),
        ({"receiver": lambda n: n - 1}, "path 0 has the receiver -1"),
        ({"bounce_actor": lambda n: n + 5}, "a bounce at the body 6, and the scene has 2 bodies"),
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
