"""Shadows of bodies and plates between radars and targets."""

import numpy as np
import pytest

from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.paths import Bounce
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from polychirp.testing.shapes import around, box, mesh_of, plate, sphere, transfer_at

TRACER = Composite(reflecting_planes=False, max_bounces=1, diffraction=False, diffuse=False)
"""Tracer without diffraction: straight paths only."""

PLACES = [(0.0, 0.0, 0.5), (10.0, 0.0, 0.5)]


def screen(material, x=5.0):
    """A body of kind tree, which blocks and does not scatter."""
    return Actor(
        name="screen", kind="tree", pose=Pose(x=x, z=0.5), mesh=mesh_of(plate(1.0, 0.5), material)
    )


@pytest.mark.parametrize("material", ["metal", "rubber", "brick", "wood"])
def test_a_body_between_two_radars_silences_them(material):
    paths = TRACER.trace(around([screen(material)], PLACES))
    assert not np.any(paths.num_bounces == 0)


@pytest.mark.parametrize("material", ["plastic", "glass", "leaf"])
def test_sheets_and_leaves_let_waves_through(material):
    paths = TRACER.trace(around([screen(material)], PLACES))
    assert np.count_nonzero(paths.num_bounces == 0) == 2


def test_a_plate_blocks_too():
    wall = Actor(
        name="wall",
        kind="building",
        pose=Pose(x=5),
        plates=(
            Plate(centre=(0, 0, 0), half_u=(0, 2, 0), half_v=(0, 0, 2), material="brick", part="w"),
        ),
    )
    assert TRACER.trace(around([wall], PLACES)).num_paths == 0
    aside = around([wall], [(0.0, 3.0, 0.5), (10.0, 3.0, 0.5)])
    assert TRACER.trace(aside).num_paths == 2


def test_a_hidden_body_has_no_echo_and_returns_when_the_screen_goes():
    ball = Actor(name="ball", kind="object", pose=Pose(x=8, z=0.5), mesh=mesh_of(sphere(0.1, 0.02)))
    hidden = TRACER.trace(around([screen("metal"), ball], PLACES[:1]))
    assert hidden.num_paths == 0
    open_ = TRACER.trace(around([ball], PLACES[:1]))
    assert set(open_.bounce_actor) == {1}
    assert open_.num_paths > 0


def test_a_trunk_hides_but_has_no_surface_to_echo():
    tree = Actor(
        name="tree", kind="tree", pose=Pose(x=5, z=0.5), mesh=mesh_of(box((1, 1, 1), 0.5), "wood")
    )
    assert TRACER.trace(around([tree], PLACES)).num_paths == 0


def on_car(mount, *others):
    """A radar on a box of a car, in the middle of the world."""
    car = Actor(name="car", kind="vehicle", mesh=mesh_of(box((4, 1.8, 1.4), 0.3)))
    return Scene(
        time=0.0, actors=(car, *others), radars=(Radar(name="r", mount=mount),), carriers=(0,)
    )


@pytest.mark.parametrize("proud", [0.0, 1e-3, 0.05])
def test_a_radar_looks_out_of_its_own_skin_but_not_through_its_car(proud):
    """A radar in or on the rear face sees what is behind the car and nothing in front of it."""
    balls = [
        Actor(name=name, kind="object", pose=Pose(x=x), mesh=mesh_of(sphere(0.2, 0.02)))
        for name, x in (("behind", -8.0), ("before", 8.0))
    ]
    paths = TRACER.trace(on_car(Pose(x=-2.0 - proud, yaw=np.pi), *balls))
    assert set(paths.bounce_actor) == {1}


def test_the_skin_of_neither_radar_hides_one_from_the_other():
    """Both radars are 5 mm behind the facing sides of their cars."""
    mesh = mesh_of(box((4, 1.8, 1.4), 0.1))
    cars = tuple(
        Actor(name=name, kind="vehicle", mesh=mesh, pose=Pose(x=x, yaw=yaw))
        for name, x, yaw in (("a", 0.0, 0.0), ("b", 20.0, np.pi))
    )
    radars = tuple(Radar(name=name, mount=Pose(x=1.995)) for name in ("a", "b"))
    scene = Scene(time=0.0, actors=cars, radars=radars, carriers=(0, 1))
    paths = TRACER.trace(scene)
    assert np.count_nonzero(paths.num_bounces == 0) == 2


def test_a_radars_own_car_is_no_target():
    assert TRACER.trace(on_car(Pose(x=2.01))).num_paths == 0


@pytest.mark.parametrize("place", [(5.0, 4.5), (2.5, 2.5), (7.5, 2.5)])
def test_what_stands_in_either_part_of_a_mirrored_leg_hides_the_image(place):
    """Radar at x = 0, ball at 10, a wall at y = 5: before the mirror point, and on either side.

    The straight way stays free, so the ball has its own echo all the same.
    """
    wall = Actor(
        name="wall",
        kind="building",
        pose=Pose(yaw=-np.pi / 2, y=5.0),
        plates=(
            Plate(
                centre=(0, 0, 0), half_u=(0, 20, 0), half_v=(0, 0, 9), material="metal", part="w"
            ),
        ),
    )
    ball = Actor(name="ball", kind="object", pose=Pose(x=10), mesh=mesh_of(sphere(0.2, 0.02)))
    cover = mesh_of(box((1.0, 0.8, 2.0), 0.5), "wood")
    tree = Actor(name="cover", kind="tree", pose=Pose(x=place[0], y=place[1]), mesh=cover)

    def kinds(*actors):
        paths = Composite().trace(around(actors, [(0, 0, 0)]))
        scattered = paths.select(_meets(paths, Bounce.SCATTERING))
        return set(scattered.num_bounces)

    assert {1, 2} <= kinds(wall, ball)
    assert kinds(wall, ball, tree) == {1}


def _meets(paths, kind):
    owner = np.repeat(np.arange(paths.num_paths), paths.num_bounces)
    return np.isin(np.arange(paths.num_paths), owner[paths.bounce_kind == kind])


@pytest.mark.parametrize("strip", [0.06, 0.1])
def test_what_looks_out_from_behind_a_screen_echoes_as_if_it_were_alone(strip):
    """A plate of 0.4 m, of which a strip at one side is lit, against that strip without the rest.

    The screen is half a metre before the plate, and the radar 10 m: by the intercept theorem the
    edge of its shadow is 10/9.5 times as far from the axis as its own edge.
    """
    whole = plate(0.4, 0.02)
    alone = whole[np.mean(whole[..., 1], axis=1) > 0.2 - strip]
    edge = (0.2 - strip) * 9.5 / 10
    before = Actor(
        name="screen", kind="tree", mesh=mesh_of(box((0.001, 1.0, 1.0), 0.5)),
        pose=Pose(x=0.5, y=edge - 0.5, z=0.5),
    )  # fmt: skip
    found = []
    for corners, others in ((whole, [before]), (alone, [])):
        target = Actor(name="target", kind="object", pose=Pose(z=0.5), mesh=mesh_of(corners))
        scene = around([target, *others], [(10.0, 0.0, 0.5)])
        found.append(transfer_at(TRACER.trace(scene), 79e9)[0, 0])
    assert abs(found[1]) > 0
    assert found[0] == pytest.approx(found[1], rel=1e-3)
