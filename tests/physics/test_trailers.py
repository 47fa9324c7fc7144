"""A semi-trailer that swings behind its tractor: its echoes and the paths of its radars.

The slow twin is a new trace a moment later, as in `test_turning_bodies`. The tests fail for a truck
of one piece, whose trailer turns with the tractor.
"""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.frames import Pose
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, PointScatterer
from polychirp.traffic.street import Street, Vehicle
from tests.physics.test_turning_bodies import errors, field, strongest, traced


def street():
    """A truck that turns before a car in a side road; radars on the car and on the trailer."""
    truck = Vehicle(
        name="truck",
        body="articulated-truck",
        x=0.0,
        y=0.0,
        speed=9.0,
        yaw_rate=0.3,
        articulation=-0.1,
        coarseness=2.0,
    )
    ego = Vehicle(name="ego", x=-10.0, y=-14.0, heading=1.4, speed=2.0, coarseness=2.0)
    return Street(vehicles=(truck, ego)).scene(
        [
            (Radar(name="ego", mount=Pose(x=2.32, z=0.5)), "ego"),
            (Radar(name="rear", mount=Pose(x=-8.3, z=0.5, yaw=np.pi)), "truck"),
        ]
    )


def of_one_piece(scene):
    """The same scene, whose trailer moves as if it were one body with the tractor."""
    tractor, ego, trailer = scene.actors
    origin = trailer.pose.position
    rigid = replace(
        trailer,
        towing=None,
        velocity=tuple(tractor.velocity_at(origin).tolist()),
        yaw_rate=tractor.yaw_rate,
    )
    return replace(scene, actors=(tractor, ego, rigid))


ECHO = "facets of truck semi-trailer", (0, 0)


def test_the_echo_of_the_trailer_a_moment_later_is_that_of_a_new_trace():
    """Facets that come into view change the field by a thousandth within any time, however short.

    A trailer that turns with the tractor has the wrong phase after the same 4 µs.
    """
    scene, step = street(), 4e-6
    error, change = errors(scene, *ECHO, step)
    assert change > 0.02
    assert error < 2e-3
    later = field(traced(scene.at(step), *ECHO))
    rigid = field(traced(of_one_piece(scene), *ECHO), step)
    assert abs(rigid - later) / abs(later) > 0.02


def test_the_rear_of_a_truck_in_one_piece_would_be_thrown_aside():
    """A truck begins a bend: its trailer still goes straight on, and in one piece it would not."""
    scene = street()
    rates = [strongest(traced(one, *ECHO))[0] for one in (scene, of_one_piece(scene))]
    rear = np.array([-8.25, -1.2, 1.5])
    speeds = [
        one.actors[2].velocity_at(one.actors[2].pose.to_outer(rear))[1]
        for one in (scene, of_one_piece(scene))
    ]
    assert speeds[0] == pytest.approx(-1.0, abs=0.6)
    assert speeds[1] == pytest.approx(-3.5, abs=0.3)
    assert abs(rates[1] - rates[0]) > 2.0


@pytest.mark.parametrize("time", [0.0, 0.3, 0.6])
def test_the_path_to_a_radar_on_the_trailer_bends_as_the_trailer_does(time):
    """Its acceleration is the slope of its rate; that of a steady turn is not."""
    part, pair, step = "line of sight", (0, 1), 1e-3
    scene = street().at(time)
    early, now, late = (
        strongest(traced(scene.at(time + t), part, pair)) for t in (-step, 0.0, step)
    )
    slope = (late[0] - early[0]) / (2 * step)
    assert now[1] == pytest.approx(slope, abs=1e-3)
    tractor, ego, trailer = scene.actors
    steady = replace(scene, actors=(tractor, ego, replace(trailer, towing=None)))
    assert abs(strongest(traced(steady, part, pair))[1] - slope) > 0.1


def test_the_echo_of_a_point_on_the_trailer_bends_as_the_trailer_does():
    """A small body that the trailer carries has the acceleration of its matter."""
    scene, step = street(), 1e-3
    trailer = scene.actors[2]
    point = Actor(
        name="lamp",
        kind="object",
        pose=trailer.pose,
        velocity=trailer.velocity,
        yaw_rate=trailer.yaw_rate,
        towing=trailer.towing,
        points=(PointScatterer(position=(-8.3, 1.0, 0.8), rcs=1.0),),
    )
    scene = replace(scene, actors=(*scene.actors[:2], point))
    early, now, late = (
        strongest(traced(scene.at(t), "points", (0, 0))) for t in (-step, 0.0, step)
    )
    assert now[1] == pytest.approx((late[0] - early[0]) / (2 * step), abs=1e-3)
