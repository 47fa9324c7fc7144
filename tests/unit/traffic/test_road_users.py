"""People who walk: gait, limbs, limits."""

import numpy as np
import pytest

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.traffic.articulated_bodies.gait import GREATEST_RELATIVE_SPEED, Gait
from polychirp.traffic.articulated_bodies.person import HIP, SHOULDER, leg_length, person
from polychirp.traffic.road_users import Pedestrian
from polychirp.traffic.street import Street, Vehicle

LEG = leg_length(1.75)
TRUNK, RIGHT_FOOT, LEFT_FOOT = 1, 11, 12
RIGHT_ARM, LEFT_ARM, RIGHT_THIGH, LEFT_THIGH = 3, 5, 7, 9
SPEEDS = (0.3, 0.6, 0.9, 1.2, 1.4, 1.7, 2.0, 2.5)


def centres(speed: float, times: FloatArray) -> FloatArray:
    """Centres of an adult's ellipsoids in the world, m ``(time, ellipsoid, xyz)``."""
    walker = Pedestrian(name="w", x=0.0, y=0.0, speed=speed).actor()
    assert walker.movement is not None
    found = np.array([walker.movement.parts_at(float(t)).ellipsoids.centre for t in times])
    found[..., 0] += speed * times[:, None]
    return found


@pytest.mark.parametrize(("speed", "slip"), [(0.9, 0.1), (1.4, 0.1), (2.0, 0.2)])
def test_feet_swing_at_three_to_five_times_the_speed_and_rest_between(speed, slip):
    """Published spectrograms of walkers have feet at 3 to 4 times the speed of the trunk.

    The model's angles are fitted joint by joint, so that the foot on the ground slips a little.
    """
    period = Gait(relative_speed=speed / LEG, leg=LEG).period
    times = np.linspace(0.0, period, 401)
    rate = np.gradient(centres(speed, times)[..., 0], times, axis=0) / speed
    foot = rate[:, RIGHT_FOOT]
    assert 3.0 < foot.max() < 4.7
    assert abs(np.mean(foot) - 1.0) < 0.01
    stance = (0.1 * period < times) & (times < 0.4 * period)
    assert np.abs(np.mean(foot[stance])) < slip
    assert np.mean(rate[:, TRUNK]) == pytest.approx(1.0, abs=0.01)
    assert np.max(np.abs(rate[:, TRUNK] - 1.0)) < 1 / 3


def upper_ends(speed: float, phase: float) -> dict[str, FloatArray]:
    """Hips and shoulders, m ``(xyz,)``, as the upper ends of thighs and upper arms."""
    gait = Gait(relative_speed=speed / LEG, leg=LEG)
    body = person(gait.joints(phase), height=1.75)
    ends = {
        "right hip": RIGHT_THIGH,
        "left hip": LEFT_THIGH,
        "right shoulder": RIGHT_ARM,
        "left shoulder": LEFT_ARM,
    }
    # the third semi-axis points downwards along the limb
    return {name: body.centre[n] - body.axes[n, 2] for name, n in ends.items()}


@pytest.mark.parametrize("speed", SPEEDS)
def test_the_hip_of_the_striking_heel_and_the_shoulder_of_the_other_side_are_in_front(speed):
    """The pelvis is turned forwards on the side of the leg that swung; the thorax turns against it.

    Perry, Gait Analysis, 1992; Bruijn et al., Gait & Posture 27, 2008. The angle of the pelvis is
    4° times the relative speed.
    """
    right, left = upper_ends(speed, 0.0), upper_ends(speed, 0.5)
    turn = np.sin(np.radians(4.0 * speed / LEG))
    ahead = right["right hip"][0] - right["left hip"][0]
    assert ahead == pytest.approx(2 * HIP * 1.75 * turn, rel=0.01)
    assert right["left shoulder"][0] > right["right shoulder"][0] + 0.1 * SHOULDER * 1.75 * turn
    for joint in ("hip", "shoulder"):
        ahead = right[f"right {joint}"][0] - right[f"left {joint}"][0]
        mirrored = left[f"left {joint}"][0] - left[f"right {joint}"][0]
        assert ahead == pytest.approx(mirrored, abs=1e-9)


@pytest.mark.parametrize("speed", SPEEDS)
def test_arms_swing_with_the_legs_of_the_other_side(speed):
    gait = Gait(relative_speed=speed / LEG, leg=LEG)
    for phase, (front, back) in ((0.0, ("left", "right")), (0.5, ("right", "left"))):
        body = person(gait.joints(phase), height=1.75)
        hand = {"right": body.centre[RIGHT_ARM + 1], "left": body.centre[LEFT_ARM + 1]}
        foot = {"right": body.centre[RIGHT_FOOT], "left": body.centre[LEFT_FOOT]}
        assert hand[front][0] > hand[back][0]
        assert foot[front][0] < foot[back][0]


