"""Terms of many facets at a time are those of one after the other."""

import numpy as np
import pytest

from polychirp.channel.materials.library import material_table
from polychirp.channel.physical_optics.corner_terms import (
    BATCH_SIZE,
    BEYOND_ALL_CELLS,
    PairTable,
    divide_row,
    empty_batch,
    expand_terms,
    fill_batch,
    next_kept_cells,
    two_cells,
    view_pair,
)
from polychirp.channel.physical_optics.facet_integral import facet_terms
from polychirp.channel.physical_optics.illumination import faces_of, facet_levels, illumination_of
from polychirp.channel.physical_optics.kernels import CELL_LENGTH
from polychirp.channel.physical_optics.views import View
from polychirp.channel.scene.world import surface_of, world_of
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, sphere
from tests.support.kernels import callable_from_python

PLACES = np.array([(4.0, 1.0, 0.5), (5.0, -2.0, 0.0)])


def lit_sphere():
    scene = around([Actor(name="ball", kind="object", mesh=mesh_of(sphere(0.5, 0.03)))], PLACES)
    world = world_of(scene, frequency=79e9, dynamic_range=1e6, table=material_table({}))
    return illumination_of(world, 0, [View(world=world, radar=radar, body=0) for radar in range(2)])


def pair_of(seen, is_kept):
    """The two radars' views with cells from 7 m on, and their first common facet."""
    first_cell = np.array([int(7.0 / CELL_LENGTH)])
    return view_pair(seen.lit, seen.lit, PairTable(np.array([[0, 1]]), first_cell, is_kept), 0)


def facets(seen):
    """The facets, the wavenumber, and the mark that none is done."""
    faces = facet_levels(seen.world.surfaces[0]).faces
    return faces, seen.world.wavenumber, np.zeros(len(faces.area), dtype=np.int8)


def filled():
    """A full batch of facets that both radars see, with its terms."""
    seen, batch = lit_sphere(), empty_batch()
    pair, place = pair_of(seen, np.ones((1, 200), dtype=bool))
    count, _ = fill_batch(batch, pair, *facets(seen), place)
    expand_terms(batch, count, seen.world.wavenumber, pair.first_cell)
    return seen, batch, count, pair.first_cell


def test_lengths_are_those_over_the_corners():
    """To first order: what is left out is ρ²/2r of both legs, ρ from the centroid."""
    seen, batch, count, _ = filled()
    assert count == BATCH_SIZE
    assert np.all(batch.scale[:count] == 1.0)  # facets so small are not divided
    surface = seen.world.surfaces[0]
    face = seen.lit.face[batch.row[0, :count]]
    corner = surface.centroid[face, None] + surface.corner[face]
    exact = sum(np.linalg.norm(corner - place, axis=-1) for place in PLACES)
    error = exact.T - batch.length[:, :count]
    assert np.all(error >= -1e-12)
    assert np.max(error) < 2 * np.max(surface.reach) ** 2 / (2 * 3.5)


def test_parts_of_a_facet_have_exact_lengths_about_their_middles():
    """Parts fill the whole; each length is wrong by ρ²/2r, with ρ from the part's own middle."""
    corners = np.array([[(0.0, -0.05, -0.04), (0.02, 0.07, -0.05), (-0.01, 0.0, 0.06)]])
    middle = corners.mean(axis=1)
    faces = faces_of(surface_of(mesh_of(corners), ("opaque",)))
    places = middle + np.array([(2.0, 0.3, 0.1), (1.5, -0.4, 0.0)])
    ways = middle - places
    length = np.linalg.norm(ways, axis=1)
    legs = tuple(tuple(way) for way in ways / length[:, None])
    batch, strips = empty_batch(), 3
    batch.row[:, 0] = 7, 8
    batch.weight[0], batch.facing[0], batch.aside[0] = 1.0, 2.0, 0.1
    batch.length[:, 0] = length.sum() + faces.corner[0] @ np.sum(legs, axis=0)
    callable_from_python(divide_row)(batch, 0, strips, faces.corner, 0, legs, tuple(1.0 / length))
    parts = slice(strips**2)
    assert batch.weight[parts].sum() == pytest.approx(1.0)
    assert np.all(batch.row[:, parts] == np.array([[7], [8]]))
    moment = batch.weight[parts] @ batch.shift[:, parts].T
    np.testing.assert_allclose(moment, 0.0, atol=1e-17)
    point = batch.shift[:, parts].T[:, None] + batch.scale[parts, None, None] * faces.corner[0]
    assert len(np.unique(np.round(point.reshape(-1, 3), 9), axis=0)) == 10  # shared corners
    exact = sum(np.linalg.norm(middle + point - place, axis=-1) for place in places)
    reach = np.max(np.linalg.norm(faces.corner[0], axis=-1)) / strips
    error = exact - batch.length[:, parts].T
    assert np.max(np.abs(error)) < 1.05 * reach**2 * np.sum(0.5 / length)
    assert np.max(np.abs(error)) > 0.3 * reach**2 * np.sum(0.5 / length)


def test_plain_terms_are_those_of_one_facet():
    seen, batch, count, first_cell = filled()
    assert 0.3 < np.mean(batch.is_plain[:count]) < 1.0
    weight, place = np.empty(3, dtype=np.complex128), np.empty((3, 3))
    for i in range(count):
        terms = facet_terms(tuple(seen.world.wavenumber * batch.length[:, i]), weight, place)
        assert batch.is_plain[i] == (terms == 3)
        found = batch.term[0, :, i] + 1j * batch.term[1, :, i]
        expected = batch.weight[i] * weight if terms == 3 else np.zeros(3)
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8 * batch.weight[i])
        cell = np.floor(batch.length[:, i] / CELL_LENGTH) - first_cell
        np.testing.assert_array_equal(batch.cell[:, i], cell)


def test_the_first_place_is_the_first_facet_that_both_views_see():
    seen = lit_sphere()
    pair, place = pair_of(seen, np.ones((1, 200), dtype=bool))
    face, (first, second) = seen.lit.face, np.split(seen.lit.face, [pair.end.first])
    assert pair.end == (seen.lit.start[1], seen.lit.start[2])
    assert face[place.first] == face[place.second] == np.intersect1d(first, second)[0]


def test_facets_in_no_kept_cell_are_left_out():
    seen = lit_sphere()
    pair, place = pair_of(seen, np.zeros((1, 200), dtype=bool))
    assert fill_batch(empty_batch(), pair, *facets(seen), place) == (0, pair.end)


def test_facets_that_are_done_are_left_out():
    seen = lit_sphere()
    pair, place = pair_of(seen, np.ones((1, 200), dtype=bool))
    faces, wavenumber, is_done = facets(seen)
    is_done[::2] = 1
    batch = empty_batch()
    count, _ = fill_batch(batch, pair, faces, wavenumber, is_done, place)
    assert count > 0
    assert np.all(seen.lit.face[batch.row[0, :count]] % 2 == 1)


def test_the_next_kept_cell():
    found = next_kept_cells(np.array([False, True, False, False, True, False]))
    assert found.tolist() == [1, 1, 4, 4, 4, BEYOND_ALL_CELLS]


@pytest.mark.parametrize(("position", "cell", "share"), [(3.0, 3, 0.0), (3.5, 3, 0.5)])
def test_shares_of_two_cells(position, cell, share):
    assert callable_from_python(two_cells)(position) == (cell, pytest.approx(share))
