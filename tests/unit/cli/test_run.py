"""``run`` checks, runs, stores, and says what was found; the trial itself is a stand-in here."""

import errno
import json
import math
import re
import shutil
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from polychirp.cli.app import main
from polychirp.cli.run import _degrees
from polychirp.errors import RunError
from polychirp.model.detection import Detections
from polychirp.model.if_frame import PARTS, IfFrame, IfParts, sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.placement import Placement, placement
from polychirp.model.score import Score
from polychirp.model.truth import Truth
from polychirp.study.monte_carlo.run import LOG, STORE
from polychirp.study.spec import scene_of, schedules_of, target_names, victim_indices
from polychirp.study.store import save
from polychirp.study.store.load import load_run
from polychirp.testing.paths import paths_of

QUICKSTART = Path(__file__).parents[3] / "studies" / "quickstart.toml"


@dataclass(frozen=True)
class Victim:
    name: str
    frame: IfFrame
    parts: IfParts
    paths: PropagationPaths
    detections: Detections
    truth: Truth
    score: Score
    placement: Placement


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
        paths=paths_of(),
        detections=Detections(time=0.0, range=one, range_rate=one, azimuth=one, power=one, snr=one),
        truth=Truth(
            time=0.0,
            name=names,
            range=many,
            range_rate=many,
            azimuth=many,
            elevation=many,
            point=np.zeros((len(names), 3)),
            is_visible=np.ones(len(names), dtype=bool),
        ),
        score=Score(
            is_detected=np.arange(len(names)) == 0,
            range_error=many,
            range_rate_error=many,
            azimuth_error=many,
            elevation_error=many,
            detection_sinr=many,
            echo_snr=many,
            is_in_sight=np.ones(len(names), dtype=bool),
            snr=10.0 + many,
            inr=many,
            mitigated_sinr=many,
            num_points=np.arange(len(names)) == 0,
            length=many,
            width=many,
            range_rate_span=many,
            nature=("target",),
            body=names[:1],
            power=one,
            target_detection=(0,),
            num_missed=len(names) - 1,
            floor_rise=10.0,
        ),
        placement=placement(scene_of(study), number, names),
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
        return SimpleNamespace(victims=victims, scene=scene_of(study), frames=None)

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
    assert "front" in shown.out
    assert "10.0 dB" in shown.out
    assert "on a target within 0.4 m, 1 m/s, 15° of azimuth" in shown.out
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
            "out_of_sight": 0,
            "other_echoes": 0,
            "unresolved": 0,
            "floor_rise": 10.0,
            "detected_targets": ["oncoming"],
            "ghosts_of_radars": {},
            "undetected_targets": ["ahead", "post"],
            "levels": {
                name: {"snr": 10.0, "inr": 0.0, "mitigated_sinr": 0.0}
                for name in ("oncoming", "ahead", "post")
            },
            "extents": {
                "oncoming": {
                    "points": 1,
                    **dict.fromkeys(("length", "width", "range_rate_span"), 0.0),
                    **dict.fromkeys(
                        ("visible_length", "visible_width", "visible_range_rate_span"), 0.0
                    ),
                }
            },
            "margins": {
                "range": 0.4,
                "range_rate": 1.0,
                "azimuth": pytest.approx(math.radians(15.0)),
                "elevation": pytest.approx(math.radians(15.0)),
            },
        }
    ]
    assert load_run(summary["stored"]).provenance.seed == 5


def test_what_a_radar_does_not_measure_is_null_in_the_summary_for_machines(
    trial, capsys, monkeypatch
):
    whole = silent_victim

    def of_one_channel(study, number):
        victim = whole(study, number)
        unknown = np.full(len(victim.truth.name), np.nan)
        return replace(victim, score=replace(victim.score, width=unknown, floor_rise=np.nan))

    monkeypatch.setitem(globals(), "silent_victim", of_one_channel)
    assert main(quick("--json", "--out", "here")) == 0
    summary = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert summary["victims"][0]["extents"]["oncoming"]["width"] is None
    assert summary["victims"][0]["floor_rise"] is None


