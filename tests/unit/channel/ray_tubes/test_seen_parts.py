"""Flat parts that a radar sees, and pairs of parts that cannot pass its wave on."""

import numpy as np

from polychirp.channel.ray_tubes.flat_pairs import (
    PlacedPart,
    may_be_joined,
    may_light,
    outlines_of,
    seen_parts,
)
from polychirp.channel.ray_tubes.flat_parts import are_joined, parts_in_world
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, plate


def facing(name, x, y=0.0, yaw=np.pi, size=0.2):
    mesh = mesh_of(plate(size, 0.05))
    return Actor(name=name, kind="object", mesh=mesh, pose=Pose(x=x, y=y, yaw=yaw))


def placed(*actors):
    world = Composite().prepare(around(actors, [(0.0, 0.0, 0.0)]))
    parts = [
        PlacedPart(part, np.zeros(3), 0.0, 0.0, body, number)
        for body, some in enumerate(parts_in_world(world))
        for number, part in enumerate(some)
    ]
    return world, parts


def test_a_part_behind_a_screen_or_turned_away_is_not_seen():
    """The second plate stands in the shadow of the first, and the third turns its back."""
    actors = facing("near", 5.0, size=0.5), facing("far", 10.0), facing("back", 5.0, 3.0, 0.0)
    world, parts = placed(*actors, facing("beside", 10.0, 3.0))
    assert seen_parts(world, np.zeros(3), parts).tolist() == [True, False, False, True]


def test_a_part_of_which_a_corner_is_seen_is_seen():
    """Only the last 5 cm of the far plate are beside the shadow."""
    world, parts = placed(facing("near", 5.0, size=0.5), facing("far", 10.0, 0.45))
    assert seen_parts(world, np.zeros(3), parts).tolist() == [True, True]


def test_a_part_that_is_turned_away_from_the_image_is_not_lit():
    """The mirror's image lies behind the mirror at x = 10 m."""
    _, parts = placed(facing("mirror", 5.0), facing("lit", 0.0, 0.5, 0.0), facing("dark", 0.0, 0.5))
    found = may_light(
        np.array([0.0, 0.1, 0.0]),
        outlines_of(parts[:1]),
        outlines_of(parts[1:]),
        1655.0,
        np.full(2, 0.01),
    )
    assert found.tolist() == [True, False]


def test_parts_that_are_joined_may_be_joined():
    """At 1 cm from each other two plates are joined, at 5 cm they are not."""
    _, parts = placed(facing("one", 5.0), facing("near", 5.0, 0.21), facing("off", 5.0, -0.25))
    near = may_be_joined(outlines_of(parts[:1]), outlines_of(parts[1:]))
    joined = [are_joined(parts[0].shape, part.shape) for part in parts[1:]]
    assert joined == [True, False]
    assert near[0]
    _, apart = placed(facing("one", 5.0), facing("far", 5.0, 1.0))
    assert not may_be_joined(outlines_of(apart[:1]), outlines_of(apart[1:]))[0]
