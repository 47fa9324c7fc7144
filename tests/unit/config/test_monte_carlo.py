"""A study file with a grid becomes a plan, or is refused before anything runs."""

import json
import re
import tomllib
from pathlib import Path

import pytest

from polychirp.cli.app import main
from polychirp.config.load import load_study
from polychirp.config.monte_carlo import load_plan
from polychirp.config.override import apply_override, set_value
from polychirp.errors import InputError, PhysicsError
from polychirp.model.baseband import no_progress
from polychirp.study.monte_carlo.grid import trial_seed
from polychirp.study.monte_carlo.plan import check_plan
from polychirp.study.spec import schedules_of
from tests.support.small_study import SMALL_GRID, SMALL_STUDY
from tests.support.snippets import pasted

ROOT = Path(__file__).parents[3]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(SMALL_STUDY + SMALL_GRID, encoding="utf-8")
    return path


def refused(tmp_path: Path, table: str) -> str:
    path = tmp_path / "refused.toml"
    path.write_text(SMALL_STUDY + table, encoding="utf-8")
    with pytest.raises(InputError) as error:
        check_plan(load_plan(path), progress=no_progress)
    return str(error.value)


def test_every_combination_is_a_point_the_last_axis_fastest(file):
    plan = load_plan(file)
    assert [axis.name for axis in plan.axes] == ["rcs", "waveform"]
    assert [point.labels for point in plan.points] == [
        ("-10 dBsm", "conventional"),
        ("-10 dBsm", "diverse"),
        ("10 dBsm", "conventional"),
        ("10 dBsm", "diverse"),
    ]
    rcs = [point.study.street.points[1].rcs for point in plan.points]
    assert rcs == pytest.approx([0.1, 0.1, 10.0, 10.0])
    for point in plan.points:
        kinds = {radar.waveform.kind for radar in point.study.radars}
        expected = "triangular" if point.labels[1] == "conventional" else "diverse-triangular"
        assert kinds == {expected}


def test_the_grid_of_the_guide_is_one_of_the_quickstart(tmp_path):
    guide = (ROOT / "docs/how-to/monte-carlo.md").read_text(encoding="utf-8")
    table, *_ = re.findall(r"```toml\n(.*?)```", guide, flags=re.DOTALL)
    path = tmp_path / "study.toml"
    quickstart = (ROOT / "studies/quickstart.toml").read_text(encoding="utf-8")
    path.write_text(pasted(quickstart, table), encoding="utf-8")
    plan = load_plan(path)
    assert [axis.name for axis in plan.axes] == ["clock_offset", "waveform"]
    kinds = [[radar.waveform.kind for radar in point.study.radars] for point in plan.points]
    assert kinds == [["triangular"] * 2, ["diverse-triangular"] * 2] * 3


def test_the_schema_accepts_a_grid_and_refuses_a_wrong_one(file):
    import jsonschema

    schema = json.loads((ROOT / "schemas/study.schema.json").read_text(encoding="utf-8"))
    validator = jsonschema.Draft202012Validator(schema)
    data = tomllib.loads(file.read_text(encoding="utf-8"))
    assert list(validator.iter_errors(data)) == []
    data["monte_carlo"]["trial"] = 3
    assert list(validator.iter_errors(data))


def test_a_file_with_a_grid_is_still_a_study(file):
    assert load_study(file).name == "small"
    assert load_study(file, overrides=["monte_carlo.trials=3"]).name == "small"


def test_the_grid_itself_can_be_overridden(file):
    plan = load_plan(file, overrides=["monte_carlo.trials=3", "radars.*.start_time=1 ms"])
    assert plan.trials == 3
    assert all(r.start_time == 1e-3 for point in plan.points for r in point.study.radars)


def test_the_command_of_a_point_gives_the_study_of_the_point(file, capsys):
    """What is printed for a failed trial does repeat it."""
    import shlex

    plan = load_plan(file, overrides=["radars.1.start_time=1 us", "monte_carlo.trials=3"])
    for point in plan.points:
        program, verb, path, *options = shlex.split(point.command)
        assert (program, verb) == ("polychirp", "run")
        assert set(options[::2]) == {"--set"}
        seed = trial_seed(plan.origin.seed, 7)
        study = load_study(path, overrides=[*options[1::2], f"seed={seed}"])
        assert study == point.trial(7)


