"""``study`` checks, runs, prints and stores; the executor makes its trials up."""

import json
from pathlib import Path

import pytest

from polychirp.cli import paper, study
from polychirp.cli.app import main
from polychirp.model.baseband import no_progress
from polychirp.study.monte_carlo.executor import WORKERS_PER_CORE
from polychirp.study.monte_carlo.tasks import Outcome
from polychirp.study.paper import statistics
from polychirp.threads import num_cores
from tests.support.small_study import SMALL_GRID, SMALL_STUDY
from tests.unit.study.test_monte_carlo import made_up


class MadeUp:
    """Outcomes at once."""

    def run(self, studies, tasks):
        del studies
        for task in tasks:
            yield Outcome(task=task, result=(made_up(task.point, task.seed),))


@pytest.fixture
def file(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(study, "_executor", lambda _: MadeUp())
    path = Path("small.toml")
    path.write_text(SMALL_STUDY + SMALL_GRID, encoding="utf-8")
    return path


def test_results_are_printed_on_stdout_and_their_place_on_stderr(file, capsys):
    assert main(["study", str(file)]) == 0
    shown = capsys.readouterr()
    (folder,) = Path("out").glob("small-*-trials")
    assert f"stored in {folder}" in shown.err
    assert "small: detections, with 95 % intervals" in shown.out
    assert "errors of targets found, rms" in shown.out
    assert "small: checking" not in shown.out


def test_the_summary_for_machines_is_all_of_stdout(file, capsys):
    assert main(["study", str(file), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["new_trials"] == 4 * 12
    assert len(summary["points"]) == 4


def test_force_removes_figures_of_the_earlier_trials(file, tmp_path):
    """A grid without their axis would not replace them."""
    command = ["study", str(file), "--out", "here"]
    assert main(command) == 0
    old = Path("here/curves-other.png")
    old.touch()
    assert main(command) == 0
    assert old.exists()
    assert main([*command, "--force"]) == 0
    assert not old.exists()


def test_a_run_in_the_default_folder_is_not_in_the_way(file):
    """Both take their folder from the name and hash of the study."""
    other = file.parent / "out"
    assert main(["study", str(file)]) == 0
    (trials,) = other.glob("small-*-trials")
    of_run = other / trials.name.removesuffix("-trials")
    (of_run / "run.zarr").mkdir(parents=True)
    assert main(["study", str(file)]) == 0


@pytest.mark.parametrize("name", ["[/x]", "[red]x", "a\x1b[31mb"])
def test_names_are_shown_as_they_are_written(file, capsys, name):
    text = file.read_text(encoding="utf-8").replace("conventional", json.dumps(name)[1:-1])
    file.write_text(text, encoding="utf-8")
    assert main(["study", str(file)]) == 0
    shown = capsys.readouterr()
    assert name.replace("\x1b", "") in shown.out
    assert "\x1b" not in shown.out + shown.err


def test_a_study_without_a_grid_says_what_to_add(file, capsys):
    file.write_text(SMALL_STUDY, encoding="utf-8")
    assert main(["study", str(file)]) == 2
    assert "add the table [monte_carlo] with trials = 100" in capsys.readouterr().err


def test_an_interrupt_keeps_finished_trials_and_says_so(file, capsys, monkeypatch):
    class Interrupted(MadeUp):
        def run(self, studies, tasks):
            for number, outcome in enumerate(super().run(studies, tasks)):
                if number == 5:
                    raise KeyboardInterrupt
                yield outcome

    with monkeypatch.context() as patch:
        patch.setattr(study, "_executor", lambda _: Interrupted())
        assert main(["study", str(file)]) == 130
    sentence = "finished trials are kept, and the same command continues with the missing trials"
    assert sentence in capsys.readouterr().err
    assert main(["study", str(file)]) == 0
    assert f"{4 * 12 - 5} new trials" in capsys.readouterr().err


def test_far_too_many_workers_are_noted_and_not_started(tmp_path, capsys):
    arguments = type("A", (), {"workers": 100_000, "cluster": None})()
    most = WORKERS_PER_CORE * num_cores()
    assert study._executor(arguments).count == most
    assert f"at most {WORKERS_PER_CORE} start for each core, here {most}" in capsys.readouterr().err


def test_a_negative_seed_is_one_sentence(tmp_path, capsys):
    path = tmp_path / "small.toml"
    path.write_text(SMALL_STUDY + SMALL_GRID, encoding="utf-8")
    assert main(["study", str(path), "--seed", "-1"]) == 2
    printed = capsys.readouterr().err
    assert "seed: is -1; use 0 or more" in printed
    assert "Traceback" not in printed


@pytest.mark.parametrize("place", ["http://x", "nowhere"])
def test_a_wrong_cluster_is_one_sentence(tmp_path, capsys, place):
    path = tmp_path / "small.toml"
    path.write_text(SMALL_STUDY + SMALL_GRID, encoding="utf-8")
    assert main(["study", str(path), "--cluster", place]) == 2
    assert capsys.readouterr().err.count("\n") == 1


# ── paper ─────────────────────────────────────────────────────────────────────


def test_the_paper_leaves_statistics_alone_that_it_did_not_write(tmp_path, capsys):
    mine = tmp_path / "statistics" / "mine.txt"
    mine.parent.mkdir()
    mine.write_text("years of work", encoding="utf-8")
    assert main(["paper", "--out", str(tmp_path)]) == 2
    assert "holds files that polychirp paper did not write" in capsys.readouterr().err
    assert mine.read_text(encoding="utf-8") == "years of work"


def test_the_paper_knows_the_statistics_that_it_wrote(tmp_path, monkeypatch):
    monkeypatch.setattr(statistics, "run_statistics", lambda *_, **__: ())
    folder = tmp_path / "statistics"
    paper._statistics(folder, seed=1, progress=no_progress)
    assert [path.name for path in folder.iterdir()] == [paper.MARK]
    paper._refuse_other_statistics(folder)
