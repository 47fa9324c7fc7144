"""``run`` checks, runs, stores, and says what was found; the trial itself is a stand-in here."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from polychirp.cli.app import main
from polychirp.errors import RunError
from polychirp.model.detection import Detections
from polychirp.model.if_frame import PARTS, IfFrame, IfParts, sample_times
from polychirp.model.score import Score
from polychirp.model.truth import Truth
from polychirp.study.spec import schedules_of, target_names, victim_indices
from polychirp.study.store import load_run

QUICKSTART = Path(__file__).parents[3] / "studies" / "quickstart.toml"


@dataclass(frozen=True)
class Victim:
    name: str
    frame: IfFrame
    parts: IfParts
    detections: Detections
    truth: Truth
    score: Score


def silent_victim(study, number: int) -> Victim:
    """A victim whose samples are zero and whose receiver claims one thing."""
    radar, schedule = study.radars[number], schedules_of(study)[number]
    times = sample_times(schedule, radar.converter)
    shape = (radar.array.num_channels, schedule.num_ramps, times.most_samples)
    names = target_names(study, radar)
    one, many = np.ones(1), np.zeros(len(names))
    return Victim(
        name=radar.name,
        frame=IfFrame(samples=np.zeros(shape), times=times, schedule=schedule, array=radar.array),
        parts=IfParts(samples=np.zeros((len(PARTS), *shape))),
        detections=Detections(time=0.0, range=one, range_rate=one, azimuth=one, power=one, snr=one),
        truth=Truth(
            time=0.0,
            name=names,
            range=many,
            range_rate=many,
            azimuth=many,
            point=np.zeros((len(names), 3)),
            is_visible=np.ones(len(names), dtype=bool),
        ),
        score=Score(
            is_detected=np.arange(len(names)) == 0,
            range_error=many,
            range_rate_error=many,
            azimuth_error=many,
            sinr=many,
            nature=("target",),
            power=one,
            target_detection=(0,),
            num_missed=len(names) - 1,
            floor_rise=10.0,
        ),
    )


@pytest.fixture
def trial(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> ModuleType:
    """A module in place of the real trial, in an empty folder; it counts its runs."""
    module = ModuleType("polychirp.study.trial")
    module.runs = []  # type: ignore[attr-defined]

    def run_trial(study, *, progress):
        module.runs.append(study)
        progress("ray tracing", 1, 2)
        victims = tuple(silent_victim(study, number) for number in victim_indices(study))
        return SimpleNamespace(victims=victims)

    module.run_trial = run_trial  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "polychirp.study.trial", module)
    monkeypatch.chdir(tmp_path)
    return module


def quick(*options: str) -> list[str]:
    return ["run", str(QUICKSTART), "--set", "num_sweeps=2", *options]


def test_a_run_is_stored_and_told(trial, capsys):
    assert main(quick()) == 0
    shown = capsys.readouterr()
    (path,) = Path("out").glob("quickstart-*/run.zarr")
    assert str(path) in shown.err
    assert "front" in shown.err
    assert "10.0 dB" in shown.err
    assert shown.out == ""
    assert [victim.name for victim in load_run(path).victims] == ["front"]


def test_the_summary_for_machines_goes_to_stdout(trial, capsys):
    assert main(quick("--json", "--out", "here", "--seed", "5")) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["seed"] == 5
    assert summary["victims"] == [
        {
            "name": "front",
            "targets": 3,
            "found": 1,
            "missed": 2,
            "ghosts": 0,
            "other_echoes": 0,
            "floor_rise": 10.0,
            "detected_targets": ["oncoming"],
            "undetected_targets": ["ahead", "post"],
        }
    ]
    assert load_run(summary["stored"]).provenance.seed == 5


def test_options_reach_the_trial(trial):
    assert main(quick("--set", "radars.1.start_time=1 ms", "--seed", "9")) == 0
    (study,) = trial.runs
    assert (study.seed, study.num_sweeps, study.radars[1].start_time) == (9, 2, 1e-3)


def test_the_same_study_may_run_again_into_its_own_folder(trial):
    assert main(quick("--out", "here")) == 0
    assert main(quick("--out", "here")) == 0


def test_another_studys_results_are_not_replaced_by_accident(trial, capsys):
    assert main(quick("--out", "here")) == 0
    assert main(quick("--out", "here", "--seed", "2")) == 2
    assert len(trial.runs) == 1
    assert "holds the results of another study" in capsys.readouterr().err
    assert main(quick("--out", "here", "--seed", "2", "--force")) == 0


def test_a_file_in_place_of_the_folder_is_refused_before_the_run(trial, capsys):
    Path("file").write_text("", encoding="utf-8")
    assert main(quick("--out", "file/results")) == 2
    assert trial.runs == []
    assert "'file' is a file" in capsys.readouterr().err


def test_what_fails_while_running_stores_nothing(trial, capsys):
    def failing(study, *, progress):
        raise RunError("the disk is full; make room")

    trial.run_trial = failing
    assert main(quick("--out", "here")) == 4
    assert not Path("here").exists()
    assert capsys.readouterr().err.endswith("polychirp: the disk is full; make room\n")


def test_check_prints_json_in_si(trial, capsys):
    assert main(["check", str(QUICKSTART), "--json"]) == 0
    derived = json.loads(capsys.readouterr().out)
    assert derived["victims"] == ["front"]
    assert [radar["name"] for radar in derived["radars"]] == ["front", "other"]
    assert 0.14 < derived["radars"][0]["range_resolution"][0] < 0.19


def test_check_prints_a_table_for_people(trial, capsys):
    assert main(["check", str(QUICKSTART)]) == 0
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "range resolution" in shown.err


def test_init_writes_the_shipped_quickstart(trial):
    assert main(["init", "study.toml"]) == 0
    assert Path("study.toml").read_bytes() == QUICKSTART.read_bytes()
    assert main(["check", "study.toml"]) == 0
