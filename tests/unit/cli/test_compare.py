"""``compare`` runs several studies of one grid and compares the schemes of its last axis."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from polychirp.axes import axes_of
from polychirp.cli import compare
from polychirp.cli.app import main
from polychirp.config.monte_carlo import completed, load_plan
from polychirp.model.baseband import no_progress
from polychirp.scoring.statistics import mean_count, ratio_difference
from polychirp.study.monte_carlo.comparison import comparison
from polychirp.study.monte_carlo.records import NATURES
from polychirp.study.monte_carlo.results import Results, load_results
from polychirp.study.monte_carlo.run import STORE, run_plan
from polychirp.study.spec import schedule_of
from tests.support.small_study import SMALL_GRID, SMALL_STUDY
from tests.unit.study.test_monte_carlo import MadeUp

ROOT = Path(__file__).parents[3]


@pytest.fixture
def files(tmp_path, monkeypatch) -> list[str]:
    """Two studies without a grid, and the grid in a file of its own; trials are made up."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(compare, "_executor", lambda _: MadeUp())
    for name in ("small", "second"):
        text = SMALL_STUDY.replace('name = "small"', f'name = "{name}"')
        Path(f"{name}.toml").write_text(text, encoding="utf-8")
    Path("grid.toml").write_text(SMALL_GRID, encoding="utf-8")
    return ["small.toml", "second.toml", "--common", "grid.toml"]


def test_every_scheme_meets_every_scenario_and_condition(files, capsys):
    assert main(["compare", *files, "--json"]) == 0
    cells = json.loads(capsys.readouterr().out)
    assert len(cells) == 2 * 2 * 2
    assert {cell["scenario"] for cell in cells} == {"small", "second"}
    assert {tuple(cell["condition"]) for cell in cells} == {("-10 dBsm",), ("10 dBsm",)}
    assert {cell["scheme"] for cell in cells} == {"conventional", "diverse"}
    assert all(cell["num_trials"] == 12 for cell in cells)


def test_tables_and_a_figure_are_stored_and_the_next_run_adds_nothing(files, capsys, monkeypatch):
    assert main(["compare", *files]) == 0
    first = capsys.readouterr()
    assert "missed targets and ghosts in a frame" in first.out
    assert "stored in out/comparison" in first.err
    out = Path("out/comparison")
    stored = {path.name for path in out.iterdir() if path.is_file()}
    assert stored == {"comparison.csv", "comparison.json", "comparison.png"}
    kept = (out / "comparison.csv").read_bytes()
    nobody = MadeUp()
    monkeypatch.setattr(compare, "_executor", lambda _: nobody)
    assert main(["compare", *files]) == 0
    assert not nobody.ran
    assert (out / "comparison.csv").read_bytes() == kept


def test_a_cell_sums_the_counts_of_its_point(files, tmp_path):
    plan = load_plan("small.toml", common="grid.toml")
    run_plan(plan, folder=tmp_path / "run", executor=MadeUp(), progress=no_progress)
    results = load_results(tmp_path / "run" / STORE)
    cells = comparison({"small": results})
    for point, cell in enumerate(cells):
        missed = np.sum(results.detected[point, :, 0] == 0, axis=1)
        ghosts = results.num_detections[point, :, 0, NATURES.index("direct")]
        assert cell.ghosts.value == pytest.approx(point)
        assert cell.errors == mean_count((missed + ghosts).astype(float))
        assert (cell.condition, cell.scheme) == (
            results.labels(point)[:-1],
            results.labels(point)[-1],
        )


def test_the_best_has_the_fewest_errors_and_others_are_paired_with_it(files, tmp_path):
    """Of these trials each point has a ghost more than the one before and misses no less."""
    plan = load_plan("small.toml", common="grid.toml")
    run_plan(plan, folder=tmp_path / "run", executor=MadeUp(), progress=no_progress)
    results = load_results(tmp_path / "run" / STORE)
    conventional, diverse = comparison({"small": results})[:2]
    assert conventional.is_among_the_best
    assert conventional.behind.value == 0.0
    assert not diverse.is_among_the_best
    errors = [np.sum(results.detected[n, :, 0] == 0, axis=1) + float(n) for n in range(2)]
    ones = np.ones(12)
    assert diverse.behind == ratio_difference((errors[1], ones), (errors[0], ones))


def test_tables_of_a_common_file_complete_those_of_a_study():
    study = {"a": {"b": 1}, "c": [1]}
    common = {"a": {"b": 2, "d": 3}, "c": [2, 3], "e": 4}
    assert completed(study, common) == {"a": {"b": 1, "d": 3}, "c": [1], "e": 4}


# ── refused ───────────────────────────────────────────────────────────────────


def refusal(capsys, *arguments) -> str:
    assert main(["compare", *arguments]) == 2
    return capsys.readouterr().err


