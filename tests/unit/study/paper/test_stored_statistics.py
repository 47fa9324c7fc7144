"""The stored points of figures 12 and 13."""

from __future__ import annotations

from importlib.resources import files
from itertools import product
from pathlib import Path

import pytest

from polychirp.study.monte_carlo.executor import LocalWorkers
from polychirp.study.paper.results import PAPER_TARGETS
from polychirp.study.paper.statistics import (
    CURVES,
    NUM_TARGETS,
    run_statistics,
    statistics_plan,
)
from polychirp.study.paper.stored_statistics import (
    StoredChannel,
    read_statistics,
    write_statistics,
)


def test_every_curve_has_a_hundred_trials_at_every_number_of_targets() -> None:
    rows = read_statistics().rows
    places = {(row.num_targets, (row.waveform, row.situation)) for row in rows}
    curves = [curve for curve in CURVES if curve[1] != "blanked"]
    assert places == set(product(NUM_TARGETS, curves))
    assert {row.num_trials for row in rows} == {100}


def test_ray_traced_vehicles_have_all_curves_at_every_number_of_targets() -> None:
    rows = read_statistics("vehicles").rows
    places = [(row.num_targets, (row.waveform, row.situation)) for row in rows]
    assert places == list(product(NUM_TARGETS, CURVES))
    assert min(row.num_trials for row in rows) >= 60
    widest = max(row.detection[2] - row.detection[1] for row in rows)
    assert widest < 0.1


@pytest.mark.parametrize(
    ("channel", "name"),
    [("points", "statistics.json"), ("vehicles", "traced_statistics.json")],
)
def test_what_is_read_is_what_was_written(
    tmp_path: Path, channel: StoredChannel, name: str
) -> None:
    stored = read_statistics(channel)
    write_statistics(stored, tmp_path / "again.json")
    written = (tmp_path / "again.json").read_text(encoding="utf-8")
    packaged = files("polychirp.study.paper").joinpath(name)
    assert written == packaged.read_text(encoding="utf-8")


@pytest.mark.claims
@pytest.mark.slow
def test_other_trials_agree_with_the_stored_ones(tmp_path: Path) -> None:
    """The intervals of Pd, and those of the number of ghosts, overlap at ten targets."""
    curves = [curve for curve in CURVES if curve[1] != "blanked"]
    plan = statistics_plan(trials=10, num_targets=(PAPER_TARGETS,), curves=curves, seed=70)
    fresh = run_statistics(plan, folder=tmp_path, executor=LocalWorkers(count=1))
    stored = {
        (row.waveform, row.situation): row
        for row in read_statistics().rows
        if row.num_targets == PAPER_TARGETS
    }
    for row in fresh:
        other = stored[row.waveform, row.situation]
        for one, two in ((row.detection, other.detection), (row.ghosts, other.ghosts)):
            assert one[1] <= two[2]
            assert two[1] <= one[2]
