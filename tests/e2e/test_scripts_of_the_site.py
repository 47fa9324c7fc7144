"""Tutorials and gallery: every script runs, shows a figure, and uses public names alone."""

import ast
import re
import runpy
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib import pyplot

from polychirp.report.figures.drawing import Drawing

DOCS = Path(__file__).parents[2] / "docs"
SCRIPTS = sorted([*(DOCS / "gallery").glob("*.py"), *(DOCS / "tutorials").glob("*.py")])


def test_there_are_tutorials_and_six_scripts_of_the_gallery():
    names = [path.stem for path in SCRIPTS]
    assert len([name for name in names if name.startswith("tutorial_")]) == 4
    assert len([name for name in names if name.startswith("plot_")]) >= 6
    assert all(name.startswith(("tutorial_", "plot_")) for name in names)  # others are not run


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_uses_public_names_alone(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    modules = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    modules += [
        n.name for node in ast.walk(tree) if isinstance(node, ast.Import) for n in node.names
    ]
    assert "polychirp" in modules
    assert [name for name in modules if name.startswith("polychirp.")] == []
    title, line = (ast.get_docstring(tree) or "").splitlines()[:2]
    assert re.fullmatch("=+", line)
    assert len(line) >= len(title)


@pytest.mark.slow
@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_runs_and_shows_a_figure(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with mpl.rc_context({"backend": "agg"}):
        found = runpy.run_path(str(path))
    drawn = [value for value in found.values() if isinstance(value, Drawing)]
    assert drawn or pyplot.get_fignums()
    pyplot.close("all")
