"""Paths beyond the greatest length are not followed, and those within it are all there."""

import numpy as np

from polychirp.channel.tracers.composite import Composite
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of


def test_the_greatest_length_takes_away_what_is_longer_and_nothing_else():
    cube = mesh_of(box((1, 1, 1), 0.05))
    bodies = [
        Actor(name=f"{x:g} m", kind="vehicle", mesh=cube, pose=Pose(x=x, y=y, yaw=0.4))
        for x, y in ((5.0, 0.0), (8.0, 1.5), (30.0, -1.0))
    ]
    scene = around(bodies, [(0, 0, 0), (0, 12.0, 0)])
    everything = Composite(dynamic_range=1e9).trace(scene)
    for limit in (9.0, 22.0, 45.0):
        found = Composite(dynamic_range=1e9, max_length=limit).trace(scene)
        length = everything.delay * SPEED_OF_LIGHT
        assert found.num_paths
        assert np.max(found.delay) * SPEED_OF_LIGHT <= limit + 2.0  # a body's own depth
        kept = everything.select(length <= limit - 2.0)
        assert np.all(np.isin(kept.delay.round(13), found.delay.round(13)))
