"""Boxes and plates that hide a point from a radar."""

import numpy as np
import pytest

from polychirp.channel.point_vehicles.occlusion_boxes import (
    Boxes,
    crosses,
    obstacles_of,
    own_boxes,
    vehicle_boxes,
)
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.testing.shapes import box, mesh_of

CAR = (4.6, 1.8, 1.4)
MESH = mesh_of(box(CAR, 2.0))
FRONT = Pose(x=2.31)
NOBODY = 10_000


def car(name, **pose):
    return Actor(name=name, kind="vehicle", mesh=MESH, pose=Pose(**pose))


def street(*actors, mounts=(FRONT,)):
    """Cars of which the first carries radars; obstacles within 100 m."""
    radars = tuple(Radar(name=str(number), mount=mount) for number, mount in enumerate(mounts))
    scene = Scene(time=0.0, actors=actors, radars=radars, carriers=(0,) * len(mounts))
    return obstacles_of(scene, Composite().prepare(scene).plates, 100.0)


def hidden(obstacles, end, spared=NOBODY):
    return bool(obstacles.hide(np.array([0]), np.array([end], float), np.array([spared]))[0])


def enters_by_steps(row, start, end):
    """True if one of 20 000 points on the way is in the box."""
    points = start + np.linspace(0, 1, 20_001)[:, None] * (end - start)
    local = (points - row.position) @ row.rotation
    return bool(np.any(np.all((local > row.low) & (local < row.high), axis=-1)))


def test_a_way_enters_a_box_if_one_of_its_points_is_inside():
    rng = np.random.default_rng(4)
    cars = [
        car(str(k), x=x, y=y, yaw=a, pitch=0.1 * a)
        for k, (x, y, a) in enumerate(rng.normal(size=(60, 3)))
    ]
    boxes = vehicle_boxes(Scene(time=0.0, actors=tuple(cars)))
    start = 3 * rng.normal(size=(60, 3))
    end = rng.normal(size=(60, 3)) - 0.5 * start
    stepped = [
        enters_by_steps(Boxes(*(field[k] for field in boxes)), start[k], end[k]) for k in range(60)
    ]
    assert 10 < sum(stepped) < 50
    np.testing.assert_array_equal(crosses(boxes, start, end), stepped)


def test_the_search_near_a_radar_finds_what_trying_all_finds():
    """The compiled search against slabs of every box, and a plate by its equation."""
    rng = np.random.default_rng(5)
    wall = Actor(
        name="wall",
        kind="building",
        plates=(
            Plate(
                centre=(0, 12, 0), half_u=(8, 0, 0), half_v=(0, 0, 3), material="brick", part="w"
            ),
        ),
    )
    places = rng.uniform(-40, 40, size=(40, 2))
    cars = [car(str(k), x=x, y=y, yaw=x) for k, (x, y) in enumerate(places)]
    obstacles = street(car("own"), *cars, wall)
    ends = rng.uniform(-60, 60, size=(300, 3)) * (1, 1, 0.02)
    found = obstacles.hide(np.zeros(300, dtype=np.int64), ends, np.full(300, 3))
    start = obstacles.place[0]
    for end, is_hidden in zip(ends, found, strict=True):
        rows = np.flatnonzero((obstacles.boxes.actor != 0) & (obstacles.boxes.actor != 3))
        count = len(rows)
        start_rows, end_rows = np.tile(start, (count, 1)), np.tile(end, (count, 1))
        behind = np.any(crosses(obstacles.boxes.select(rows), start_rows, end_rows))
        own = crosses(obstacles.own, start[None], end[None])[0]
        t = (12 - start[1]) / (end[1] - start[1])
        meet = start + t * (end - start)
        walled = 0 < t < 1 and abs(meet[0]) <= 8 and abs(meet[2]) <= 3
        assert is_hidden == (behind or own or walled)
    assert 50 < np.sum(found) < 290


