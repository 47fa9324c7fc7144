"""Text of users on the terminal and in figures, and folders that results go to."""

import errno
import tempfile
from pathlib import Path

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from rich.table import Table

from polychirp.cli.terminal import figure_text, tables, usable_file, usable_folder
from polychirp.errors import InputError, RunError

NAMES = ("[/x]", "[red]x", ":smile:", "$x^{$", "plain")


@pytest.mark.parametrize("name", NAMES)
def test_a_table_shows_text_as_it_is(capsys, name):
    table = Table(title=f"title {name}")
    table.add_column(f"head {name}")
    table.add_row(f"cell {name}")
    tables().print(table)
    tables().print(f"line {name}")
    shown = capsys.readouterr().out
    assert all(f"{place} {name}" in shown for place in ("title", "head", "cell", "line"))


def test_a_table_lets_no_code_through_to_the_terminal(capsys):
    table = Table()
    table.add_column("radar")
    table.add_row("a\x1b[2Jb\x07\u202ec")
    tables().print(table)
    shown = capsys.readouterr().out
    assert "a[2Jbc" in shown
    assert "\x1b" not in shown


def test_a_table_in_a_file_is_wide(capsys):
    table = Table()
    for number in range(12):
        table.add_column(f"column {number}")
    tables().print(table)
    assert "column 11" in capsys.readouterr().out


@pytest.mark.parametrize("name", NAMES)
def test_a_figure_takes_no_name_for_a_formula(name):
    figure = Figure()
    FigureCanvasAgg(figure)
    text = figure.text(0.0, 0.0, figure_text(name))
    figure.draw_without_rendering()
    cleaned, is_formula = text._preprocess_math(text.get_text())
    assert (cleaned, is_formula) == (name, False)


def read_only(**_):
    raise OSError(errno.EROFS, "Read-only file system")


def test_folders_are_refused_before_the_work(tmp_path: Path, monkeypatch):
    (tmp_path / "file").touch()
    assert usable_folder(tmp_path / "new" / "deep") == tmp_path / "new" / "deep"
    with pytest.raises(InputError, match="is a file; name a folder"):
        usable_folder(tmp_path / "file" / "deep")
    monkeypatch.setattr(tempfile, "TemporaryFile", read_only)
    with pytest.raises(RunError, match="cannot be written"):
        usable_folder(tmp_path / "new")


def test_files_are_refused_before_the_work(tmp_path: Path, monkeypatch):
    usable_file(str(tmp_path / "a.png"), option="--figure")
    with pytest.raises(InputError, match="--figure: there is no folder"):
        usable_file(str(tmp_path / "no" / "a.png"), option="--figure")
    with pytest.raises(InputError, match="is a folder; name a file"):
        usable_file(str(tmp_path), option="--figure")
    monkeypatch.setattr(tempfile, "TemporaryFile", read_only)
    with pytest.raises(RunError, match="cannot be written"):
        usable_file(str(tmp_path / "a.png"), option="--figure")
