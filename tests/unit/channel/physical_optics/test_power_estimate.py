"""Power of echoes in mirrors, estimated before they are computed."""

import numpy as np
import pytest

from polychirp.channel.base import strength, without_weak
from polychirp.channel.materials.library import material_table
from polychirp.channel.physical_optics.corner_terms import PairTable
from polychirp.channel.physical_optics.delay_cells import sum_in_cells
from polychirp.channel.physical_optics.illumination import facet_levels, illumination_of, media_of
from polychirp.channel.physical_optics.kernels import CELL_LENGTH
from polychirp.channel.physical_optics.power_estimate import (
    estimated_amplitudes,
    estimated_power,
    mark_needed_rows,
)
from polychirp.channel.physical_optics.term_sums import TRANSFER
from polychirp.channel.physical_optics.views import View
from polychirp.channel.scene.world import world_of
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.paths import Bounce
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, box, mesh_of, plate, sphere
from polychirp.traffic.vehicle import vehicle_mesh
from tests.support.references.physical_optics import scalar_scattered

FREQUENCY = 79e9
PAIRS = np.array([[0, 0], [0, 1], [1, 1]])


def lit(mesh, places):
    """Illumination of a body at the origin by radars at places."""
    scene = around([Actor(name="body", kind="object", mesh=mesh)], places)
    world = world_of(scene, frequency=FREQUENCY, dynamic_range=1e6, table=material_table({}))
    views = [View(world=world, radar=radar, body=0) for radar in range(len(places))]
    return illumination_of(world, 0, views).with_waves()


def table_of(seen, pairs, is_kept=None):
    """Table of pairs of views; all cells are kept unless a mask ``(pair, cell)`` is given."""
    least = [sum(seen.views[view].distance for view in pair) for pair in pairs]
    first_cell = np.floor(np.array(least) / CELL_LENGTH).astype(np.int64) - 1
    if is_kept is None:
        num_cells = int(4 * seen.world.radius[0] / CELL_LENGTH) + 5
        is_kept = np.ones((len(pairs), num_cells), dtype=bool)
    return PairTable(pairs, first_cell, is_kept)


def estimated(seen, pairs):
    """Amplitudes ``(pair, cell, 2)``."""
    surface, lit, k = seen.world.surfaces[0], seen.lit, seen.world.wavenumber
    faces, media = facet_levels(surface).faces, media_of(seen.world, surface.materials)
    return estimated_amplitudes(faces, media, lit, lit, table_of(seen, pairs), k)


def computed(seen, pairs, is_kept=None):
    """Moments ``(pair, cell, moment)``."""
    world, surface = seen.world, seen.world.surfaces[0]
    return sum_in_cells(
        facet_levels(surface).faces,
        facet_levels(surface).flats,
        media_of(world, surface.materials),
        seen.lit,
        seen.lit,
        table_of(seen, pairs, is_kept),
        np.zeros((len(pairs), 2, 3)),
        world.wavenumber,
    )


def test_the_estimate_is_the_plain_sum():
    corners = plate(0.3, 0.02)
    places = np.array([(4.0, 1.0, 0.5), (5.0, -2.0, 0.0)])
    found = np.sum(estimated(lit(mesh_of(corners), places), PAIRS), axis=1)
    for (t, x), value in zip(PAIRS, found, strict=True):
        expected = scalar_scattered(corners, places[t], places[x], FREQUENCY)
        assert value[0] == value[1] == pytest.approx(expected, rel=1e-6)


def test_the_estimate_of_a_flat_conductor_is_its_echo():
    """F is a turn of the polarisations times one number, out of the plane of incidence too."""
    seen = lit(mesh_of(plate(0.06, 0.02)), [(4.0, 1.0, 0.2), (1.0, -1.0, 4.0)])
    guess = estimated(seen, PAIRS)
    exact = computed(seen, PAIRS)
    transfer = np.sum(exact[:, :, TRANSFER], axis=1).reshape(-1, 2, 2)
    for total, matrix in zip(np.abs(np.sum(guess, axis=1)), transfer, strict=True):
        np.testing.assert_allclose(np.linalg.svd(matrix, compute_uv=False), total, rtol=0.02)


