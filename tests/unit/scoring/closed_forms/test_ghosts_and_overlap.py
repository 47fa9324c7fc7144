"""Closed forms of ghosts, against the numbers of their sources and against draws."""

from __future__ import annotations

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.if_frame import SampleTimes
from polychirp.receiver.signal_model.point_signal import beat_phase
from polychirp.rng import Streams
from polychirp.scoring.closed_forms.overlap import (
    any_of,
    chirp_time,
    crossing,
    crossing_time,
    frame_hit,
    frames_lost,
    frames_overlap,
    parallel,
    parallel_in_a_bin,
    same_band,
    same_time,
)
from polychirp.scoring.closed_forms.synchronous import (
    apparent_point,
    ghost_by_clock,
    ghost_by_start,
    has_ridge_in_map,
    random_start,
    removing_slope_difference,
)
from polychirp.waveform import Triangular

DRAWS = np.random.default_rng(1).uniform(size=(200_000, 2))
FOUR_SIGMA = 4 * 0.5 / np.sqrt(len(DRAWS))
BIN = {"bin_delay": 2 * 0.78 / SPEED_OF_LIGHT, "duration": 20e-6, "num_chirps": 250, "duty": 0.25}


def test_a_synchronous_radar_with_another_clock_has_the_phases_of_a_moving_point():
    """On all ramps, the phases that it sends are compared with those of the point's echo."""
    plan = Triangular().schedule(num_sweeps=8, streams=Streams(1))
    start, clock, delay, delay_rate = 30e-9, 1.3e-7, 50e-9, -2.7e-8
    distance, rate = apparent_point(
        delay=delay, delay_rate=delay_rate, start_offset=start, clock_offset=clock
    )
    times = np.array([0.3e-3, 1.2e-3])  # on up-ramp and down-ramp, after each triangle's start
    late = plan.as_clocked(start_time=start, clock_offset=clock)
    beats = []
    for sweep in range(8):
        for ramp, inside in ((2 * sweep, times[0]), (2 * sweep + 1, times[1])):
            t = plan.start_time[ramp] + inside
            sent = t - (delay + delay_rate * t)
            ahead = _phase(plan, ramp, t) - _phase(late, ramp, sent)
            echo = 2.0 * (distance + rate * t) / (SPEED_OF_LIGHT + rate)
            beats.append(ahead - (_phase(plan, ramp, t) - _phase(plan, ramp, t - echo)))
    turns = np.array(beats) - beats[0]
    assert np.abs(turns - np.round(turns)).max() < 2e-3  # ε² f t and ε τ f, in cycles


def _phase(plan, ramp, time):
    """Cycles that a schedule has sent at a time of one of its ramps."""
    inside = time - plan.start_time[ramp]
    advance = plan.start_frequency[ramp] * inside + 0.5 * plan.slope[ramp] * inside**2
    return plan.start_phase[ramp] + advance


def test_the_probability_of_a_start_is_the_share_of_starts_that_are_drawn_into_the_map():
    for delay, spread in ((10e-9, 0.02e-6), (150e-9, 0.1e-6), (120e-9, 1e-6), (1e-9, 0.3e-6)):
        range_ = 0.5 * SPEED_OF_LIGHT * (delay + spread * DRAWS[:, 0])
        drawn = np.mean((range_ >= 0.5) & (range_ <= 30.0))
        form = ghost_by_start(delay, spread=spread, least_range=0.5, greatest_range=30.0)
        assert form == pytest.approx(drawn, abs=FOUR_SIGMA)


def test_the_probability_of_a_clock_is_the_share_of_clocks_that_are_slow_enough():
    for rate, spread in ((0.0, 1e-6), (-5e-8, 0.2e-6), (-5e-8, 0.3e-6), (-5e-8, 0.01e-6)):
        speed = 0.5 * SPEED_OF_LIGHT * (rate - spread * (2 * DRAWS[:, 0] - 1))
        drawn = np.mean(np.abs(speed) <= 32.0)
        form = ghost_by_clock(rate, spread=spread, greatest_speed=32.0)
        assert form == pytest.approx(drawn, abs=FOUR_SIGMA)


def test_a_start_anywhere_in_a_period_meets_as_often_as_a_random_one():
    """A spread of the whole period."""
    whole = ghost_by_start(0.0, spread=3e-3, least_range=0.0, greatest_range=30.0)
    assert whole == pytest.approx(random_start(greatest_range=30.0, period=3e-3))


def test_spreads_are_not_negative():
    with pytest.raises(InputError, match="0 or more"):
        ghost_by_clock(0.0, spread=-1e-6, greatest_speed=32.0)