def test_the_command_of_a_point_names_the_program_as_it_was_called(file, monkeypatch):
    seen = []
    monkeypatch.setenv("POLYCHIRP_NAME", "./run")
    monkeypatch.setattr(
        "polychirp.study.monte_carlo.plan.check_plan", lambda plan, **_: seen.append(plan)
    )
    assert main(["study", str(file), "--out", str(file)]) == 2
    assert {point.command.split()[0] for point in seen[0].points} == {"./run"}


def test_the_same_trial_draws_alike_at_every_point(file):
    """What does not depend on the grid is the same to the bit: here, the diverse ramps."""
    plan = load_plan(file)
    weak, strong = (p for p in plan.points if p.labels[1] == "diverse")
    for number in range(3):
        for one, two in zip(
            schedules_of(weak.trial(number)), schedules_of(strong.trial(number)), strict=True
        ):
            assert one.slope.tobytes() == two.slope.tobytes()
    first, second = schedules_of(weak.trial(0))[0], schedules_of(weak.trial(1))[0]
    assert first.slope[0] != second.slope[0]


@pytest.mark.parametrize("value", ["200", "nan", "true", "0", "'a'", "[1, 2]"])
def test_check_refuses_a_table_that_is_none(file, value, capsys):
    assert main(["check", str(file), "--set", f"monte_carlo={value}"]) == 2
    assert "monte_carlo: must be a table, not" in capsys.readouterr().err


def test_seeds_differ_between_trials_and_studies():
    seeds = {trial_seed(seed, trial) for seed in range(20) for trial in range(200)}
    assert len(seeds) == 4000
    assert all(0 <= seed < 2**52 for seed in seeds)


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ("", "monte_carlo: is missing; add the table [monte_carlo] with trials = 100"),
        ("[monte_carlo]", "monte_carlo.trials: is missing"),
        ("[monte_carlo]\ntrials = 0", "trials is 0; a point needs 1 or more"),
        ("[monte_carlo]\ntrials = 2.5", "monte_carlo.trials: must be a whole number"),
        ("[monte_carlo]\ntrial = 2", "monte_carlo.trial: unknown key; did you mean 'trials'?"),
        ("[monte_carlo]\ntrials = 2\nstop_half_width = 2", "stop_half_width is 2"),
        ("[monte_carlo]\ntrials = 2\ngrid = 3", "monte_carlo.grid: must be a table"),
    ],
)
def test_a_wrong_table_is_refused_in_one_sentence(tmp_path, table, sentence):
    assert sentence in refused(tmp_path, f"\n{table}\n")


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ('"num_sweps" = [1, 2]', "num_sweps: unknown key; did you mean 'num_sweeps'? known are"),
        ('"num_sweeps" = [2, "many"]', "num_sweeps: must be a whole number, not 'many' (at num_sw"),
        ('"num_sweeps" = []', "axis 'num_sweeps' has no values"),
        ('"num_sweeps" = 2', "monte_carlo.grid.num_sweeps: must be a list"),
        ('"num_sweeps" = [2, 2]', "axis 'num_sweeps' has '2' twice"),
        ('"radars.7.start_time" = ["0 s", "1 s"]', "radars.7 does not exist; radars has 2"),
        (
            '"radar.*.start_time" = ["0 s", "1 s"]',
            "radar is not a list; '*' stands for every entry",
        ),
        ('"radars.*.start_time" = [0, 1]', "radars.0.start_time: 0 needs a unit"),
        ('"radars.*.start_time" = ["0 s", "0 ms"]', "are one and the same study"),
        ('"seed" = [1, 2]', "a grid cannot change seed: every trial gets its own"),
        ('"radars..start_time" = ["0 s", "1 s"]', "'radars..start_time' is not a path of keys"),
        ('"radars.0.vehicle" = ["ego", "egg"]', "there is no vehicle 'egg'; did you mean 'ego'?"),
    ],
)
def test_a_wrong_key_or_value_is_refused_with_its_place(tmp_path, line, sentence):
    assert sentence in refused(
        tmp_path, f"\n[monte_carlo]\ntrials = 2\n[monte_carlo.grid]\n{line}\n"
    )


