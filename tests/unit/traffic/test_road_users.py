"""People who walk: gait, limbs, limits."""

import numpy as np
import pytest

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.traffic.articulated_bodies.gait import GREATEST_RELATIVE_SPEED, Gait
from polychirp.traffic.articulated_bodies.person import leg_length
from polychirp.traffic.road_users import Pedestrian
from polychirp.traffic.street import Street, Vehicle

LEG = leg_length(1.75)
TRUNK, RIGHT_FOOT, LEFT_FOOT = 1, 11, 12


def centres(speed: float, times: FloatArray) -> FloatArray:
    """Centres of an adult's ellipsoids in the world, m ``(time, ellipsoid, xyz)``."""
    walker = Pedestrian(name="w", x=0.0, y=0.0, speed=speed).actor()
    assert walker.movement is not None
    found = np.array([walker.movement.parts_at(float(t)).ellipsoids.centre for t in times])
    found[..., 0] += speed * times[:, None]
    return found


@pytest.mark.parametrize(("speed", "slip"), [(0.9, 0.25), (1.4, 0.25), (2.0, 0.4)])
def test_feet_swing_at_three_to_four_and_a_half_times_the_speed_and_rest_between(speed, slip):
    """Published spectrograms of walkers have feet at 3 to 4 times the speed of the trunk.

    The model's angles are fitted joint by joint, so that the foot on the ground slips a little.
    """
    period = Gait(relative_speed=speed / LEG, leg=LEG).period
    times = np.linspace(0.0, period, 401)
    rate = np.gradient(centres(speed, times)[..., 0], times, axis=0) / speed
    foot = rate[:, RIGHT_FOOT]
    assert 3.0 < foot.max() < 4.5
    assert abs(np.mean(foot) - 1.0) < 0.01
    stance = (0.1 * period < times) & (times < 0.4 * period)
    assert np.abs(np.mean(foot[stance])) < slip
    assert np.mean(rate[:, TRUNK]) == pytest.approx(1.0, abs=0.01)
    assert np.max(np.abs(rate[:, TRUNK] - 1.0)) < 1 / 3


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
