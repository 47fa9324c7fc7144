"""Waves over edges do not depend on which of two radars comes first."""

import numpy as np
import pytest

from polychirp.channel.base import gather
from polychirp.channel.diffraction.paths import diffracted_paths
from polychirp.channel.direct.occluded import visible_line_of_sight
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, transfer_at


@pytest.mark.parametrize("seed", range(4))
def test_the_field_past_several_bodies_is_the_same_for_either_order_of_the_radars(seed):
    """In some half-planes more edges begin than end, so that not all of them go on."""
    draw = np.random.default_rng([53, seed])
    bodies = [
        Actor(
            name=f"body {number}",
            kind="object",
            pose=Pose(
                x=float(draw.uniform(5, 25)),
                y=float(draw.uniform(-1.0, 1.0)),
                z=float(draw.uniform(0.2, 1.5)),
                yaw=float(draw.uniform(-1, 1)),
            ),
            mesh=mesh_of(box(draw.uniform(0.1, 0.8, 3), 0.1)),
        )
        for number in range(6)
    ]
    ends = [(0.0, 0.0, 0.5), (30.0, 0.3, 0.8)]
    pairs, fields = np.array([[0, 1], [1, 0]]), []
    for places in (ends, ends[::-1]):
        world = Composite(dynamic_range=1e12).prepare(around(bodies, places))
        paths = gather([visible_line_of_sight(world, pairs), diffracted_paths(world, pairs)])
        fields.append(transfer_at(paths, 79e9, 0, 1)[0, 0])
    free = 3e8 / 79e9 / (4 * np.pi * 30.0)
    assert abs(fields[1] - fields[0]) < 1e-4 * free
