"""Waves over edges are the same in scenes that are turned or mirrored as a whole."""

import numpy as np
import pytest

from polychirp.channel.diffraction.paths import diffracted_paths
from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, transfer_at

BOXES = (
    # size, and the place of the middle, m
    ((1.2, 0.9, 0.5), (5.0, 0.35, 0.35)),
    ((0.9, 0.3, 1.6), (8.0, -0.45, 0.2)),
    ((2.0, 0.7, 0.3), (12.0, 0.1, 1.0)),
    ((0.4, 0.2, 0.9), (14.5, 0.5, 0.4)),
)
RADARS = ((0.0, 0.1, 0.3), (20.0, -0.1, 0.75))
"""Their line of sight climbs by more than it goes aside."""


def field_between_radars(*, turn=0.0, side=1.0):
    """Field over the boxes in units of the unobstructed one, in a scene turned by ``turn``, rad.

    ``side`` is −1 for the scene that is mirrored left to right.
    """
    c, s = np.cos(turn), np.sin(turn)

    def placed(place):
        x, y, z = place
        return c * x - s * side * y, s * x + c * side * y, z

    actors = []
    for number, (size, place) in enumerate(BOXES):
        x, y, z = placed(place)
        mesh = mesh_of(box(size, 0.3))
        pose = Pose(x=x, y=y, z=z, yaw=turn)
        actors.append(Actor(name=f"box {number}", kind="object", mesh=mesh, pose=pose))
    scene = around(actors, [placed(place) for place in RADARS])
    world = Composite(dynamic_range=1e12).prepare(scene)
    paths = diffracted_paths(world, np.array([[0, 1]]))
    length = np.linalg.norm(np.subtract(*RADARS))
    return transfer_at(paths, 79e9, 0, 1)[0, 0] * 4 * np.pi * length * 79e9 / SPEED_OF_LIGHT


@pytest.mark.parametrize("turn", [10.0, 37.0, 90.0, 137.0, 200.0])
def test_turned_scenes_have_the_same_waves(turn):
    """Half-planes about a line that climbs were turned about it with the scene's direction."""
    expected = field_between_radars()
    assert abs(expected) > 0.01
    assert abs(field_between_radars(turn=np.radians(turn)) - expected) < 1e-9


@pytest.mark.parametrize("turn", [0.0, 37.0])
def test_mirrored_scenes_have_the_same_waves(turn):
    """Edges were continued in the order in which half-planes turn, which a mirror reverses."""
    found = field_between_radars(turn=np.radians(turn), side=-1.0)
    assert abs(found - field_between_radars()) < 5e-5
