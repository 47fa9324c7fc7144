"""Table for docs/validation of the effect of mitigation in scenarios C and B.

``python -m tools.pages.mitigation_table FILE`` runs both with every method and stores the
results as JSON.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from tools.experiments.mitigations import MitigationRow, compare_paper_mitigations
from tools.pages.markdown import table

RECORD: Final = "mitigation.json"
"""File with the numbers of the table, in the folder of the pages."""

_COLUMNS: Final[Mapping[str, Callable[[Mapping[str, Any]], str]]] = {
    "SINR, dB": lambda row: f"{row['sinr_db']:.1f}",
    "EVM, %": lambda row: f"{100 * row['evm']:.3f}",
    "floor, dB": lambda row: f"{row['floor_rise_db'] + 0.0:.1f}",
    "ghosts": lambda row: f"{row['ghosts']}",
    "other false": lambda row: f"{row['others']}",
    "missed": lambda row: f"{row['missed']}",
    "other echoes": lambda row: f"{row['echoes']}",
    "lost, %": lambda row: f"{100 * row['lost']:.2f}",
    "clean: touched, %": lambda row: f"{100 * row['touched_clean']:.3f}",
    "clean: SINR lost, dB": lambda row: f"{row['loss_clean_db'] + 0.0:.3f}",
}


def mitigation_table(folder: Path) -> str:
    """One row for every scenario and method."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    rows = [
        (row["scenario"], row["method"], *(cell(row) for cell in _COLUMNS.values()))
        for row in record
    ]
    return table(("scenario", "method", *_COLUMNS), rows)


def write_mitigations(rows: Sequence[MitigationRow], path: Path) -> None:
    """Store rows as JSON: decibels to two digits, shares to six."""

    def rounded(key: str, value: object) -> object:
        digits = 2 if key.endswith("_db") else 6
        return round(value, digits) + 0.0 if isinstance(value, float) else value

    record = [{key: rounded(key, value) for key, value in asdict(row).items()} for row in rows]
    path.write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_mitigations(compare_paper_mitigations(), Path(sys.argv[1]))
