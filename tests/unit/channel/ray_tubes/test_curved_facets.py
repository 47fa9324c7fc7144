"""Normals and heights of the curved surfaces for which facets stand."""

import numpy as np
import pytest

from polychirp.channel.ray_tubes.curved_facets import (
    HEIGHTS,
    IS_CURVED,
    NORMALS,
    corner_normals,
    curved_facets,
)
from polychirp.channel.scene.world import surface_of
from polychirp.testing.shapes import box, dihedral, mesh_of, sphere

RADIUS = 0.5
BALL = sphere(RADIUS, 0.05)


def surface(corners):
    return surface_of(mesh_of(corners), ("opaque",))


def corners_of(one):
    return one.centroid[:, None] + one.corner


def test_normals_of_a_sphere_point_away_from_its_middle():
    ball = surface(BALL)
    away = corners_of(ball) / RADIUS
    assert np.max(np.linalg.norm(corner_normals(ball) - away, axis=-1)) < np.radians(0.5)


def test_a_sphere_lies_above_the_middles_of_its_edges_by_their_sagitta():
    ball = surface(BALL)
    corner, table = corners_of(ball), curved_facets(ball)
    for column, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
        middle = 0.5 * (corner[:, i] + corner[:, j])
        expected = RADIUS - np.linalg.norm(middle, axis=-1)
        found = table[:, HEIGHTS + column] / 4
        np.testing.assert_allclose(found, expected, atol=0.1 * np.max(expected))
    assert np.all(table[:, IS_CURVED] == 1)


@pytest.mark.parametrize("corners", [box((1.0, 0.5, 0.5), 0.1), dihedral(0.3, 0.1)])
def test_sharp_edges_stay_sharp(corners):
    flat = surface(corners)
    np.testing.assert_allclose(
        corner_normals(flat), np.repeat(flat.normal[:, None], 3, axis=1), atol=1e-12
    )
    assert not np.any(curved_facets(flat)[:, IS_CURVED])


def test_a_hollow_is_turned_inside_out():
    """Seen from within, a sphere has the opposite normals and heights."""
    out, hollow = (curved_facets(surface(s)) for s in (BALL, BALL[:, ::-1]))
    np.testing.assert_allclose(hollow[:, HEIGHTS + 1], -out[:, HEIGHTS + 1], rtol=1e-6)
    np.testing.assert_allclose(hollow[:, NORMALS : NORMALS + 3], -out[:, NORMALS + 6 :], atol=1e-9)
