"""Table for docs/validation of methods of mitigation on the signal of TU Delft.

``python -m tools.pages.published_table FILE`` measures all methods and stores the results as JSON.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Final

from tools.experiments.published_signals import PublishedRow, tu_delft_rows
from tools.pages.markdown import table

RECORD: Final = "published.json"
"""File with the numbers of the table, in the folder of the pages."""


def published_table(folder: Path) -> str:
    """One row for every method, the worst first."""
    rows = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    body = [
        (
            row["method"],
            f"{row['median']:.1f}",
            f"{row['low']:.1f} … {row['high']:.1f}",
            f"{row['tenth']:.1f}",
            row["published"],
        )
        for row in sorted(rows, key=lambda row: float(row["median"]))
    ]
    head = (
        "method",
        "median, dB",
        "its 95 % interval",
        "a tenth is below",
        "published, dB",
    )
    return table(head, body)


def write_published(rows: Sequence[PublishedRow], path: Path) -> None:
    """Store rows as JSON, decibels to two digits."""
    record = [
        {key: round(value, 2) if isinstance(value, float) else value for key, value in row.items()}
        for row in map(asdict, rows)
    ]
    path.write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_published(tu_delft_rows(), Path(sys.argv[1]))
