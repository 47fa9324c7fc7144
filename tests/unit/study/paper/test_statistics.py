"""Figures 12 and 13: the plan, its study file, and what is read off."""

from __future__ import annotations

from pathlib import Path

import pytest

from polychirp.channel.tracers.composite import Composite
from polychirp.config.monte_carlo import load_plan
from polychirp.study.check import check
from polychirp.study.monte_carlo.executor import LocalWorkers
from polychirp.study.monte_carlo.plan import check_plan
from polychirp.study.paper.statistics import (
    CURVES,
    NUM_TARGETS,
    TRIALS,
    run_statistics,
    statistics_plan,
    statistics_study,
)
from polychirp.study.random_draw import sample_street

FILE = Path(__file__).parents[4] / "studies" / "paper" / "fig12-13.toml"


def test_the_study_file_makes_the_same_points() -> None:
    ours, written = statistics_plan(trials=TRIALS), load_plan(FILE)
    assert [axis.name for axis in written.axes] == [axis.name for axis in ours.axes]
    assert [point.labels for point in written.points] == [point.labels for point in ours.points]
    assert [p.study_hash for p in written.points] == [p.study_hash for p in ours.points]
    assert written.trials >= ours.trials


def test_every_point_can_run() -> None:
    check_plan(statistics_plan(trials=1, num_targets=(1, 10)), progress=lambda *_: None)


def test_all_curves_share_the_street_of_a_trial() -> None:
    plan = statistics_plan(trials=1)
    most = [point for point in plan.points if point.labels[0] == max(NUM_TARGETS)]
    assert len(most) == len(CURVES)
    assert len({sample_street(point.trial(3)).street for point in most}) == 1


def test_vehicles_are_traced() -> None:
    study = statistics_study("vehicles")
    assert isinstance(study.tracer, Composite)
    assert check(study).targets == (sample_street(study).targets,)


@pytest.mark.claims
@pytest.mark.slow
def test_few_trials_give_every_curve_with_its_limits(tmp_path: Path) -> None:
    rows = run_statistics(
        statistics_plan(trials=2, num_targets=(1,)), folder=tmp_path, executor=LocalWorkers(count=1)
    )
    assert [(row.waveform, row.situation) for row in rows] == list(CURVES)
    for row in rows:
        value, low, high = row.detection
        assert (row.num_targets, row.num_trials, value, high) == (1, 2, 1.0, 1.0)
        assert 0.0 < low < 1.0
    in_step = next(r for r in rows if (r.waveform, r.situation) == ("conventional", "interfered"))
    diverse = next(r for r in rows if (r.waveform, r.situation) == ("diverse", "interfered"))
    assert in_step.ghosts[0] >= 1.0
    assert diverse.ghosts[0] == 0.0
    assert in_step.ghosts_gain is None
    assert diverse.ghosts_gain is not None
    assert diverse.ghosts_gain[0] == -in_step.ghosts[0]
