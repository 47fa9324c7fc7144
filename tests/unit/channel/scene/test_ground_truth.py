"""Nearest visible points of targets, and mounts of radars inside bodies."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.geometry.closest_point import closest_points
from polychirp.channel.scene.ground_truth import least_power, refuse_radar_inside_body, truth
from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.detection import Detections
from polychirp.model.mesh import Mesh, Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, PointScatterer, Scene
from polychirp.scoring.association import Gate, distances_from_bodies
from polychirp.testing.shapes import around, box, mesh_of, plate, sphere
from tests.support.references.geometry import closest_points_by_columns

EYE = [(0.0, 0.0, 0.0)]


def body(corners, material="metal", *, velocity=(0.0, 0.0, 0.0), kind="object", **pose):
    return Actor(
        name="body",
        kind=kind,
        mesh=mesh_of(corners, material),
        pose=Pose(**pose),
        velocity=velocity,
    )


def test_the_nearest_point_of_a_box_is_on_its_face_between_mesh_lines():
    """The point is exact although the mesh has edges of 1 m."""
    seen = truth(around([body(box((2, 2, 2), 1.0), x=6.0, y=0.3, z=-0.2)], EYE), 0, ["body"])
    assert seen.range[0] == pytest.approx(5.0, abs=1e-12)
    np.testing.assert_allclose(seen.point[0], [5, 0, 0], atol=1e-12)
    assert seen.is_visible[0]


def test_a_sphere_is_nearest_towards_the_radar_and_recedes_along_the_line_of_sight():
    """Range R − r within the sagitta of facets of 2 cm, e²/8r = 0.2 mm; rate u·v."""
    centre, velocity = np.array([6.0, 8.0, 0.0]), (3.0, -1.0, 0.5)
    scene = around([body(sphere(0.25, 0.02), velocity=velocity, x=6.0, y=8.0)], EYE)
    seen = truth(scene, 0, ["body"])
    assert seen.range[0] == pytest.approx(10.0 - 0.25, abs=5e-4)
    assert seen.azimuth[0] == pytest.approx(np.arctan2(8, 6), abs=2e-3)
    assert seen.range_rate[0] == pytest.approx(np.dot(centre / 10, velocity), abs=0.01)
    later = truth(scene.at(1e-3), 0, ["body"])
    assert (later.range[0] - seen.range[0]) / 1e-3 == pytest.approx(seen.range_rate[0], abs=0.02)


def test_azimuth_is_positive_to_the_left_of_a_turned_radar():
    car = Actor(name="car", kind="vehicle", pose=Pose(yaw=np.pi / 2))
    radar = Radar(name="r", mount=Pose(yaw=0.3))
    target = body(sphere(0.1, 0.05), y=10.0)
    scene = Scene(time=0.0, actors=(car, target), radars=(radar,), carriers=(0,))
    assert truth(scene, 0, ["body"]).azimuth[0] == pytest.approx(-0.3, abs=2e-3)


def test_of_a_car_only_metal_counts():
    """A bumper half a metre before the metal is not the body."""
    metal, plastic = box((1, 1, 1), 1.0), box((0.2, 1, 1), 1.0) - [0.9, 0, 0]
    corners = np.concatenate([metal, plastic])
    both = mesh_of(corners)
    mesh = Mesh(
        vertex=both.vertex,
        face=both.face,
        material=np.repeat([0, 1], [len(metal), len(plastic)]),
        part=both.part,
        materials=("metal", "plastic"),
        parts=("body",),
    )
    actor = Actor(name="body", kind="vehicle", mesh=mesh, pose=Pose(x=5.0))
    seen = truth(around([actor], EYE), 0, ["body"])
    assert seen.range[0] == pytest.approx(4.5)
    assert seen.is_visible[0]


def screen(half_width, y=0.0):
    return Actor(
        name="screen",
        kind="building",
        pose=Pose(x=2.0, y=y),
        plates=(
            Plate(
                centre=(0, 0, 0),
                half_u=(0, half_width, 0),
                half_v=(0, 0, 5),
                material="brick",
                part="wall",
            ),
        ),
    )


def test_a_hidden_body_is_said_to_be_hidden():
    scene = around([body(box((1, 1, 1), 0.5), x=5.0), screen(3.0)], EYE)
    seen = truth(scene, 0, ["body"])
    assert not seen.is_visible[0]
    assert seen.range[0] == pytest.approx(4.5)


def test_of_a_half_hidden_body_the_nearest_visible_point_counts():
    """A screen from y = −∞ to 0.1 at x = 2 hides, at x = 4.5, all up to y = 0.225."""
    scene = around([body(box((1, 1, 1), 0.5), x=5.0), screen(3.0, y=-2.9)], EYE)
    seen = truth(scene, 0, ["body"])
    assert seen.is_visible[0]
    # found among pieces of 5 cm
    assert 0.225 <= seen.point[0, 1] < 0.225 + 0.05
    assert seen.range[0] == pytest.approx(np.hypot(4.5, 0.225), abs=5e-3)


def test_a_body_of_points_counts_with_its_nearest_one():
    points = tuple(PointScatterer(position=(x, 0, 0), rcs=1.0) for x in (1.0, -1.0))
    actor = Actor(name="p", kind="object", pose=Pose(x=5.0), points=points)
    seen = truth(around([actor, screen(0.2, y=3.0)], EYE), 0, ["p"])
    assert seen.range[0] == pytest.approx(4.0)
    assert seen.is_visible[0]
    assert not truth(around([actor, screen(1.0)], EYE), 0, ["p"]).is_visible[0]


def test_two_bodies_of_one_mesh_hide_each_where_it_is():
    """Both bodies share the trees of one surface, at different places."""
    twin = body(box((1, 1, 1), 0.5), x=4.0, y=8.0)
    hider = replace(twin, name="hider", pose=Pose(x=2.0, y=0.3))
    small = replace(body(box((0.1, 0.1, 0.1), 0.1), x=4.0, y=-8.0), name="small")
    target = Actor(name="p", kind="object", points=(PointScatterer(position=(6, 0, 0), rcs=1.0),))
    assert truth(around([small, twin, target], EYE), 0, ["p"]).is_visible[0]
    assert not truth(around([small, twin, hider, target], EYE), 0, ["p"]).is_visible[0]
    assert not truth(around([hider, small, twin, target], EYE), 0, ["p"]).is_visible[0]


def test_a_wall_can_be_a_target():
    seen = truth(around([screen(3.0)], EYE), 0, ["screen"])
    assert seen.range[0] == pytest.approx(2.0)
    assert seen.is_visible[0]


def test_an_unknown_or_bodiless_target_is_refused():
    scene = around([], EYE)
    with pytest.raises(InputError, match="no actor 'ghost'; the scene has carrier 0"):
        truth(scene, 0, ["ghost"])
    with pytest.raises(InputError, match="'carrier 0' has no faces, plates or points"):
        truth(scene, 0, ["carrier 0"])


def test_nearest_points_agree_with_a_fine_sample_of_the_triangles():
    rng = np.random.default_rng(2)
    corners, point = rng.normal(size=(20, 3, 3)), rng.normal(size=3)
    a, b = np.meshgrid(np.linspace(0, 1, 200), np.linspace(0, 1, 200))
    inside = a + b <= 1
    weights = np.stack([1 - a - b, a, b], axis=-1)[inside]
    sample = np.einsum("wc,fcx->fwx", weights, corners)
    expected = np.min(np.linalg.norm(sample - point, axis=-1), axis=1)
    found = np.linalg.norm(closest_points(corners, point)[0] - point, axis=-1)
    assert np.all(found <= expected + 1e-12)
    np.testing.assert_allclose(found, expected, atol=2e-2)


def test_closest_points_and_fronts_are_those_of_the_slow_twin():
    rng = np.random.default_rng(3)
    corners = rng.normal(size=(500, 3, 3))
    corners[:50, 2] = corners[:50, 1]  # no area
    corners[50:60, 1:] = corners[50:60, :1]  # a single point
    for place in rng.normal(size=(4, 3)):
        found, is_front = closest_points(corners, place)
        expected, is_expected_front = closest_points_by_columns(corners, place)
        np.testing.assert_allclose(found, expected, atol=1e-12)
        assert np.array_equal(is_front, is_expected_front)


def test_the_least_power_is_that_of_the_smaller_singular_value():
    rng = np.random.default_rng(4)
    matrix = rng.normal(size=(200, 2, 2)) + 1j * rng.normal(size=(200, 2, 2))
    matrix[0] = 0.0
    matrix[1] = np.eye(2)
    expected = np.linalg.svd(matrix, compute_uv=False)[:, -1] ** 2
    np.testing.assert_allclose(least_power(matrix), expected, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(("place", "is_legal"), [((2.01, 0, 0), True), ((1.9, 0, 0), False)])
def test_a_radar_in_the_metal_of_its_own_car_is_refused(place, is_legal):
    car = Actor(
        name="car", kind="vehicle", mesh=mesh_of(box((4, 1.8, 1.4), 0.5)), pose=Pose(yaw=1.0)
    )
    x, y, z = place
    scene = Scene(
        time=0.0, actors=(car,), radars=(Radar(name="r", mount=Pose(x=x, y=y, z=z)),), carriers=(0,)
    )
    if is_legal:
        refuse_radar_inside_body(scene)
    else:
        with pytest.raises(InputError, match="radar 'r' is inside 'car'; move its mount outwards"):
            refuse_radar_inside_body(scene)


def test_a_radar_behind_its_bumper_is_legal():
    """A closed box of plastic around it is a cover, and an open sheet of metal is no body."""
    cover = body(box((0.2, 1, 0.4), 0.2), "plastic")
    refuse_radar_inside_body(around([cover], [(0.01, 0, 0)]))
    sheet = body(plate(1.0, 0.5))
    refuse_radar_inside_body(around([sheet], [(-0.01, 0, 0)]))


def house():
    def side(x, y, u):
        return Plate(
            centre=(x, y, 2.0), half_u=u, half_v=(0, 0, 2.0), material="brick", part="wall"
        )

    plates = (
        side(5.0, 0.0, (0, 4.0, 0)),
        side(-5.0, 0.0, (0, -4.0, 0)),
        side(0.0, 4.0, (-5.0, 0, 0)),
        side(0.0, -4.0, (5.0, 0, 0)),
    )
    return Actor(name="house", kind="building", pose=Pose(x=20, yaw=0.4), plates=plates)


def test_a_radar_in_a_house_is_refused_and_one_before_it_is_not():
    refuse_radar_inside_body(around([house()], [(10.0, 0, 0.5)]))
    with pytest.raises(InputError, match="radar '0' is inside 'house'"):
        refuse_radar_inside_body(around([house()], [(20.0, 1.0, 0.5)]))


def test_a_radar_under_the_road_is_refused():
    road = Actor(
        name="road",
        kind="road",
        plates=(
            Plate(
                centre=(0, 0, 0), half_u=(50, 0, 0), half_v=(0, 4, 0), material="asphalt", part="r"
            ),
        ),
    )
    refuse_radar_inside_body(around([road], [(0, 0, 0.5)]))
    with pytest.raises(InputError, match="radar '0' is below 'road'; raise its mount"):
        refuse_radar_inside_body(around([road], [(0, 0, -0.1)]))


def test_without_occlusion_the_nearest_point_is_visible_behind_a_wall():
    wall = Actor(name="wall", kind="object", mesh=mesh_of(box((0.1, 8, 8), 4.0), "metal"))
    wall = replace(wall, pose=Pose(x=3.0))
    point = PointScatterer(position=(0.0, 0.0, 0.0), rcs=1.0)
    target = Actor(name="point", kind="object", pose=Pose(x=9.0), points=(point,))
    scene = around([wall, body(box((2, 2, 2), 1.0), x=6.0), target], EYE)
    assert not truth(scene, 0, ["body", "point"]).is_visible.any()
    seen = truth(scene, 0, ["body", "point"], has_occlusion=False)
    assert seen.is_visible.all()
    np.testing.assert_allclose(seen.range, [5.0, 9.0])


CAR = (4.5, 1.8, 1.4)
"""m, size of a box for a car."""


def metal_box(**pose):
    return body(box(CAR, 2.0), kind="vehicle", **pose)


def test_the_extent_of_a_box_ahead_is_its_rear():
    """The rear 1.8 m × 1.4 m at 10 m: the corners are √(10² + 0.9² + 0.7²) − 10 = 0.065 m farther.

    Places are the parts of a mesh's pieces of 0.2 m that are nearest to the radar, so that the
    outermost ones may be missing.
    """
    seen = truth(around([metal_box(x=10.0 + CAR[0] / 2)], EYE), 0, ["body"])
    extent = seen.extent(0)
    assert 1.4 < extent.width <= CAR[1]
    assert 0.03 < extent.length <= 0.0648
    assert extent.num_points > 30


def test_the_extent_of_a_box_beside_the_axis_has_its_length():
    """From the corner (10, 4) m to (14.5, 4) m: √(14.5² + 4²) − √(10² + 4²) = 4.271 m."""
    scene = around([metal_box(x=10.0 + CAR[0] / 2, y=4.0 + CAR[1] / 2)], EYE)
    assert truth(scene, 0, ["body"]).extent(0).length == pytest.approx(4.271, abs=0.25)


def test_every_place_on_a_drawn_box_is_within_the_margins_of_a_place_of_its_truth():
    """Points of the faces that are turned to the radar lie on the body, which is convex.

    A point that is beyond the margin of 0.4 m, from all points of those faces, does not.
    """
    draw = np.random.default_rng(11)
    half = 0.5 * np.array(CAR)
    for _ in range(20):
        pose = Pose(x=draw.uniform(7, 20), y=draw.uniform(-6, 6), yaw=draw.uniform(0, 2 * np.pi))
        actor = replace(metal_box(), pose=pose, velocity=(*draw.uniform(-20, 20, 2), 0.0))
        scene = around([actor], EYE)
        seen = truth(scene, 0, ["body"])
        eye = pose.to_inner(np.zeros(3))
        point = draw.uniform(-half, half, size=(600, 3))
        face = draw.integers(0, 3, 600)
        side = np.where(eye[face] > 0, 1.0, -1.0)
        point[np.arange(600), face] = side * half[face]
        is_turned = np.abs(eye[face]) > half[face]
        inner = point[is_turned]
        world = pose.to_outer(inner)
        apart = distances_from_bodies(as_detections(world, actor.velocity), seen, Gate())[0]
        assert apart.max() <= 1.0
        farther = world * (1.0 + 0.7 / np.linalg.norm(world, axis=1))[:, None]
        beyond = np.linalg.norm(farther, axis=1) - np.linalg.norm(world, axis=1).max() > 0.45
        apart = distances_from_bodies(as_detections(farther, actor.velocity), seen, Gate())[0]
        assert np.all(apart[beyond] > 1.0)


def as_detections(point, velocity):
    """Detections at points ``(point, xyz)`` that move alike, seen from a radar at the origin."""
    distance = np.linalg.norm(point, axis=1)
    one = np.ones(len(point))
    return Detections(
        time=0.0,
        range=distance,
        range_rate=point @ np.array(velocity) / distance,
        azimuth=np.arctan2(point[:, 1], point[:, 0]),
        elevation=np.arcsin(point[:, 2] / distance),
        power=one,
        snr=one,
    )


def test_what_a_screen_hides_of_a_body_does_not_belong_to_it():
    """The screen hides the left half of the rear: no place is to the left of its shadow."""
    scene = around([metal_box(x=12.0), screen(3.0, y=3.1)], EYE)
    seen = truth(scene, 0, ["body"])
    # the screen's right edge at (2, 0.1) m shades y > 0.05 x
    y = seen.place_range * np.sin(seen.place_azimuth)
    x = seen.place_range * np.cos(seen.place_azimuth)
    assert np.all(y <= 0.05 * x + 1e-2)
    assert y.min() < -0.7


@pytest.mark.parametrize("has_occlusion", [True, False])
def test_the_truth_of_a_scene_without_targets_is_empty(has_occlusion):
    seen = truth(around([], EYE), 0, [], has_occlusion=has_occlusion)
    assert seen.range.size == seen.place_range.size == 0
    assert seen.point.shape == (0, 3)
