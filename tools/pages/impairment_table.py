"""Table for docs/validation of the effect of impairments on ghosts and floor in scenario C.

``python -m tools.pages.impairment_table FILE`` runs the scenario with each of them and stores
the results as JSON.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Final

from tools.experiments.impairments import ImpairedRow, compare_impairments
from tools.pages.markdown import table

RECORD: Final = "impairments.json"
"""File with the numbers of the table, in the folder of the pages."""


def impairment_table(folder: Path) -> str:
    """One row for every impairment: the conventional waveform, then the diverse one."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    by_waveform: dict[str, dict[str, dict[str, object]]] = {}
    for row in record:
        by_waveform.setdefault(row["waveform"], {})[row["impairment"]] = row
    head = ("impairment", *(_heading(what, w) for w in by_waveform for what in _COLUMNS))
    first = next(iter(by_waveform.values()))
    rows = [
        (name, *(cell for some in by_waveform.values() for cell in _cells(some[name])))
        for name in first
    ]
    return table(head, rows)


_COLUMNS: Final = ("ghosts", "floor, dB", "missed", "other false")


def _heading(what: str, waveform: str) -> str:
    return f"{waveform}: {what}"


def _cells(row: dict[str, object]) -> tuple[str, ...]:
    return (
        _ghosts(row["ghosts"]),
        f"{row['floor_rise_db']:.1f}",
        f"{row['missed']}",
        f"{row['others']}",
    )


def _ghosts(ghosts: object) -> str:
    """The strongest two, and the number of the others."""
    assert isinstance(ghosts, list)
    shown = [
        f"{distance:.1f} m ({level:+.0f} dB)".replace("-", "−") for distance, level in ghosts[:2]
    ]
    more = [f"{len(ghosts) - 2} more"] if len(ghosts) > 2 else []
    return ", ".join([*shown, *more]) or "–"


def write_impairments(rows: Sequence[ImpairedRow], path: Path) -> None:
    """Store rows as JSON, metres and decibels to two digits."""

    def rounded(value: object) -> object:
        if isinstance(value, float):
            return round(value, 2)
        return [rounded(v) for v in value] if isinstance(value, tuple) else value

    record = [{key: rounded(value) for key, value in asdict(row).items()} for row in rows]
    path.write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_impairments(compare_impairments(), Path(sys.argv[1]))
