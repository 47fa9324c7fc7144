"""Trailers follow their pin: the closed form beside steps of the equation, and its limits.

The twin integrates the yaw rate of an axle that does not slip with Runge and Kutta's method.
"""

import math

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.frames import Pose
from polychirp.model.scene import Actor, Scene
from polychirp.model.towing import Towing

PIN_X, AXLE_X = 3.5, -4.5
LENGTH = PIN_X - AXLE_X


def trailer(*, heading, pin_velocity, pin_yaw_rate, name="trailer", part_of=""):
    towing = Towing(pin_x=PIN_X, axle_x=AXLE_X, pin_yaw_rate=pin_yaw_rate)
    motion = towing.drawn(Pose(x=2.0, y=-1.0, z=0.3, yaw=heading), np.array(pin_velocity))
    return Actor(
        name=name,
        kind="vehicle",
        pose=motion.pose,
        velocity=tuple(motion.velocity.tolist()),
        yaw_rate=motion.yaw_rate,
        towing=towing,
        part_of=part_of,
    )


def drawn_trailer(seed):
    rng = np.random.default_rng(seed)
    speed, way = rng.uniform(0.0, 25.0), rng.uniform(-math.pi, math.pi)
    return trailer(
        heading=way + rng.uniform(-1.5, 1.5),
        pin_velocity=(speed * math.cos(way), speed * math.sin(way), 0.0),
        pin_yaw_rate=rng.uniform(-1.0, 1.0),
    )


def stepped(actor, duration, steps=4000):
    """Heading and place of the pin after some time, step by step."""
    w = pin_velocity(actor)
    place, heading, h = pin(actor), actor.pose.yaw, duration / steps
    omega = actor.towing.pin_yaw_rate

    def rates(time, psi):
        c, s = math.cos(omega * time), math.sin(omega * time)
        v = np.array([c * w[0] - s * w[1], s * w[0] + c * w[1], w[2]])
        return v, (v[1] * math.cos(psi) - v[0] * math.sin(psi)) / LENGTH

    for number in range(steps):
        t = number * h
        v1, k1 = rates(t, heading)
        v2, k2 = rates(t + h / 2, heading + h / 2 * k1)
        _, k3 = rates(t + h / 2, heading + h / 2 * k2)
        v4, k4 = rates(t + h, heading + h * k3)
        heading += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        place = place + h / 6 * (v1 + 4 * v2 + v4)
    return heading, place


def pin(actor):
    return actor.pose.to_outer(np.array([PIN_X, 0.0, 0.0]))


def pin_velocity(actor):
    return actor.velocity_at(pin(actor))


def turned(first, second):
    return math.remainder(first - second, 2 * math.pi)


@pytest.mark.parametrize("duration", [0.03, 1.0, 4.0])
@pytest.mark.parametrize("seed", range(6))
def test_the_closed_form_is_the_integral_of_the_equation(seed, duration):
    actor = drawn_trailer(seed)
    heading, place = stepped(actor, duration)
    later = actor.at(duration)
    assert turned(later.pose.yaw, heading) == pytest.approx(0.0, abs=1e-9)
    assert pin(later) == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_two_steps_are_one(seed):
    actor = drawn_trailer(seed)
    once, twice = actor.at(1.7), actor.at(0.4).at(1.3)
    assert twice.pose.position == pytest.approx(once.pose.position, abs=1e-9)
    assert turned(twice.pose.yaw, once.pose.yaw) == pytest.approx(0.0, abs=1e-9)
    assert twice.velocity == pytest.approx(once.velocity, abs=1e-9)
    assert twice.yaw_rate == pytest.approx(once.yaw_rate, abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_velocity_and_acceleration_are_the_derivatives_of_the_place(seed):
    """Of matter that is neither at the pin nor at the axle."""
    actor, inner, step = drawn_trailer(seed).at(0.2), np.array([-6.0, 1.2, 2.0]), 1e-4
    early, now, late = (actor.at(t).pose.to_outer(inner) for t in (-step, 0.0, step))
    assert actor.velocity_at(now) == pytest.approx((late - early) / (2 * step), abs=1e-6)
    slope = (late - 2 * now + early) / step**2
    assert actor.acceleration_at(now) == pytest.approx(slope, abs=1e-5)
    scene = Scene(time=0.0, actors=(Actor(name="a", kind="object"), actor))
    velocity, acceleration = scene.motion_at(np.array([1, 0]), np.stack([now, now]))
    assert velocity[0] == pytest.approx(actor.velocity_at(now))
    assert acceleration[0] == pytest.approx(actor.acceleration_at(now))
    assert not acceleration[1].any()


@pytest.mark.parametrize("seed", range(6))
def test_the_axle_moves_along_the_heading_alone(seed):
    actor = drawn_trailer(seed).at(0.6)
    axle = actor.pose.to_outer(np.array([AXLE_X, 0.0, 0.0]))
    left = np.array([-math.sin(actor.pose.yaw), math.cos(actor.pose.yaw), 0.0])
    assert actor.velocity_at(axle) @ left == pytest.approx(0.0, abs=1e-12)


def test_behind_a_straight_way_the_trailer_follows_a_tractrix():
    """Tan δ/2 falls by a factor of e for every length of the trailer."""
    actor = trailer(heading=1.2, pin_velocity=(10.0, 0.0, 0.0), pin_yaw_rate=0.0)
    later = actor.at(2.0)
    assert math.tan(later.pose.yaw / 2) == pytest.approx(
        math.tan(0.6) * math.exp(-10.0 * 2.0 / LENGTH), rel=1e-12
    )


def test_in_a_long_bend_both_turn_alike():
    """The sine of the angle between the pin's way and the trailer is then −ωℓ/v."""
    actor = trailer(heading=0.0, pin_velocity=(10.0, 0.0, 0.0), pin_yaw_rate=0.5).at(30.0)
    assert actor.yaw_rate == pytest.approx(0.5, rel=1e-9)
    way = math.atan2(*pin_velocity(actor)[1::-1])
    assert math.sin(actor.pose.yaw - way) == pytest.approx(-0.5 * LENGTH / 10.0, rel=1e-9)


def test_behind_a_standing_pin_the_trailer_stands():
    actor = trailer(heading=0.4, pin_velocity=(0.0, 0.0, 0.0), pin_yaw_rate=0.7).at(3.0)
    assert actor.yaw_rate == 0.0
    assert actor.pose.yaw == pytest.approx(0.4)
    assert actor.pose.position == pytest.approx([2.0, -1.0, 0.3])


def test_the_axle_must_be_behind_the_pin():
    with pytest.raises(InputError, match="axle at 4 m is not behind the pin at 3 m"):
        Towing(pin_x=3.0, axle_x=4.0)


def test_a_part_needs_the_actor_that_it_belongs_to():
    lonely = trailer(heading=0.0, pin_velocity=(1.0, 0.0, 0.0), pin_yaw_rate=0.0, part_of="truck")
    with pytest.raises(InputError, match="'trailer' is a part of 'truck', which is not"):
        Scene(time=0.0, actors=(lonely,))
