"""Speed of the parts of polychirp, as tables for docs/validation/speed.md.

``python -m tools.pages.speed_table FILE`` runs the benchmarks of ``bench/`` one after the other,
each with one thread but for the frame, which takes all cores, and stores what they print as JSON.
The growth curves are records of their own, beside their figures.
"""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from tools.pages.markdown import table, three_digits
from tools.sources import ROOT

RECORD: Final = "speed.json"
"""File that the tables are made of, in the folder of the pages."""

ONE_THREAD: Final = dict.fromkeys(
    ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"
)
"""Environment in which a program keeps to one thread."""

KERNELS: Final = ("receiver", "correlation", "synthesis")
"""Files ``bench/test_NAME.py`` whose medians are listed."""


def measure() -> dict[str, Any]:
    """All benchmarks' figures."""
    return {
        "machine": {
            "processor": _processor(),
            "cores": len(os.sched_getaffinity(0)),
            "python": platform.python_version(),
        },
        "snapshot": _printed("bench.snapshot", ONE_THREAD),
        "frame": _printed("bench.frame", {"OPENBLAS_NUM_THREADS": "1"}),
        "workers": _printed("bench.monte_carlo", {"OPENBLAS_NUM_THREADS": "1"}),
        "kernels": _medians(),
    }


def _processor() -> str:
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    names = [line.partition(": ")[2] for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def _printed(module: str, environment: Mapping[str, str]) -> Any:
    done = subprocess.run(
        [sys.executable, "-m", module, "--json"],
        cwd=ROOT,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        check=True,
    )
    return json.loads(done.stdout)


def _medians() -> list[dict[str, Any]]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "benchmarks.json"
        files = [f"bench/test_{name}.py" for name in KERNELS]
        subprocess.run(
            [sys.executable, "-m", "pytest", "-q", *files, f"--benchmark-json={path}"],
            cwd=ROOT,
            env={**os.environ, **ONE_THREAD},
            check=True,
        )
        rows = json.loads(path.read_text(encoding="utf-8"))["benchmarks"]
    return [{"name": row["name"], "median": row["stats"]["median"]} for row in rows]


def speed_tables(folder: Path) -> dict[str, str]:
    """Blocks of the page by their names, from the records in the folder and beside the figures."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    images = folder.parent / "images"
    return {
        "speed-machine": _machine(record["machine"]),
        "speed-snapshot": _snapshot(record["snapshot"]),
        "speed-frame": _frame(record["frame"]),
        "speed-workers": _workers(record["workers"]),
        "speed-kernels": _kernels(record["kernels"]),
        "speed-paths": _paths(json.loads((images / "synthesis_growth.json").read_text("utf-8"))),
        "speed-growth": _growth(json.loads((images / "scaling.json").read_text("utf-8"))),
    }


def _machine(row: Mapping[str, Any]) -> str:
    return f"Measured on {row['cores']} cores of a {row['processor']}, Python {row['python']}."


def _snapshot(record: Mapping[str, Any]) -> str:
    """One column for every mesh and mechanism set, CPU-seconds."""
    columns = [
        (f"{mesh}, {rows['facets']:,} facets, {switch}", rows[switch])
        for mesh, rows in record.items()
        for switch in rows
        if switch != "facets"
    ]
    kinds = dict.fromkeys(kind for _, seconds in columns for kind in seconds)
    ordered = [kind for kind in kinds if kind != "sum"] + ["sum"]
    body = [
        (kind, *(f"{seconds[kind]:.2f}" if kind in seconds else "–" for _, seconds in columns))
        for kind in ordered
    ]
    return table(("part", *(name for name, _ in columns)), body)


def _frame(record: Mapping[str, Any]) -> str:
    runs = record["runs"]
    again = runs[1:]
    body = [
        ("first frame of a process", *(f"{t:.1f}" for t in (*runs[0], sum(runs[0])))),
        (
            f"frames after it, median of {len(again)}",
            *(f"{statistics.median(column):.1f}" for column in zip(*again, strict=True)),
            f"{statistics.median(map(sum, again)):.1f}",
        ),
    ]
    head = ("s", "scene and paths", "signals and receivers", "whole frame")
    return f"{table(head, body)}\n\nThe process takes {record['peak_mb']} MB at its peak."


def _workers(record: Sequence[Mapping[str, Any]]) -> str:
    names = {
        "efficiency": "trials of two workers over twice those of one",
        "plain_loops": "the same for two plain loops that share nothing",
        "busy": "share of their time that the workers spend in trials",
        "leader_ms_per_trial": "CPU time of the leading process for a trial, ms",
    }
    body = []
    for key, text in names.items():
        values = [row[key] for row in record]
        body.append((text, f"{min(values):g} to {max(values):g}"))
    return table((f"{len(record)} runs in turn", "least to greatest"), body)


def _kernels(rows: Iterable[Mapping[str, Any]]) -> str:
    return table(
        ("benchmark", "median, ms"),
        [(f"`{row['name']}`", three_digits(1e3 * row["median"])) for row in rows],
    )


def _paths(record: Mapping[str, Any]) -> str:
    """Nanoseconds per path, channel and sample: 4 channels of 48 000 samples."""
    sizes = (100, 300, 1000, 3000, 10_000, 100_000, 1_000_000)
    body = []
    for panel, lines in record.items():
        if not panel.startswith("paths of "):
            continue
        for name, points in lines.items():
            found = dict(points)
            cells = (
                f"{1e9 * found[size] / (4 * 48_000 * size):.2g}" if size in found else ""
                for size in sizes
            )
            body.append((f"{panel.removeprefix('paths of ')}, {name}", *cells))
    return table(("ns", *(f"{size:,} paths" for size in sizes)), body)


def _growth(record: Mapping[str, Any]) -> str:
    body = [
        (f"{panel}: {name}", "; ".join(f"{size:,}: {seconds:g} s" for size, seconds in points))
        for panel, lines in record.items()
        for name, points in lines.items()
    ]
    return table(("varied", "CPU time of a snapshot"), body)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps(measure(), indent=1) + "\n", encoding="utf-8")