def test_any_of_some_is_one_minus_none_of_all():
    hits = np.random.default_rng(2).uniform(size=(100_000, 3)) < np.array([0.1, 0.3, 0.5])
    drawn = np.mean(hits.any(axis=1))
    assert any_of(np.array([0.1, 0.3, 0.5])) == pytest.approx(drawn, abs=0.007)
    assert any_of(0.2, 4) == pytest.approx(1 - 0.8**4)


RAO = "Rao and Mani 2020"
SAID = {
    "parallel chirps, 200 m in 20 µs": (
        parallel(greatest_delay=2 * 200.0 / SPEED_OF_LIGHT, duration=20e-6),
        *(0.0667, 5e-5, RAO),
    ),
    "parallel chirps, ten radars, 20 m in 100 µs": (
        parallel(greatest_delay=2 * 20.0 / SPEED_OF_LIGHT, duration=1e-4, number=10),
        *(0.013, 5e-4, "TI SWRA662A"),
    ),
    "an interferer in a bin, equal clocks": (
        parallel_in_a_bin(clock_spread=0.0, **BIN),
        *(1.30e-4, 5e-7, RAO),
    ),
    "an interferer in a bin, 100 ppm": (
        parallel_in_a_bin(clock_spread=100e-6, **BIN),
        *(3.255e-3, 5e-7, RAO),
    ),
    "a bin clean of 20 interferers": (
        1.0 - any_of(parallel_in_a_bin(clock_spread=100e-6, **BIN), 20),
        *(0.937, 5e-4, RAO),
    ),
    "crossing chirps, 50 against 9.5 MHz/µs": (
        crossing(own_slope=9.5e12, other_slope=50e12),
        *(0.81, 5e-3, RAO),
    ),
    "synchronous clocks, random start, 30 m, 2 × 1.5 ms": (
        random_start(greatest_range=30.0, period=3e-3),
        *(6.7e-5, 5e-7, "2R/c over 2T"),
    ),
}


@pytest.mark.parametrize("what", SAID)
def test_a_form_gives_the_number_of_its_source(what, compare):
    measured, expected, tolerance, source = SAID[what]
    compare(
        page="ghosts",
        case=what,
        quantity="probability by a closed form",
        expected=expected,
        measured=measured,
        tolerance=tolerance,
        source=source,
    )


def test_a_crossing_lasts_as_long_as_the_band_is_wide():
    """Rao and Mani's 12.7 MHz: .314 µs."""
    time = crossing_time(own_slope=9.5e12, other_slope=50e12, band=12.7e6)
    assert time == pytest.approx(0.314e-6, abs=5e-10)
    with pytest.raises(InputError, match="other_slope at least as large"):
        crossing(own_slope=50e12, other_slope=9.5e12)


def test_a_slope_difference_of_kim_leaves_the_band_in_half_a_ramp():
    """The beat of the greatest delay runs through δB; half of that is the band of τ_max."""
    ramp = Triangular()
    delta = removing_slope_difference(greatest_delay=0.2e-6, duration=ramp.ramp_duration)
    slope = ramp.bandwidth / ramp.ramp_duration
    assert 0.5 * delta * ramp.bandwidth == pytest.approx(slope * 0.2e-6)


def test_bazzis_overlap_is_that_of_two_chirps_drawn_into_the_band():
    for tolerated in (0.0, 0.3):
        apart = np.abs(DRAWS[:, 0] - DRAWS[:, 1]) * (5e9 - 1e9)
        drawn = np.mean(apart < (1 - tolerated) * 1e9)
        form = same_band(chirp_band=1e9, total_band=5e9, tolerated=tolerated)
        assert form == pytest.approx(drawn, abs=FOUR_SIGMA)
    assert same_band(chirp_band=1e9, total_band=1.5e9) == 1.0
    with pytest.raises(InputError, match="chirp_band must be at most total_band"):
        same_band(chirp_band=2e9, total_band=1e9)


def test_bazzis_frames_meet_in_time_as_often_as_drawn():
    """Two frames of duty δ in one period, cyclically: closer than δ either way."""
    apart = np.abs(DRAWS[:, 0] - DRAWS[:, 1])
    drawn = np.mean(np.minimum(apart, 1 - apart) < 0.2)
    assert same_time(duty=0.2) == pytest.approx(drawn, abs=FOUR_SIGMA)
    assert same_time(duty=0.7) == 1.0
    assert frames_lost(together=0.1, number=2, in_a_row=3) == pytest.approx(0.19**3)


