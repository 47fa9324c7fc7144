"""Targets that pass the radar nearby: their range rates change from subframe to subframe.

A point at the range R with the speed v across the line of sight has the radial acceleration v²/R.
Points in noise, four channels; SNRs are those of one subframe, as in `test_subframes`.
"""

import numpy as np
import pytest

from polychirp.receiver.range_doppler import combination
from polychirp.receiver.range_doppler.association import associated
from polychirp.receiver.range_doppler.subframes import wrapped
from polychirp.waveform import Subframes
from tests.physics.test_empty_bands import CONVERTER
from tests.physics.test_subframes import (
    ARRAY,
    READER,
    THREE,
    TWO,
    drawn_point,
    plan,
    seen,
    subframe,
    wrong_speeds,
)
from tests.support.points import HandPoint, coded_frame, true_motions

LONG = Subframes(
    start_frequency=76.5e9,
    bandwidth=1e9,
    ramp_duration=40e-6,
    intervals=(44e-6, 49e-6, 55e-6),
    ramps_per_subframe=96,
)
SPANS, TIMES = np.array([44.3, 39.8, 35.5]), np.array([2.1e-3, 6.6e-3, 11.6e-3])


def drawn_passer(draw, snr_db: float, least: float, most: float) -> HandPoint:
    """A point on a straight way, 2.5 to 6 m aside or above, of ``least`` to ``most`` m/s²."""
    while True:
        speed, aside, distance = draw.uniform(10, 40), draw.uniform(2.5, 6), draw.uniform(4, 20)
        across = speed * min(aside / distance, 1.0)
        if least < across**2 / distance < most:
            break
    return drawn_point(
        draw,
        snr_db + 10 * np.log10(64 / 96),
        range=distance,
        range_rate=draw.choice([-1.0, 1.0]) * np.sqrt(speed**2 - across**2),
        acceleration=across**2 / distance,
    )


def test_points_that_pass_nearby_are_found_with_their_motion_at_the_frames_middle():
    """20 drawn points of 5 to 60 m/s² and 28 to 60 dB.

    At 28 dB the noise of range and range rate, over three subframes, is 0.015 cells: 2 mm and
    7 mm/s; interpolation is wrong by 0.01 cells. Tolerances are five times their sum.
    """
    schedule = plan(LONG)
    for seed in range(20):
        draw = np.random.default_rng([91, seed])
        point = drawn_passer(draw, draw.uniform(28, 60), 5.0, 60.0)
        frame = coded_frame(schedule, [point], array=ARRAY, converter=CONVERTER, seed=seed)
        found = READER.detect(frame)
        [[distance, rate, _, _]] = true_motions(schedule, [point])
        assert found.range == pytest.approx([distance], abs=0.02)
        assert found.range_rate == pytest.approx([rate], abs=0.06)


def accelerated(rate: float, acceleration: float, *, deviation=0.03, noise=(0.0, 0.0, 0.0)):
    """Subframes of a point with the range rate at 7 ms; its limit is 30 m/s²."""
    late = TIMES - 7e-3
    folded = wrapped(rate + acceleration * late + deviation * np.asarray(noise), SPANS)
    distance = 20.0 + rate * late + 0.5 * acceleration * late**2
    return [
        subframe(span, one, time=time, ranges=away, deviation=deviation)
        for span, one, time, away in zip(SPANS, folded, TIMES, distance, strict=True)
    ]


def test_the_range_rate_is_the_most_likely_one_with_an_acceleration_from_zero_to_its_limit():
    """The slow route: the sum of squares on a fine grid of range rates and accelerations."""
    grid, change = np.arange(-0.25, 0.25, 2e-3), np.arange(0.0, 30.1, 0.25)
    for seed in range(30):
        draw = np.random.default_rng([92, seed])
        rate, acceleration = draw.uniform(-60, 60), draw.uniform(-2, 32)
        parts = accelerated(rate, acceleration, noise=draw.normal(size=3))
        folded = np.array([part.range_rate[0] for part in parts])
        tried = rate + grid[:, None, None] + change[:, None] * (TIMES - 7e-3)
        squares = np.sum(wrapped(folded - tried, SPANS) ** 2, axis=-1)
        place, slope = np.unravel_index(np.argmin(squares), squares.shape)
        found = associated(parts, span=140.0, time=7e-3)
        assert found.range_rate == pytest.approx([rate + grid[place]], abs=3e-3)
        assert found.acceleration == pytest.approx([change[slope]], abs=0.3)


@pytest.mark.parametrize("acceleration", [-40.0, 60.0])
def test_detections_whose_acceleration_is_beyond_the_limits_are_of_no_target(acceleration):
    """In 9.5 ms, −40 m/s² are 0.38 m/s below 0, and 60 m/s² 0.28 m/s above the limit of 30 m/s².

    These are nine and 6.7 standard deviations of a difference of two subframes.
    """
    found = associated(accelerated(12.0, acceleration), span=140.0, time=7e-3)
    assert found.range_rate.size == 0
    assert found.num_unresolved == 1


def test_range_rates_that_no_uniform_acceleration_joins_are_of_no_target():
    """The range rate of the second subframe is 0.3 m/s above those before and after it.

    It exceeds what 30 m/s² change in 4.5 ms by 3.9 standard deviations, and the third one agrees
    with the first. The three together have 66 variances from any straight line.
    """
    parts = accelerated(12.0, 0.0, noise=(0.0, 0.3 / 0.03, 0.0))
    assert associated(parts, span=140.0, time=7e-3).range_rate.size == 0


@pytest.mark.parametrize(("waveform", "most"), [(TWO, 6), (THREE, 0)], ids=["two", "three"])
def test_the_acceleration_gives_crowded_points_hardly_more_wrong_speeds(
    waveform, most, monkeypatch
):
    """30 frames of 15 steady points of 17 to 35 dB at 3 to 12 m, two of three of which move.

    Detections of one subframe meet those of others by chance. Of 2250 points before two subframes,
    20 had wrong speeds, and 13 without any acceleration: 1 and 0.6 %. As many are found.
    """

    def counts() -> tuple[int, int]:
        found, wrong = 0, 0
        for seed in range(30):
            draw = np.random.default_rng([93, seed])
            points = [
                drawn_point(
                    draw,
                    draw.uniform(17, 35),
                    range=draw.uniform(3, 12),
                    range_rate=draw.uniform(-70, 70) * (draw.random() < 2 / 3),
                )
                for _ in range(15)
            ]
            detections = seen(waveform, points, seed)
            found += detections.num_detections
            wrong += wrong_speeds(detections, points)
        return found, wrong

    found, wrong = counts()
    monkeypatch.setattr(combination, "TANGENTIAL_SPEED", 0.0)
    found_before, wrong_before = counts()
    assert wrong <= most
    assert wrong <= wrong_before + 3
    assert found - wrong >= found_before - wrong_before
