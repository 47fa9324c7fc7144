"""Measures the numbers and figures of the documentation anew, and stamps them.

``./run validation`` runs it. Each record below is a file, or some, that a program writes; the
record's stamp holds the date and a hash of the code on which the program depends. Without names,
the program measures all records whose code has changed since; ``--all`` measures every record,
names measure just these. ``--check`` measures nothing: it names the records that are older than
their sources and ends with 1 if there are any. Pages are written afterwards in any case.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any, Final

from tools.pages.validation_pages import write_pages
from tools.sources import ROOT, code_hash

PAGES: Final = ROOT / "docs" / "validation"
"""Folder of the pages and of most records."""

IMAGES: Final = ROOT / "docs" / "images"
"""Folder of the figures."""

STAMPS: Final = PAGES / "stamps.json"
"""File that holds the stamp of every record."""


COMPARING: Final = re.compile(r"def \w+\([^)]*\bcompare\b")
"""Definition of a test or a fixture that uses the fixture ``compare``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """Files of the documentation that one program writes.

    Parameters
    ----------
    name : of the record
    command : arguments of Python that write the files; "{out}" stands for a new folder
    starts : files of code with which the program begins, or folders of them
    minutes : time that the program takes on two cores, about
    copied : figures of "{out}" that go into docs/images
    """

    name: str
    command: tuple[str, ...]
    starts: tuple[str, ...]
    minutes: float
    copied: tuple[str, ...] = ()

    def hash(self) -> str:
        """Hash of the code on which the record depends, as it is now."""
        files = []
        for start in self.starts:
            path = ROOT / start
            files += sorted(path.rglob("*.py")) if path.is_dir() else [path]
        return code_hash(file.relative_to(ROOT) for file in files)

    def measure(self) -> None:
        """Run the program.

        Raises
        ------
        subprocess.CalledProcessError
            The program fails.
        """
        with tempfile.TemporaryDirectory() as out:
            command = [argument.format(out=out) for argument in self.command]
            subprocess.run([sys.executable, *command], cwd=ROOT, check=True)
            for figure in self.copied:
                shutil.copy2(Path(out) / "figures" / figure, IMAGES / figure)


def _table(name: str, minutes: float, *, program: str = "") -> Record:
    program = f"{program or name}_table"
    return Record(
        name=name,
        command=("-m", f"tools.pages.{program}", f"docs/validation/{name}.json"),
        starts=(f"tools/pages/{program}.py",),
        minutes=minutes,
    )


def _figure(name: str, program: str, minutes: float, *arguments: str) -> Record:
    return Record(
        name=name,
        command=("-m", f"bench.{program}", *arguments, "docs/images"),
        starts=(f"bench/{program}.py",),
        minutes=minutes,
    )


def _comparing_tests() -> tuple[str, ...]:
    """Test files with tests that use the fixture ``compare``, and all files of fixtures."""
    files = sorted((ROOT / "tests").rglob("*.py"))
    return tuple(
        str(file.relative_to(ROOT))
        for file in files
        if file.name == "conftest.py" or COMPARING.search(file.read_text(encoding="utf-8"))
    )


