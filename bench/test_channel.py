"""Speed of the channel: facets, rays and a whole street, beside their slow twins."""

import time

import numpy as np
import pytest

from polychirp.channel.geometry.bvh import Caster
from polychirp.channel.materials.library import known_materials
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.testing.shapes import around, box, mesh_of, sphere
from tests.support.references.geometry import closest_by_trying_all
from tests.support.references.physical_optics import scattered

CAR = (4.5, 1.8, 1.4)


def seconds(work):
    """Duration of the fastest of three calls, s."""
    times = []
    for _ in range(3):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def record_ratio(benchmark, fast, slow, share):
    """Record the time of the slow reference, run for a ``share``, over that of the kernel."""
    benchmark.extra_info["twin_over_kernel"] = slow / share / fast


def test_facets_of_one_body(benchmark):
    """Own echo of a sphere of 120 000 facets, occlusion included, against NumPy."""
    corners = sphere(0.5, 8e-3)
    scene = around([Actor(name="b", kind="object", mesh=mesh_of(corners))], [(8.0, 0, 0.5)])
    tracer = Composite()
    tracer.trace(scene)
    benchmark(tracer.trace, scene)
    metal, part = known_materials()["metal"], corners[::50]
    place = np.array([8.0, 0.0, 0.5])
    slow = seconds(lambda: scattered(part, metal, place, place, 79e9))
    fast = benchmark.stats.stats.min
    # the twin takes all facets for lit, and a facet both ways; half of them, one way, are enough
    record_ratio(benchmark, fast, slow / 4, len(part) / len(corners))
    benchmark.extra_info["facets"] = len(corners)


@pytest.mark.parametrize("query", ["closest", "occluded"])
def test_rays_at_a_sphere(benchmark, query):
    """A million rays a second and more, at 120 000 triangles."""
    corners = sphere(1.0, 16e-3)
    rng = np.random.default_rng(0)
    origins = rng.normal(size=(100_000, 3))
    origins *= 3 / np.linalg.norm(origins, axis=-1, keepdims=True)
    ends = 0.7 * rng.normal(size=origins.shape)
    caster = Caster(corners)
    ways = ends - origins if query == "closest" else ends
    work = getattr(caster, query)
    work(origins[:8], ways[:8])
    benchmark(work, origins, ways)
    slow = seconds(lambda: closest_by_trying_all(corners, origins[:4], (ends - origins)[:4]))
    record_ratio(benchmark, benchmark.stats.stats.min, slow, 4 / len(origins))


def test_growing_a_tree(benchmark):
    corners = sphere(1.0, 16e-3)
    Caster(corners[:100])
    benchmark(Caster, corners)


def street():
    """Eight boxes of cars in two lanes, four of them with a radar; road and twelve houses."""
    mesh = mesh_of(box(CAR, 0.05))

    def car(name, x, y, yaw, speed):
        return Actor(
            name=name,
            kind="vehicle",
            mesh=mesh,
            pose=Pose(x=x, y=y, z=0.9, yaw=yaw),
            velocity=(speed * np.cos(yaw), 0.0, 0.0),
        )

    def brick(centre, half_u):
        return Plate(centre=centre, half_u=half_u, half_v=(0, 0, 4), material="brick", part="wall")

    right = [car(f"right {i}", x, -1.75, 0.0, 12.0) for i, x in enumerate((0, -11, 25, 42))]
    left = [car(f"left {i}", x, 1.75, np.pi, 10.0) for i, x in enumerate((-11, 5, 33, 43))]
    road = Actor(
        name="road",
        kind="road",
        plates=(
            Plate(
                centre=(10, 0, 0), half_u=(60, 0, 0), half_v=(0, 4, 0), material="asphalt", part="r"
            ),
        ),
    )
    houses = [
        Actor(
            name=f"house {x} {y}",
            kind="building",
            pose=Pose(x=x, y=y, yaw=0.0 if y < 0 else np.pi),
            plates=(
                brick(centre=(0, 0, 4), half_u=(-6, 0, 0)),
                brick(centre=(6, -4, 4), half_u=(0, 4, 0)),
            ),
        )
        for x in range(-25, 70, 16)
        for y in (-8, 8)
    ]  # fmt: skip
    front = Pose(x=CAR[0] / 2 + 0.01, z=-0.4)
    rear = Pose(x=-CAR[0] / 2 - 0.01, z=-0.4, yaw=np.pi)
    return Scene(
        time=0.0,
        actors=(*right, *left, road, *houses),
        radars=(
            Radar(name="1", mount=rear),
            Radar(name="2", mount=front),
            Radar(name="3", mount=front),
            Radar(name="4", mount=front),
        ),
        carriers=(0, 2, 5, 7),
    )


@pytest.mark.parametrize("planes", [False, True], ids=["direct", "with mirrors"])
def test_a_snapshot_of_a_street(benchmark, planes):
    """4 × 4 radars; of the second snapshot and after, when meshes have been prepared."""
    scene, tracer = street(), Composite(reflecting_planes=planes)
    tracer.trace(scene)
    times = iter(np.arange(1, 10_000) * 1e-3)
    paths = benchmark(lambda: tracer.trace(scene.at(next(times))))
    benchmark.extra_info["paths"] = paths.num_paths
    benchmark.extra_info["facets"] = sum(actor.mesh.num_faces for actor in scene.actors)
