"""Frequency of ghosts in a receiver, against the closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from polychirp.scoring.causes import Nature
from polychirp.study.monte_carlo.grid import trial_seed
from polychirp.study.monte_carlo.tasks import attempt
from polychirp.study.random_draw import sample_street
from polychirp.study.trial import run_trial
from tools.experiments.ghosts import case, expectation, measure_ghosts


class Here:
    """Runs tasks in this process, one after the other."""

    def run(self, studies, tasks):
        for task in tasks:
            yield attempt(studies, task)


@pytest.mark.claims
@pytest.mark.slow
def test_the_mean_of_what_is_drawn_is_the_closed_form():
    """Over 100 streets with starts within 0.2 µs, and with clocks within 0.5 ppm."""
    for one in (case("start", 0.2e-6), case("clock", 0.5e-6), case("number", 3)):
        found = [expectation(one, trial_seed(5, n)) for n in range(100)]
        for form, hit in (("in_map", "is_in_map"), ("ridge", "has_ridge")):
            mean = np.mean([getattr(row, form) for row in found])
            hits = np.mean([getattr(row, hit) for row in found])
            assert hits == pytest.approx(mean, abs=0.15)  # 3 σ


def test_a_diverse_radar_and_a_slope_far_off_are_expected_to_make_none():
    assert expectation(case("start", 0.02e-6, "diverse"), 1).in_map == 0.0
    assert expectation(case("slope", 1e-3), 1).in_map == 0.0
    assert expectation(case("slope", 1e-4), 1).in_map == 1.0


@pytest.mark.claims
@pytest.mark.slow
def test_ghosts_are_as_frequent_as_the_closed_form_says():
    """Every expected ghost is detected, and no other."""
    one = replace(case("start", 0.5e-6), num_trials=60)
    (row,) = measure_ghosts([one], executor=Here(), seed=3)
    assert row.lost == 0
    assert row.extra == 0
    assert row.direct.low <= row.theory <= row.direct.high
    assert row.predicted == pytest.approx(60 * row.theory, abs=3 * np.sqrt(60 * 0.25))


def hides_or_shows_the_ghost(study, seed):
    """True if a frame lost a target, or has a detection to which the ghost contributed most."""
    victim = run_trial(sample_street(replace(study, seed=seed))).victims[0]
    is_found = all(victim.score.is_detected[victim.truth.is_visible])
    return Nature.DIRECT.value in victim.score.nature or not is_found


@pytest.mark.claims
@pytest.mark.slow
def test_a_ghost_beyond_the_map_hides_no_target_and_leaves_nothing_in_it():
    """Even if its up-beats or its down-beats cross the map."""
    one, seed = case("start", 0.2e-6), trial_seed(1, 14)
    there = expectation(one, seed)
    assert there.has_ridge
    assert not there.is_in_map
    assert not hides_or_shows_the_ghost(one.study, seed)


@pytest.mark.claims
@pytest.mark.slow
def test_a_ghost_beyond_the_map_hides_hardly_any_target_and_leaves_hardly_anything_in_it():
    """Even if its up-beats or its down-beats cross the map.

    Of 173 such frames, other ones than these, nine lost a target, or had a detection to which the
    ghost contributed most.
    """
    count = wrong = 0
    for axis, spread in (("clock", 0.3e-6), ("start", 0.2e-6)):
        one = case(axis, spread)
        for trial in range(600, 700):
            seed = trial_seed(1, trial)
            there = expectation(one, seed)
            if there.is_in_map or not there.has_ridge:
                continue
            count += 1
            wrong += hides_or_shows_the_ghost(one.study, seed)
    assert count > 30
    assert wrong <= binom.ppf(0.99, count, 9 / 173)


_KINDS = ("conventional", "diverse")


@pytest.mark.claims
@pytest.mark.slow
def test_diverse_radars_make_no_ghost_where_conventional_ones_make_all_that_are_due():
    pair = [replace(case("start", 0.02e-6, kind), num_trials=15) for kind in _KINDS]
    conventional, diverse = measure_ghosts(pair, executor=Here(), seed=3)
    assert conventional.lost == conventional.extra == 0
    assert conventional.predicted >= 10
    assert diverse.any_ghost.value == 0.0