def test_detections_that_the_receiver_left_out_are_told(trial, capsys, monkeypatch):
    whole = silent_victim

    def one_that_dropped(study, number):
        victim = whole(study, number)
        return replace(victim, score=replace(victim.score, num_unresolved=2))

    monkeypatch.setitem(globals(), "silent_victim", one_that_dropped)
    assert main(quick()) == 0
    assert "note: 2 detections with unresolved speeds were left out of the frame of 'front'" in (
        capsys.readouterr().err
    )
    (path,) = Path("out").glob("quickstart-*/run.zarr")
    assert load_run(path).victims[0].score.num_unresolved == 2


def test_a_target_whose_echo_is_folded_is_told_apart_from_one_without_an_echo(
    trial, capsys, monkeypatch
):
    whole = silent_victim

    def folded(study, number):
        victim = whole(study, number)
        names, score = victim.truth.name, victim.score
        score = replace(
            score, nature=("folded",), body=names[1:2], is_detected=score.is_detected & 0
        )
        return replace(victim, score=score)

    assert main(quick()) == 0
    assert "folded" not in capsys.readouterr().out
    monkeypatch.setitem(globals(), "silent_victim", folded)
    assert main(quick("--out", "there")) == 0
    assert capsys.readouterr().out.count("missed: folded") == 1


@pytest.mark.parametrize(("azimuth", "in_front"), [(101.0, "79°"), (-120.0, "-60°"), (80.0, "")])
def test_a_missed_target_behind_the_array_has_a_note(trial, capsys, monkeypatch, azimuth, in_front):
    whole = silent_victim

    def beside(study, number):
        victim = whole(study, number)
        many = np.full(len(victim.truth.name), np.radians(azimuth))
        score = replace(
            victim.score,
            is_detected=victim.score.is_detected & False,
            is_in_sight=victim.score.is_in_sight | True,
        )
        return replace(victim, truth=replace(victim.truth, azimuth=many), score=score)

    monkeypatch.setitem(globals(), "silent_victim", beside)
    assert main(quick()) == 0
    told = capsys.readouterr().err
    assert (f"at {azimuth:.0f}° of azimuth; the array sees it at {in_front}" in told) == (
        in_front != ""
    )
    assert ("behind the array of 'front'" in told) == (in_front != "")


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


@pytest.mark.parametrize("out", ["here/run.zarr", "new/run.zarr", "renamed", "here/run.zarr/"])
def test_a_run_inside_a_run_is_refused(trial, capsys, out):
    """It would hide the outer one from all commands that read runs."""
    assert main(quick("--out", "here")) == 0
    shutil.copytree("here/run.zarr", "renamed")
    assert main(quick("--out", out)) == 2
    around = Path(out).parent
    told = capsys.readouterr().err
    assert f"of a run and not of the folder around it; name that folder, '{around}'" in told
    assert len(trial.runs) == 1


def test_a_run_that_holds_another_is_read_itself(trial):
    """Earlier versions wrote runs into runs."""
    for number, out in enumerate(("here", "inner")):
        assert main(quick("--out", out, "--seed", str(number))) == 0
    shutil.copytree("inner/run.zarr", "here/run.zarr/run.zarr")
    assert [load_run(path).provenance.seed for path in ("here", "here/run.zarr")] == [0, 0]


@pytest.mark.parametrize("name", [LOG, STORE])
def test_a_run_beside_the_trials_of_a_study_is_refused(trial, capsys, name):
    Path("here", name).mkdir(parents=True)
    assert main(quick("--out", "here", "--force")) == 2
    told = capsys.readouterr().err
    assert "'here' holds the trials of a study" in told
    assert "such as 'here/run'" in told
    assert trial.runs == []
    assert main(quick("--out", "here/run")) == 0


