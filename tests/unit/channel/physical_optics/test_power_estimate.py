"""What echoes in mirrors are worth, estimated before they are computed."""

import numpy as np
import pytest

from polychirp.channel.base import strength, without_weak
from polychirp.channel.materials.library import material_table
from polychirp.channel.physical_optics.delay_cells import gather_cells
from polychirp.channel.physical_optics.illumination import lighting_of, media_of, parts_of
from polychirp.channel.physical_optics.kernels import CELL
from polychirp.channel.physical_optics.power_estimate import (
    estimated_power,
    mark_needed,
    scalar_cells,
)
from polychirp.channel.physical_optics.reference import scalar_scattered
from polychirp.channel.physical_optics.views import View
from polychirp.channel.scene.world import world_of
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.paths import Bounce
from polychirp.model.scene import Actor
from polychirp.testing.shapes import around, mesh_of, plate, sphere
from polychirp.traffic.vehicle import vehicle_mesh

FREQUENCY = 79e9
TASKS = np.array([[0, 0], [0, 1], [1, 1]])


def lit(mesh, places):
    """What radars at places see of a body at the origin."""
    scene = around([Actor(name="body", kind="object", mesh=mesh)], places)
    world = world_of(scene, frequency=FREQUENCY, dynamic_range=1e6, table=material_table({}))
    views = [View(world=world, radar=radar, body=0) for radar in range(len(places))]
    return lighting_of(world, 0, views).with_waves()


def first_cells(seen, tasks):
    least = [sum(seen.views[view].distance for view in task) for task in tasks]
    return np.floor(np.array(least) / CELL).astype(np.int64) - 1


def estimated(seen, tasks):
    """Amplitudes ``(task, cell, 2)``."""
    size = int(4 * seen.world.radius[0] / CELL) + 5
    surface, rows, k = seen.world.surfaces[0], seen.rows, seen.world.wavenumber
    faces, media = parts_of(surface).faces, media_of(seen.world, surface.materials)
    return scalar_cells(faces, media, rows, rows, tasks, first_cells(seen, tasks), size, k)


def computed(seen, tasks, worth):
    """Moments ``(task, cell, moment)``."""
    world, surface = seen.world, seen.world.surfaces[0]
    return gather_cells(
        parts_of(surface).faces,
        media_of(world, surface.materials),
        seen.rows,
        seen.rows,
        tasks,
        first_cells(seen, tasks),
        worth,
        np.zeros((len(tasks), 2, 3)),
        world.wavenumber,
    )


def test_the_estimate_is_the_plain_sum():
    corners = plate(0.3, 0.02)
    places = np.array([(4.0, 1.0, 0.5), (5.0, -2.0, 0.0)])
    found = np.sum(estimated(lit(mesh_of(corners), places), TASKS), axis=1)
    for (t, x), value in zip(TASKS, found, strict=True):
        expected = scalar_scattered(corners, places[t], places[x], FREQUENCY)
        assert value[0] == value[1] == pytest.approx(expected, rel=1e-6)


def test_the_estimate_of_a_flat_conductor_is_its_echo():
    """F is a turn of the polarisations times one number, out of the plane of incidence too."""
    seen = lit(mesh_of(plate(0.3, 0.02)), [(4.0, 1.0, 0.2), (1.0, -1.0, 4.0)])
    guess = estimated(seen, TASKS)
    exact = computed(seen, TASKS, np.ones(guess.shape[:2], dtype=bool))
    transfer = np.sum(exact[:, :, :4], axis=1).reshape(-1, 2, 2)
    for total, matrix in zip(np.abs(np.sum(guess, axis=1)), transfer, strict=True):
        np.testing.assert_allclose(np.linalg.svd(matrix, compute_uv=False), total, rtol=0.02)


@pytest.mark.parametrize("body", ["sedan", "van"])
def test_cells_of_vehicles_are_not_underestimated(body):
    """From any side, none within 25 dB of the strongest; those that are hold 2 % of the power.

    They are panes' rims, whose polarisations part.
    """
    rng = np.random.default_rng(3)
    angle, away = rng.uniform(0, 2 * np.pi, 6), rng.uniform(6.0, 30.0, 6)
    places = np.stack([away * np.cos(angle), away * np.sin(angle), rng.uniform(0.3, 2, 6)], -1)
    seen = lit(vehicle_mesh(body), places)
    number = np.arange(len(seen.views))
    tasks = np.stack([number, np.roll(number, 1)], axis=-1)
    tasks = np.concatenate([tasks, np.stack([number, number], axis=-1)])
    guess = estimated(seen, tasks)
    exact = computed(seen, tasks, np.ones(guess.shape[:2], dtype=bool))
    power = np.max(np.abs(exact[:, :, :4]) ** 2, axis=-1)
    guess = estimated_power(guess)
    is_low = guess < power
    assert not np.any(is_low & (power >= 10**-2.5 * power.max(axis=1, keepdims=True)))
    assert np.all(np.sum(power * is_low, axis=1) <= 0.02 * np.sum(power, axis=1))
    # nor are they much overestimated: a margin of 10, and a factor of 5
    strong = power >= 1e-3 * power.max(axis=1, keepdims=True)
    assert np.median(guess[strong] / power[strong]) < 50


def test_cells_that_are_worth_it_are_as_they_would_be_alone():
    seen = lit(mesh_of(sphere(0.5, 0.03)), [(4.0, 1.0, 0.5), (5.0, -2.0, 0.0)])
    guess = estimated_power(estimated(seen, TASKS))
    worth = guess >= np.median(guess[guess > 0])
    every = computed(seen, TASKS, np.ones(guess.shape[:2], dtype=bool))
    needed = np.zeros(len(seen.rows.face), dtype=bool)
    reach = seen.world.surfaces[0].reach
    rows, cells = seen.rows, first_cells(seen, TASKS)
    mark_needed(reach, rows, rows, TASKS, cells, worth, (needed, needed))
    assert 0.1 < np.mean(needed) < 0.9
    some = computed(seen.only(needed), TASKS, worth)
    np.testing.assert_allclose(some[worth], every[worth], rtol=1e-12)
    assert not np.any(some[~worth])


def test_what_is_left_out_in_mirrors_would_have_been_dropped():
    """A sphere before a wall, which two radars see beside each other's direct path."""
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
