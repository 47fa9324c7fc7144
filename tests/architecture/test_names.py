"""Names inside polychirp carry no unit, and every public name has a docstring."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "src" / "polychirp"
EDGE = {"cli", "config", "report", "study", "units"}
"""Packages in which dB, degrees and km/h are allowed; `units` converts between them and SI."""
SUFFIXES = ("_db", "_dbi", "_dbm", "_dbsm", "_deg", "_ghz", "_kmh", "_mhz")

MODULES = sorted(SOURCE.rglob("*.py"))
INNER_MODULES = [
    path for path in MODULES if path.relative_to(SOURCE).with_suffix("").parts[0] not in EDGE
]


def name_of(path: Path) -> str:
    return path.relative_to(SOURCE).as_posix()


def bound_names(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Names a module gives to things: functions, parameters, fields, variables."""
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.arg(arg=name):
                yield name, node.lineno
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                yield name, node.lineno


def undocumented(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Public functions, classes and methods without a docstring."""
    scopes: list[ast.Module | ast.ClassDef] = [tree]
    while scopes:
        for node in scopes.pop().body:
            if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                continue
            if node.name.startswith("_"):
                continue
            if ast.get_docstring(node) is None:
                yield node.name, node.lineno
            if isinstance(node, ast.ClassDef):
                scopes.append(node)


def test_there_is_something_to_look_at():
    assert SOURCE / "units.py" in MODULES
    assert SOURCE / "frames.py" in INNER_MODULES


@pytest.mark.parametrize("path", INNER_MODULES, ids=name_of)
def test_no_name_inside_carries_a_unit(path: Path):
    found = [
        f"{name_of(path)}:{line}: {name}"
        for name, line in bound_names(ast.parse(path.read_text(encoding="utf-8")))
        if name.lower().endswith(SUFFIXES)
    ]
    assert found == []


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_every_public_name_says_what_it_is(path: Path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert ast.get_docstring(tree), f"{name_of(path)} does not say what it holds"
    found = [f"{name_of(path)}:{line}: {name}" for name, line in undocumented(tree)]
    assert found == []
