"""The tree of boxes finds what trying every triangle finds."""

import numpy as np
import pytest

from polychirp.channel.geometry.bvh import Caster
from polychirp.frames import Pose
from polychirp.testing.shapes import box, plate, sphere
from tests.support.references.geometry import closest_by_trying_all


def rays(count, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, 3)) * 2, rng.normal(size=(count, 3))


def soup(count, seed=1):
    """Triangles in disorder, some of them degenerate."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(count, 1, 3)) + 0.3 * rng.normal(size=(count, 3, 3))
    corners[::50, 1] = corners[::50, 0]
    return corners


@pytest.mark.parametrize("corners", [soup(1), soup(300), sphere(1.0, 0.2), box((1, 2, 0.5), 0.3)])
def test_the_tree_finds_the_closest_triangle(corners):
    origins, directions = rays(400)
    distance, face = Caster(corners).closest(origins, directions)
    expected, number = closest_by_trying_all(corners, origins, directions)
    is_hit = np.isfinite(expected)
    np.testing.assert_array_equal(np.isfinite(distance), is_hit)
    np.testing.assert_allclose(distance[is_hit], expected[is_hit], rtol=1e-12)
    # an edge belongs to two faces, so faces may differ where distances do not
    assert np.mean(face[is_hit] == number[is_hit]) > 0.99 if np.any(is_hit) else True


def test_a_ray_is_occluded_where_a_hit_is_strictly_between():
    corners = soup(200)
    origins, directions = rays(400, seed=3)
    expected, _ = closest_by_trying_all(corners, origins, directions)
    length = np.linalg.norm(directions, axis=-1)
    found = Caster(corners).occluded(origins, origins + directions)
    np.testing.assert_array_equal(found, expected < length)


def test_a_ray_that_ends_on_a_triangle_is_free():
    wall = np.array([[[1.0, -1, -1], [1, 1, -1], [1, 0, 1]]])
    caster = Caster(wall)
    assert not caster.occluded([[0, 0, 0]], [[1.0, 0, 0]])[0]
    assert caster.occluded([[0, 0, 0]], [[1.0 + 1e-9, 0, 0]])[0]
    assert not caster.occluded([[1.0, 0, 0]], [[2.0, 0, 0]])[0]


def test_rays_along_an_axis_and_through_flat_boxes_are_found():
    """Directions with zeros meet boxes without extent along them."""
    caster = Caster(box((1, 1, 1), 0.5))
    for axis in range(3):
        start, way = np.full((1, 3), 0.1), np.zeros((1, 3))
        start[0, axis], way[0, axis] = -3.0, 1.0
        assert caster.closest(start, way)[0][0] == pytest.approx(2.5)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_ray_in_the_plane_in_which_a_triangle_ends_meets_it(axis, side):
    """Radars of one lane see panes and bodies whose edges lie in the plane of the sight line."""
    along = (axis + 1) % 3
    corners = np.zeros((1, 3, 3))
    corners[0, :, along] = 5.0
    corners[0, :2, (axis + 2) % 3] = -1.0, 1.0
    corners[0, 2, axis] = side
    start, end = np.zeros((1, 3)), np.zeros((1, 3))
    end[0, along] = 10.0
    caster = Caster(corners)
    assert caster.occluded(start, end)[0]
    assert caster.closest(start, end - start)[0][0] == pytest.approx(5.0)


@pytest.mark.parametrize("tilt", [0.0, 1.2, 1.5])
def test_no_ray_slips_through_between_two_triangles(tilt):
    """Through edges and corners of a sheet that is turned about all axes, from 20 m away."""
    rng = np.random.default_rng(7)
    turned = Pose(x=1.0, y=2.0, z=3.0, yaw=0.7, pitch=0.2, roll=-0.3)
    caster = Caster(turned.to_outer(plate(4.0, 0.2).reshape(-1, 3)).reshape(-1, 3, 3))
    places = 0.2 * rng.integers(-8, 9, (4000, 2)).astype(float)
    places[::2, 1] = rng.uniform(-1.6, 1.6, 2000)  # on an edge; the others are on a corner
    around = rng.uniform(0.0, 2 * np.pi, 4000)
    way = np.stack(
        [np.full(4000, np.cos(tilt)), *(np.sin(tilt) * f(around) for f in (np.cos, np.sin))]
    )
    place = turned.to_outer(np.column_stack([np.zeros(4000), places]))
    way = way.T @ turned.rotation.T
    assert caster.occluded(place - 20.0 * way, place + 20.0 * way).all()


def test_a_ray_crosses_a_closed_body_as_often_in_as_out():
    """From far away, the number of successive hits is even."""
    caster = Caster(sphere(1.0, 0.3))
    origins, directions = rays(50, seed=5)
    directions = -origins + 0.5 * directions
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    places = origins - 10 * directions
    crossings = np.zeros(len(places), dtype=int)
    for _ in range(4):
        distance, _ = caster.closest(places, directions)
        is_hit = np.isfinite(distance)
        crossings += is_hit
        places = places + np.where(is_hit, distance + 1e-6, 0.0)[:, None] * directions
        if not np.any(is_hit):
            break
    assert set(crossings) == {0, 2}


def test_nothing_is_hit_where_there_is_nothing():
    caster = Caster(np.zeros((0, 3, 3)))
    distance, _ = caster.closest(np.zeros((2, 3)), np.ones((2, 3)))
    assert np.all(np.isinf(distance))
    assert not np.any(caster.occluded(np.zeros((2, 3)), np.ones((2, 3))))
