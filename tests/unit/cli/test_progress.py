"""Progress without a terminal is a line now and then; only steady work tells when it ends."""

import time

import pytest

from polychirp.cli.progress import TimeLeft, progress_bar


def test_long_work_is_shown_once_in_a_minute_with_the_time_left(monkeypatch, capsys):
    clock = iter(range(1000, 2000, 10))
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    with progress_bar("small") as progress:
        for done in range(41):
            progress("trials", done, 40)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "small: trials 0/40"
    assert lines[1] == "small: trials 6/40, about 6 min left"
    assert lines[-1] == "small: trials 40/40"
    assert len(lines) == 1 + 6 + 1


def test_equal_steps_are_shown_once(monkeypatch, capsys):
    """Many kernels can be compiled before the weighted number of them is one."""
    monkeypatch.setattr(time, "monotonic", lambda: 0.0)
    with progress_bar("small") as progress:
        for done in (0, 0, 0, 0, 1, 2, 2, 2):
            progress("compiling kernels", done, 2)
        progress("compiling kernels", 0, 3)
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"small: compiling kernels {done}" for done in ("0/2", "2/2", "0/3")]


def test_a_first_step_that_compiles_gives_no_hours():
    """Two minutes for the first of 60 trials, then one second each."""
    left = TimeLeft(0.0)
    known = {done: left.update(done, 60, 120.0 + done) for done in range(1, 60)}
    assert {known[done] for done in range(1, 20)} == {None}
    assert all(seconds is None or seconds < 60.0 for seconds in known.values())


def test_steady_work_is_estimated_from_a_tenth_of_it_on():
    left = TimeLeft(0.0)
    known = [left.update(done, 100, float(done)) for done in range(1, 100)]
    assert known[:9] == [None] * 9
    assert known[9:] == pytest.approx([100.0 - done for done in range(10, 100)])


def test_a_few_seconds_are_too_few_for_an_estimate():
    left = TimeLeft(0.0)
    assert [left.update(done, 10, 0.4 * done) for done in range(1, 10)] == [None] * 9


def test_each_kind_of_work_has_its_own_time(monkeypatch, capsys):
    clock = iter([*range(0, 1000, 100), *range(1000, 1100)])
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    with progress_bar("small") as progress:
        for done in range(10):
            progress("slow", done, 100)
        for done in range(99):
            progress("quick", done, 100)
    assert "quick 60/100, about 40 s left" in capsys.readouterr().err
