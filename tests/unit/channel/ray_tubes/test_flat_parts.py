"""Flat parts with sharp edges: which faces they have, their borders, and contact between them."""

import numpy as np
import pytest

from polychirp.channel.ray_tubes.flat_parts import NO_PART, are_joined, flat_parts_of
from polychirp.channel.scene.world import surface_of
from polychirp.testing.shapes import box, mesh_of, plate, sphere


def parts(corners, role="opaque"):
    return flat_parts_of(surface_of(mesh_of(corners), (role,)))


def strip(*angles):
    """Faces of 0.2 m × 0.2 m in a row, each turned by an angle (deg) against the one before."""
    faces, at, turn = [], np.zeros(3), 0.0
    for angle in angles:
        turn += np.radians(angle)
        way, up = 0.2 * np.array([np.cos(turn), 0, np.sin(turn)]), np.array([0, 0.2, 0])
        faces += [[at, at + way, at + way + up], [at, at + way + up, at + up]]
        at = at + way
    return np.array(faces)


def test_a_box_has_six_parts_with_four_edges():
    """However many facets there are along an edge."""
    found = parts(box((0.7, 0.6, 0.5), 0.1))
    assert [len(part.border) for part in found.parts] == [4] * 6
    assert sorted(set(found.of_face)) == [0, 1, 2, 3, 4, 5]
    for part in found.parts:
        a, b = part.border[:, 0], part.border[:, 1]
        around = 0.5 * np.sum(np.cross(a - a.mean(axis=0), b - a.mean(axis=0)), axis=0)
        u, v = part.corner[:, 1] - part.corner[:, 0], part.corner[:, 2] - part.corner[:, 0]
        area = 0.5 * np.linalg.norm(np.cross(u, v), axis=1).sum()
        np.testing.assert_allclose(around, area * part.normal, atol=1e-9)


def test_curved_small_and_large_surfaces_and_panes_have_no_parts():
    assert not parts(sphere(0.5, 0.05)).parts
    assert not parts(plate(0.06, 0.06)).parts
    assert not parts(box((4.5, 1.8, 1.4), 0.1)).parts
    pane = parts(plate(0.5, 0.1), "pane")
    assert not pane.parts
    assert np.all(pane.of_face == NO_PART)


@pytest.mark.parametrize(("bend", "count"), [(10, 0), (30, 2), (90, 2)])
def test_a_part_ends_where_the_surface_bends_sharply(bend, count):
    """Along a gentle bend the reflected wave has no edge."""
    assert len(parts(strip(0, bend)).parts) == count


def test_in_line_with_a_gentle_bend_only_what_is_beyond_a_sharp_one_is_a_part():
    found = parts(strip(0, 10, 60))
    assert len(found.parts) == 1
    assert np.all(found.of_face == [NO_PART] * 4 + [0, 0])


@pytest.mark.parametrize(("gap", "is_joined"), [(0.0, True), (0.01, True), (0.05, False)])
def test_parts_are_joined_if_they_touch(gap, is_joined):
    """At right angles, edge to edge, and one that stands in the middle of the other."""
    (one,) = parts(plate(0.4, 0.1)).parts
    for shift in (0.0, 0.2):
        corners = plate(0.4, 0.1) @ np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]).T
        (other,) = parts(corners + np.array([0.2 + gap, 0.0, shift])).parts
        assert are_joined(one, other) == is_joined == are_joined(other, one)