def test_what_physics_refuses_at_one_point_is_refused_before_the_others_run(tmp_path):
    path = tmp_path / "deaf.toml"
    grid = '"receiver.greatest_range" = ["30 m", "300 m"]'
    path.write_text(
        f"{SMALL_STUDY}\n[monte_carlo]\ntrials = 2\n[monte_carlo.grid]\n{grid}\n", encoding="utf-8"
    )
    with pytest.raises(PhysicsError, match="echoes from 300 m") as error:
        check_plan(load_plan(path), progress=no_progress)
    assert "(at greatest_range = 300 m)" in str(error.value)


def test_axes_of_like_keys_get_names_that_tell_them_apart(tmp_path):
    path = tmp_path / "like.toml"
    path.write_text(
        SMALL_STUDY
        + "\n[monte_carlo]\ntrials = 2\n[monte_carlo.grid]\n"
        + '"radars.0.start_time" = ["0 s", "1 us"]\n"radars.1.start_time" = ["0 s", "1 us"]\n'
        + '"radars.*.waveform.kind" = ["triangular"]\n',
        encoding="utf-8",
    )
    names = [axis.name for axis in load_plan(path).axes]
    assert names == ["radars_0_start_time", "radars_1_start_time", "waveform_kind"]


def test_a_star_stands_for_every_entry_and_shares_nothing_between_them():
    data = {"radars": [{}, {"waveform": {"kind": "sawtooth"}}]}
    set_value(data, "radars.*.waveform", {"kind": "triangular"})
    apply_override(data, "radars.0.waveform.idle=1 us")
    assert data["radars"] == [
        {"waveform": {"kind": "triangular", "idle": "1 us"}},
        {"waveform": {"kind": "triangular"}},
    ]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--workers", "0"], "--workers is 0; use 1 or more"),
        (["--cluster", "slrum"], "--cluster: there is no 'slrum'"),
        (["--out", "small.toml"], "'small.toml' is a file"),
    ],
)
def test_wrong_options_are_refused(file, monkeypatch, capsys, options, sentence):
    monkeypatch.chdir(file.parent)
    assert main(["study", str(file), *options]) == 2
    assert sentence in capsys.readouterr().err


def test_a_folder_with_something_else_in_it_is_left_alone(file, monkeypatch, capsys):
    (file.parent / "other").mkdir()
    (file.parent / "other" / "letter.txt").write_text("dear", encoding="utf-8")
    assert main(["study", str(file), "--force", "--out", str(file.parent / "other")]) == 2
    assert "holds files but no log of trials" in capsys.readouterr().err
    assert (file.parent / "other" / "letter.txt").exists()


def test_a_cluster_without_dask_says_what_to_install(file, monkeypatch, capsys):
    monkeypatch.setattr("polychirp.study.monte_carlo.dask_executor.find_spec", lambda _: None)
    assert main(["study", str(file), "--cluster", "local"]) == 3
    assert "pip install polychirp[cluster]" in capsys.readouterr().err


def test_entries_of_a_list_go_by_number_or_by_name():
    data = {"radars": [{"name": "front"}, {"name": "1"}, {"name": "rear"}]}
    apply_override(data, "radars.rear.start_time=1 ms")
    apply_override(data, "radars.1.start_time=2 ms")
    assert [radar.get("start_time") for radar in data["radars"]] == [None, "2 ms", "1 ms"]
    with pytest.raises(InputError, match=r"counted from 0: front, 1, rear; did you mean 'rear'\?"):
        apply_override(data, "radars.raer.start_time=1 ms")
    with pytest.raises(InputError, match=r"radars has 3 entries, counted from 0: front, 1, rear$"):
        apply_override(data, "radars.3.start_time=1 ms")