@pytest.mark.parametrize("speed", [1.1, 1.4, 1.7, 2.0])
def test_a_step_is_as_long_as_the_way_of_half_a_cycle(speed):
    """Slower than 1 m/s the model's steps are longer than the way: 16 % at 0.9 m/s."""
    gait = Gait(relative_speed=speed / LEG, leg=LEG)
    feet = person(gait.joints(0.0), height=1.75).centre[[RIGHT_FOOT, LEFT_FOOT], 0]
    assert feet[0] - feet[1] == pytest.approx(speed * gait.period / 2, rel=0.1)


@pytest.mark.parametrize(
    ("speed", "step", "slip"),
    [(0.6, 1.40, -0.12), (0.43, 1.65, -0.27), (0.2, 1.14, 0.12), (0.1, 0.80, 0.42)],
)
def test_slow_walkers_slip_as_the_documentation_says(speed, step, slip):
    """Step over the way of half a cycle, and mean speed of the ankle on the ground over the walk's.

    The ankle is that of thigh and shank, turned by the angles of hip and knee.
    """
    gait = Gait(relative_speed=speed / LEG, leg=LEG)
    feet = person(gait.joints(0.0), height=1.75).centre[[RIGHT_FOOT, LEFT_FOOT], 0]
    assert feet[0] - feet[1] == pytest.approx(step * speed * gait.period / 2, rel=0.01)
    place = []
    for phase in (0.0, gait.support):
        joints = gait.joints(phase)
        hip, knee = joints.hip[0], joints.knee[0]
        aside = 0.0955 * 1.75 * np.sin(joints.pelvis_yaw)  # the right hip is in front by this
        limb = 0.245 * np.sin(hip) + 0.246 * np.sin(hip - knee)
        place.append(joints.offset[0] + aside + 1.75 * limb)
    drift = 1.0 + (place[1] - place[0]) / (speed * gait.support * gait.period)
    assert drift == pytest.approx(slip, abs=0.02)


@pytest.mark.parametrize("speed", SPEEDS)
def test_feet_on_the_ground_stay_on_their_line(speed):
    """They move sideways with the sway of the pelvis alone, which peaks at 0.25 m/s."""
    period = Gait(relative_speed=speed / LEG, leg=LEG).period
    times = np.linspace(0.1 * period, 0.4 * period, 200)
    aside = np.gradient(centres(speed, times)[:, RIGHT_FOOT, 1], times)
    assert np.abs(aside).max() < 0.25


def test_the_left_side_follows_the_right_one_after_half_a_cycle():
    period = Gait(relative_speed=1.4 / LEG, leg=LEG).period
    times = np.linspace(0.0, period, 50)
    now, later = centres(1.4, times), centres(1.4, times + 0.5 * period)
    ahead = now[:, RIGHT_FOOT] + np.array([0.7 * period, 0.0, 0.0])
    assert ahead == pytest.approx(later[:, LEFT_FOOT] * np.array([1, -1, 1]), abs=0.002)


def test_a_cycle_is_as_long_as_in_published_walks():
    """At 1.4 m/s an adult takes 110 to 120 steps a minute (Murray 1967; Perry 1992)."""
    period = Gait(relative_speed=1.4 / LEG, leg=LEG).period
    assert 110 < 2 * 60 / period < 120


@pytest.mark.parametrize("speed", [0.0, 0.4, 1.0, 1.4, 2.5])
def test_no_foot_is_in_the_ground_and_the_head_is_at_the_top(speed):
    walker = Pedestrian(name="w", x=0.0, y=0.0, speed=speed).actor()
    assert walker.movement is not None
    for time in np.linspace(0.0, 2.0, 60):
        solid = walker.movement.parts_at(float(time)).ellipsoids
        half = np.linalg.norm(solid.axes[:, :, 2], axis=1)
        assert np.min(solid.centre[:, 2] - half) > -2e-3
        assert 1.6 < np.max(solid.centre[:, 2] + half) < 1.85


def test_angles_are_continuous_over_the_strike_of_the_heel():
    gait = Gait(relative_speed=1.6, leg=LEG)
    before, after = gait.joints(1.0 - 1e-7), gait.joints(1.0 + 1e-7)
    flat = [np.hstack(one) for one in (before, after)]
    assert flat[0] == pytest.approx(flat[1], abs=1e-4)


def test_a_runner_is_refused():
    fastest = GREATEST_RELATIVE_SPEED * LEG
    with pytest.raises(InputError, match=r"pedestrian 'w' walks at 4 m/s; use 0 m/s to 2\.6 m/s"):
        Pedestrian(name="w", x=0.0, y=0.0, speed=4.0)
    assert Pedestrian(name="w", x=0.0, y=0.0, speed=fastest * 0.999).actor().movement is not None


def test_names_of_walkers_are_those_of_no_other_body():
    car = Vehicle(name="a", x=0.0, y=0.0)
    with pytest.raises(InputError, match="two things on the street are called 'a'"):
        Street(vehicles=(car,), pedestrians=(Pedestrian(name="a", x=9.0, y=0.0),))
