"""Random traffic: legal, free of collisions, in sight, and the same for the same seed."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations, product

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.rng import Streams
from polychirp.traffic.placing import is_clear, nearest_point
from polychirp.traffic.random_traffic import CrossingLane, Lane, RandomTraffic
from polychirp.traffic.road_users import Bicycle, Motorcycle
from polychirp.traffic.street import Building, Street, Vehicle, overlap
from polychirp.traffic.vehicle import vehicle_size

STREET = Street(vehicles=(Vehicle(name="ego", x=3.0, y=-1.75),))
TRAFFIC = RandomTraffic(seen_from="ego", num_targets=8, num_carriers=3)
SEEDS = range(6)


def streets(traffic: RandomTraffic = TRAFFIC) -> list[Street]:
    return [traffic.on(STREET, Streams(seed)) for seed in SEEDS]


def test_no_two_vehicles_collide_and_those_of_a_lane_keep_their_gap() -> None:
    for street in streets():
        for first, second in combinations(street.vehicles, 2):
            assert not overlap(first.footprint()[1], second.footprint()[1])
            if first.y == second.y:
                boxes = [car.footprint()[1][:, 0] for car in (first, second)]
                behind, ahead = sorted(boxes, key=lambda x: float(x.min()))
                assert ahead.min() - behind.max() >= TRAFFIC.gap


def test_vehicles_of_a_crossing_street_keep_the_gap_from_all_that_cross_their_way() -> None:
    crossing = (CrossingLane(x=15.0), CrossingLane(x=18.5, oncoming=True))
    traffic = RandomTraffic(seen_from="ego", num_targets=6, num_carriers=3, crossing=crossing)
    distances = []
    for seed in range(60):
        for pair in combinations(traffic.on(STREET, Streams(seed)).vehicles, 2):
            if sum(abs(math.sin(car.heading)) > 0.5 for car in pair) == 1:
                (first, second) = (car.footprint()[1] for car in pair)
                low = np.maximum(first.min(axis=0), second.min(axis=0))
                high = np.minimum(first.max(axis=0), second.max(axis=0))
                distances.append(float(np.max(low - high)))
    assert len(distances) > 100
    assert min(distances) >= traffic.gap - 1e-9


def test_vehicles_of_a_crossing_street_neither_stand_in_buildings_nor_behind_them() -> None:
    crossing = (CrossingLane(x=15.0), CrossingLane(x=18.5, oncoming=True))
    traffic = RandomTraffic(seen_from="ego", num_targets=6, num_carriers=3, crossing=crossing)
    house = Building(name="house", x=17.0, y=14.0, length=12.0, width=10.0, height=9.0)
    before = Building(name="corner", x=10.0, y=-14.0, length=4.0, width=14.0, height=9.0)
    turned = replace(before, name="turned", x=30.0, y=11.0, heading=0.5)
    built = replace(STREET, buildings=(house, before, turned))
    eye = np.array([STREET.vehicles[0].footprint()[1][:, 0].max(), -1.75])
    for seed in range(60):
        street = traffic.on(built, Streams(seed))  # raises where vehicles overlap buildings
        for car in street.vehicles[1:]:
            if car.name in traffic.target_names:
                corners = car.footprint()[1]
                near = np.clip(eye, corners.min(axis=0), corners.max(axis=0))
                sight = eye + np.linspace(0.0, 1.0, 200)[:, None] * (near - eye)
                for building in built.buildings:
                    local = building.pose.to_inner(np.column_stack([sight, 0.0 * sight[:, 0]]))
                    inside = np.abs(local[:, :2]) < (building.length / 2, building.width / 2)
                    assert not np.any(np.all(inside, axis=1))


def test_road_users_of_the_street_are_left_room() -> None:
    rider = Motorcycle(name="moto", x=14.0, y=-1.75, speed=10.0)
    bicycle = Bicycle(name="bike", x=20.0, y=1.0, speed=5.0)
    crowded = replace(STREET, motorcycles=(rider,), bicycles=(bicycle,))
    for seed in range(40):
        street = TRAFFIC.on(crowded, Streams(seed))
        for car, user in product(street.vehicles, (rider, bicycle)):
            assert not overlap(car.footprint()[1], user.footprint()[1])


def test_a_motorcycle_covers_its_length() -> None:
    """2.1 m along its heading, less than 1 m across."""
    _, corners = Motorcycle(name="moto", x=5.0, y=1.0, heading=0.5 * math.pi).footprint()
    size = np.ptp(corners, axis=0)
    assert 0.4 < size[0] < 1.0
    assert 1.8 < size[1] < 2.4
    assert corners.mean(axis=0) == pytest.approx([5.0, 1.0], abs=0.2)


def test_vehicles_drive_as_their_lanes_allow() -> None:
    allowed = {lane.y: lane for lane in TRAFFIC.lanes}
    for street in streets():
        for vehicle in street.vehicles[1:]:
            lane = allowed[vehicle.y]
            assert lane.speed[0] <= vehicle.speed <= lane.speed[1]
            assert math.isclose(math.cos(vehicle.heading), -1.0 if lane.oncoming else 1.0)


def test_dense_sampling_of_every_sight_line_meets_no_other_vehicle() -> None:
    """Another route to visibility: a thousand points of the line, each asked of each rectangle."""
    for street in streets():
        ego = street.vehicles[0].footprint()[1]
        eye = np.array([ego[:, 0].max(), STREET.vehicles[0].y])
        boxes = {car.name: car.footprint()[1] for car in street.vehicles[1:]}
        for name in TRAFFIC.target_names:
            low, high = boxes[name].min(axis=0), boxes[name].max(axis=0)
            point = np.clip(eye, low, high)
            distance = float(np.linalg.norm(point - eye))
            assert 3.0 < distance < TRAFFIC.reach
            way = eye + np.linspace(0.0, 1.0, 1000)[:, None] * (point - eye)
            for other, corners in boxes.items():
                if other != name:
                    inside = (way > corners.min(axis=0)) & (way < corners.max(axis=0))
                    assert not np.any(np.all(inside, axis=1)), (name, other)


def test_no_target_hides_behind_a_vehicle_of_the_street() -> None:
    """A truck right ahead leaves only the other lanes for targets."""
    truck = Vehicle(name="truck", x=12.0, y=-1.75, body="truck")
    eye = (3.0 + vehicle_size("sedan")[0] / 2, -1.75)
    box = truck.footprint()[1]
    low, high = box.min(axis=0), box.max(axis=0)
    street = replace(STREET, vehicles=(*STREET.vehicles, truck))
    for seed in range(5):
        cars = replace(TRAFFIC, num_targets=3).on(street, Streams(seed)).vehicles
        for car in (car for car in cars if car.name.startswith("target")):
            corners = car.footprint()[1]
            point = np.clip(eye, corners.min(axis=0), corners.max(axis=0))
            assert is_clear(eye, (point[0], point[1]), (low[0], high[0], low[1], high[1]), 0.0)


def test_a_street_with_fewer_targets_is_part_of_one_with_more() -> None:
    few = replace(TRAFFIC, num_targets=2)
    for small, large in zip(streets(few), streets(), strict=True):
        assert set(small.vehicles) < set(large.vehicles)


def test_a_seed_draws_one_street_and_seeds_differ() -> None:
    assert streets() == streets()
    assert len({street.vehicles for street in streets()}) == len(SEEDS)


def test_points_stand_where_vehicles_would_be_nearest() -> None:
    points = replace(TRAFFIC, shape="points")
    for cars, dots in zip(streets(), streets(points), strict=True):
        assert [point.name for point in dots.points] == list(TRAFFIC.target_names)
        named = {car.name: car for car in cars.vehicles}
        for point in dots.points:
            corners = named[point.name].footprint()[1]
            assert corners[:, 0].min() <= point.x <= corners[:, 0].max()
            assert point.velocity[0] == pytest.approx(
                named[point.name].speed * math.cos(named[point.name].heading)
            )


@pytest.mark.parametrize(
    ("point", "expected"), [((9.0, 0.0), False), ((3.9, 0.0), True), ((9.0, 4.0), True)]
)
def test_a_box_hides_what_lies_behind_it(point: tuple[float, float], expected: bool) -> None:
    assert is_clear((0.0, 0.0), point, (4.0, 5.0, -1.0, 1.0), 0.0) is expected


def test_the_nearest_point_of_a_box_around_the_eye_is_the_eye() -> None:
    assert nearest_point((1.0, 1.0), (0.0, 2.0, 0.0, 2.0)) == (1.0, 1.0)


def test_traffic_that_cannot_be_is_refused_in_a_sentence() -> None:
    with pytest.raises(InputError, match="no room for 30 targets"):
        replace(TRAFFIC, num_targets=30).on(STREET, Streams(1))
    with pytest.raises(InputError, match="seen from 'eog', which is not on the street"):
        replace(TRAFFIC, seen_from="eog").on(STREET, Streams(1))
    back = Street(vehicles=(Vehicle(name="ego", x=0.0, y=0.0, heading=math.pi),))
    with pytest.raises(InputError, match=r"must head along \+x"):
        TRAFFIC.on(back, Streams(1))
    with pytest.raises(InputError, match="two speeds, from low to high"):
        Lane(y=0.0, speed=(5.0, 1.0))
    for wrong in ({"num_targets": -1}, {"reach": 2.0}, {"gap": -1.0}, {"lanes": ()}):
        with pytest.raises(InputError, match="random traffic"):
            replace(TRAFFIC, **wrong)
