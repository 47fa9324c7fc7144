"""Range and range rate from beat and phase, and what looks alike."""

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.stepped.solution import (
    alike,
    beat_and_phase,
    slowest,
    solved,
    unambiguous_speed,
)
from polychirp.receiver.stepped.staircase import Staircase

N = 256
PUBLISHED = Staircase(
    num_steps=N, interval=80e-6, late=40e-6, increment=150e6 / N, shift=-75e6 / N, frequency=77e9
)
"""Steps as published: 150 MHz in 20 ms, B half an increment below A."""


@pytest.mark.parametrize("shift", [-0.5, -1.5, 0.0, 2.0])
@pytest.mark.parametrize(("distance", "rate"), [(3.0, 0.0), (40.0, -30.0), (120.0, 55.0)])
def test_the_solution_inverts_beat_and_phase(shift, distance, rate):
    steps = Staircase(
        num_steps=N, interval=2e-5, late=9e-6, increment=-1e6, shift=shift * 1e6, frequency=76.5e9
    )
    beat, phase = beat_and_phase(steps, distance=distance, range_rate=rate)
    found = solved(steps, beat=beat, phase=phase)
    assert float(found.range) == pytest.approx(distance, rel=1e-12)
    assert float(found.range_rate) == pytest.approx(rate, rel=1e-12, abs=1e-12)


def test_with_half_the_increment_it_is_the_published_solution():
    """R/ΔR = κ/2 − Nδ and v/Δv = κ/2 + Nδ, ΔR = c/2B and Δv = λ/2NT."""
    beat, phase = 700.0, 0.013
    kappa = beat * PUBLISHED.duration
    found = solved(PUBLISHED, beat=beat, phase=phase)
    range_cell = SPEED_OF_LIGHT / (2.0 * 150e6)
    rate_cell = SPEED_OF_LIGHT / 77e9 / (2.0 * N * 80e-6)
    assert float(found.range) / range_cell == pytest.approx(kappa / 2 - N * phase, rel=1e-12)
    assert float(found.range_rate) / rate_cell == pytest.approx(kappa / 2 + N * phase, rel=1e-12)
    assert PUBLISHED.range_cell == pytest.approx(range_cell)
    assert PUBLISHED.rate_cell == pytest.approx(rate_cell)


def test_motions_that_look_alike_differ_by_whole_turns_and_cycles():
    pairs = alike(PUBLISHED, span=300.0, greatest_speed=100.0)
    assert len(pairs.range) > 1
    beat, phase = beat_and_phase(PUBLISHED, distance=pairs.range, range_rate=pairs.range_rate)
    for turns in (beat * PUBLISHED.interval, phase):
        np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)


def test_half_the_range_of_all_steps_is_unambiguous_to_the_speed_of_all_steps():
    """N/2 cells of range and ±N cells of range rate have the area N² of all beats and phases."""
    half = 0.5 * N * PUBLISHED.range_cell
    limits = {"least_range": 0.0, "greatest_speed": 1e3}
    near = unambiguous_speed(PUBLISHED, greatest_range=0.999 * half, **limits)
    far = unambiguous_speed(PUBLISHED, greatest_range=1.001 * half, **limits)
    assert near == pytest.approx(N * PUBLISHED.rate_cell)
    assert far == pytest.approx(0.25 * N * PUBLISHED.rate_cell)


def test_the_slowest_motion_within_the_limits_is_taken_and_none_is_said():
    beat, phase = beat_and_phase(
        PUBLISHED, distance=np.array([100.0, 20.0]), range_rate=np.array([11.0, -9.0])
    )
    wrapped = {"beat": beat % (1 / PUBLISHED.interval), "phase": phase - np.round(phase)}
    limits = {"least_range": 1.0, "greatest_range": 120.0, "greatest_speed": 20.0}
    found = slowest(PUBLISHED, **wrapped, **limits)
    np.testing.assert_allclose(found.range, [100.0, 20.0], rtol=1e-9)
    np.testing.assert_allclose(found.range_rate, [11.0, -9.0], rtol=1e-9)
    nearer = slowest(PUBLISHED, **wrapped, **{**limits, "greatest_range": 50.0})
    np.testing.assert_array_equal(np.isnan(nearer.range), [True, False])
    both = slowest(PUBLISHED, **wrapped, **{**limits, "greatest_speed": 60.0})
    np.testing.assert_allclose(both.range_rate, [11.0, -9.0], rtol=1e-9)
