"""CPU time of a snapshot over vehicles, radars and facets: data and figure of the docs.

    NUMBA_NUM_THREADS=1 python bench/scaling.py docs/images

writes scaling.png, and scaling.json beside it; some five minutes.
"""

import json
import sys
import time
from dataclasses import replace
from pathlib import Path

from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.traffic.vehicle import vehicle_mesh
from tools.figures.growth import growth_picture

REACH = 100.0
"""m: longer paths are not followed."""

GAP = 12.0
"""m from bumper to bumper and a car's length, in each of two lanes: dense town traffic."""

LONG = 10.0
"""s: beside that, preparing meshes is nothing."""

TRACERS = {
    "all mechanisms": Composite(max_length=REACH),
    "vehicles as points": PointVehicles(max_length=REACH),
}


def street(num_vehicles, num_radars, max_edge=0.05):
    """Two lanes with radars in front, on the vehicles in the middle."""
    mesh = vehicle_mesh("sedan", max_edge=max_edge)
    middle = GAP * num_vehicles / 4
    actors = []
    for number in range(num_vehicles):
        row, lane = divmod(number, 2)
        pose = Pose(x=GAP * (row + 0.5 * lane), y=3.5 * lane - 1.75, yaw=3.14159265 * lane)
        velocity = (12.0 - 24.0 * lane, 0.0, 0.0)
        actors.append(
            Actor(name=f"{number}", kind="vehicle", mesh=mesh, pose=pose, velocity=velocity)
        )
    plate = Plate(
        centre=(middle, 0, 0), half_u=(middle + 50, 0, 0), half_v=(0, 4, 0), material="asphalt",
        part="road",
    )  # fmt: skip
    first = (num_vehicles - num_radars) // 2
    return Scene(
        time=0.0,
        actors=(*actors, Actor(name="road", kind="road", plates=(plate,))),
        radars=tuple(Radar(name=f"{k}", mount=Pose(x=2.4, z=0.5)) for k in range(num_radars)),
        carriers=tuple(range(first, first + num_radars)),
    )


def seconds(tracer, scene):
    """CPU time of a snapshot after the first, the lesser of two; of the first if that is long."""
    times = []
    for number in range(3):
        moment = scene.at(number * 1e-3)
        start = time.process_time()
        tracer.trace(moment)
        times.append(time.process_time() - start)
        if times[0] > LONG:
            return times[0]
    return min(times[1:])


def curve(sizes, scene_of, tracers):
    lines = {name: [] for name in tracers}
    for size in sizes:
        scene = scene_of(size)
        for name, tracer in tracers.items():
            lines[name].append((size, round(seconds(tracer, scene), 4)))
            print(size, name, lines[name][-1][1], flush=True)
    return lines


def facet_curve():
    """Eight vehicles and four radars, bodies alone: the mesh is made finer."""
    lines = []
    for max_edge in (0.2, 0.1, 0.05, 0.025):
        scene = street(8, 4, max_edge)
        facets = sum(actor.mesh.num_faces for actor in scene.actors)
        tracer = replace(TRACERS["all mechanisms"], max_bounces=1, diffraction=False, diffuse=False)
        lines.append((facets, round(seconds(tracer, scene), 4)))
        print(facets, lines[-1][1], flush=True)
    return {"all mechanisms": lines}


def main(folder):
    panels = {
        "vehicles, with 4 radars": curve(
            (8, 16, 32, 64, 128, 200), lambda n: street(n, 4), TRACERS
        ),
        "radars, among 64 vehicles": curve((4, 8, 16, 32, 64), lambda n: street(64, n), TRACERS),
        "facets, single bounce": facet_curve(),
    }
    note = f"Two lanes, a vehicle every {GAP:g} m, paths up to {REACH:g} m, one thread"
    picture = growth_picture(panels, cost="CPU time of a snapshot (s)", note=note)
    (folder / "scaling.png").write_bytes(picture.png())
    (folder / "scaling.json").write_text(json.dumps(panels, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
