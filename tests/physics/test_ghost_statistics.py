"""How often a receiver claims a ghost, against the closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.line_of_sight import line_of_sight
from polychirp.scoring.closed_forms import apparent_point
from polychirp.scoring.ghosts import Nature
from polychirp.study.drawn import drawn
from polychirp.study.ghosts import case, expectation, measure_ghosts
from polychirp.study.monte_carlo.grid import trial_seed
from polychirp.study.monte_carlo.tasks import attempt
from polychirp.study.spec import scene_of
from polychirp.study.trial import run_trial


class Here:
    """Runs tasks in this process, one after the other."""

    def run(self, studies, tasks):
        for task in tasks:
            yield attempt(studies, task)


@pytest.mark.slow
def test_the_mean_of_what_is_drawn_is_the_closed_form():
    """Over 100 streets with starts within 0.2 µs, and with clocks within 0.5 ppm."""
    for one in (case("start", 0.2e-6), case("clock", 0.5e-6), case("number", 3)):
        found = [expectation(one, trial_seed(5, n)) for n in range(100)]
        for form, hit in (("in_map", "is_in_map"), ("arm", "has_arm")):
            mean = np.mean([getattr(row, form) for row in found])
            hits = np.mean([getattr(row, hit) for row in found])
            assert hits == pytest.approx(mean, abs=0.15)  # 3 σ


def test_a_diverse_radar_and_a_slope_far_off_are_expected_to_make_none():
    assert expectation(case("start", 0.02e-6, "diverse"), 1).in_map == 0.0
    assert expectation(case("slope", 1e-3), 1).in_map == 0.0
    assert expectation(case("slope", 1e-4), 1).in_map == 1.0


@pytest.mark.slow
def test_ghosts_are_as_frequent_as_the_closed_form_says():
    """Between the probability of the ghost's point and that of its arms, and none that is due
    is lost."""
    one = replace(case("start", 0.5e-6), num_trials=60)
    (row,) = measure_ghosts([one], executor=Here(), seed=3)
    assert row.lost == 0
    assert row.extra == row.arms
    assert row.direct.high >= row.theory
    assert row.direct.low <= row.theory_of_arms
    assert row.predicted == pytest.approx(60 * row.theory, abs=3 * np.sqrt(60 * 0.25))


@pytest.mark.slow
@pytest.mark.parametrize(("axis", "spread", "trial"), [("clock", 0.3e-6, 5), ("start", 0.2e-6, 14)])
def test_what_a_ghost_beyond_the_map_leaves_in_it_lies_on_its_arms(axis, spread, trial):
    """Every claim has its up-beat or its down-beat, to three range cells of 0.17 m."""
    one, seed = case(axis, spread), trial_seed(1, trial)
    there = expectation(one, seed)
    assert there.has_arm
    assert not there.is_in_map
    study = drawn(replace(one.study, seed=seed))
    victim = run_trial(study).victims[0]
    interferer = study.radars[1]
    path = line_of_sight(scene_of(study), frequency=79e9, pairs=np.array([[1, 0]]))
    distance, speed = apparent_point(
        delay=path.delay[0],
        delay_rate=path.delay_rate[0],
        start_offset=interferer.start_time,
        clock_offset=interferer.clock_offset,
    )
    ramp = study.radars[0].waveform
    coupling = ramp.ramp_duration * (ramp.start_frequency / ramp.bandwidth + 0.5)
    is_ghost = [nature == Nature.DIRECT.value for nature in victim.score.nature]
    away = victim.detections.range[is_ghost] - distance
    turn = coupling * (victim.detections.range_rate[is_ghost] - speed)
    assert away.size
    assert np.all(np.minimum(np.abs(away + turn), np.abs(away - turn)) < 0.5)


_KINDS = ("conventional", "diverse")


@pytest.mark.slow
def test_diverse_radars_make_no_ghost_where_conventional_ones_always_do():
    pair = [replace(case("start", 0.02e-6, kind), num_trials=15) for kind in _KINDS]
    conventional, diverse = measure_ghosts(pair, executor=Here(), seed=3)
    assert conventional.direct.value == 1.0
    assert diverse.any_ghost.value == 0.0
