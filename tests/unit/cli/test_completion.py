"""Scripts for shells complete every verb and every option."""

import argparse
import shutil
import subprocess
from pathlib import Path

import pytest

from polychirp.cli.app import VERBS, build_parser, main
from polychirp.cli.completion import SHELLS, _mark_paths


def script(shell: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["completion", shell]) == 0
    return capsys.readouterr().out


def verbs() -> dict[str, argparse.ArgumentParser]:
    (group,) = (a for a in build_parser()._actions if isinstance(a, argparse._SubParsersAction))
    return group.choices


@pytest.mark.parametrize("shell", SHELLS)
def test_a_script_has_every_verb_and_option(shell, capsys, monkeypatch):
    monkeypatch.setenv("POLYCHIRP_NAME", "./run")  # the script is for the command, not for ./run
    text = script(shell, capsys)
    assert "./run" not in text
    for verb, parser in verbs().items():
        assert verb in text
        for action in parser._actions:
            for option in action.option_strings:
                assert (f"-l {option[2:]}" if shell == "fish" and len(option) > 2 else option) in (
                    text.replace("'", "")
                ), f"{verb} {option}"


@pytest.mark.parametrize("shell", SHELLS)
def test_a_shell_can_read_its_script(shell, capsys, tmp_path):
    program = shutil.which(shell)
    if program is None:
        pytest.skip(f"there is no {shell} on this machine")
    path = tmp_path / "script"
    path.write_text(script(shell, capsys), encoding="utf-8")
    done = subprocess.run([program, "-n", path], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def completed(text: str, words: list[str], folder: Path) -> list[str]:
    """Completions that bash offers for the last of the words."""
    (folder / "script").write_text(text, encoding="utf-8")
    listed = " ".join(f"'{word}'" for word in words)
    done = subprocess.run(
        ["bash", "-c", f"source ./script; COMP_WORDS=({listed}); COMP_CWORD={len(words) - 1}; "
         "_shtab_polychirp; printf '%s\\n' \"${COMPREPLY[@]}\""],
        cwd=folder, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return done.stdout.split()


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash on this machine")
def test_bash_completes_verbs_options_values_and_files(capsys, tmp_path):
    text = script("bash", capsys)
    (tmp_path / "study.toml").touch()
    assert completed(text, ["polychirp", "i"], tmp_path) == ["init"]
    assert set(completed(text, ["polychirp", ""], tmp_path)) >= set(VERBS)
    assert completed(text, ["polychirp", "init", "--te"], tmp_path) == ["--template"]
    assert "pedestrian" in completed(text, ["polychirp", "init", "--template", ""], tmp_path)
    assert completed(text, ["polychirp", "check", "st"], tmp_path) == ["study.toml"]


def test_arguments_that_are_paths_are_completed_as_paths():
    parser = build_parser()
    _mark_paths(parser)
    (group,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    marked = {
        (verb, action.dest)
        for verb, inner in group.choices.items()
        for action in inner._actions
        if hasattr(action, "complete")
    }
    assert {("run", "study"), ("run", "out"), ("process", "params"), ("export", "run")} <= marked
    assert ("run", "seed") not in marked
