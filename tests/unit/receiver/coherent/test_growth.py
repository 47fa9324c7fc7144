"""Growth of points: direct ghosts and passers do not follow 1/R²."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.receiver.coherent.growth import GREATEST_GROWTH, grown, without_growth
from polychirp.receiver.coherent.residual import Residual
from tests.support.points import HandPoint
from tests.unit.receiver.coherent.test_fit import (
    NEAR,
    fitted_to_the_end,
    in_the_middle,
    observed,
    points_at,
    with_amplitudes,
)

GHOST = HandPoint(range=12.3, range_rate=-7.7, azimuth=0.2, spreading=1.0)
"""The direct path of a radar that comes nearer; its amplitude grows with 1/R."""

NOISE = 1e-7
"""70 dB below the ghost's power in a sample."""


def at_their_places(points):
    """The observation of points in little noise, and these points without growth."""
    seen = observed(points, noise=NOISE)
    return seen, with_amplitudes(seen, points_at(seen, in_the_middle(seen, points), floor=NOISE))


def noise_of(seen):
    return NOISE * np.count_nonzero(seen.present) * len(seen.samples)


def test_the_growth_of_a_direct_ghost_is_that_of_its_range():
    seen, points = at_their_places([GHOST])
    found, residual = fitted_to_the_end(seen, points)
    distance, rate = found.motion[0, :2]
    assert found.growth[0] == pytest.approx(rate / distance, rel=0.01)
    assert residual.energy == pytest.approx(noise_of(seen), rel=0.05)


def test_without_a_growth_a_ghost_leaves_far_more_than_noise():
    seen, points = at_their_places([GHOST])
    assert Residual.of(seen, points).energy > 10.0 * noise_of(seen)


def test_echoes_do_not_grow_beyond_their_ranges():
    seen, points = at_their_places([NEAR])
    found, _ = fitted_to_the_end(seen, points)
    assert found.growth[0] == pytest.approx(0.0, abs=0.01)


def test_growths_of_points_that_overlap_are_found_together():
    beside = replace(GHOST, range=12.55, range_rate=-4.0, azimuth=-0.4, spreading=3.0)
    seen, points = at_their_places([GHOST, beside])
    found, _ = fitted_to_the_end(seen, points)
    slope = found.motion[:, 1] / found.motion[:, 0]
    assert found.growth == pytest.approx(slope * [1.0, -1.0], rel=0.05)


def test_points_of_one_cell_have_no_growth():
    """A direct ghost, and the wave that the road mirrors, an eighth of a cell behind it.

    The two beat with each other, which one point alone takes for a growth.
    """
    mirrored = replace(GHOST, range=GHOST.range + 0.02, range_rate=-7.69, power=0.2)
    seen, points = at_their_places([GHOST, mirrored])
    alone, _ = fitted_to_the_end(seen, with_amplitudes(seen, points[np.array([0])]))
    assert abs(alone.growth[0]) > 5.0
    second = points[np.array([1])]
    both = with_amplitudes(seen, without_growth(seen, alone, second) + second)
    found, _ = fitted_to_the_end(seen, both)
    assert found.growth.tolist() == [0.0, 0.0]
    assert found.motion[1, 0] - found.motion[0, 0] == pytest.approx(0.02, abs=0.004)


def test_weak_points_keep_their_growth():
    seen, points = at_their_places([GHOST])
    weak = replace(points, power=np.array([100.0]))
    found, any_grown = grown(seen, Residual.of(seen, weak), weak)
    assert found is weak
    assert not any_grown


def test_a_point_does_not_take_another_one_for_its_growth():
    """One that is 40 dB stronger and not subtracted yet, three cells away in range rate."""
    strong = replace(GHOST, range=GHOST.range + 0.02, range_rate=-7.45, power=1e4)
    seen, points = at_their_places([GHOST, strong])
    alone = with_amplitudes(observed([GHOST], noise=NOISE), points[np.array([0])])
    found, _ = grown(seen, Residual.of(seen, alone), alone)
    assert abs(found.growth[0]) <= GREATEST_GROWTH
