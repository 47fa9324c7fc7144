"""``polychirp roc``: what it prints and writes, and the one sentence of every mistake."""

import csv
import json
import tomllib

import pytest

from polychirp.cli.app import main
from polychirp.cli.roc import _snrs
from polychirp.config.dump import dump
from polychirp.study.monte_carlo.executor import LocalWorkers
from tests.support.roc_study import TRIANGLES, roc_study


@pytest.fixture
def chirps(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(dump(roc_study()), encoding="utf-8")
    return str(path)


@pytest.fixture
def here(monkeypatch):
    """Frames are computed in this process."""
    monkeypatch.setattr(
        LocalWorkers, "compute", lambda _self, work, tasks: (work(task) for task in tasks)
    )


def in_one_line(text):
    """The text without its line breaks, which depend on the width of the terminal."""
    return " ".join(text.split())


SMALL = ["--snr", "14,60", "--trials", "2", "--noise-trials", "3"]


def test_curves_are_printed_drawn_and_written(chirps, here, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["roc", chirps, *SMALL, "--pfa", "1e-3,1e-6", "--out", str(out)]) == 0
    printed = capsys.readouterr()
    for words in (
        "small, radar 'front': one point",
        "receiver range-doppler, 1e-3",
        "receiver range-doppler, 1e-6",
        "SNR at which half of the points are detected",
        "frames of noise alone",
        "errors up to 1.1 m and 1.8 m/s (range-doppler)",
        "adds the powers of 2 channels",
    ):
        assert words in in_one_line(printed.out)
    assert "7 new frames; stored in" in printed.err
    names = {"roc.png", "roc.csv", "false_alarms.csv", "provenance.json", "frames.log"}
    assert {path.name for path in out.iterdir()} == names
    assert (out / "roc.png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((out / "roc.csv").read_text().splitlines()))
    assert [(row["false_alarm_probability"], row["snr_db"]) for row in rows] == [
        ("0.001", "14"),
        ("0.001", "60"),
        ("1e-06", "14"),
        ("1e-06", "60"),
    ]
    assert [row["detection"] for row in rows if row["snr_db"] == "60"] == ["1", "1"]
    (first, _) = csv.DictReader((out / "false_alarms.csv").read_text().splitlines())
    assert first["frames"] == "3"


def test_the_same_command_computes_nothing_twice(chirps, here, tmp_path, capsys):
    command = ["roc", chirps, *SMALL, "--out", str(tmp_path / "out")]
    assert main(command) == 0
    before = (tmp_path / "out" / "roc.csv").read_bytes()
    assert main(command) == 0
    assert "0 new frames" in capsys.readouterr().err
    assert (tmp_path / "out" / "roc.csv").read_bytes() == before
    assert main([*command, "--force"]) == 0
    assert "7 new frames" in capsys.readouterr().err


def test_frames_anew_that_are_stopped_leave_no_earlier_figure(chirps, here, tmp_path, monkeypatch):
    out = tmp_path / "out"
    command = ["roc", chirps, *SMALL, "--out", str(out)]
    assert main(command) == 0

    def stopped(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(LocalWorkers, "compute", stopped)
    assert main([*command, "--force"]) != 0
    assert [path.name for path in out.iterdir()] == ["frames.log"]


def test_json_has_all_estimates_in_si(chirps, here, tmp_path, capsys):
    options = ["--strong", "20 dB", "--apart-range", "5 m", "--interferer", "other", "--json"]
    assert main(["roc", chirps, *SMALL, *options, "--out", str(tmp_path / "out")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["strong"] == {"ratio": pytest.approx(100.0), "apart": [5.0, 0.0]}
    assert found["interferers"] == ["other"]
    (curve,) = found["curves"]
    assert (curve["receiver"], curve["looks"]) == ("range-doppler", 2)
    assert [point["snr_db"] for point in curve["points"]] == [14.0, 60.0]
    assert curve["noise"]["num_trials"] == 3


def test_all_receivers_read_the_same_triangles(here, tmp_path, capsys):
    path = tmp_path / "small.toml"
    path.write_text(dump(roc_study(TRIANGLES, num_sweeps=6)), encoding="utf-8")
    kinds = [word for kind in ("coherent", "paper") for word in ("--receiver", kind)]
    assert main(["roc", str(path), *kinds, *SMALL, "--out", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr()
    assert "note: the receiver 'paper' serves for comparison" in printed.err
    assert "receiver coherent, 1e-4" in printed.out
    assert "The receiver 'paper' states no probability" in in_one_line(printed.out)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("12", (12.0,)),
        ("12,14.5, 16 dB", (12.0, 14.5, 16.0)),
        ("8:14:2", (8.0, 10.0, 12.0, 14.0)),
        ("-2:0.5:1", (-2.0, -1.0, 0.0)),
        ("0:0.3:0.1", (0.0, 0.1, 0.2, 0.3)),
    ],
)
def test_snrs_are_a_list_or_a_range(text, expected):
    assert _snrs(text) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--snr", "a"], "--snr: 'a' is not a number; write values like 12,14,16"),
        (["--snr", "1:2"], "--snr: '1:2' is neither a list nor a range; write it like"),
        (["--snr", "16-20"], "--snr: '16-20' is not a range; write it like 16:20:2, with the st"),
        (["--snr", "9:8:1"], "has no values; write the lower end first"),
        (["--snr", "1:2:0"], "has no values"),
        (["--snr", "0:1:1e-9"], "has more than 1000 values"),
        (["--snr", "nan"], "is not a number"),
        (["--pfa", "x"], "--pfa: 'x' is not a number; write values like 1e-4,1e-6"),
        (["--pfa", "2"], "must lie between 1e-12 and 0.1"),
        (["--trials", "0"], "must be 1 or more"),
        (["--noise-trials", "-1"], "must be 1 or more"),
        (["--trials", "some"], "invalid int value"),
        (["--radar", "frnt"], "did you mean 'front'"),
        (["--receiver", "papr"], "did you mean 'paper'"),
        (["--strong", "loud"], "--strong: 'loud' is not a value in dB"),
        (["--apart-range", "1 m"], "they place the point of --strong; add --strong"),
        (["--strong", "9 dB", "--apart-range=-1 m"], "use 0 or more; both signs are drawn"),
        (["--strong", "9 dB", "--apart-rate", "1 m"], "--apart-rate: '1 m' is not a value in m/s"),
        (["--interferer", "front"], "other radars than 'front'"),
        (["--workers", "0"], "--workers is 0; use 1 or more"),
        (["--out", "pyproject.toml"], "is a file; name a folder"),
    ],
)
def test_a_mistake_is_one_sentence(chirps, capsys, monkeypatch, tmp_path, options, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pyproject.toml").write_text("", encoding="utf-8")
    assert main(["roc", chirps, *options]) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert printed.out == ""
    assert not (tmp_path / "out").exists()


def test_a_receiver_that_cannot_read_the_ramps_is_refused(chirps, capsys):
    assert main(["roc", chirps, "--receiver", "paper"]) == 3
    assert "radars.0.waveform: the paper's receiver pairs the beats" in capsys.readouterr().err


def test_a_folder_of_other_files_is_left_alone(chirps, tmp_path, capsys):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("years", encoding="utf-8")
    assert main(["roc", chirps, *SMALL, "--out", str(tmp_path / "mine")]) == 2
    assert "holds files but no log of trials" in capsys.readouterr().err


def test_the_study_of_these_tests_is_a_file():
    assert tomllib.loads(dump(roc_study()))["name"] == "small"
