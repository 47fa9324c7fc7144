"""Nothing that only POSIX has is needed: not at import, and not to check and run a study."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.small_study import SMALL_STUDY

SOURCE = Path(__file__).parents[2] / "src" / "polychirp"
MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
"""Modules that Windows lacks."""

NAMES = {
    "os": {
        "chown", "fork", "forkpty", "getegid", "geteuid", "getgid", "getpgid", "getuid", "killpg",
        "mkfifo", "nice", "O_DIRECTORY", "openpty", "sched_getaffinity", "setsid", "spawnvp",
        "sysconf", "uname", "wait", "wait4", "waitid",
    },
    "signal": {
        "SIGALRM", "SIGCHLD", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGSTOP", "SIGUSR1", "SIGUSR2",
        "alarm", "pause", "pthread_sigmask", "setitimer", "sigwait",
    },
}  # fmt: skip
"""Names that `os` and `signal` have on POSIX alone."""

PLACES = re.compile(r"^/(dev|home|proc|tmp|var)(/|$)")


def posix_only(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Uses of what only POSIX has that no condition guards."""
    guarded = {id(inner) for node in ast.walk(tree) if is_guard(node) for inner in ast.walk(node)}
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names) if id(node) not in guarded:
                yield from ((one.name, node.lineno) for one in names if one.name in MODULES)
            case ast.ImportFrom(module=str(module)) if id(node) not in guarded:
                if module in MODULES:
                    yield module, node.lineno
            case ast.Attribute(value=ast.Name(id=owner), attr=name) if id(node) not in guarded:
                if name in NAMES.get(owner, set()):
                    yield f"{owner}.{name}", node.lineno
            case ast.Call(func=ast.Attribute(attr="get_context" | "set_start_method")):
                if not [a for a in node.args if isinstance(a, ast.Constant) and a.value == "spawn"]:
                    yield "a start method other than spawn", node.lineno
            case ast.Constant(value=str(text)) if PLACES.match(text):
                yield text, node.lineno


def is_guard(node: ast.AST) -> bool:
    """True for a choice by platform, and for a ``try`` that goes on without the module."""
    match node:
        case ast.If() | ast.IfExp():
            return any(word in ast.unparse(node.test) for word in ("sys.platform", "hasattr(os"))
        case ast.Try(handlers=handlers):
            return any("ImportError" in ast.unparse(handler.type or node) for handler in handlers)
    return False


def test_the_search_finds_what_it_is_for():
    text = (
        "import fcntl\nos.fork()\nx = '/tmp/a'\nget_context('fork')\nsignal.SIGKILL\n"
        "try:\n    import fcntl\nexcept ImportError:\n    pass\n"
        "y = os.uname() if sys.platform == 'linux' else ''\nos.kill(1, signal.SIGTERM)\n"
        "m.get_context('spawn')\nm.get_context('fork')\n"
    )
    found = {line: name for name, line in posix_only(ast.parse(text))}
    assert found == {
        1: "fcntl",
        2: "os.fork",
        3: "/tmp/a",
        5: "signal.SIGKILL",
        13: "a start method other than spawn",
    }


@pytest.mark.parametrize(
    "path", sorted(SOURCE.rglob("*.py")), ids=lambda path: path.relative_to(SOURCE).as_posix()
)
def test_no_module_needs_posix(path):
    found = list(posix_only(ast.parse(path.read_text(encoding="utf-8"))))
    assert found == []


WITHOUT_POSIX = f"""
import os, signal, sys
import multiprocessing, subprocess, tempfile  # these may need what is removed below
import numba, numpy, pydantic, scipy, zarr

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name in {sorted(MODULES)!r}:
            raise ImportError(f"No module named '{{name}}'")

# the standard library's own on POSIX, which compilation of kernels may use
subprocess.Popen.kill = subprocess.Popen.terminate
sys.meta_path.insert(0, Absent())
for name in {sorted(MODULES)!r}:
    sys.modules.pop(name, None)
for owner, names in ((os, {sorted(NAMES["os"])!r}), (signal, {sorted(NAMES["signal"])!r})):
    for name in names:
        if hasattr(owner, name):
            delattr(owner, name)

from polychirp.cli.app import main
sys.exit(main(sys.argv[1:]))
"""


def test_a_study_is_checked_and_run_without_posix(tmp_path):
    """Python on POSIX, from which the modules and names that only POSIX has are removed."""
    (tmp_path / "study.toml").write_text(SMALL_STUDY, encoding="utf-8")
    for words in (["check", "study.toml"], ["run", "study.toml", "--out", "out"]):
        done = subprocess.run(
            [sys.executable, "-c", WITHOUT_POSIX, *words],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "run.zarr").is_dir()