def test_a_car_between_hides_and_the_car_that_is_seen_does_not():
    obstacles = street(car("own"), car("between", x=10.0), car("far", x=20.0))
    assert hidden(obstacles, (18.0, 0, 0), spared=2)
    assert not hidden(obstacles, (8.0, 0, 0), spared=1)
    assert hidden(obstacles, (8.0, 0, 0))
    assert not hidden(obstacles, (8.0, 3, 0))


def test_a_wall_hides_and_a_wall_farther_off_does_not():
    def wall(x):
        plate = Plate(
            centre=(x, 0, 0), half_u=(0, 5, 0), half_v=(0, 0, 3), material="brick", part="w"
        )
        return Actor(name="wall", kind="building", plates=(plate,))

    assert hidden(street(car("own"), wall(6.0)), (10.0, 0, 0))
    assert not hidden(street(car("own"), wall(12.0)), (10.0, 0, 0))
    boxes_alone = street(car("own"), wall(6.0)).without_plates()
    assert not hidden(boxes_alone, (10.0, 0, 0))


@pytest.mark.parametrize("depth", [-0.02, 0.0, 0.15, 0.3])
@pytest.mark.parametrize(
    ("mount", "way"),
    [((2.3, 0.3, 0), (1, 0, 0)), ((-2.3, 0, 0), (-1, 0, 0)), ((0.7, 0.9, 0), (0, 1, 0))],
    ids=["front", "rear", "side"],
)
def test_a_radar_near_a_face_of_its_own_vehicle_sees_outward_and_not_through(mount, way, depth):
    """Before the face or behind it; also along the face, but for the last degrees."""
    place = np.array(mount) - depth * np.array(way)
    obstacles = street(car("own"), mounts=(Pose(x=place[0], y=place[1]),))
    way, side = np.array(way), np.array([way[1], way[0], 0])
    assert not hidden(obstacles, place + 10 * way)
    for sign in (1, -1):
        assert not hidden(obstacles, place + way + 10 * sign * side)
    assert hidden(obstacles, place - 10 * way)


@pytest.mark.parametrize("forwards", [1, -1])
@pytest.mark.parametrize("left", [1, -1])
def test_a_radar_at_a_corner_sees_out_of_both_faces(forwards, left):
    """The car's round corner is within the box: the mesh hides nothing up to 90° off the axis."""
    place = np.array([forwards * 2.144, left * 0.758, 0.0])
    axis = np.arctan2(left, forwards)
    own = car("own", x=3.0, y=-2.0, yaw=0.7)
    obstacles = street(own, mounts=(Pose(x=place[0], y=place[1], yaw=float(axis)),))
    for off in np.radians([-85.0, -60.0, -30.0, 0.0, 30.0, 60.0, 85.0]):
        way = np.array([np.cos(axis + off), np.sin(axis + off), 0.0])
        assert not hidden(obstacles, own.pose.to_outer(place + 20 * way))
    assert hidden(obstacles, own.pose.to_outer(place - 20 * np.array([forwards, left, 0.0])))


def test_a_radar_that_looks_ahead_beside_a_corner_does_not_see_through_the_side():
    obstacles = street(car("own"), mounts=(Pose(x=2.25, y=0.6),))
    assert not hidden(obstacles, (2.5, 20.0, 0.0))
    assert hidden(obstacles, (-15.0, 10.0, 0.0))


def test_a_carrier_without_a_body_hides_nothing():
    obstacles = street(Actor(name="own", kind="vehicle"))
    assert not hidden(obstacles, (-10, 0, 0))


def test_own_boxes_of_radars_outside_are_the_vehicles():
    scene = Scene(
        time=0.0, actors=(car("own", yaw=0.3),), radars=(Radar(name="r", mount=Pose(x=3.0)),),
        carriers=(0,),
    )  # fmt: skip
    boxes = vehicle_boxes(scene)
    for mine, whole in zip(own_boxes(scene, boxes), boxes, strict=True):
        np.testing.assert_array_equal(mine, whole)
