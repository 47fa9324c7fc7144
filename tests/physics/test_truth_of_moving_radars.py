"""The range rate of a target is the relative velocity along the line of sight."""

import numpy as np
import pytest

from polychirp.channel.scene.ground_truth import truth
from polychirp.frames import Pose
from polychirp.model.scene import Actor, PointScatterer
from polychirp.testing.shapes import around


def standing_point(velocity=(0.0, 0.0, 0.0)):
    return Actor(
        name="target",
        kind="object",
        pose=Pose(x=8.0, y=6.0, z=0.5),
        velocity=velocity,
        points=(PointScatterer(position=(0.0, 0.0, 0.0), rcs=1.0),),
    )


def rate(*, own, target):
    scene = around([standing_point(target)], [(0.0, 0.0, 0.5)], velocities=[own])
    return float(truth(scene, 0, ["target"]).range_rate[0])


def test_a_radar_that_drives_towards_a_standing_point_closes_in():
    """The line of sight is (0.8, 0.6): at 10 m/s ahead the range shrinks by 8 m/s."""
    assert rate(own=(10.0, 0.0, 0.0), target=(0.0, 0.0, 0.0)) == pytest.approx(-8.0)


def test_a_target_that_drives_alongside_stays_where_it_is():
    assert rate(own=(10.0, 3.0, 0.0), target=(10.0, 3.0, 0.0)) == pytest.approx(0.0, abs=1e-12)


def test_the_range_rate_is_the_slope_of_the_range():
    """Central difference of the distance over a microsecond."""
    own, target, step = (11.0, -2.0, 0.0), (-7.0, 4.0, 0.0), 1e-6
    scene = around([standing_point(target)], [(0.0, 0.0, 0.5)], velocities=[own])
    ranges = [truth(scene.at(t), 0, ["target"]).range[0] for t in (-step, step)]
    assert rate(own=own, target=target) == pytest.approx(np.diff(ranges)[0] / (2 * step), rel=1e-6)
