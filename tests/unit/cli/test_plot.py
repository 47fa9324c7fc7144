"""``plot`` draws what ``run`` and ``study`` have stored."""

import csv
from dataclasses import replace

import pytest

from polychirp.cli.app import main
from polychirp.cli.plot import OF_RUNS
from polychirp.model.radar import Radar
from polychirp.report.figures.grid_axis import grid_axis
from polychirp.report.run_plots import FIGURES
from polychirp.study.store.save import save_run
from tests.support.runs import BOTH, ORIGIN

STUDY = """
name = "grid"
num_sweeps = 2
[tracer]
kind = "free-space"
[[street.vehicles]]
name = "ego"
x = "0 m"
y = "0 m"
[[street.points]]
name = "post"
x = "12 m"
y = "0 m"
z = "0.5 m"
rcs = "10 dBsm"
[[radars]]
name = "front"
vehicle = "ego"
[radars.array]
num_channels = 2
[radars.waveform]
kind = "triangular"
ramp_duration = "1 ms"
[receiver]
kind = "paper"
[monte_carlo]
trials = 2
[monte_carlo.grid]
"street.points.post.rcs" = ["0 dBsm", "10 dBsm"]
num_sweeps = [2, 4]
"""


@pytest.fixture
def stored(tmp_path):
    save_run(tmp_path / "run.zarr", BOTH, provenance=ORIGIN)
    return tmp_path


def test_the_figures_of_a_run_are_those_that_the_report_draws():
    assert tuple(FIGURES) == OF_RUNS


def test_a_figure_and_its_data_are_written_for_every_radar(stored, capsys):
    assert main(["plot", str(stored), "detections", "--format", "svg", "--format", "png"]) == 0
    names = [line.rsplit("/", 1)[1] for line in capsys.readouterr().out.splitlines()]
    ends = ("svg", "png", "csv")
    assert names == [f"detections-{n}.{end}" for n in (0, 1) for end in ends]
    with (stored / "detections-0.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["nature"] for row in rows] == ["direct"] * 3


def test_one_radar_is_drawn_into_another_folder(stored, tmp_path):
    out = tmp_path / "figures"
    assert (
        main(["plot", str(stored / "run.zarr"), "ramps", "--radar", "rear", "--out", str(out)]) == 0
    )
    assert sorted(path.name for path in out.iterdir()) == ["ramps-1.csv", "ramps-1.png"]


def test_what_cannot_be_drawn_is_told(stored, tmp_path, capsys):
    for arguments, message in (
        (["nothing"], "there is no run and no study in 'nothing'"),
        ([str(stored), "curves"], "there is no figure 'curves' of a run; there are range-profile"),
        ([str(stored), "ramps", "--radar", "frnt"], "no radar 'frnt'"),
        ([str(stored), "--over", "seed"], "is a run, and only figures of a study take this"),
        ([str(stored), "ramps", "--channel", "0"], "only 'spectrogram' shows one channel"),
        ([str(stored), "--channel", "0", "ramps"], "stand before its options"),
    ):
        assert main(["plot", *arguments]) == 2
        assert message in capsys.readouterr().err


def test_a_radar_that_is_no_victim_is_not_said_to_be_missing(tmp_path, capsys):
    radars = (Radar(name="front"), Radar(name="rear"))
    scene = replace(BOTH.scene, radars=radars, carriers=(0, 0))
    alone = replace(BOTH, scene=scene, victims=BOTH.victims[:1])
    save_run(tmp_path / "run.zarr", alone, provenance=ORIGIN)
    assert main(["plot", str(tmp_path), "--radar", "rear"]) == 2
    told = capsys.readouterr().err
    assert "is no victim of this run, which stored the frames of 'front' alone" in told


def test_curves_and_differences_of_a_study(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "grid.toml").write_text(STUDY, encoding="utf-8")
    assert main(["study", "grid.toml", "--out", "out", "--workers", "1"]) == 0
    capsys.readouterr()
    assert main(["plot", "out"]) == 0
    written = capsys.readouterr().out.splitlines()
    assert [line.split("/")[1] for line in written if line.endswith("csv")] == [
        "curves-rcs.csv",
        "curves-num_sweeps.csv",
        "differences-rcs.csv",
        "differences-num_sweeps.csv",
    ]
    with (tmp_path / "out" / "curves-num_sweeps.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4
    with (tmp_path / "out" / "summary.csv").open(encoding="utf-8") as file:
        expected = [row["detection"] for row in csv.DictReader(file)]
    assert [float(row["detection"]) for row in rows] == [float(value) for value in expected]
    for options, message in (
        (["--over", "sweeps"], "there is no axis 'sweeps'"),
        (["--channel", "1"], "--channel: 'out' is a study, and only figures of a run take"),
    ):
        assert main(["plot", "out", "curves", *options]) == 2
        assert message in capsys.readouterr().err


def test_numbers_are_drawn_to_scale_and_names_in_order():
    assert grid_axis([1, 2.5, 10]).places == (1.0, 2.5, 10.0)
    assert grid_axis(["none", "blanking"]).places == (0.0, 1.0)
