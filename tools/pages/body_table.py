"""Table for docs/validation of the cross sections of all bodies.

``python -m tools.pages.body_table FILE`` computes them and stores them as JSON.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Final

from tools.experiments.body_sections import SECTORS, bodies
from tools.pages.markdown import table

RECORD: Final = "bodies.json"
"""File with the numbers of the table and the figure, in the folder of the pages."""


def body_table(folder: Path) -> str:
    """One line for every body."""
    rows = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    body = [
        (
            row["name"],
            f"{row['distance']:.0f} m",
            _level(row["mean"]),
            _level(row["median"]),
            ", ".join(_level(row["sectors"][sector]) for sector in SECTORS),
            row["source"],
        )
        for row in rows
    ]
    head = ("body", "range", "mean, dBsm", "median, dBsm", f"medians {', '.join(SECTORS)}, dBsm")
    return table((*head, "published"), body)


def _level(value: float) -> str:
    return f"{value:.1f}".replace("-", "−")


if __name__ == "__main__":
    exact = json.dumps([asdict(row) for row in bodies()])
    rows = json.loads(exact, parse_float=lambda digits: round(float(digits), 1))
    lines = ",\n".join(json.dumps(row, ensure_ascii=False) for row in rows)
    Path(sys.argv[1]).write_text(f"[\n{lines}\n]\n", encoding="utf-8")
