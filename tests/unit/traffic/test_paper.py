"""The paper's street has its distances: geometry to 5 mm, and free sights."""

from itertools import pairwise

import numpy as np
import pytest

from polychirp.model.mesh import Mesh
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.traffic.paper import LANE_1, LANE_2, paper_mounts, paper_street
from polychirp.traffic.street import overlap

TOLERANCE = 5e-3


@pytest.fixture(scope="module")
def scene() -> Scene:
    radars = [(Radar(name=name, mount=mount), car) for name, (car, mount) in paper_mounts().items()]
    return paper_street().scene(radars)


def surface(actor: Actor, *materials: str) -> np.ndarray:
    """Triangles in the world, ``(face, corner, xyz)``."""
    mesh: Mesh = actor.mesh
    chosen = np.isin(mesh.material, [k for k, m in enumerate(mesh.materials) if m in materials])
    return actor.pose.to_outer(mesh.corners[chosen])


@pytest.fixture(scope="module")
def opaque(scene) -> np.ndarray:
    return np.concatenate(
        [surface(a, "metal", "rubber", "wood", "leaf") for a in scene.actors if a.mesh.num_faces]
    )


def metal(scene: Scene, name: str) -> np.ndarray:
    """Corners ``(face, corner, xyz)`` of the metal of the actor called ``name``."""
    (actor,) = (actor for actor in scene.actors if actor.name == name)
    return surface(actor, "metal")


def nearest(scene: Scene, radar: str, target: str, closest) -> tuple[float, np.ndarray]:
    origin = scene.radar_position[scene.radar_index(radar)]
    distance, place = closest(origin, metal(scene, target))
    number = int(np.argmin(distance))
    return float(distance[number]), place[number]


@pytest.mark.parametrize(
    ("radar", "target", "distance"),
    [
        ("vehicle-1", "target-4", 6.50),
        ("vehicle-1", "target-3", 9.15),
        ("vehicle-2", "target-2", 12.60),
        ("vehicle-2", "vehicle-4", 13.65),
    ],
)
def test_the_nearest_metal_of_each_target_is_visible_where_the_paper_has_it(
    scene, opaque, radar, target, distance, closest, blocked
):
    found, place = nearest(scene, radar, target, closest)
    assert found == pytest.approx(distance, abs=TOLERANCE)
    assert not blocked(scene.radar_position[scene.radar_index(radar)], place, opaque)


def test_the_oncoming_radar_is_at_twice_its_ghost(scene, opaque, blocked):
    two, four = (scene.radar_position[scene.radar_index(f"vehicle-{k}")] for k in (2, 4))
    assert np.linalg.norm(two - four) == pytest.approx(13.20, abs=TOLERANCE)
    assert np.linalg.norm(two - four) / 2 == pytest.approx(6.60, abs=TOLERANCE)
    assert not blocked(two, four, opaque)


def test_indirect_ghosts_are_clear_of_the_targets(scene, opaque, closest, blocked):
    """A one-way path of d₁ + d₂ is read as a range of half of it.

    The shortest path over a body is bounded from above by the point nearest to either radar.
    """
    one, three = (scene.radar_position[scene.radar_index(f"vehicle-{k}")] for k in (1, 3))
    ghosts = []
    for target in ("target-4", "target-3"):
        centres = metal(scene, target).mean(axis=1)
        way = np.linalg.norm(centres - one, axis=1) + np.linalg.norm(centres - three, axis=1)
        place = centres[np.argmin(way)]
        assert not blocked(three, place, opaque)
        assert not blocked(one, place, opaque)
        ghosts.append(way.min() / 2)
    assert ghosts == pytest.approx([5.6, 7.4], abs=0.05)
    for ghost in ghosts:
        assert min(abs(ghost - 6.50), abs(ghost - 9.15)) >= 0.6


def test_radars_sit_in_the_open_half_a_metre_high_and_look_along_the_road(scene, closest):
    for k, forward in enumerate((-1, 1, -1, -1)):
        assert scene.radar_rotation[k][:, 0] == pytest.approx([forward, 0, 0], abs=1e-12)
        assert scene.radar_position[k][2] == 0.5
        for actor in scene.actors:
            if actor.kind == "vehicle":
                corners = actor.pose.to_outer(actor.mesh.corners)
                assert closest(scene.radar_position[k], corners)[0].min() > 0.013
    assert scene.radar_position[0][0] - scene.radar_position[2][0] == pytest.approx(3.0, abs=0.05)


def test_vehicles_keep_their_lanes_differ_in_speed_and_never_collide(scene):
    vehicles = paper_street().vehicles
    speeds = [vehicle.speed for vehicle in vehicles]
    assert len(set(speeds)) == 8
    assert all(8 <= speed <= 12 for speed in speeds)
    assert len({vehicle.body for vehicle in vehicles}) == 4
    for lane, heading in ((LANE_1, 0.0), (LANE_2, np.pi)):
        queue = sorted((v for v in vehicles if v.y == lane), key=lambda v: v.x)
        assert len(queue) == 4
        assert all(vehicle.heading == heading for vehicle in queue)
    for elapsed in (0.0, 0.1, 1.0):
        later = [
            footprint + np.array([vehicle.speed * np.cos(vehicle.heading) * elapsed, 0.0])
            for vehicle in vehicles
            for _, footprint in [vehicle.footprint()]
        ]
        assert not any(overlap(a, b) for k, a in enumerate(later) for b in later[k + 1 :])


def test_the_order_of_the_street_is_the_papers():
    x = {vehicle.name: vehicle.x for vehicle in paper_street().vehicles}
    lane_1 = [x[n] for n in ("target-4", "vehicle-1", "vehicle-2", "target-2")]
    lane_2 = [x[n] for n in ("target-3", "vehicle-3", "target-1", "vehicle-4")]
    assert all(a < b for queue in (lane_1, lane_2) for a, b in pairwise(queue))
    assert 20 <= x["vehicle-2"] - x["vehicle-1"] <= 25


def test_buildings_stand_six_to_nine_metres_from_the_middle_with_gaps(scene):
    houses = paper_street().buildings
    for house in houses:
        assert 6 <= abs(house.y) - house.width / 2 <= 9
    for side in (-1, 1):
        row = sorted((h for h in houses if h.y * side > 0), key=lambda h: h.x)
        assert len(row) == 3
        assert all(b.x - b.length / 2 - a.x - a.length / 2 > 2 for a, b in pairwise(row))
    assert {h.material for h in houses} == {"brick"}
    assert len(paper_street().trees) >= 4
    assert 60 <= paper_street().road.length <= 80


def test_trees_touch_no_wall_and_no_lane():
    street = paper_street()
    for tree in street.trees:
        assert abs(tree.y) - tree.crown_radius >= 4.0
        for house in street.buildings:
            gap = np.maximum(
                np.abs([tree.x - house.x, tree.y - house.y])
                - np.array([house.length, house.width]) / 2,
                0.0,
            )
            assert np.hypot(*gap) > tree.crown_radius


def test_a_coarser_street_keeps_the_distances(closest):
    radars = [(Radar(name=n, mount=m), car) for n, (car, m) in paper_mounts().items()]
    coarse = paper_street(max_edge=0.15, coarseness=3.0).scene(radars)
    assert nearest(coarse, "vehicle-1", "target-4", closest)[0] == pytest.approx(6.5, abs=5e-3)
    faces = sum(actor.mesh.num_faces for actor in coarse.actors)
    assert faces < 150_000
