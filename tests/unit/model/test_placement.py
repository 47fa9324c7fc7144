"""`placement`: a radar and the boxes around bodies in the world."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.frames import Pose, rotation, rotation_angles
from polychirp.model.placement import placement
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.traffic.road_users import Pedestrian
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.traffic.vehicle import vehicle_size

MOUNT = Pose(x=-2.2, y=0.4, z=0.7, yaw=np.pi, pitch=0.05)


def street(**changes):
    ego = Vehicle(name="ego", x=3.0, y=1.0, heading=0.7, speed=10.0, coarseness=4.0)
    post = Point(name="post", x=9.0, y=-2.0, z=1.5, rcs=1.0, velocity=(1.0, 2.0, 0.0))
    return Street(vehicles=(replace(ego, **changes),), points=(post,))


def scene(**changes):
    return street(**changes).scene([(Radar(name="rear", mount=MOUNT), "ego")])


@pytest.mark.parametrize("time", [0.0, 0.03])
@pytest.mark.parametrize("yaw_rate", [0.0, 0.5])
def test_the_mount_stays_while_the_vehicle_drives_and_turns(time, yaw_rate):
    """From the middle of the rear axle of a sedan, 1.34 m behind its middle and 0.32 m high."""
    placed = placement(scene(yaw_rate=yaw_rate).at(time), 0, ("post",))
    np.testing.assert_allclose(placed.mount_position, [-2.2 + 1.34, 0.4, 0.7 - 0.32], atol=1e-12)
    turned = rotation(*placed.mount_orientation)
    np.testing.assert_allclose(turned, MOUNT.rotation, atol=1e-12)
    assert (placed.time, placed.name, placed.carrier) == (time, ("post", "ego"), 1)


def test_a_point_is_a_box_without_size_that_moves():
    placed = placement(scene().at(0.5), 0, ("post",))
    np.testing.assert_allclose(placed.box_centre[0], [9.5, -1.0, 1.5])
    np.testing.assert_array_equal(placed.box_size[0], 0.0)
    np.testing.assert_allclose(placed.velocity[0], [1.0, 2.0, 0.0])


def test_a_target_that_carries_the_radar_is_named_once():
    placed = placement(scene(), 0, ("ego", "post"))
    assert (placed.name, placed.carrier) == (("ego", "post"), 0)


def test_a_box_is_along_its_vehicle_and_leaves_out_mirrors():
    placed = placement(scene(), 0, ())
    assert placed.box_size[0, :2] == pytest.approx(vehicle_size("sedan"), abs=0.02)
    assert placed.box_orientation[0] == pytest.approx([0.7, 0.0, 0.0])
    assert placed.box_centre[0, 2] == pytest.approx(placed.box_size[0, 2] / 2)


def test_the_box_of_a_bent_truck_holds_its_trailer():
    """A trailer that is turned to the left about its king pin has its rear to the right, and the
    box around both is wider than that of the straight truck and less long."""
    straight = placement(scene(body="articulated-truck"), 0, ())
    bent = placement(scene(body="articulated-truck", articulation=0.3), 0, ())
    assert bent.name == straight.name == ("ego",)
    assert bent.box_size[0, 1] > straight.box_size[0, 1] + 2.0
    assert bent.box_size[0, 0] < straight.box_size[0, 0]
    across = (bent.box_centre - straight.box_centre)[0] @ rotation(0.7)
    assert across[1] < -1.0


def test_the_box_of_a_pedestrian_holds_his_limbs():
    walker = Pedestrian(name="walker", x=12.0, y=4.0, heading=0.0, speed=1.5)
    placed = placement(
        replace(street(), pedestrians=(walker,)).scene([(Radar(name="r", mount=MOUNT), "ego")]),
        0,
        ("walker",),
    )
    assert 1.5 < placed.box_size[0, 2] < 2.1
    assert placed.box_centre[0] == pytest.approx([12.0, 4.0, 0.9], abs=0.4)


def test_a_carrier_may_be_a_frame_alone():
    bare = Scene(
        time=0.0,
        actors=(
            Actor(name="mast", kind="object", pose=Pose(x=1.0)),
            Actor(name="p", kind="object", points=(PointScatterer(position=(1, 2, 3), rcs=1.0),)),
        ),
        radars=(Radar(name="r", mount=Pose(z=2.0)),),
        carriers=(0,),
    )
    placed = placement(bare, 0, ("p",))
    np.testing.assert_array_equal(placed.box_centre, [[1.0, 2.0, 3.0], [1.0, 0.0, 0.0]])
    np.testing.assert_array_equal(placed.radar_position, [1.0, 0.0, 2.0])


@pytest.mark.parametrize("seed", range(5))
def test_angles_give_their_rotation_again(seed):
    yaw, roll = np.random.default_rng(seed).uniform(-np.pi, np.pi, 2)
    pitch = np.random.default_rng(seed + 99).uniform(-np.pi / 2, np.pi / 2)
    for one in (pitch, np.pi / 2, -np.pi / 2):
        turned = rotation(yaw, one, roll)
        np.testing.assert_allclose(rotation(*rotation_angles(turned)), turned, atol=1e-9)
