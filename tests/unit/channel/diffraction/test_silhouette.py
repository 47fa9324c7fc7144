"""The silhouette does not depend on the order in which obstacles are searched."""

import numpy as np
import pytest

from polychirp.channel.diffraction.sight_lines import obstacles_of, rotation_to
from polychirp.channel.diffraction.silhouette import blocked_intervals
from polychirp.channel.materials.library import material_table
from polychirp.channel.scene.world import world_of
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, sphere

LENGTH = 20.0


def in_the_way():
    """Two balls and a box between radars at 0 and 20 m; each hides a part of the others."""
    shapes = {
        "near ball": (sphere(0.4, 0.05), Pose(x=2.0, y=0.1, z=0.05)),
        "box": (box((0.6, 0.7, 0.5), 0.1), Pose(x=11.0, y=-0.2, z=0.1)),
        "far ball": (sphere(0.5, 0.06), Pose(x=17.5, y=0.2, z=-0.1)),
    }
    actors = [
        Actor(name=name, kind="object", mesh=mesh_of(corners), pose=pose)
        for name, (corners, pose) in shapes.items()
    ]
    scene = around(actors, [(0.0, 0.0, 0.0), (LENGTH, 0.0, 0.0)])
    return world_of(scene, frequency=79e9, dynamic_range=1e6, table=material_table({}))


def intervals_of(world, bodies):
    """Ends of all blocked intervals, m of excess, one half-plane after the other."""
    start, end = world.scene.radar_position
    rotation = rotation_to((end - start) / LENGTH)
    none = np.zeros(0, dtype=np.int64)
    obstacles = obstacles_of(world, rotation, start, np.array(bodies), none)
    found = blocked_intervals(obstacles, LENGTH, 0.5, 1e-8)
    ends = [edge[:count, :, 0] for edge, count in zip(found.edge, found.filled, strict=True)]
    return found.filled, np.concatenate(ends)


@pytest.mark.parametrize("bodies", [(2, 1, 0), (1, 2, 0), (1, 0, 2)])
def test_the_order_of_bodies_does_not_change_what_is_blocked(bodies):
    world = in_the_way()
    filled, ends = intervals_of(world, (0, 1, 2))
    again, others = intervals_of(world, bodies)
    np.testing.assert_array_equal(again, filled)
    # what touches is one interval: ends may differ by what counts as touching
    np.testing.assert_allclose(others, ends, rtol=0, atol=1e-8)


def test_bodies_together_block_what_each_of_them_blocks():
    world = in_the_way()
    filled, ends = intervals_of(world, (0, 1, 2))
    first = np.concatenate([[0], np.cumsum(filled)])
    for body in range(3):
        count, alone = intervals_of(world, (body,))
        azimuth = np.repeat(np.arange(len(count)), count)
        for i, (near, far) in zip(azimuth, alone, strict=True):
            mine = ends[first[i] : first[i + 1]]
            assert np.any((mine[:, 0] <= near + 1e-8) & (mine[:, 1] >= far - 1e-8))
