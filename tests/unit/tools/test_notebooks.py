"""Notebooks of the site are run as they are."""

import pytest

from tools.notebooks import error_of

nbformat = pytest.importorskip(
    "nbformat", reason="the packages of requirements-docs.lock are not installed"
)


def written(folder, *sources):
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(s) for s in sources])
    nbformat.write(notebook, folder / "one.ipynb")
    return folder / "one.ipynb"


def test_a_notebook_that_runs_has_no_error_and_starts_in_an_empty_folder(tmp_path):
    path = written(tmp_path, "from pathlib import Path", "assert not list(Path().iterdir())")
    assert error_of(path) == ""


def test_the_error_of_a_notebook_is_told(tmp_path):
    assert "one fails" in error_of(written(tmp_path, "x = 1", "x / 0"))
    assert "ZeroDivisionError" in error_of(written(tmp_path, "x = 1", "x / 0"))
