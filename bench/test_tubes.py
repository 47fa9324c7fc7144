"""Speed of ray tubes: a street through two bounces and more, and beside the slow twin."""

import time

import numpy as np
import pytest

from polychirp.channel.base import all_pairs
from polychirp.channel.materials.library import known_materials
from polychirp.channel.ray_tubes.paths import tube_paths
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.testing.shapes import around, box, dihedral, mesh_of
from tests.support.references.ray_tubes import PlainBody, multiple_bounces

CAR = (4.5, 1.8, 1.4)


def street():
    """Eight boxes of cars in two lanes, four of them with a radar; a road and two walls."""
    mesh = mesh_of(box(CAR, 0.05))
    places = [(x, -1.75, 0.0) for x in (0, -11, 25, 42)]
    places += [(x, 1.75, np.pi) for x in (-11, 5, 33, 43)]
    cars = [
        Actor(name=f"car {i}", kind="vehicle", mesh=mesh, pose=Pose(x=x, y=y, z=0.9, yaw=yaw))
        for i, (x, y, yaw) in enumerate(places)
    ]
    road = Plate(
        centre=(10, 0, 0), half_u=(60, 0, 0), half_v=(0, 4, 0), material="asphalt", part="r"
    )
    walls = [
        Plate(
            centre=(10, 8 * side, 4),
            half_u=(-60 * side, 0, 0),
            half_v=(0, 0, 4),
            material="brick",
            part="wall",
        )
        for side in (1, -1)
    ]
    front = Pose(x=CAR[0] / 2 + 0.01, z=-0.4)
    rear = Pose(x=-CAR[0] / 2 - 0.01, z=-0.4, yaw=np.pi)
    return Scene(
        time=0.0,
        actors=(*cars, Actor(name="street", kind="road", plates=(road, *walls))),
        radars=tuple(Radar(name=str(i), mount=rear if i == 0 else front) for i in range(4)),
        carriers=(0, 2, 5, 7),
    )


@pytest.mark.parametrize("tube", [0.02, 0.01], ids=["20 mm", "10 mm"])
def test_tubes_in_a_street(benchmark, tube):
    """4 × 4 radars over eight cars; of the second snapshot and after."""
    scene, tracer = street(), Composite()
    pairs = all_pairs(scene)
    tube_paths(tracer.prepare(scene), pairs, tube=tube)
    world = tracer.prepare(scene.at(1e-3))
    paths = benchmark(tube_paths, world, pairs, tube=tube)
    benchmark.extra_info["paths"] = paths.num_paths


def test_tubes_in_a_corner(benchmark):
    """A dihedral of 0.3 m by tubes of 10 mm, against one ray after the other."""
    corner, place = dihedral(0.3, 0.1), (10.0, 0.0, 0.0)
    scene = around([Actor(name="corner", kind="object", mesh=mesh_of(corner))], [place])
    world, pair = Composite().prepare(scene), np.array([[0, 0]])
    tube_paths(world, pair, tube=0.01)
    benchmark(tube_paths, world, pair, tube=0.01)
    body = PlainBody(corners=corner, material=known_materials()["metal"])
    ends = np.array(place), np.array(place)
    start = time.perf_counter()
    multiple_bounces([body], *ends, 79e9, tube=0.1)
    # a hundredth of the tubes, which the twin follows in both directions
    slow = 0.5 * 100 * (time.perf_counter() - start)
    benchmark.extra_info["twin_over_kernel"] = slow / benchmark.stats.stats.min