def test_figures_of_a_run_that_is_replaced_are_removed(trial):
    """Beside the new results they would show the old ones."""
    assert main(quick("--out", "here")) == 0
    old, own = Path("here/range-profile.png"), Path("here/notes.csv")
    for path in (old, own):
        path.touch()
    assert main(quick("--out", "here", "--force")) == 0
    assert old.exists()  # the study is the same
    assert main(quick("--out", "here", "--seed", "2", "--force")) == 0
    assert (old.exists(), own.exists()) == (False, True)


def test_figures_stay_if_the_run_that_would_replace_theirs_fails(trial):
    def failing(study, *, progress):
        raise RunError("the disk is full; make room")

    assert main(quick("--out", "here")) == 0
    Path("here/report.html").touch()
    trial.run_trial = failing
    assert main(quick("--out", "here", "--seed", "2", "--force")) == 4
    assert Path("here/report.html").exists()


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
    """10 dBm, 9 dB and 10 dB radiate 29 dBm; four elements at half a wavelength have 26.3°."""
    assert main(["check", str(QUICKSTART)]) == 0
    rows = [line.split("│")[1:-1] for line in capsys.readouterr().out.splitlines() if "│" in line]
    cells = {row[0].strip(): [cell.strip() for cell in row[1:]] for row in rows if len(row) == 3}
    assert "range resolution" in cells
    assert cells["peak EIRP of an element"] == ["29.0 dBm"] * 2
    assert cells["noise figure"] == ["4.5 dB"] * 2
    assert cells["azimuth resolution (3-dB beam)"][0].startswith("26.")


@pytest.mark.parametrize(
    ("is_missing", "said"),
    [(True, "the first one also compiles kernels, which takes"), (False, "s on one core.")],
)
def test_check_speaks_of_compilation_only_if_kernels_are_missing(
    trial, monkeypatch, capsys, is_missing, said
):
    monkeypatch.setattr("polychirp.kernel_cache.missing", lambda names: names if is_missing else ())
    assert main(["check", str(QUICKSTART)]) == 0
    assert said in capsys.readouterr().out


POST = """
name = "post"
tracer = { kind = "free-space" }
street.vehicles = [{ name = "ego", x = "0 m", y = "0 m" }]
street.points = [{ name = "post", x = "12 m", y = "0 m", z = "0.5 m", rcs = "1 m^2" }]
[defaults.radar]
vehicle = "ego"
waveform = { kind = "triangular", ramp_duration = "1 ms" }
noise_figure = "11 dB"
[[radars]]
name = "left"
mount = { x = "2.4 m", y = "0.5 m", z = "0.5 m" }
array.pattern.peak_gain = "11 dB"
[[radars]]
name = "right"
mount = { x = "2.4 m", y = "-0.5 m", z = "0.5 m" }
transmit_power = "12 dBm"
"""


def test_check_names_the_power_keys_that_the_file_leaves_out(trial, capsys):
    """Also with those of the defaults and of the command line counted as given."""
    Path("post.toml").write_text(POST, encoding="utf-8")
    arguments = ["check", "post.toml", "--set", "radars.*.receive_gain=3 dB"]
    assert main(arguments) == 0
    printed = capsys.readouterr()
    notes = [line for line in printed.err.splitlines() if "the paper's" in line]
    assert notes == [
        "note: 'left' has the paper's transmit_power = 10 dBm and transmit_gain = 9 dB, as the "
        "study gives no other",
        "note: 'right' has the paper's transmit_gain = 9 dB and array.pattern.peak_gain = 27 dB, "
        "as the study gives no other",
    ]
    assert main([*arguments, "--json"]) == 0
    derived = json.loads(capsys.readouterr().out)
    assert [f"note: {note}" for note in derived["notes"][-2:]] == notes
    assert [echo["radar"] for echo in derived["echoes"]] == ["left", "right"]
    assert "46.0 dBm" not in printed.out
    assert "30.0 dBm" in printed.out  # 10 + 9 + 11
    assert "48.0 dBm" in printed.out  # 12 + 9 + 27


