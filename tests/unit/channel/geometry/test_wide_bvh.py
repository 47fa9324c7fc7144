"""The closest hit of a ray, found near boxes first."""

import numpy as np
import pytest

from polychirp.channel.geometry import wide_bvh
from polychirp.channel.geometry.bvh import grow_tree
from polychirp.channel.geometry.wide_bvh import (
    EITHER_KIND,
    OPAQUE_KIND,
    SHEET_KIND,
    Bundles,
    SearchRay,
    bundles_of,
    nearest_hit,
)
from polychirp.errors import InputError
from tests.support.kernels import callable_from_python
from tests.support.references.geometry import closest_by_trying_all

_nearest_hit = callable_from_python(nearest_hit)


def _rays_and_triangles(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    corner = random.uniform(-1, 1, (300, 1, 3))
    triangles = corner + random.normal(scale=0.15, size=(300, 3, 3))
    directions = random.normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return triangles, random.uniform(-2, 2, (400, 3)), directions


def _nearest(parts, origins, directions, *, span=(0.0, np.inf), wanted=EITHER_KIND, begin=(0, 0)):
    """Distances, and numbers of the triangles of ``parts``: opaque ones, then sheets."""
    trees = tuple(grow_tree(part) for part in parts)
    media = tuple(np.zeros(len(part), dtype=np.int64) for part in parts)
    found = bundles_of(trees, media, (OPAQUE_KIND, SHEET_KIND)[: len(parts)])
    bundles = Bundles(
        np.concatenate([np.zeros((begin[0], 64), dtype=np.float32), found.bundle]),
        np.concatenate([np.zeros((begin[1], 11)), found.triangle]),
        found.stack_size,
    )
    stack = np.empty(found.stack_size, dtype=np.float32)
    hits = [
        _nearest_hit(
            bundles, begin, SearchRay(tuple(o), tuple(d), span, float(-o @ d)), wanted, stack
        )
        for o, d in zip(origins, directions, strict=True)
    ]
    distance, number = (np.array(values) for values in zip(*hits, strict=True))
    start = np.cumsum([0] + [len(part) for part in parts])
    face = np.concatenate([t.face + s for t, s in zip(trees, start, strict=False)])
    return distance, face[number] if len(face) else number


@pytest.mark.parametrize("begin", [(0, 0), (3, 7)])
def test_near_boxes_first_finds_what_trying_all_triangles_finds(begin) -> None:
    """The hits are the same wherever in a table the tree begins."""
    triangles, origins, directions = _rays_and_triangles(1)
    distance, face = _nearest([triangles], origins, directions, begin=begin)
    length, expected = closest_by_trying_all(triangles, origins, directions)
    is_hit = np.isfinite(length)
    assert 50 < is_hit.sum() < 350
    np.testing.assert_array_equal(np.isfinite(distance), is_hit)
    np.testing.assert_array_equal(face[is_hit], expected[is_hit])
    # a rounding of the distance itself
    np.testing.assert_allclose(distance[is_hit], length[is_hit], rtol=1e-9)


@pytest.mark.parametrize("size", [1e-2, 1.0, 30.0])
def test_single_precision_loses_no_hit_from_far_away(size: float) -> None:
    """Rays from 300 m aim at corners and edges of small triangles, where boxes are narrowest."""
    triangles, origins, _ = _rays_and_triangles(3)
    triangles, origins = size * triangles, 300.0 * origins
    random = np.random.default_rng(4)
    weight = random.dirichlet([0.3, 0.3, 0.3], size=len(origins))
    aim = np.einsum("rc,rcx->rx", weight, triangles[random.integers(300, size=len(origins))])
    directions = aim - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    distance, _ = _nearest([triangles], origins, directions)
    length, _ = closest_by_trying_all(triangles, origins, directions)
    assert np.mean(np.isfinite(length)) > 0.9
    np.testing.assert_allclose(distance, length, rtol=1e-9)


def test_flat_trees_are_hit_along_the_axes() -> None:
    """A square in the plane x = 0.3, met by rays exactly along x, from both sides."""
    y, z = (
        np.array([[0.0, 1.0, 1.0], [0.0, 1.0, 0.0]]),
        np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 1.0]]),
    )
    square = np.stack([np.full((2, 3), 0.3), y, z], axis=-1)
    origins = np.array([[-1.0, 0.5, 0.25], [1.0, 0.5, 0.25], [-1.0, 1.5, 0.25]])
    ways = np.array([[1.0, 0.0, 0.0], [-1.0, -0.0, 0.0], [1.0, 0.0, 0.0]])
    np.testing.assert_allclose(_nearest([square], origins, ways)[0], [1.3, 0.7, np.inf])


def test_only_what_is_strictly_within_the_span_is_hit() -> None:
    triangles, origins, directions = _rays_and_triangles(2)
    anywhere, _ = _nearest([triangles], origins, directions)
    up_to, _ = _nearest([triangles], origins, directions, span=(0.0, 1.0))
    beyond, _ = _nearest([triangles], origins, directions, span=(1.0, np.inf))
    assert np.sum(anywhere < 1.0) > 20
    np.testing.assert_array_equal(up_to, np.where(anywhere < 1.0, anywhere, np.inf))
    assert np.all(beyond > 1.0)
    np.testing.assert_array_equal(np.where(anywhere < 1.0, up_to, beyond), anywhere)


def test_two_trees_are_one_and_either_kind_can_be_asked_for() -> None:
    triangles, origins, directions = _rays_and_triangles(5)
    parts = triangles[:200], triangles[200:]
    both, face = _nearest(parts, origins, directions)
    whole, expected = closest_by_trying_all(triangles, origins, directions)
    is_hit = np.isfinite(whole)
    np.testing.assert_allclose(both, whole, rtol=1e-9)
    np.testing.assert_array_equal(face[is_hit], expected[is_hit])
    for wanted, part in zip((OPAQUE_KIND, SHEET_KIND), parts, strict=True):
        some, _ = _nearest(parts, origins, directions, wanted=wanted)
        alone, _ = closest_by_trying_all(part, origins, directions)
        np.testing.assert_array_equal(np.isfinite(some), np.isfinite(alone))
        assert np.all(some[np.isfinite(alone)] >= alone[np.isfinite(alone)] * (1 - 1e-9))


def test_more_trees_than_a_row_has_boxes_are_refused() -> None:
    tree, medium = grow_tree(_rays_and_triangles(7)[0]), np.zeros(300, dtype=np.int64)
    eight = bundles_of(8 * (tree,), 8 * (medium,), 8 * (OPAQUE_KIND,))
    assert len(eight.triangle) == 2400
    with pytest.raises(InputError, match="9 trees of triangles are searched together; use at most"):
        bundles_of(9 * (tree,), 9 * (medium,), 9 * (OPAQUE_KIND,))


def test_more_triangles_than_single_precision_can_count_are_refused(monkeypatch) -> None:
    monkeypatch.setattr(wide_bvh, "GREATEST_LINK", 299)
    tree, medium = grow_tree(_rays_and_triangles(7)[0]), np.zeros(300, dtype=np.int64)
    with pytest.raises(InputError, match=r"trees of 300 triangles .* are too large"):
        bundles_of((tree,), (medium,), (OPAQUE_KIND,))


def test_a_tree_without_triangles_is_never_hit() -> None:
    nothing, (_, origins, directions) = np.zeros((0, 3, 3)), _rays_and_triangles(6)
    assert np.all(_nearest([nothing, nothing], origins[:9], directions[:9])[0] == np.inf)
