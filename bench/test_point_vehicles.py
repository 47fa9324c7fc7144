"""Cost of vehicles as points: it grows with vehicles and radars, not with their squares."""

import time

import numpy as np
import pytest

from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.traffic.vehicle import vehicle_mesh

BODIES = ("sedan", "hatchback", "van", "truck")
GAP = 25.0
"""Distance from a vehicle to the next in its lane, m: 40 in a kilometre, at 50 km/h."""
REACH = 300.0


def road(num_vehicles, num_radars):
    """Vehicles in two lanes, radars spread evenly among them, and the road."""
    num_rows = (num_vehicles + 1) // 2
    cars = []
    for number in range(num_vehicles):
        row, lane = divmod(number, 2)
        cars.append(
            Actor(
                name=f"car {number}",
                kind="vehicle",
                mesh=vehicle_mesh(BODIES[number % 4]),
                pose=Pose(x=GAP * (row + 0.3 * lane), y=3.5 * lane - 1.75, yaw=np.pi * lane),
                velocity=(14.0 * (1 - 2 * lane), 0.0, 0.0),
            )
        )
    middle = GAP * num_rows / 2
    plate = Plate(
        centre=(middle, 0, 0), half_u=(middle + 50, 0, 0), half_v=(0, 4, 0), material="asphalt",
        part="road",
    )  # fmt: skip
    carriers = np.linspace(0, num_vehicles - 1, num_radars).round().astype(int)
    ahead = Pose(x=3.7, z=0.5)
    return Scene(
        time=0.0,
        actors=(*cars, Actor(name="road", kind="road", plates=(plate,))),
        radars=tuple(Radar(name=str(k), mount=ahead) for k in range(num_radars)),
        carriers=tuple(carriers.tolist()),
    )


def timed(benchmark, scene, tracer):
    """Time a snapshot after the first, when all that never changes has been computed."""
    tracer.trace(scene)
    times = iter(np.arange(1, 100_000) * 1e-3)
    paths = benchmark(lambda: tracer.trace(scene.at(next(times))))
    benchmark.extra_info["paths"] = paths.num_paths


@pytest.mark.parametrize("vehicles", [8, 25, 50, 100, 200, 400])
def test_growing_with_vehicles(benchmark, vehicles):
    """Four radars in every eight vehicles, at one density."""
    scene = road(vehicles, vehicles // 2)
    timed(benchmark, scene, PointVehicles(max_length=REACH))


@pytest.mark.parametrize("radars", [4, 8, 16, 32, 64])
def test_growing_with_radars(benchmark, radars):
    """Among 200 vehicles on 2.5 km."""
    timed(benchmark, road(200, radars), PointVehicles(max_length=REACH))


@pytest.mark.parametrize("model", ["tables", "3gpp-one", "3gpp-five"])
def test_beside_facets(benchmark, model):
    """Eight vehicles and four radars: ratio of the durations with facets and with points."""
    scene, tracer, facets = road(8, 4), PointVehicles(model=model), Composite()
    facets.trace(scene)
    timed(benchmark, scene, tracer)
    times = []
    for _ in range(3):
        start = time.perf_counter()
        facets.trace(scene.at(1e-3))
        times.append(time.perf_counter() - start)
    benchmark.extra_info["facets_over_points"] = min(times) / benchmark.stats.stats.min