RECORDS: Final = (
    Record(
        name="comparisons",
        command=("-m", "pytest", "-q", "tests", "--record", "docs/validation/comparisons.json"),
        starts=_comparing_tests(),
        minutes=12,
    ),
    Record(
        name="paper",
        command=("-m", "polychirp", "paper", "--out", "{out}"),
        starts=("src/polychirp/cli/paper.py",),
        minutes=3,
        copied=(
            "fig06.png",
            "fig07-baseband.png",
            "fig08-view.png",
            "fig11a.png",
            "fig11b.png",
            "fig12-13.png",
            "fig12-13-traced.png",
            "slope-law.png",
        ),
    ),
    _table("mechanisms", 5, program="mechanism"),
    _table("impairments", 3, program="impairment"),
    _table("mitigation", 3),
    _table("published", 2),
    _table("chirp-sequence", 3, program="chirp_sequence"),
    _table("benchmark", 20),
    _table("diversity", 20),
    _table("ghosts", 8, program="ghost"),
    Record(
        name="fig12-13",
        command=(
            "-m",
            "tools.experiments.paper_statistics",
            "src/polychirp/study/paper/statistics.json",
        ),
        starts=("tools/experiments/paper_statistics.py",),
        minutes=10,
    ),
    Record(
        name="fig12-13-traced",
        command=(
            "-m",
            "tools.experiments.paper_statistics",
            "src/polychirp/study/paper/traced_statistics.json",
            "vehicles",
        ),
        starts=("tools/experiments/paper_statistics.py",),
        minutes=240,
    ),
    _table("roads", 3, program="road"),
    _table("league", 55),
    _table("statistics", 10),
    _table("receiver", 12),
    _table("streets", 60, program="street"),
    _table("bodies", 4, program="body"),
    Record(
        name="bodies-figure",
        command=("-m", "tools.figures.bodies", "docs/validation/bodies.json", "docs/images"),
        starts=("tools/figures/bodies.py",),
        minutes=0.1,
    ),
    _figure("diversity-figure", "diversity", 0.1, "docs/validation/diversity.json"),
    _figure("ghosts-figure", "ghosts", 0.1, "docs/validation/ghosts.json"),
    _figure("receiver-figure", "receivers", 0.1, "docs/validation/receiver.json"),
    Record(
        name="road-users-figure",
        command=("-m", "tools.figures.road_users", "docs/images"),
        starts=("tools/figures/road_users.py",),
        minutes=3,
    ),
    Record(
        name="shadow-figure",
        command=("-m", "tools.figures.shadow", "docs/images"),
        starts=("tools/figures/shadow.py",),
        minutes=1,
    ),
    _figure("scaling", "scaling", 10),
    _figure("synthesis-growth", "synthesis_growth", 2),
    _figure("convergence", "convergence", 10),
    _figure("estimation-bound", "estimation_bound", 8),
    Record(
        name="speed",
        command=("-m", "tools.pages.speed_table", "docs/validation/speed.json"),
        starts=("tools/pages/speed_table.py", "bench"),
        minutes=7,
    ),
)
"""Every record of the documentation, those that others are drawn from first."""


def stale(records: Sequence[Record], stamps: Mapping[str, Any]) -> list[Record]:
    """Records that were never stamped, or whose code is not that of their stamp."""
    return [r for r in records if stamps.get(r.name, {}).get("code") != r.hash()]


def read_stamps() -> dict[str, Any]:
    """Stamps by the names of their records; none where there is no file."""
    return json.loads(STAMPS.read_text(encoding="utf-8")) if STAMPS.exists() else {}


def _stamp(record: Record, code: str) -> None:
    """Write the record's stamp, so that a run that is interrupted keeps what it has measured."""
    stamps = read_stamps() | {record.name: {"code": code, "date": date.today().isoformat()}}
    text = json.dumps(dict(sorted(stamps.items())), indent=1)
    STAMPS.write_text(text + "\n", encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure what the command line asks for, and write the pages."""
    parser = argparse.ArgumentParser(prog="./run validation", description=__doc__)
    parser.add_argument("name", nargs="*", help=", ".join(record.name for record in RECORDS))
    parser.add_argument("--all", action="store_true", help="measure every record")
    parser.add_argument("--check", action="store_true", help="name what is out of date")
    options = parser.parse_args(arguments)
    unknown = sorted(set(options.name) - {record.name for record in RECORDS})
    if unknown:
        parser.error(f"there is no record '{unknown[0]}'")
    chosen = [r for r in RECORDS if not options.name or r.name in options.name]
    if not options.all and not (options.name and not options.check):
        chosen = stale(chosen, read_stamps())
    if options.check:
        for record in chosen:
            print(f"{record.name} is older than its sources; it takes {record.minutes:g} minutes")
        return 1 if chosen else 0
    for record in chosen:
        print(f"measuring {record.name}, about {record.minutes:g} minutes", flush=True)
        code = record.hash()
        record.measure()
        _stamp(record, code)
    write_pages(PAGES)
    return 0


if __name__ == "__main__":
    sys.exit(main())
