"""Above its horizon a body hides nothing of itself."""

import numpy as np
import pytest

from polychirp.channel.geometry.bvh import Caster, grow_tree
from polychirp.channel.physical_optics.horizon import horizons
from polychirp.testing.shapes import box, sphere


def normals_of(corners):
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return cross / np.linalg.norm(cross, axis=-1, keepdims=True)


def test_no_ray_above_the_horizon_meets_the_body():
    """Rays start from the facets of two balls and a box, in all directions."""
    rng = np.random.default_rng(5)
    corners = np.concatenate(
        [
            sphere(0.5, 0.1),
            sphere(0.3, 0.1) + np.array([0.9, 0.2, 0.1]),
            box((0.2, 1.5, 0.4), 0.1) + np.array([0, 1, 0]),
        ]
    )
    chosen = rng.integers(0, len(corners), 300)
    normal = normals_of(corners)[chosen]
    point = corners[chosen].mean(axis=1) + 3e-3 * normal
    sine = horizons(grow_tree(corners), point, normal)
    way = rng.normal(size=(40, len(point), 3))
    way /= np.linalg.norm(way, axis=-1, keepdims=True)
    above = np.sum(way * normal, axis=-1) > sine
    assert 0.1 < np.mean(above) < 0.5
    starts = np.broadcast_to(point, way.shape)[above]
    assert not np.any(Caster(corners).occluded(starts, starts + 10.0 * way[above]))


def test_a_convex_body_has_no_horizon_over_its_planes():
    corners = box((1.0, 2.0, 0.5), 0.25)
    point, normal = corners.mean(axis=1), normals_of(corners)
    np.testing.assert_array_equal(horizons(grow_tree(corners), point + 1e-3 * normal, normal), 0.0)


@pytest.mark.parametrize("height", [0.2, 1.0])
def test_a_wall_has_the_horizon_of_its_top(height):
    """An upright wall at 2 m: its greatest height over its least distance at floor level."""
    wall = np.array([[[2.0, -1, 0], [2.0, 1, 0], [2.0, 0, height]]])
    found = horizons(grow_tree(wall), np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))
    assert found[0] == pytest.approx(height / 2)


def test_nothing_has_no_horizon():
    nothing = grow_tree(np.zeros((0, 3, 3)))
    assert horizons(nothing, np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))[0] == 0.0
