"""From beats to range and rate."""

import numpy as np
import pytest

from polychirp.receiver.estimation.beat_refinement import range_and_rate_from_beats
from tests.support.references.receiver import range_and_rate_from_beats_twin


def ramps():
    """Logs with a parabola at known beats, some of them pulled away, and noise elsewhere."""
    draw = np.random.default_rng(5)
    slope = np.stack([np.tile([13.0, -13.0], 8) * draw.uniform(0.8, 1.0, 16), np.full(16, 0.8)], 1)
    place = 100.0 + slope @ [1.0, 2.0]
    logs = draw.normal(size=(16, 220, 2))
    true = place + slope @ [0.03, -0.2]
    true[[2, 9]] += 1.0
    bins = np.arange(220)
    for k in range(16):
        near = np.abs(bins - true[k]) < 3.0
        logs[k, near, 1] = 20.0 - (bins[near] - true[k]) ** 2
    return logs.astype(np.float32), place, slope


@pytest.mark.parametrize("solve", [range_and_rate_from_beats, range_and_rate_from_beats_twin])
def test_range_and_rate_follow_the_beats_of_most_ramps(solve):
    """Two ramps of sixteen have their peak elsewhere and get no weight."""
    logs, place, slope = ramps()
    guess, beam = np.array([[7.0, 3.0]]), np.array([1])
    found = solve(logs, guess, beam=beam, place=place[None], slope=slope, reach=2, resolution=2.0)
    assert found[0] == pytest.approx([7.03, 2.8], abs=1e-3)


def test_the_compiled_solution_is_its_references():
    logs, place, slope = ramps()
    guess, beam = np.array([[7.0, 3.0], [7.0, 3.0]]), np.array([1, 0])
    places = np.stack([place, place + 3.0])
    options = {"beam": beam, "place": places, "slope": slope, "reach": 2, "resolution": 2.0}
    fast = range_and_rate_from_beats(logs, guess, **options)
    slow = range_and_rate_from_beats_twin(logs, guess, **options)
    assert fast == pytest.approx(slow, abs=1e-6)


def test_a_fit_that_runs_away_leaves_the_guess():
    logs, place, slope = ramps()
    guess, beam = np.array([[7.0, 3.0]]), np.array([1])
    far = place + slope @ [0.05, 1.3]  # the beats are 1.5 m/s off
    found = range_and_rate_from_beats(
        logs, guess, beam=beam, place=far[None], slope=slope, reach=4, resolution=2.0
    )
    assert found.tolist() == guess.tolist()
