"""Speed of diffraction: a plate's edges beside its area, and every pair of a street with a road."""

import time

import numpy as np
import pytest

from polychirp.channel.base import all_pairs
from polychirp.channel.diffraction.mirrored_paths import diffracted_mirror_paths
from polychirp.channel.diffraction.paths import diffracted_paths
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.testing.shapes import around, box, mesh_of, plate
from tests.support.references.diffraction import beside_obstacle

ENDS = [(0.0, 0.0, 0.0), (10.0, 0.0, 0.0)]


def test_a_plate_in_the_way(benchmark):
    """Both directions of one pair, against Kirchhoff's integral over 20 000 facets in one."""
    actor = Actor(name="plate", kind="object", pose=Pose(x=4.0), mesh=mesh_of(plate(0.4, 0.4)))
    scene = around([actor], ENDS)
    world, pairs = Composite().prepare(scene), all_pairs(scene)
    diffracted_paths(world, pairs)
    benchmark(diffracted_paths, world, pairs)
    fine, ends = plate(0.4, 4e-3) + np.array([4.0, 0, 0]), np.array(ENDS)
    start = time.perf_counter()
    beside_obstacle(fine, *ends, 79e9)
    slow = 2 * (time.perf_counter() - start)
    benchmark.extra_info["twin_over_kernel"] = slow / benchmark.stats.stats.min


def street(num_radars):
    """Cars of 5 cm facets in two lanes of a road, each with a radar ahead and, if many, another."""
    mesh = mesh_of(box((4.5, 1.8, 1.4), 0.05))
    num_cars = 8
    cars = tuple(
        Actor(
            name=f"car {i}",
            kind="vehicle",
            mesh=mesh,
            pose=Pose(
                x=10.0 * (i // 2) + 3.0 * (i % 2),
                y=3.5 * (i % 2) - 1.75,
                z=0.9,
                yaw=np.pi * (i % 2),
            ),
        )
        for i in range(num_cars)
    )
    plane = Plate(
        centre=(20, 0, 0), half_u=(60, 0, 0), half_v=(0, 8, 0), material="asphalt", part="road"
    )
    mounts = (Pose(x=2.26, z=-0.4), Pose(x=-2.26, z=-0.4, yaw=np.pi))
    return Scene(
        time=0.0,
        actors=(*cars, Actor(name="road", kind="road", plates=(plane,))),
        radars=tuple(Radar(name=str(i), mount=mounts[i // num_cars]) for i in range(num_radars)),
        carriers=tuple(i % num_cars for i in range(num_radars)),
    )


@pytest.mark.parametrize("num_radars", [4, 16])
def test_every_pair_of_a_street(benchmark, num_radars):
    scene = street(num_radars)
    world, pairs = Composite().prepare(scene), all_pairs(scene)
    diffracted_paths(world, pairs[:8])
    benchmark.pedantic(diffracted_paths, (world, pairs), rounds=3 if num_radars < 10 else 1)
    benchmark.extra_info["pairs"] = len(pairs) - num_radars


@pytest.mark.parametrize("num_radars", [4, 16])
def test_every_pair_of_a_street_by_way_of_the_road(benchmark, num_radars):
    """Every car obstructs twice, itself and by its image; the ratio is to the direct paths."""
    scene = street(num_radars)
    world, pairs = Composite().prepare(scene), all_pairs(scene)
    none = np.zeros((num_radars, num_radars))
    diffracted_mirror_paths(world, pairs[:8], none)
    benchmark.pedantic(
        diffracted_mirror_paths, (world, pairs, none), rounds=3 if num_radars < 10 else 1
    )
    began = time.perf_counter()
    diffracted_paths(world, pairs)
    direct = time.perf_counter() - began
    benchmark.extra_info["over_direct_paths"] = benchmark.stats.stats.min / direct
