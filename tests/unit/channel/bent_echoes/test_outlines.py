"""Outlines of vehicles: corners of the upper hull, and the way from a radar to a body."""

import numpy as np
import pytest

from polychirp.channel.bent_echoes.outlines import HULL_STEP, _upper_hull, way_to
from polychirp.channel.tracers.composite import Composite
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, dihedral, mesh_of


@pytest.mark.parametrize("seed", range(5))
def test_no_highest_point_of_a_step_is_above_the_hull(seed):
    """The hull passes above the highest point of each step, and through no other points."""
    draw = np.random.default_rng(seed)
    points = draw.uniform((2.0, 0.0), (6.0, 1.5), (400, 2))
    hull = _upper_hull(points)
    assert np.all(np.diff(hull[:, 0]) > 0)
    assert np.all(np.diff(np.diff(hull[:, 1]) / np.diff(hull[:, 0])) < 0)
    step = np.floor(points[:, 0] / HULL_STEP)
    highest = np.array([max(points[step == one].tolist(), key=lambda p: p[1]) for one in set(step)])
    within = (highest[:, 0] >= hull[0, 0]) & (highest[:, 0] <= hull[-1, 0])
    assert np.all(within)
    assert np.all(highest[:, 1] <= np.interp(highest[:, 0], *hull.T) + 1e-9)
    assert set(map(tuple, hull.tolist())) <= set(map(tuple, highest.tolist()))


def test_the_hull_of_points_behind_the_origin_is_found():
    """Depths may be negative: steps are numbered from the first one."""
    points = np.array([[-1.0, 2.0], [-0.5, 1.0], [1.0, 2.0], [0.0, 3.0]])
    assert _upper_hull(points).tolist() == [[-1.0, 2.0], [0.0, 3.0], [1.0, 2.0]]


def test_a_way_is_a_right_handed_frame_with_the_body_ahead():
    """The body's extent in the frame is that of its corners."""
    corner = Actor(name="corner", kind="object", mesh=mesh_of(dihedral(0.5, 0.05)))
    world = Composite().prepare(around([corner], [(20.0, 15.0, 1.0)]))
    radar = world.scene.radar_position[0]
    way = way_to(world, radar, 0)
    assert way is not None
    assert way.frame @ way.frame.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(way.frame) == pytest.approx(1.0)
    ahead = way.frame @ (world.centre[0] - radar)
    assert ahead[1] == pytest.approx(0.0, abs=1e-9)
    assert np.all(way.low <= ahead + 1e-9)
    assert np.all(ahead <= way.high + 1e-9)
    surface = world.surfaces[0]
    corners = (surface.centroid[:, None] + surface.corner).reshape(-1, 3) @ world.rotation[0].T
    there = (corners + world.position[0] - radar) @ way.frame.T
    # of the corners in a cube of 1 cm, one is kept
    assert way.low == pytest.approx(there.min(axis=0), abs=0.02)
    assert way.high == pytest.approx(there.max(axis=0), abs=0.02)


def test_a_radar_within_a_body_has_no_way_to_it():
    """Nothing stands between a radar and the body's sphere around it."""
    corner = Actor(name="corner", kind="object", mesh=mesh_of(dihedral(0.5, 0.05)))
    world = Composite().prepare(around([corner], [(20.0, 0.0, 0.0)]))
    assert way_to(world, world.centre[0] + (0.1, 0.0, 0.0), 0) is None
