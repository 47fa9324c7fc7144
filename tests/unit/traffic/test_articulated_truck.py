"""Articulated truck: sizes of the directive, a trailer that turns about its king pin, errors."""

import math

import numpy as np
import pytest

from polychirp.channel.point_vehicles.tracer import PointVehicles
from polychirp.channel.scene.ground_truth import truth
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.radar import Radar
from polychirp.scoring.echoes import echoes_of
from polychirp.traffic.mounting import bumper_mount
from polychirp.traffic.semi_trailer import BOX, GUARD, KING_PIN_X, TRUCK_SIZE
from polychirp.traffic.street import Street, Vehicle
from polychirp.traffic.vehicle import vehicle_mesh, vehicle_size

COARSE = {"max_edge": 0.3, "coarseness": 4.0}


def truck(**values):
    return Vehicle(name="truck", body="articulated-truck", x=0.0, y=0.0, **COARSE, **values)


def corners(mesh, *parts):
    wanted = [k for k, name in enumerate(mesh.parts) if name.startswith(parts)]
    return mesh.corners[np.isin(mesh.part, wanted)]


def test_the_truck_has_the_greatest_size_of_the_directive():
    mesh = vehicle_mesh("articulated-truck", **COARSE)
    is_mirror = np.array([name.startswith("mirror") for name in mesh.parts])
    bare = mesh.corners[~is_mirror[mesh.part]].reshape(-1, 3)
    assert np.ptp(bare, axis=0) == pytest.approx([16.5, 2.55, 4.0], abs=0.02)
    assert bare[:, 2].min() == pytest.approx(0.0, abs=1e-3)
    assert vehicle_size("articulated-truck") == (16.5, 2.55)


def test_lengths_from_the_king_pin_are_within_the_directive():
    """12.00 m to the rear, 2.04 m to any point of the front; 15.65 m of load and 16.40 m in all."""
    front, rear, _ = BOX
    cab_rear = corners(vehicle_mesh("articulated-truck", **COARSE), "cab")[..., 0].min()
    assert KING_PIN_X - rear <= 12.0
    assert math.hypot(front - KING_PIN_X, TRUCK_SIZE[1] / 2) <= 2.05
    assert front - rear <= 15.65
    assert cab_rear - rear <= 16.40
    assert cab_rear - front > 0.5


def test_the_rear_guard_is_that_of_un_regulation_58():
    _, low, high, reach = GUARD
    guard = corners(vehicle_mesh("articulated-truck", **COARSE), "rear-bumper").reshape(-1, 3)
    assert guard[:, 2].min() == pytest.approx(low)
    assert low <= 0.45
    assert high - low >= 0.10
    # on either side at most 10 cm shorter than the rear axle
    assert corners(vehicle_mesh("articulated-truck"), "wheel-trailer-3")[..., 1].max() - reach < 0.1


@pytest.mark.parametrize("angle", [-1.2, 0.0, 0.5])
def test_the_trailer_turns_about_its_king_pin(angle):
    """Its rear, 12 m behind the pin, is at pin − 12 (cos, sin); the tractor stays in its place."""
    straight, bent = (
        vehicle_mesh("articulated-truck", articulation=a, **COARSE) for a in (0.0, angle)
    )
    rear = corners(bent, "rear-bumper").reshape(-1, 3).mean(axis=0)
    reach = KING_PIN_X - GUARD[0] - 0.05
    expected = [KING_PIN_X - reach * math.cos(angle), -reach * math.sin(angle)]
    assert rear[:2] == pytest.approx(expected, abs=0.03)
    for part in ("cab", "body", "wheel-front", "windscreen"):
        np.testing.assert_array_equal(corners(bent, part), corners(straight, part))


@pytest.mark.parametrize("angle", [-math.pi / 2, -0.7, 0.7, math.pi / 2])
def test_at_no_angle_the_trailer_touches_the_cab(angle):
    mesh = vehicle_mesh("articulated-truck", articulation=angle, **COARSE)
    cab_rear = corners(mesh, "cab")[..., 0].min()
    assert corners(mesh, "trailer", "girder", "leg")[..., 0].max() < cab_rear


def test_the_box_encloses_its_volume_with_faces_outwards():
    corner = corners(vehicle_mesh("articulated-truck"), "trailer")
    volume = np.sum(np.cross(corner[:, 0], corner[:, 1]) * corner[:, 2]) / 6
    assert volume == pytest.approx(13.6 * 2.55 * 2.8, rel=1e-6)


@pytest.mark.parametrize("max_edge", [0.02, 0.05])
def test_the_walls_of_the_cab_do_not_fold_over(max_edge):
    mesh = vehicle_mesh("articulated-truck", max_edge=max_edge)
    for part in ("cab", "window-left", "window-right"):
        one = mesh.corners[mesh.part == mesh.parts.index(part)]
        area = np.linalg.norm(np.cross(one[:, 1] - one[:, 0], one[:, 2] - one[:, 0]), axis=1)
        assert area.min() > 1e-9
    pane = corners(mesh, "window-left")
    assert np.all(np.cross(pane[:, 1] - pane[:, 0], pane[:, 2] - pane[:, 0])[:, 1] > 0)


