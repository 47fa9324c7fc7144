"""The command line's manners: one sentence, the right exit code, notes once, tracebacks kept."""

import argparse
import errno
import json
import os
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import pytest

from polychirp.cli import app
from polychirp.errors import (
    CapabilityError,
    InputError,
    ModelWarning,
    PhysicsError,
    RunError,
)


def command_that(monkeypatch: pytest.MonkeyPatch, action) -> None:
    """Make ``polychirp`` do ``action`` whatever its arguments are."""

    parser = argparse.ArgumentParser()
    parser.set_defaults(command=action)
    monkeypatch.setattr(app, "build_parser", lambda: parser)


def raising(error: BaseException):
    def action(arguments: argparse.Namespace) -> int:
        raise error

    return action


@pytest.mark.parametrize(
    ("error", "code"),
    [(InputError, 2), (PhysicsError, 3), (CapabilityError, 3), (RunError, 4)],
)
def test_an_error_raised_on_purpose_is_one_sentence_and_its_exit_code(
    monkeypatch, capsys, error, code
):
    command_that(monkeypatch, raising(error("the wall is in the way; move it")))
    assert app.main([]) == code
    assert capsys.readouterr().err == "polychirp: the wall is in the way; move it\n"


def full_disk() -> OSError:
    return OSError(errno.ENOSPC, "No space left on device", "results.csv")


@pytest.mark.parametrize(
    ("error", "code", "sentence"),
    [
        (full_disk(), 4, "'results.csv': No space left on device; check that the path exists"),
        (PermissionError(errno.EACCES, "Permission denied", "/x"), 4, "'/x': Permission denied"),
        (
            MemoryError("Unable to allocate 3 TiB"),
            4,
            "not enough memory (Unable to allocate 3 TiB)",
        ),
        (RecursionError(), 2, "nested too deeply"),
        (OverflowError("too large"), 2, "a number is too large to compute with (too large)"),
    ],
    ids=["full disk", "permission", "memory", "recursion", "overflow"],
)
def test_what_the_system_refuses_is_one_sentence(monkeypatch, capsys, error, code, sentence):
    command_that(monkeypatch, raising(error))
    assert app.main([]) == code
    said = capsys.readouterr().err
    assert said.startswith("polychirp: ")
    assert sentence in said
    assert said.count("\n") == 1


def test_sigterm_ends_as_an_interrupt_does_and_says_what_is_kept(monkeypatch, capsys):
    def action(arguments: argparse.Namespace) -> int:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(10)
        return 0

    command_that(monkeypatch, action)
    before = signal.getsignal(signal.SIGTERM)
    assert app.main([]) == 143
    assert capsys.readouterr().err.startswith("polychirp: stopped before the end; ")
    assert signal.getsignal(signal.SIGTERM) is before


def test_a_study_says_that_finished_trials_are_kept():
    arguments = app.build_parser().parse_args(["study", "a.toml"])
    assert arguments.kept == (
        "finished trials are kept, and the same command continues with the missing trials"
    )


def test_messages_hold_no_codes_of_a_terminal(monkeypatch, capsys):
    command_that(monkeypatch, raising(InputError("there is no '\x1b[31mred'")))
    assert app.main([]) == 2
    assert capsys.readouterr().err == "polychirp: there is no '[31mred'\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no full device")