@pytest.mark.parametrize("body", ["sedan", "van"])
def test_cells_of_vehicles_are_not_underestimated(body):
    """No cell within 25 dB of the strongest, from any side; those below hold 2 % of the power.

    Underestimated cells hold rims of panes, which reflect the polarisations differently.
    """
    rng = np.random.default_rng(3)
    angle, away = rng.uniform(0, 2 * np.pi, 6), rng.uniform(6.0, 30.0, 6)
    places = np.stack([away * np.cos(angle), away * np.sin(angle), rng.uniform(0.3, 2, 6)], -1)
    seen = lit(vehicle_mesh(body), places)
    number = np.arange(len(seen.views))
    pairs = np.stack([number, np.roll(number, 1)], axis=-1)
    pairs = np.concatenate([pairs, np.stack([number, number], axis=-1)])
    guess = estimated(seen, pairs)
    exact = computed(seen, pairs)
    power = np.max(np.abs(exact[:, :, TRANSFER]) ** 2, axis=-1)
    guess = estimated_power(guess)
    is_low = guess < power
    assert not np.any(is_low & (power >= 10**-2.5 * power.max(axis=1, keepdims=True)))
    assert np.all(np.sum(power * is_low, axis=1) <= 0.02 * np.sum(power, axis=1))
    # nor are they much overestimated: a margin of 10, and a factor of 5
    strong = power >= 1e-3 * power.max(axis=1, keepdims=True)
    assert np.median(guess[strong] / power[strong]) < 50


@pytest.mark.parametrize("corners", [sphere(0.5, 0.03), box((0.8, 1.0, 0.6), 0.04)])
def test_kept_cells_do_not_depend_on_the_others(corners):
    """Nor on the facets that are in none: no border arises where they are left out."""
    seen = lit(mesh_of(corners), [(4.0, 1.0, 0.5), (5.0, -2.0, 0.0)])
    guess = estimated_power(estimated(seen, PAIRS))
    is_kept = guess >= np.median(guess[guess > 0])
    every = computed(seen, PAIRS)
    is_needed = np.zeros(len(seen.lit.face), dtype=bool)
    reach, table = seen.world.surfaces[0].reach, table_of(seen, PAIRS, is_kept)
    mark_needed_rows(reach, seen.lit, seen.lit, table, (is_needed, is_needed))
    assert 0.1 < np.mean(is_needed) < 0.9
    some = computed(seen.select(is_needed), PAIRS, is_kept)
    np.testing.assert_allclose(some[is_kept], every[is_kept], rtol=1e-12)
    assert not np.any(some[~is_kept])


def test_paths_in_mirrors_left_out_by_the_estimate_are_below_the_dynamic_range():
    """A sphere in front of a wall, seen by two radars that also receive each other directly."""
    wall = Actor(
        name="wall",
        kind="building",
        pose=Pose(y=6.0, yaw=-np.pi / 2),
        plates=(
            Plate(
                centre=(0, 0, 0),
                half_u=(0, 30, 0),
                half_v=(0, 0, 30),
                material="concrete",
                part="wall",
            ),
        ),
    )
    ball = Actor(name="ball", kind="object", mesh=mesh_of(sphere(0.5, 0.03)), pose=Pose(x=9.0))
    scene = around([ball, wall], [(0.0, 0.0, 0.0), (2.0, 2.0, 0.5)])
    every, some = (Composite(dynamic_range=r, max_bounces=1).trace(scene) for r in (1e20, 1e5))
    every = without_weak(every, scene, 1e5)
    mirrored = (every.bounce_kind == Bounce.REFLECTION).sum()
    assert mirrored > 10
    assert some.num_paths == every.num_paths
    np.testing.assert_allclose(np.sort(strength(some, scene)), np.sort(strength(every, scene)))
