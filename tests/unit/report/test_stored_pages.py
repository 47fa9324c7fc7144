"""Pages of stored runs and studies."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from polychirp.cli.app import main
from polychirp.model.spectra import RangeRateMap
from polychirp.report.page_data import causes
from polychirp.report.run_page import frame_data, run_page, write_run_page
from polychirp.report.statistics import short, within
from polychirp.report.study_page import POINT_HEAD, _sentence, study_page
from polychirp.study.store.load import load_run
from polychirp.study.store.save import save_run
from tests.support.runs import BOTH, ORIGIN, STUDY
from tests.unit.report.test_page import Reader
from tests.unit.report.test_study_curves import results_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("run")
    save_run(path / "run.zarr", BOTH, provenance=ORIGIN)
    return path


@pytest.fixture(scope="module")
def run(folder):
    return load_run(folder / "run.zarr")


def test_the_page_of_a_run_has_the_frame_of_every_radar(run):
    reader = Reader()
    html = run_page(run, [])
    reader.feed(html)
    assert reader.open == []
    assert "http" not in html
    data = json.loads(reader.data)
    assert [row["key"] for row in data["rows"]] == ["front", "rear"]
    text = " ".join(reader.text)
    assert "Radar front finds" in text
    assert {link[1:] for link in reader.links if link.startswith("#")} <= set(reader.ids)


def test_a_frame_has_its_detections_and_visible_targets_alone(run):
    """The van of these runs is not visible."""
    victim = run.victim("front")
    data = frame_data(victim, STUDY.receiver)
    assert [target["name"] for target in data["targets"]] == ["car"]
    assert len(data["marks"]) == victim.detections.num_detections
    assert {mark["cause"] for mark in data["marks"]} <= causes().keys()


def test_speeds_beyond_a_map_of_equal_chirps_are_where_the_map_has_their_echoes(run, monkeypatch):
    """Otherwise their circles and marks are outside of the map, which has no echo there."""
    victim = run.victim("front")
    rate = np.arange(-4.0, 4.0)
    map_ = RangeRateMap(
        power=np.ones((8, 50)), range_rate=rate, range=np.arange(50.0), is_periodic=True
    )
    monkeypatch.setattr("polychirp.report.run_page.part_views", lambda *_: {"all": map_})
    count = victim.detections.num_detections
    fast = replace(
        victim,
        truth=replace(victim.truth, range_rate=np.full(len(victim.truth.name), -15.0)),
        detections=replace(victim.detections, range_rate=np.full(count, 2.0)),
    )
    data = frame_data(fast, STUDY.receiver)
    assert [(one["speed"], one["folded"]) for one in data["targets"]] == [(15.0, -1.0)]
    assert all(mark["speed"] == -2.0 and "folded" not in mark for mark in data["marks"])
    map_ = replace(map_, is_periodic=False)
    monkeypatch.setattr("polychirp.report.run_page.part_views", lambda *_: {"all": map_})
    assert all("folded" not in one for one in frame_data(fast, STUDY.receiver)["targets"])


@pytest.mark.parametrize("is_periodic", [True, False])
def test_the_page_speaks_of_equal_sweeps_where_a_map_folds_speeds_alone(
    run, monkeypatch, is_periodic
):
    """Steps of MFSK and diverse ramps have maps that do not fold; it spoke of equal chirps."""
    map_ = RangeRateMap(
        power=np.ones((8, 50)),
        range_rate=np.arange(-4.0, 4.0),
        range=np.arange(50.0),
        is_periodic=is_periodic,
    )
    monkeypatch.setattr("polychirp.report.run_page.part_views", lambda *_: {"all": map_})
    html = run_page(run, [])
    assert ("tell closing speeds apart within the map only" in html) == is_periodic
    assert ("as those of front, rear" in html) == is_periodic


def test_a_target_out_of_sight_is_not_called_missed(run):
    """It is visible, but nothing of it can be found: an echo without power, for instance."""
    victim = run.victim("front")
    nothing = np.zeros_like(victim.score.is_in_sight)
    score = replace(victim.score, is_in_sight=nothing, is_detected=nothing)
    unseen = replace(victim, score=score)
    assert victim.truth.is_visible.any()
    assert frame_data(unseen, STUDY.receiver)["targets"] == []
    page = run_page(replace(run, victims=(unseen,)), [])
    assert "Radar front has no target in sight and detects" in page


def test_the_page_of_a_run_has_its_figures_beside_it(run, tmp_path):
    page = write_run_page(run, tmp_path)
    names = {path.name for path in (tmp_path / "figures").iterdir()}
    figures = {f"{name}-{n}" for name in ("range-profile", "detections", "ramps") for n in (0, 1)}
    assert names == {f"{name}.{kind}" for name in figures for kind in ("png", "svg", "csv")}
    reader = Reader()
    reader.feed(page.read_text(encoding="utf-8"))
    files = {link for link in reader.links if link.startswith("figures/")}
    assert files == {f"figures/{name}" for name in names}


def test_the_command_writes_the_page_into_the_folder_of_the_run(folder, capsys):
    assert main(["report", str(folder)]) == 0
    assert capsys.readouterr().out.strip() == str(folder / "report.html")
    assert (folder / "report.html").is_file()


def test_a_folder_without_results_is_refused(tmp_path, capsys):
    assert main(["report", str(tmp_path)]) == 2
    assert "there is no run and no study" in capsys.readouterr().err


def test_the_page_of_a_study_says_where_its_numbers_come_from():
    """The seed, the study and the versions, as the page of a run."""
    results = replace(results_of(("speed", (10, 20))), origin=ORIGIN)
    html = study_page(results, [], title="made up")
    facts = {
        "seed": str(ORIGIN.seed),
        "study": ORIGIN.study_hash[:12],
        **ORIGIN.versions,
        "points": "2",
        "axes": "speed",
    }
    assert ORIGIN.versions
    for name, value in facts.items():
        assert f"<dt>{name}</dt><dd>{value}</dd>" in html


def test_points_without_targets_in_sight_leave_the_span_of_the_others():
    rows = [
        SimpleNamespace(detection=SimpleNamespace(value=value), num_trials=3)
        for value in (np.nan, 0.5, 1.0)
    ]
    assert "0.50 to 1.00" in _sentence(rows)
    assert _sentence(rows[:1]).endswith("no target is in sight.")
    assert _sentence(rows[:2]).endswith("the detection probability is 0.50.")


def test_the_table_of_points_says_which_errors_and_which_rise_it_has():
    """The sums are rms errors, and the rise is a median over trials, as in the other tables."""
    assert {"Range error, rms (m)", "Speed error, rms (km/h)"} <= set(POINT_HEAD)
    assert "Floor rise, median (dB)" in POINT_HEAD


def test_an_estimate_without_limits_is_shown_alone():
    """One trial has errors, but no interval of them."""
    assert short((0.0012, np.nan, np.nan)) == "0.0012"
    assert short((np.nan, np.nan, np.nan)) == within((np.nan, np.nan, np.nan), 2) == "–"