def test_a_full_disk_under_stdout_is_one_sentence():
    program = "import sys; from polychirp.cli.app import main; sys.exit(main())"
    with Path("/dev/full").open("w") as full:
        ended = subprocess.run(
            [sys.executable, "-c", program, "process", "--describe"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert ended.returncode == 4
    assert ended.stderr.startswith("polychirp: No space left on device")
    assert ended.stderr.count("\n") == 1


def test_the_script_that_was_called_is_named_in_what_it_suggests(monkeypatch, capsys, tmp_path):
    monkeypatch.setenv("POLYCHIRP_NAME", "./run")
    assert app.main(["init", str(tmp_path / "a b.toml")]) == 0
    assert capsys.readouterr().err.endswith(f"next: ./run check '{tmp_path}/a b.toml'\n")


def test_the_script_that_was_called_is_named_in_what_an_error_suggests(
    monkeypatch, capsys, tmp_path
):
    monkeypatch.setenv("POLYCHIRP_NAME", "./run")
    path = tmp_path / "missing.toml"
    assert app.main(["check", str(path)]) == 2
    assert capsys.readouterr().err == (
        f"polychirp: there is no file '{path}'; './run init {path}' writes one to start from\n"
    )


def test_a_fault_of_polychirp_keeps_its_traceback(monkeypatch):
    command_that(monkeypatch, raising(ZeroDivisionError()))
    with pytest.raises(ZeroDivisionError):
        app.main([])


def test_an_interrupt_ends_with_130_and_one_sentence(monkeypatch, capsys):
    command_that(monkeypatch, raising(KeyboardInterrupt()))
    assert app.main([]) == 130
    assert capsys.readouterr().err.count("\n") == 1


def test_a_model_warning_is_shown_once_as_a_note(monkeypatch, capsys):
    def action(arguments: argparse.Namespace) -> int:
        for _ in range(3):
            warnings.warn("roughness is beyond Kirchhoff's limit", ModelWarning, stacklevel=1)
        warnings.warn("vegetation is thin", ModelWarning, stacklevel=1)
        return 0

    command_that(monkeypatch, action)
    assert app.main([]) == 0
    assert capsys.readouterr().err.splitlines() == [
        "note: roughness is beyond Kirchhoff's limit",
        "note: vegetation is thin",
    ]


def test_other_warnings_are_treated_as_ever(monkeypatch):
    def action(arguments: argparse.Namespace) -> int:
        warnings.warn("old", DeprecationWarning, stacklevel=1)
        return 0

    command_that(monkeypatch, action)
    with pytest.raises(DeprecationWarning):
        app.main([])


@pytest.mark.parametrize(
    ("argv", "sentence"),
    [
        ([], "the following arguments are required: COMMAND; see 'polychirp --help'"),
        (["rum"], "invalid choice: 'rum'"),
        (["run"], "the following arguments are required: STUDY; see 'polychirp run --help'"),
        (["plot"], "the following arguments are required: PATH; see 'polychirp plot --help'"),
        (["check", "a.toml", "b.toml"], "arguments: b.toml; 'check' takes one study; see '"),
        (["check", "a.toml", "--jsn"], "unrecognized arguments: --jsn"),
        (["check", "a.toml", "--set"], "argument --set: expected one argument"),
    ],
)
def test_wrong_arguments_are_one_sentence(capsys, argv, sentence):
    assert app.main(argv) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.startswith("polychirp: ")
    assert sentence in shown.err
    assert shown.err.count("\n") == 1


@pytest.mark.parametrize("argv", [["--help"], ["run", "--help"], ["init", "-h"], ["--version"]])
def test_help_goes_to_stdout_and_ends_well(capsys, argv):
    with pytest.raises(SystemExit) as ended:
        app.main(argv)
    assert ended.value.code == 0
    assert capsys.readouterr().out


def test_every_verb_is_explained_in_the_help(capsys):
    with pytest.raises(SystemExit):
        app.main(["--help"])
    text = capsys.readouterr().out
    assert all(verb in text for verb in ("init", "check", "run"))


def test_the_parser_loads_no_heavy_library():
    program = (
        "import json, sys; from polychirp.cli.app import build_parser; build_parser();"
        "print(json.dumps(sorted(sys.modules)))"
    )
    listing = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    ).stdout
    heavy = {"numpy", "pydantic", "rich", "zarr", "scipy", "numba", "matplotlib"}
    assert heavy & {name.partition(".")[0] for name in json.loads(listing)} == set()


def test_init_writes_a_study_and_does_not_overwrite_it(tmp_path: Path, capsys):
    path = tmp_path / "new" / "study.toml"
    assert app.main(["init", str(path)]) == 0
    text = path.read_text(encoding="utf-8")
    path.write_text("mine", encoding="utf-8")
    assert app.main(["init", str(path)]) == 2
    assert path.read_text(encoding="utf-8") == "mine"
    assert "exists already" in capsys.readouterr().err
    assert app.main(["init", str(path), "--force"]) == 0
    assert path.read_text(encoding="utf-8") == text


def test_init_into_a_folder_names_the_file_itself(tmp_path: Path):
    assert app.main(["init", str(tmp_path)]) == 0
    assert (tmp_path / "study.toml").exists()


def test_init_where_nothing_can_be_written_says_so(tmp_path: Path, capsys):
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert app.main(["init", str(tmp_path / "file" / "study.toml")]) == 4
    assert "cannot be written" in capsys.readouterr().err
