"""Plants faults in the code, one at a time, and reports which of them the tests notice.

``python -m tools.planted_faults`` reads ``tools/planted_faults.toml``. Each fault is a piece of
code that occurs once in one file, and what stands there instead while the tests run. A copy of the
tree gets the fault; then run the tests that are likely to notice, and if all of them pass, every
quick test. Numbers of faults to plant may follow; ``--check`` only checks that each fault has its
place in the code.

Kernels are compiled anew only where a fault can reach them: numba does not notice that a function
in another file changed, so that the caches of all files that import the faulty one are removed.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tools.sources import ROOT, importers_of

LIST: Final = Path(__file__).with_suffix(".toml")
"""File that holds the faults."""

NEEDED_SHARE: Final = 0.95
"""Share of the faults that the quick tests must notice for the program to end with 0."""

NOT_COPIED: Final = (".git", ".venv", ".*_cache", "shared")
"""Files and folders that the tests do without."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """A change of one place in the code that makes a result wrong.

    Parameters
    ----------
    name : the fault in a few words
    file : path below ``src/polychirp``
    old, new : code that occurs once in the file, and the faulty code in its place
    tests : files or folders of tests that are likely to notice, tried first
    survives : the reason why no quick test notices, for a fault that is known to survive
    """

    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    survives: str = ""

    @property
    def path(self) -> Path:
        """Path of the file below the repository's folder."""
        return Path("src/polychirp") / self.file

    def problem(self, root: Path = ROOT) -> str:
        """Reason why the fault cannot be planted; empty if it can."""
        path = root / self.path
        if not path.is_file():
            return f"there is no file {self.path}"
        count = path.read_text(encoding="utf-8").count(self.old)
        missing = [test for test in self.tests if not (root / test).exists()]
        if missing:
            return f"there is no {missing[0]}"
        return "" if count == 1 else f"{self.path} holds the code {count} times, not once"

    def plant(self, root: Path) -> None:
        """Write the fault into a copy of the repository and forget kernels that it can reach."""
        path = root / self.path
        path.write_text(path.read_text(encoding="utf-8").replace(self.old, self.new), "utf-8")
        for reached in importers_of(self.path, root):
            for cache in (root / reached.parent / "__pycache__").glob(f"{reached.stem}.*.nb[ic]"):
                cache.unlink()


def read_faults(path: Path = LIST) -> list[Fault]:
    """Faults of a TOML file, in its order."""
    rows = tomllib.loads(path.read_text(encoding="utf-8"))["fault"]
    return [Fault(**{**row, "tests": tuple(row["tests"])}) for row in rows]


def noticed_by(fault: Fault) -> str:
    """First test that fails with the fault; empty if every quick test passes."""
    with tempfile.TemporaryDirectory(prefix="planted-") as folder:
        root = Path(folder) / "tree"
        _copy(root)
        fault.plant(root)
        return _first_failure(root, fault.tests) or _first_failure(root, ())


def _copy(root: Path) -> None:
    # with times, so that compiled kernels are valid
    shutil.copytree(ROOT, root, ignore=shutil.ignore_patterns(*NOT_COPIED))


def _first_failure(root: Path, tests: Sequence[str]) -> str:
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-x",
        "-q",
        "-m",
        "not slow",
        "-p",
        "no:cacheprovider",
    ]
    one = {"OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [*command, *tests],
        cwd=root,
        env={**os.environ, **one, "PYTHONPATH": f"{root / 'src'}{os.pathsep}{root}"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode == 0:
        return ""
    lines = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return lines[0].partition(" - ")[0] if lines else f"pytest ended with {done.returncode}"


def report(faults: Sequence[Fault], answers: Sequence[str]) -> bool:
    """Print who noticed what, and give whether enough of the faults were noticed."""
    noticed = sum(map(bool, answers))
    print(f"\n{noticed} of {len(faults)} faults were noticed by the quick tests")
    for fault, answer in zip(faults, answers, strict=True):
        if not answer:
            print(f"  survived: {fault.name} ({fault.survives or 'not explained'})")
    explained = all(answer or fault.survives for fault, answer in zip(faults, answers, strict=True))
    return explained and noticed >= NEEDED_SHARE * len(faults)


def main() -> int:
    """Plant the faults that the command line names, or all."""
    parser = argparse.ArgumentParser(prog="python -m tools.planted_faults", description=__doc__)
    parser.add_argument("number", nargs="*", type=int, help="faults to plant, counted from 1")
    parser.add_argument("--check", action="store_true", help="only look for each fault's place")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="copies at a time")
    options = parser.parse_args()
    faults = read_faults()
    if options.number:
        faults = [faults[number - 1] for number in options.number]
    problems = [f"{fault.name}: {problem}" for fault in faults if (problem := fault.problem())]
    if problems or options.check:
        print("\n".join(problems) or f"all {len(faults)} faults have their place")
        return 1 if problems else 0

    def tried(fault: Fault) -> str:
        begin = time.monotonic()
        answer = noticed_by(fault)
        print(
            f"{fault.name}: {answer or 'SURVIVED'} ({time.monotonic() - begin:.0f} s)", flush=True
        )
        return answer

    with ThreadPoolExecutor(options.workers) as pool:
        answers = list(pool.map(tried, faults))
    return 0 if report(faults, answers) else 1


if __name__ == "__main__":
    sys.exit(main())