def test_init_writes_the_shipped_quickstart(trial):
    assert main(["init", "study.toml"]) == 0
    assert Path("study.toml").read_bytes() == QUICKSTART.read_bytes()
    assert main(["check", "study.toml"]) == 0


TDM = (
    *(
        "--set",
        'radars.*.waveform={ kind = "triangular", bandwidth = "1 GHz", ramp_duration = "1 ms" }',
    ),
    *("--set", "radars.*.array.num_transmitters=3"),
    *("--set", "radars.*.coding.kind=time-division"),
)


def test_elements_that_take_turns_divide_the_unambiguous_speed(trial, capsys):
    """λ/4NT: 79.5 GHz, triangles of 2 ms, three elements in turns."""
    speeds = []
    for options in (TDM, TDM[:2]):
        assert main(["check", str(QUICKSTART), "--set", "num_sweeps=6", "--json", *options]) == 0
        derived = json.loads(capsys.readouterr().out)
        speeds.append(derived["radars"][0]["unambiguous_speed"])
    assert speeds[1] == pytest.approx(299792458 / 79.5e9 / (4 * 2e-3))
    assert speeds[0] == pytest.approx(speeds[1] / 3)


def test_codes_that_cannot_be_decoded_are_refused_by_the_check(trial, capsys):
    assert main(["check", str(QUICKSTART), "--set", "num_sweeps=8", *TDM]) == 3
    assert "radars.0.coding: the codes of 3 transmitting elements" in capsys.readouterr().err


def test_sweeps_that_differ_have_no_unambiguous_speed(trial, capsys):
    assert main(["check", str(QUICKSTART)]) == 0
    assert "no limit: sweeps differ" in capsys.readouterr().out
    assert main(["check", str(QUICKSTART), *TDM[:2]]) == 0
    assert "no limit" not in capsys.readouterr().out


def test_long_and_short_ramps_are_shown_in_units_that_fit(trial, capsys):
    """Ramps of 1.1 to 2 ms beat at kilohertz; chirps of 40 µs and 1 GHz at 5.005 MHz from 30 m."""
    assert main(["check", str(QUICKSTART)]) == 0
    long = capsys.readouterr().out
    assert re.search(r"ramp +│ +1\.\d+ … [12](\.\d+)? ms", long)
    assert re.search(r"beat band +│ +0 … 1\d\d\.\d kHz", long)
    assert "by beams or empty bands" not in long
    assert main(["init", "tdm.toml", "--template", "tdm-mimo"]) == 0
    assert main(["check", "tdm.toml", "--set", "receiver.greatest_range=30 m"]) == 0
    short = capsys.readouterr().out
    assert re.search(r"ramp +│ +40 µs", short)
    assert re.search(r"frame +│ +11\.5 ms, 192 ramps", short)
    assert re.search(r"beat band +│ +0 … 5\.003 MHz", short)
    assert re.search(r"unambiguous speed, by Doppler +│ +±19\.5 km/h", short)
    assert re.search(r"by beams or empty bands +│ +±58\.4 km/h", short)


def test_check_suggests_the_run_with_the_same_changes(trial, capsys, monkeypatch):
    monkeypatch.setenv("POLYCHIRP_NAME", "./run")
    assert main(["check", str(QUICKSTART), "--set", "radars.1.start_time=1 ms"]) == 0
    suggested = capsys.readouterr().err.splitlines()[-1]
    assert suggested == f"next: ./run run {QUICKSTART} --set 'radars.1.start_time=1 ms'"


def test_the_run_suggests_a_study_where_the_file_has_a_grid(trial, capsys, tmp_path):
    text = QUICKSTART.read_text(encoding="utf-8")
    path = tmp_path / "one.toml"
    path.write_text(text[: text.index("[monte_carlo]")], encoding="utf-8")
    for file, is_suggested in ((QUICKSTART, True), (path, False)):
        assert main(["run", str(file)]) == 0
        assert (f"next: polychirp study {file}" in capsys.readouterr().err) is is_suggested


