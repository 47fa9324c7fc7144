"""Tables for docs/validation of methods of mitigation on a set of frames.

``python -m tools.pages.benchmark_table FILE`` runs `polychirp benchmark` and stores its summary.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any, Final

from polychirp.study.mitigation.benchmark import (
    NO_MITIGATION,
    ORACLE,
    benchmark_record,
    run_benchmark,
)
from polychirp.study.mitigation.own_methods import methods_named
from tools.pages.markdown import table

RECORD: Final = "benchmark.json"
"""File with the numbers of the tables, in the folder of the pages."""

FRAMES: Final = 12
"""Frames of every family; chosen: four minutes."""


def benchmark_tables(folder: Path) -> str:
    """SINR and EVM of every method and family, and harm on clean frames."""
    rows = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    families = list(dict.fromkeys(row["family"] for row in rows))
    methods = list(dict.fromkeys(row["method"] for row in rows))
    of = {(row["method"], row["family"]): row for row in rows}

    def body(names: list[str], shown: Any) -> list[tuple[str, ...]]:
        return [(name, *(shown(of[name, family]) for family in families)) for name in names]

    own = [name for name in methods if name not in (NO_MITIGATION, ORACLE)]
    parts = [
        ("frames made worse, %, and clean samples touched, %", body(own, _harm)),
        ("SINR along range, dB: median (10 … 90 %)", body(methods, _sinr)),
        ("EVM, %: median, and ghosts per frame: median", body(methods, _evm)),
    ]
    head = ("method", *families)
    return "\n\n".join(f"**{title}**\n\n{table(head, rows)}" for title, rows in parts)


def _harm(row: dict[str, Any]) -> str:
    if row["refusal"]:
        return "refuses"
    return f"{100 * row['share_worse']:.0f}; {100 * row['summary']['false_mitigation'][1]:.1f}"


def _sinr(row: dict[str, Any]) -> str:
    low, median, high = row["summary"]["sinr_range"]
    return "–" if median is None else f"{median:.1f} ({low:.0f} … {high:.0f})"


def _evm(row: dict[str, Any]) -> str:
    evm, ghosts = (row["summary"][name][1] for name in ("evm", "ghosts"))
    return "–" if evm is None else f"{100 * evm:.1f}; {math.floor(ghosts)}"


def write_benchmark(path: Path) -> None:
    """Run all methods that are not slow, and store the summary without times and frames."""
    methods = methods_named((), ())
    results = run_benchmark(methods, num_frames=FRAMES)
    rows = benchmark_record(results, methods, frame_set="v1")["results"]
    for row in rows:
        del row["frames"]
        del row["summary"]["seconds"]
        for name, values in row["summary"].items():
            row["summary"][name] = [None if v is None else round(v, 4) for v in values]
    path.write_text(json.dumps(rows, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_benchmark(Path(sys.argv[1]))
