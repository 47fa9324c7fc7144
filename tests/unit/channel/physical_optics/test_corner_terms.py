"""Terms of many facets at a time are those of one after the other."""

import numpy as np
import pytest

from polychirp.channel.materials.library import material_table
from polychirp.channel.physical_optics.corner_terms import (
    BATCH,
    NEVER,
    batch,
    expand,
    fill,
    next_worthy,
    two_cells,
)
from polychirp.channel.physical_optics.illumination import lighting_of
from polychirp.channel.physical_optics.kernels import CELL, facet_terms
from polychirp.channel.physical_optics.views import View
from polychirp.channel.scene.world import world_of
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, sphere

PLACES = np.array([(4.0, 1.0, 0.5), (5.0, -2.0, 0.0)])


def lit_sphere():
    scene = around([Actor(name="ball", kind="object", mesh=mesh_of(sphere(0.5, 0.03)))], PLACES)
    world = world_of(scene, frequency=79e9, dynamic_range=1e6, table=material_table({}))
    return lighting_of(world, 0, [View(world=world, radar=radar, body=0) for radar in range(2)])


def filled():
    """A full batch of facets that both radars see, with its terms."""
    seen = lit_sphere()
    rows, area = seen.rows, seen.world.surfaces[0].area
    room, first_cell = batch(), int(7.0 / CELL)
    everything = next_worthy(np.ones(200, dtype=bool))
    ends = rows.start[1], rows.start[2]
    start = np.intersect1d(rows.face[: ends[0]], rows.face[ends[0] :])[0]
    a = int(np.flatnonzero(rows.face[: ends[0]] == start)[0])
    b = int(ends[0] + np.flatnonzero(rows.face[ends[0] :] == start)[0])
    count, *_ = fill(room, area, rows, rows, (a, b), ends, everything, first_cell)
    expand(room, count, seen.world.wavenumber, first_cell)
    return seen, room, count, first_cell


def test_lengths_are_those_over_the_corners():
    """To first order: what is left out is ρ²/2r of both legs, ρ from the centroid."""
    seen, room, count, _ = filled()
    assert count == BATCH
    surface = seen.world.surfaces[0]
    face = seen.rows.face[room.row[0]]
    corner = surface.centroid[face, None] + surface.corner[face]
    exact = sum(np.linalg.norm(corner - place, axis=-1) for place in PLACES)
    error = exact.T - room.length
    assert np.all(error >= -1e-12)
    assert np.max(error) < 2 * np.max(surface.reach) ** 2 / (2 * 3.5)


def test_plain_terms_are_those_of_one_facet():
    seen, room, count, first_cell = filled()
    assert 0.3 < np.mean(room.is_plain[:count]) < 1.0
    weight, place = np.empty(3, dtype=np.complex128), np.empty((3, 3))
    for i in range(count):
        terms = facet_terms(tuple(seen.world.wavenumber * room.length[:, i]), weight, place)
        assert room.is_plain[i] == (terms == 3)
        found = room.term[0, :, i] + 1j * room.term[1, :, i]
        expected = room.weight[i] * weight if terms == 3 else np.zeros(3)
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8 * room.weight[i])
        cell = np.floor(room.length[:, i] / CELL) - first_cell
        np.testing.assert_array_equal(room.cell[:, i], cell)


def test_facets_in_no_worthy_cell_are_left_out():
    seen = lit_sphere()
    rows, area = seen.rows, seen.world.surfaces[0].area
    nothing, ends = next_worthy(np.zeros(200, dtype=bool)), (rows.start[1], rows.start[2])
    place = 0, int(rows.start[1])
    assert fill(batch(), area, rows, rows, place, ends, nothing, int(7.0 / CELL))[0] == 0


def test_the_next_worthy_cell():
    found = next_worthy(np.array([False, True, False, False, True, False]))
    assert found.tolist() == [1, 1, 4, 4, 4, NEVER]


@pytest.mark.parametrize(("position", "cell", "share"), [(3.0, 3, 0.0), (3.5, 3, 0.5)])
def test_shares_of_two_cells(position, cell, share):
    assert two_cells(position) == (cell, pytest.approx(share))
