"""Triangles: order of ramps, random draws, refused values."""

import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, FixedTriangular, Sawtooth, Triangular

STREAMS = Streams(seed=3).of("front")


def schedule(waveform, num_sweeps=16):
    return waveform.schedule(num_sweeps=num_sweeps, streams=STREAMS)


def test_an_up_first_triangle_rises_from_the_bottom_of_the_band_and_returns():
    ramps = schedule(Triangular(bandwidth=1e9, ramp_duration=1e-3), 1)
    np.testing.assert_allclose(ramps.start_frequency, [79e9, 80e9])
    np.testing.assert_allclose(ramps.stop_frequency, [80e9, 79e9])


def test_a_down_first_triangle_falls_from_the_top_of_the_band_and_returns():
    ramps = schedule(Triangular(bandwidth=1e9, ramp_duration=1e-3, order="down-first"), 1)
    np.testing.assert_allclose(ramps.start_frequency, [80e9, 79e9])
    np.testing.assert_allclose(ramps.stop_frequency, [79e9, 80e9])


def test_a_falling_sawtooth_falls_from_the_top_of_the_band():
    ramps = schedule(Sawtooth(bandwidth=1e9, direction="down"), 2)
    np.testing.assert_allclose(ramps.start_frequency, 80e9)
    np.testing.assert_allclose(ramps.stop_frequency, 79e9)


def test_idle_time_lies_between_triangles_and_not_inside():
    ramps = schedule(Triangular(ramp_duration=1e-3, idle=1e-4), 3)
    np.testing.assert_allclose(
        ramps.start_time[1:] - ramps.end_time[:-1], [0, 1e-4, 0, 1e-4, 0], atol=1e-15
    )


def test_draws_stay_within_their_limits_and_fill_them():
    """The probability that none of 2 000 uniform draws is within 1 % of a limit is below 1e-8."""
    ramps = schedule(DiverseTriangular(), 2000)
    for values, lowest, highest in ((ramps.duration, 1e-3, 2e-3), (ramps.bandwidth, 8e8, 1e9)):
        margin = 0.01 * (highest - lowest)
        assert lowest <= values.min() * (1 + 1e-12) < lowest + margin
        assert highest >= values.max() * (1 - 1e-12) > highest - margin


def test_time_and_bandwidth_are_drawn_independently():
    """The sample correlation of n independent pairs has deviation 1/√n; five of them are 1e-6."""
    ramps = schedule(DiverseTriangular(start_frequency_spread=1e8, random_order=True), 2000)
    up = ramps.slope > 0
    lowest = np.where(up, ramps.start_frequency, ramps.stop_frequency)
    draws = np.stack(
        [ramps.duration, ramps.bandwidth, lowest, up[np.repeat(np.arange(0, up.size, 2), 2)]]
    )[:, ::2]
    correlation = np.corrcoef(draws) - np.eye(4)
    assert np.abs(correlation).max() < 5 / np.sqrt(2000)


def test_one_more_diversity_changes_no_other_draw():
    plain = schedule(DiverseTriangular())
    more = schedule(DiverseTriangular(start_frequency_spread=1e8, random_order=True))
    np.testing.assert_array_equal(plain.duration, more.duration)
    np.testing.assert_array_equal(np.abs(plain.slope), np.abs(more.slope))
    assert (plain.start_frequency != more.start_frequency).any()


def test_both_ramps_of_a_triangle_share_its_draw():
    ramps = schedule(DiverseTriangular(start_frequency_spread=1e8, random_order=True))
    np.testing.assert_array_equal(ramps.slope[::2], -ramps.slope[1::2])
    np.testing.assert_array_equal(ramps.duration[::2], ramps.duration[1::2])
    np.testing.assert_allclose(ramps.stop_frequency[::2], ramps.start_frequency[1::2], rtol=1e-15)


def test_a_random_order_is_up_first_in_half_of_the_triangles():
    """400 draws have a standard deviation of 10; the tolerance is five of them."""
    first = schedule(DiverseTriangular(random_order=True), 400).slope[::2]
    assert abs(np.count_nonzero(first > 0) - 200) < 50


def test_a_start_frequency_spread_raises_triangles_by_up_to_itself():
    ramps = schedule(DiverseTriangular(start_frequency_spread=1e8), 500)
    lowest = ramps.start_frequency[::2]
    assert 79e9 <= lowest.min() < 79.005e9
    assert 79.095e9 < lowest.max() < 79.1e9


def test_limits_that_meet_draw_nothing():
    one = DiverseTriangular(bandwidth=(9e8, 9e8), ramp_duration=(1.5e-3, 1.5e-3))
    np.testing.assert_allclose(np.abs(schedule(one).slope), 9e8 / 1.5e-3)


def test_fixed_per_radar_equals_the_first_draw_of_diverse():
    """Both draw from the same named streams, so the first triangle is shared."""
    fixed, diverse = schedule(FixedTriangular()), schedule(DiverseTriangular())
    np.testing.assert_array_equal(fixed.slope[:2], diverse.slope[:2])
    assert np.unique(np.abs(fixed.slope)).size == 1


@pytest.mark.parametrize("family", [DiverseTriangular, FixedTriangular])
@pytest.mark.parametrize("field", ["bandwidth", "ramp_duration"])
def test_limits_in_the_wrong_order_are_refused_by_name(family, field):
    with pytest.raises(InputError, match=f"{field}.*write the smaller one first"):
        family(**{field: (2e-3, 1e-3)})
    with pytest.raises(InputError, match=f"positive lower limit of {field}"):
        family(**{field: (0.0, 1e-3)})


@pytest.mark.parametrize("family", [Sawtooth, Triangular])
@pytest.mark.parametrize("field", ["start_frequency", "bandwidth", "ramp_duration"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_values_that_are_not_positive_are_refused_by_name(family, field, value):
    with pytest.raises(InputError, match=f"positive {field}"):
        family(**{field: value})


def test_an_infinite_bandwidth_is_refused():
    with pytest.raises(InputError, match="finite bandwidth"):
        Sawtooth(bandwidth=float("inf"))


@pytest.mark.parametrize("family", [Sawtooth, Triangular, DiverseTriangular, FixedTriangular])
def test_negative_idle_time_is_refused(family):
    with pytest.raises(InputError, match="negative idle"):
        family(idle=-1e-6)


def test_a_negative_spread_is_refused():
    with pytest.raises(InputError, match="negative start_frequency_spread"):
        DiverseTriangular(start_frequency_spread=-1.0)
