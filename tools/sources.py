"""Import graph of the repository's Python files, and hashes of the code that a program runs."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
"""Folder of the repository."""

CODE: Final = ("src/polychirp", "tools", "bench", "tests")
"""Folders whose files count as code that a program may import."""

DATA: Final = (".toml", ".css", ".html", ".mplstyle")
"""Suffixes of files in a package that its code reads."""


THREADS: Final = "polychirp.threads"
"""Module that decides in how many threads code runs. Neither it nor its decorators count: times
alone depend on them, since results are the same bytes for any number of threads."""


def imports_of(file: Path) -> set[str]:
    """Dotted names of all that a file imports, inside its functions too.

    >>> "ast" in imports_of(Path(__file__))
    False
    >>> "pathlib.Path" in imports_of(Path(__file__))
    True
    """
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


@cache
def graph(root: Path = ROOT) -> dict[Path, set[Path]]:
    """Files of the repository, below its root, and the files that each of them imports.

    A public name of the package stands for the file that defines it.
    """
    files = {
        module_of(file.relative_to(root)): file.relative_to(root)
        for folder in CODE
        for file in sorted((root / folder).rglob("*.py"))
    }
    public = public_names(root)
    return {
        file: {
            files[module]
            for module in (public.get(name, name) for name in imports_of(root / file))
            if module in files
        }
        for file in files.values()
    }


def public_names(root: Path = ROOT) -> dict[str, str]:
    """Module of each public name of the package, by the dotted name under which it is imported.

    ``__init__.py`` imports them when they are used, which its syntax tree does not show.

    >>> public_names()["polychirp.run_trial"]
    'polychirp.study.trial'
    """
    file = root / "src" / "polychirp" / "__init__.pyi"
    if not file.exists():
        return {}
    return {
        f"polychirp.{alias.name}": node.module
        for node in ast.parse(file.read_text(encoding="utf-8")).body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }


def module_of(file: Path) -> str:
    """Dotted name under which a file of the repository is imported.

    >>> module_of(Path("src/polychirp/model/__init__.py")), module_of(Path("tools/renew.py"))
    ('polychirp.model', 'tools.renew')
    """
    parts = [part for part in file.with_suffix("").parts if part != "src"]
    return ".".join(parts).removesuffix(".__init__")


def imported_by(starts: Iterable[Path], root: Path = ROOT) -> set[Path]:
    """The files and all that they import, directly or by way of others."""
    return _reached(starts, graph(root))


def importers_of(start: Path, root: Path = ROOT) -> set[Path]:
    """The file and all files that import it, directly or by way of others."""
    users: dict[Path, set[Path]] = {}
    for file, targets in graph(root).items():
        for target in targets:
            users.setdefault(target, set()).add(file)
    return _reached([start], users)


def _reached(starts: Iterable[Path], arrows: dict[Path, set[Path]]) -> set[Path]:
    reached: set[Path] = set()
    waiting = list(starts)
    while waiting:
        file = waiting.pop()
        if file not in reached:
            reached.add(file)
            waiting += arrows.get(file, set())
    return reached


def code_hash(starts: Iterable[Path], root: Path = ROOT) -> str:
    """Hash of the code that files run: their own, that of all they import, and its data files.

    Comments and docstrings do not count, since no number depends on them, nor does `THREADS`.
    """
    total = sha256()
    files = {file for file in imported_by(starts, root) if module_of(file) != THREADS}
    for file in sorted(files):
        total.update(f"{module_of(file)}\n".encode())
        total.update(_code(root / file).encode())
    folders = {file.parent for file in files if file.parts[0] == "src"}
    for path in sorted(p for folder in folders for p in (root / folder).iterdir()):
        if path.suffix in DATA:
            total.update(path.read_bytes())
    return total.hexdigest()[:12]


@cache
def _code(file: Path) -> str:
    """Text of a file's syntax tree without its docstrings and without the names of `THREADS`."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    of_threads = {
        alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module == THREADS
        for alias in node.names
    }
    for node in ast.walk(tree):
        for name in ("body", "orelse", "finalbody"):
            block = getattr(node, name, None)
            if isinstance(block, list):
                block[:] = [
                    line for line in block if not _is_text(line) and not _is_of_threads(line)
                ]
        if isinstance(node, ast.FunctionDef):
            node.decorator_list = [
                one
                for one in node.decorator_list
                if not (isinstance(one, ast.Call) and ast.unparse(one.func) in of_threads)
            ]
    return ast.dump(tree)


def _is_of_threads(node: ast.AST) -> bool:
    return isinstance(node, ast.ImportFrom) and node.module == THREADS


def _is_text(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )
