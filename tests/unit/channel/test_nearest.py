"""The closest hit of a ray, found near boxes first."""

import numpy as np
import pytest

from polychirp.channel.caster import closest_by_trying_all, grow_tree
from polychirp.channel.nearest import DEPTH, nearest_hit


def _rays_and_triangles(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    corner = random.uniform(-1, 1, (300, 1, 3))
    triangles = corner + random.normal(scale=0.15, size=(300, 3, 3))
    return triangles, random.uniform(-2, 2, (400, 3)), random.normal(size=(400, 3))


def _nearest(triangles, origins, directions, span, room):
    tree, waiting = grow_tree(triangles), np.empty(room, dtype=np.int64)
    found = [
        nearest_hit(*tree[:5], (0, tree.skip.size), tuple(o), tuple(d), span, waiting)
        for o, d in zip(origins, directions, strict=True)
    ]
    distance, number = (np.array(values) for values in zip(*found, strict=True))
    return distance, tree.face[number]


@pytest.mark.parametrize("room", [DEPTH, 2, 0])
def test_near_boxes_first_finds_what_trying_all_triangles_finds(room: int) -> None:
    """However few boxes may wait: with no room at all, the tree is walked as it is stored."""
    triangles, origins, directions = _rays_and_triangles(1)
    distance, face = _nearest(triangles, origins, directions, (0.0, np.inf), room)
    length, expected = closest_by_trying_all(triangles, origins, directions)
    is_hit = np.isfinite(length)
    assert 50 < is_hit.sum() < 350
    np.testing.assert_array_equal(np.isfinite(distance), is_hit)
    np.testing.assert_array_equal(face[is_hit], expected[is_hit])
    along = distance * np.linalg.norm(directions, axis=1)
    # a rounding of the distance itself
    np.testing.assert_allclose(along[is_hit], length[is_hit], rtol=1e-9)


def test_only_what_is_strictly_within_the_span_is_hit() -> None:
    triangles, origins, directions = _rays_and_triangles(2)
    anywhere, _ = _nearest(triangles, origins, directions, (0.0, np.inf), DEPTH)
    up_to, _ = _nearest(triangles, origins, directions, (0.0, 0.5), DEPTH)
    beyond, _ = _nearest(triangles, origins, directions, (0.5, np.inf), DEPTH)
    np.testing.assert_array_equal(up_to, np.where(anywhere < 0.5, anywhere, np.inf))
    assert np.all(beyond > 0.5)
    np.testing.assert_array_equal(np.where(anywhere < 0.5, up_to, beyond), anywhere)


def test_a_tree_without_triangles_is_never_hit() -> None:
    tree, waiting = grow_tree(np.zeros((0, 3, 3))), np.empty(DEPTH, dtype=np.int64)
    nodes, start, way = (0, tree.skip.size), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)
    distance, _ = nearest_hit(*tree[:5], nodes, start, way, (0.0, np.inf), waiting)
    assert distance == np.inf