@pytest.mark.parametrize("end", ["front", "rear"])
def test_radars_can_be_mounted_at_both_ends(end):
    mount = bumper_mount("articulated-truck", end)
    assert abs(mount.x) == pytest.approx(8.2, abs=0.1)


def test_only_an_articulated_truck_has_an_articulation():
    with pytest.raises(InputError, match=r"vehicle 'car' has an articulation, but no trailer"):
        Vehicle(name="car", x=0.0, y=0.0, articulation=0.1)
    with pytest.raises(InputError, match="a van has no trailer"):
        vehicle_mesh("van", articulation=0.1)


def test_a_bent_truck_needs_the_room_of_its_trailer():
    """A car beside the straight truck is in the way of the bent one, whose rear swings right."""
    car = Vehicle(name="car", x=-4.0, y=-3.0)
    assert len(Street(vehicles=(truck(), car)).scene().actors) == 2
    with pytest.raises(InputError, match="overlap"):
        Street(vehicles=(truck(articulation=0.4), car))


def bent_street(**values):
    """A bent truck that turns, beside a car with a radar, with a radar at each of its ends."""
    ego = Vehicle(name="ego", x=-24.0, y=0.0, **COARSE)
    radars = [
        (Radar(name=name, mount=Pose(x=x, z=0.5, yaw=yaw)), carrier)
        for name, carrier, x, yaw in (
            ("ego", "ego", 2.32, 0.0),
            ("front", "truck", 8.3, 0.0),
            ("rear", "truck", -8.3, math.pi),
        )
    ]
    return Street(vehicles=(truck(**values), ego)).scene(radars)


def test_a_truck_that_is_straight_and_does_not_turn_is_one_body():
    assert [actor.name for actor in bent_street(speed=12.0).actors] == ["truck", "ego"]


@pytest.mark.parametrize("values", [{"articulation": 0.3}, {"yaw_rate": 0.3, "speed": 8.0}])
def test_tractor_and_trailer_are_where_the_mesh_of_the_whole_truck_is(values):
    scene = bent_street(heading=0.4, **values)
    assert [actor.name for actor in scene.actors] == ["truck", "ego", "truck semi-trailer"]
    parts = scene.parts_of("truck")
    vertices = np.concatenate([a.pose.to_outer(a.mesh.corners.reshape(-1, 3)) for a in parts])
    articulation = values.get("articulation", 0.0)
    whole = vehicle_mesh("articulated-truck", articulation=articulation, **COARSE)
    there = parts[0].pose.to_outer(whole.corners.reshape(-1, 3))
    assert np.sort(vertices, axis=0) == pytest.approx(np.sort(there, axis=0), abs=1e-9)


def test_the_trailer_stays_at_the_king_pin():
    scene = bent_street(heading=0.4, articulation=0.3, yaw_rate=-0.4, speed=9.0).at(2.5)
    tractor, trailer = scene.parts_of("truck")
    pin = np.array([3.75, 0.0, 0.0])
    assert trailer.pose.to_outer(pin) == pytest.approx(tractor.pose.to_outer(pin), abs=1e-9)
    there = tractor.pose.to_outer(pin)
    assert trailer.velocity_at(there) == pytest.approx(tractor.velocity_at(there), abs=1e-9)


def test_a_radar_at_the_rear_goes_with_the_trailer():
    scene = bent_street(articulation=0.3, speed=9.0)
    assert scene.carriers == (1, 0, 2)
    trailer = scene.actors[2]
    behind = trailer.pose.to_outer(np.array([-8.3, 0.0, 0.5]))
    assert scene.radar_position[2] == pytest.approx(behind)
    assert scene.radar_velocity[2] == pytest.approx(trailer.velocity_at(behind))
    assert scene.radar_acceleration[2] == pytest.approx(trailer.acceleration_at(behind))
    assert scene.radar_yaw_rate[2] == pytest.approx(-9.0 * math.sin(0.3) / 7.7)


def test_tractor_and_trailer_are_one_target():
    """Seen from behind, its places are those of the trailer, with the trailer's velocities."""
    scene = bent_street(articulation=0.3, speed=9.0)
    found = truth(scene, 0, ["truck"])
    assert found.is_visible.all()
    assert 0.0 < found.visible_share[0] < 1.0
    trailer = scene.actors[2]
    rear = trailer.pose.to_inner(found.point[0])
    assert rear[0] == pytest.approx(-8.25, abs=0.1)
    way = found.point[0] - scene.radar_position[0]
    assert found.range_rate[0] == pytest.approx(
        trailer.velocity_at(found.point[0]) @ way / np.linalg.norm(way)
    )
    with pytest.raises(InputError, match="no actor 'truck semi-trailer'; the scene has truck, ego"):
        truth(scene, 0, ["truck semi-trailer"])


def test_echoes_of_the_trailer_are_echoes_of_the_truck():
    scene = bent_street(articulation=0.3, speed=9.0)
    paths = PointVehicles().trace(scene)
    assert echoes_of(paths, scene, 0).body == ("truck", "ego", "truck")