def test_studies_of_different_grids_are_refused(files, capsys):
    text = SMALL_GRID.replace('label = "diverse"', 'label = "another"')
    Path("second.toml").write_text(
        SMALL_STUDY.replace('name = "small"', 'name = "second"') + text, encoding="utf-8"
    )
    sentence = refusal(capsys, *files)
    assert "second: its grid has the axis 'waveform' of conventional, another where" in sentence
    assert "use one grid for all of them" in sentence


def test_two_studies_of_one_name_are_refused(files, capsys):
    assert "two studies are called 'small'" in refusal(
        capsys, "small.toml", "small.toml", "--common", "grid.toml"
    )


def test_a_grid_without_an_axis_is_refused(files, capsys):
    Path("grid.toml").write_text("[monte_carlo]\ntrials = 1\n", encoding="utf-8")
    assert "no axis, and so no schemes to compare" in refusal(capsys, *files)


def test_a_study_that_cannot_run_is_refused_before_the_first_trial_of_any(
    files, capsys, monkeypatch
):
    nobody = MadeUp()
    monkeypatch.setattr(compare, "_executor", lambda _: nobody)
    text = SMALL_STUDY.replace('name = "small"', 'name = "second"')
    text = text.replace('greatest_range = "30 m"', 'greatest_range = "3000 m"')
    Path("second.toml").write_text(text, encoding="utf-8")
    assert main(["compare", *files]) in (2, 3)
    assert "echoes from 3000 m" in capsys.readouterr().err
    assert not nobody.ran


def test_a_study_without_a_grid_is_refused(files, capsys):
    assert "monte_carlo: is missing" in refusal(capsys, "small.toml")


def test_a_common_file_that_does_not_exist_is_named(files, capsys):
    sentence = "there is no file 'none.toml'; name a file with the tables that all studies share"
    assert sentence in refusal(capsys, "small.toml", "--common", "none.toml")


# ── the league ────────────────────────────────────────────────────────────────


def test_the_league_has_one_grid_and_equal_radars():
    """Radars that a file lists and those of its traffic, which copy the first, are all alike."""
    folder = ROOT / "studies" / "league"
    paths = sorted(folder.glob("*.toml"))
    paths = [path for path in paths if path.name not in ("common.toml", "mitigation.toml")]
    plans = [load_plan(path, common=folder / "common.toml") for path in paths]
    assert len(plans) >= 5
    for point in (point for plan in plans for point in plan.points):
        for radar in point.study.radars:
            assert radar.transmit_power == pytest.approx(10 ** (12 / 10) / 1e3)
            assert radar.array.num_channels == 4
            sent = schedule_of(point.study, radar)
            assert sent.num_ramps == (512 if sent.is_stepped else 128)
            span = sent.end_time[-1] - sent.start_time[0]
            assert span == pytest.approx(3.2e-3, rel=0.02)
            assert np.sum(sent.duration) == pytest.approx(128 * 20e-6, rel=0.02)
            lowest, highest = sent.occupied
            assert lowest.min() >= 76.5e9 * (1 - 1e-9)
            assert highest.max() <= 76.8e9 * (1 + 1e-9)
    assert all(plan.axes == plans[0].axes for plan in plans)


def test_the_mitigations_of_the_league_are_an_axis_beside_its_schemes():
    folder = ROOT / "studies" / "league"
    plan = load_plan(
        folder / "junction.toml", common=[folder / "mitigation.toml", folder / "common.toml"]
    )
    assert [axis.name for axis in plan.axes] == ["mitigation", "scheme"]
    kinds = {str(getattr(point.study.receiver.mitigation, "kind", None)) for point in plan.points}
    assert kinds == {"None", "blanking", "stft-excision"}
    assert all(point.command is None for point in plan.points)


def test_a_trial_is_one_draw_whatever_the_number_of_its_victims(files, tmp_path):
    """Three victims whose frames are alike add nothing: same values, same intervals."""
    plan = load_plan("small.toml", common=["grid.toml"])
    run_plan(plan, folder=tmp_path / "run", executor=MadeUp(), progress=no_progress)
    one = load_results(tmp_path / "run" / STORE)
    rng = np.random.default_rng(1)
    one = replace(one, lost=(rng.uniform(size=(*one.lost.shape[:3], 8)) < 0.3).astype(float))
    alike = {
        name: np.repeat(getattr(one, name), 3, axis=2)
        for name, axes in axes_of(Results).items()
        if "victim" in axes
    }
    three = replace(one, victim=("a", "b", "c"), **alike)
    for single, triple in zip(
        *(comparison({"small": results}) for results in (one, three)), strict=True
    ):
        for name in ("detection", "ghosts", "errors", "behind", "lost", "longest_loss"):
            expected, found = getattr(single, name), getattr(triple, name)
            assert found.value == pytest.approx(expected.value)
            assert found.half_width == pytest.approx(expected.half_width, rel=0.02)
