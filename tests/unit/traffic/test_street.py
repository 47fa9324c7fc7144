"""A street becomes a scene, and impossible streets are refused at the door."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import TypeAdapter

from polychirp.errors import InputError
from polychirp.model.radar import Radar
from polychirp.traffic.mesh_file import save_glb
from polychirp.traffic.street import Building, Point, Road, Street, Tree, Vehicle, overlap
from polychirp.traffic.vehicle import vehicle_mesh

CAR = Vehicle(name="a", x=0.0, y=0.0, speed=10.0, max_edge=0.2, coarseness=4.0)
HOUSE = Building(name="house", x=0.0, y=12.0, length=10.0, width=8.0, height=6.0)


def test_a_street_becomes_a_scene_of_actors_with_their_motion():
    street = Street(
        road=Road(length=60.0, width=8.0),
        vehicles=(CAR, replace(CAR, name="b", y=4.0, heading=math.pi, speed=8.0)),
        buildings=(HOUSE,),
        trees=(Tree(name="oak", x=9.0, y=5.0, height=6.0, crown_radius=1.2),),
        points=(Point(name="p", x=20.0, y=0.0, z=0.5, rcs=10.0, velocity=(1.0, 0.0, 0.0)),),
    )
    scene = street.scene([(Radar(name="r"), "b")])
    kinds = {actor.name: actor.kind for actor in scene.actors}
    assert kinds == {
        "a": "vehicle",
        "b": "vehicle",
        "p": "object",
        "road": "road",
        "house": "building",
        "oak": "tree",
    }
    actors = {actor.name: actor for actor in scene.actors}
    assert actors["b"].velocity == pytest.approx((-8.0, 0.0, 0.0))
    assert scene.actors[scene.carriers[0]].name == "b"
    point = actors["p"]
    assert (point.points[0].rcs, point.pose.x, point.velocity) == (10.0, 20.0, (1.0, 0.0, 0.0))
    assert scene.actors[0].mesh is scene.actors[1].mesh


def test_a_street_is_read_from_text_with_units():
    text = {
        "road": {"length": "60 m", "width": "8 m"},
        "vehicles": [
            {
                "name": "a",
                "body": "van",
                "x": "0 m",
                "y": "-1.75 m",
                "heading": "180 deg",
                "speed": "36 km/h",
            }
        ],
        "points": [
            {
                "name": "p",
                "x": "9 m",
                "y": "0 m",
                "z": "50 cm",
                "rcs": "10 dBsm",
                "velocity": ["1 m/s", "0 m/s", "0 m/s"],
            }
        ],
    }
    street = TypeAdapter(Street).validate_python(text)
    assert street.vehicles[0].heading == pytest.approx(math.pi)
    assert street.vehicles[0].speed == pytest.approx(10.0)
    assert street.points[0].rcs == pytest.approx(10.0)
    assert hash(street) == hash(replace(street))


def test_two_things_of_one_name_are_refused():
    tree = Tree(name="a", x=9.0, y=9.0, height=6.0, crown_radius=1.0)
    with pytest.raises(InputError, match="two things on the street are called 'a'"):
        Street(vehicles=(CAR,), trees=(tree,))


def test_a_radar_on_an_unknown_vehicle_is_refused_with_the_known_ones():
    street = Street(vehicles=(CAR, replace(CAR, name="b", x=9.0)))
    with pytest.raises(
        InputError, match=r"'r' rides on 'c', which is no vehicle.*choose among a, b"
    ):
        street.scene([(Radar(name="r"), "c")])


def test_vehicles_that_overlap_are_both_named():
    with pytest.raises(InputError, match="vehicle 'a' and vehicle 'b' overlap; move one"):
        Street(vehicles=(CAR, replace(CAR, name="b", x=4.5)))
    Street(vehicles=(CAR, replace(CAR, name="b", x=4.7)))


def test_a_turned_vehicle_is_measured_as_it_stands():
    """Across the road a 4.6 m car reaches 2.3 m to the side, along it 0.91 m."""
    beside = replace(CAR, name="b", y=2.9)
    Street(vehicles=(CAR, beside))
    with pytest.raises(InputError, match="overlap"):
        Street(vehicles=(CAR, replace(beside, heading=math.pi / 2)))


def test_a_vehicle_in_a_building_is_refused():
    with pytest.raises(InputError, match="vehicle 'a' and building 'house' overlap"):
        Street(vehicles=(replace(CAR, y=7.5),), buildings=(HOUSE,))


def test_a_vehicle_from_a_file_is_placed_and_measured(tmp_path):
    save_glb(vehicle_mesh("hatchback", max_edge=0.3, coarseness=6.0), tmp_path / "own.glb")
    own = Vehicle(name="own", mesh=str(tmp_path / "own.glb"), x=10.0, y=0.0, max_edge=0.4)
    scene = Street(vehicles=(CAR, own)).scene()
    mesh = scene.actors[1].mesh
    assert np.ptp(mesh.vertex[:, 0]) == pytest.approx(4.1, abs=0.01)
    with pytest.raises(InputError, match="vehicle 'a' and vehicle 'own' overlap"):
        Street(vehicles=(CAR, replace(own, x=4.0))).scene()


def test_values_out_of_range_are_refused():
    with pytest.raises(InputError, match="vehicle 'a' needs a positive max_edge"):
        replace(CAR, max_edge=0.0)
    with pytest.raises(InputError, match="vehicle 'a' has facets of up to 1 m"):
        replace(CAR, max_edge=1.0)
    with pytest.raises(InputError, match="point 'p' cannot have a negative"):
        Point(name="p", x=0.0, y=0.0, z=0.0, rcs=-1.0)


def test_rectangles_that_cross_without_a_corner_in_each_other_overlap():
    long = np.array([[-2.0, -0.1], [2.0, -0.1], [2.0, 0.1], [-2.0, 0.1]])
    assert overlap(long, long[:, ::-1])
    assert not overlap(long, long + np.array([0.0, 0.21]))