def test_a_chirp_of_a_steeper_interferer_crosses_as_often_as_drawn():
    """Chirps of both radars fill the same band without pauses; the first start is random."""
    own, other = 1.0, 1.0 / 5.0  # durations for slopes that are 1 to 5
    first = DRAWS[:20_000, 0] * other
    starts = first[:, None] + other * np.arange(-6, 6)
    begin, end = np.maximum(starts, 0.0), np.minimum(starts + other, own)
    is_meeting = end > begin
    # the difference of both frequencies changes its sign within the common time
    low = (begin - starts) / other - begin / own
    high = (end - starts) / other - end / own
    crossings = np.sum(is_meeting & (low < 0) & (high > 0), axis=1)
    chirps_in_own_time = own / other
    share = np.mean(crossings) / chirps_in_own_time
    assert crossing(own_slope=1.0, other_slope=5.0) == pytest.approx(share, abs=1e-9)


def test_bazzis_hopping_chirps_meet_as_often_as_drawn():
    """The start of the other chirp is uniform within the repetition interval; δ is a share."""
    is_active = DRAWS[:, 0] < 0.5
    late = DRAWS[:, 1] * 25e-6
    is_in_band = late * 1e9 / 20e-6 < 0.3e9  # the beat of a chirp of 1 GHz in 20 µs
    form = chirp_time(duty=0.5, chirp=20e-6, repetition=25e-6, if_share=0.3)
    assert form == pytest.approx(np.mean(is_active & is_in_band), abs=FOUR_SIGMA)


def test_bazzis_frame_is_hit_as_often_as_drawn_and_never_surely():
    drawn = np.random.default_rng(5).uniform(size=(50_000, 40)) < 0.1
    for tolerated in (0, 3, 8):
        form = frame_hit(together=0.1, num_chirps=40, tolerated=tolerated)
        hit = np.mean(drawn.sum(axis=1) > tolerated)
        assert form == pytest.approx(hit, abs=2 * FOUR_SIGMA)
    assert frame_hit(together=0.1, num_chirps=40, tolerated=40) == 0.0


@pytest.mark.parametrize("distance_share", [0.0, 0.8])
def test_radchats_frames_overlap_as_often_as_drawn(distance_share):
    """N chirps of length 1 in a period of N/U, at a random start; some pair is within the window.

    A chirp of the interferer is heard if it starts up to the window after one of the victim's.
    """
    chirps, duty, window = 20, 0.4, 0.2 * (1.0 + distance_share)
    period = chirps / duty
    late = DRAWS[:20_000, 0] * period
    numbers = np.arange(chirps)
    apart = numbers[:, None] - numbers  # all differences of chirps' numbers
    differences = np.unique(apart)
    gap = late[:, None] + differences
    drawn = np.mean(np.any(gap % period < window, axis=1))
    form = frames_overlap(duty=duty, num_chirps=chirps, if_share=0.2, distance_share=distance_share)
    assert form == pytest.approx(drawn, abs=np.sqrt(10) * FOUR_SIGMA)
    with pytest.raises(InputError, match=r"duty must be above 0 and at most 0\.5"):
        frames_overlap(duty=0.6, num_chirps=20, if_share=0.2)


def test_a_ridge_is_in_the_map_if_a_point_there_has_the_same_beat_on_up_or_down_ramps():
    """Against the beats of all points of the map, on a schedule of one triangle."""
    ramps = Triangular()
    plan = ramps.schedule(num_sweeps=1, streams=Streams(1))
    coupling = ramps.ramp_duration * (ramps.start_frequency / ramps.bandwidth + 0.5)
    draw = np.random.default_rng(3)
    points = np.column_stack([draw.uniform(0, 70, 300), draw.uniform(-150, 150, 300)])
    grid = np.stack(np.meshgrid([0.5, 30.0], [-32.0, 32.0]), axis=-1).reshape(-1, 2)
    found = has_ridge_in_map(
        distance=points[:, 0],
        range_rate=points[:, 1],
        coupling=coupling,
        least_range=0.5,
        greatest_range=30.0,
        greatest_speed=32.0,
    )
    corners, own = _beats(plan, grid), _beats(plan, points)
    inside = (own >= corners.min(axis=0)) & (own <= corners.max(axis=0))
    assert np.mean(found == inside.any(axis=1)) > 0.98  # range walks by up to 0.1 m on a ramp
    assert 0.1 < np.mean(found) < 0.9


def _beats(plan, points):
    """Hz in the middle of each ramp of points that are there at their range: (point, ramp)."""
    middle = plan.start_time + 0.5 * plan.duration
    times = SampleTimes(first=middle, rate=1e6, num_samples=np.array([1, 1]))
    motion = np.column_stack([points, np.zeros(len(points))])
    ramps = [
        beat_phase(plan, times, motion=motion, time=float(time))[:, n, 1]
        for n, time in enumerate(middle)
    ]
    return np.stack(ramps, axis=-1)
