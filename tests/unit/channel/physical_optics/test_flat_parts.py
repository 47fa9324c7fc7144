"""Flat parts of bodies: which facets they have, and the integral along a piece of their border."""

import numpy as np
import pytest
from scipy.integrate import quad

from polychirp.channel.physical_optics.flat_faces import NO_NEIGHBOUR, flats_of
from polychirp.channel.physical_optics.flat_terms import fresnel_tail
from polychirp.channel.scene.world import surface_of
from polychirp.testing.shapes import box, mesh_of, plate, sphere
from tests.support.kernels import callable_from_python


def flats(corners, medium=None):
    surface = surface_of(mesh_of(corners), ("opaque",))
    number = surface.medium if medium is None else medium
    return flats_of(surface.centroid, surface.normal, surface.corner, number)


def test_all_sides_of_a_box_are_flat_and_end_at_its_edges():
    """Each facet along an edge of the box has no neighbour there; seven cells by six by five."""
    found = flats(box((0.7, 0.6, 0.5), 0.1001))
    assert np.all(found.is_flat)
    around = 2 * 2 * ((7 + 6) + (6 + 5) + (5 + 7))
    assert np.sum(found.neighbour == NO_NEIGHBOUR) == around
    face, edge = np.nonzero(found.neighbour != NO_NEIGHBOUR)
    other = found.neighbour[face, edge]
    assert np.all(np.any(found.neighbour[other] == face[:, None], axis=1))


def test_neighbours_share_the_edge_that_is_named():
    corners = plate(0.5, 0.1)
    found = flats(corners)
    for face, edge in zip(*np.nonzero(found.neighbour != NO_NEIGHBOUR), strict=True):
        ends = corners[face][[edge, (edge + 1) % 3]]
        other = corners[found.neighbour[face, edge]]
        away = np.linalg.norm(other[:, None] - ends, axis=-1)
        assert np.sum(away < 1e-9) == 2


@pytest.mark.parametrize("corners", [sphere(0.5, 0.05), plate(0.1, 0.1), plate(0.1, 0.05)])
def test_curved_bodies_and_single_facets_have_no_flat_parts(corners):
    found = flats(corners)
    assert not found.has_any
    assert not np.any(found.is_flat)
    assert np.all(found.neighbour == NO_NEIGHBOUR)


def test_a_flat_part_ends_where_the_medium_changes():
    corners = plate(1.0, 0.1)
    is_left = corners.mean(axis=1)[:, 1] < 0
    found = flats(corners, is_left.astype(np.int64))
    assert np.all(found.is_flat)
    face, edge = np.nonzero(found.neighbour != NO_NEIGHBOUR)
    assert np.all(is_left[face] == is_left[found.neighbour[face, edge]])
    assert np.sum(found.neighbour == NO_NEIGHBOUR) == 2 * 2 * (10 + 5)


@pytest.mark.parametrize("slope", [0.0, 1.0, 30.0, 1000.0])
@pytest.mark.parametrize("bend", [1e-3, 5.0, 400.0])
def test_the_tail_of_a_quadratic_phase(slope, bend):
    """Against quadrature along a path on which the integrand falls: s turned by −45°."""
    turn = np.exp(-0.25j * np.pi)

    def integrand(s):
        return turn * np.exp(-1j * (slope * turn * s + 0.5 * bend * (turn * s) ** 2))

    far = 12.0 / max(np.sqrt(bend), slope * np.sqrt(0.5))
    real, imaginary = (
        quad(lambda s, part=part: part(integrand(s)), 0.0, far, epsabs=1e-12, limit=200)[0]
        for part in (np.real, np.imag)
    )
    found = callable_from_python(fresnel_tail)(slope, bend)
    assert found == pytest.approx(real + 1j * imaginary, rel=3e-5)
