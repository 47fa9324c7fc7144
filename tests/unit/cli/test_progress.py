"""Where there is no terminal, progress is a line now and then, with the time left."""

import time

from polychirp.cli.progress import progress_bar


def test_long_work_says_once_in_a_minute_how_much_is_left(monkeypatch, capsys):
    clock = iter(range(1000, 2000, 10))
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    with progress_bar("small") as progress:
        for done in range(41):
            progress("trials", done, 40)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "small: trials 0/40"
    assert lines[1] == "small: trials 6/40, 6 min left"
    assert lines[-1] == "small: trials 40/40"
    assert len(lines) == 1 + 6 + 1
