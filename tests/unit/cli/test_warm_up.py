"""``polychirp warm-up`` says what it compiled, and when there is nothing to do."""

import json
from pathlib import Path

import pytest

from polychirp.cli import app
from polychirp.kernel_cache import Compiled
from polychirp.study import kernel_parts


@pytest.fixture
def outcome(monkeypatch):
    """What the compilation gives in this test."""
    given = {}
    monkeypatch.setattr(kernel_parts, "compile_all", lambda **_: given["done"])
    return given


def test_it_says_what_it_compiled(outcome, capsys):
    outcome["done"] = Compiled(
        folder=Path("cache"), parts=("receiver", "edges"), kernels=("b", "a"), duration=12.3
    )
    assert app.main(["warm-up"]) == 0
    assert capsys.readouterr().err.endswith(
        "compiled 2 kernels (receiver, edges) in 12 s; the cache is cache\n"
    )


def test_it_says_that_there_is_nothing_to_do(outcome, capsys):
    outcome["done"] = Compiled(folder=Path("cache"))
    assert app.main(["warm-up"]) == 0
    assert capsys.readouterr().err == "nothing to do: all kernels are in cache\n"


def test_json_goes_to_stdout(outcome, capsys):
    outcome["done"] = Compiled(
        folder=Path("cache"), parts=("edges",), kernels=("b", "a"), duration=1.0
    )
    assert app.main(["warm-up", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "folder": "cache",
        "parts": ["edges"],
        "kernels": ["a", "b"],
        "duration_s": 1.0,
        "failures": [],
    }


def test_a_failure_is_an_error(outcome, capsys):
    outcome["done"] = Compiled(folder=Path("cache"), failures=("a worker ended",))
    assert app.main(["warm-up"]) == 4
    assert "workers or parts that failed: 1" in capsys.readouterr().err


def test_a_machine_that_may_not_compile_is_told_so(monkeypatch, capsys):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert app.main(["warm-up"]) == 4
    assert "NUMBA_DISABLE_JIT" in capsys.readouterr().err


def test_every_part_has_a_worker():
    from polychirp.study.warm_up import PARTS

    assert set(PARTS) == set(kernel_parts.PARTS)