NAMED = ("[/x]", "[red]x", "a\x1b[31mb")


@pytest.mark.parametrize("name", NAMED)
def test_names_are_shown_as_they_are_written(trial, capsys, name):
    """Neither markup nor the codes of a terminal in a name do anything."""
    options = ["--set", f"radars.0.name={name}", "--set", f"victims=[{json.dumps(name)}]"]
    study = ["--set", f"name={name.replace('/', '')}"]
    for verb in ("check", "run"):
        assert main([verb, str(QUICKSTART), *options, *study]) == 0
        shown = capsys.readouterr()
        assert name.replace("\x1b", "") in shown.out
        assert "\x1b" not in shown.out + shown.err


def test_radars_are_changed_by_name_and_a_wrong_name_is_told(trial, capsys):
    assert main(quick("--set", "radars.other.start_time=1 ms")) == 0
    assert trial.runs[0].radars[1].start_time == 1e-3
    assert main(quick("--set", "radars.othr.start_time=1 ms")) == 2
    assert "0: front, other; did you mean 'other'?" in capsys.readouterr().err
    assert main(quick("--set", "radars.zzz.start_time=1 ms")) == 2
    told = capsys.readouterr().err
    assert "counted from 0: front, other\n" in told
    assert "known are" not in told


def test_an_interrupt_while_storing_leaves_no_half_of_a_run(trial, capsys, monkeypatch):
    def interrupted(path, *content):
        path.mkdir(parents=True)
        raise KeyboardInterrupt

    monkeypatch.setattr(save, "_write", interrupted)
    assert main(quick("--out", "here")) == 130
    assert "no results were stored" in capsys.readouterr().err
    assert list(Path("here").iterdir()) == []


def test_a_guard_that_takes_much_of_a_ramp_is_warned_of(trial, capsys):
    assert main(["check", str(QUICKSTART), "--set", "receiver.mitigation.guard=200 us"]) == 0
    assert "the guard of the mitigation 'blanking' is 200 µs" in capsys.readouterr().err


def full_disk(**_):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_folder_that_cannot_be_written_is_refused_before_the_run(trial, capsys, monkeypatch):
    monkeypatch.setattr(tempfile, "TemporaryFile", full_disk)
    assert main(quick("--out", "here")) == 4
    assert trial.runs == []
    assert capsys.readouterr().err.count("\n") == 1


def test_an_azimuth_that_was_not_measured_is_a_dash():
    assert [_degrees(angle) for angle in (float("nan"), math.radians(-1.5))] == ["–", "-1.50°"]


def test_check_reads_the_grid_of_a_study_too(trial, capsys):
    """What `study` would refuse in [monte_carlo], `check` refuses."""
    text = QUICKSTART.read_text(encoding="utf-8")
    table = '[monte_carlo]\ntrials = 4\n[monte_carlo.grid]\n"seed.x" = ["1 ms"]\n'
    Path("bad.toml").write_text(text.partition("[monte_carlo]")[0] + table, encoding="utf-8")
    assert main(["check", "bad.toml"]) == 2
    assert "bad.toml" in capsys.readouterr().err


def test_check_leaves_a_grid_alone_that_a_common_file_completes(trial, capsys):
    text = QUICKSTART.read_text(encoding="utf-8").partition("[monte_carlo]")[0]
    Path("part.toml").write_text(f"{text}[monte_carlo]\nstop_half_width = 0.1\n", encoding="utf-8")
    assert main(["check", "part.toml"]) == 0
    assert "range resolution" in capsys.readouterr().out


def test_a_byte_order_mark_is_read_over(trial, capsys):
    """Notepad and PowerShell begin files with it."""
    text = QUICKSTART.read_text(encoding="utf-8")
    Path("marked.toml").write_text(text, encoding="utf-8-sig")
    assert main(["check", "marked.toml"]) == 0
    assert "range resolution" in capsys.readouterr().out
