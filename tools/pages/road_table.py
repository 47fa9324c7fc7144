"""Table for docs/validation of the interference of oncoming lanes.

``python -m tools.pages.road_table FILE`` draws the roads and stores their means as JSON.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from polychirp.units import to_db
from tools.experiments.roads import measure_roads
from tools.pages.markdown import table

RECORD: Final = "roads.json"
"""File with the numbers of the table, in the folder of the pages."""

_HEAD: Final = (
    "lanes, m to the side",
    "cars in 100 m of a lane",
    "closed form, dBm",
    "free space over closed form",
    "with vehicles that hide others, over free space",
    "that is, dB",
)


def road_table(folder: Path) -> str:
    """One row for every road, with intervals of two standard errors."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    return table(_HEAD, [_cells(row) for row in record])


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    form = row["closed_form"]
    return (
        " and ".join(f"{y:g}" for y in row["offsets"]),
        f"{100 * row['cars']:.2f}",
        f"{float(to_db(form)) + 30:.1f}".replace("-", "−"),
        _ratio(row["free_space"], form),
        _ratio(row["visible"], 1.0),
        f"{float(to_db(row['visible'][0])):.1f}".replace("-", "−"),
    )


def _ratio(estimate: list[float], form: float) -> str:
    value, error = (one / form for one in estimate)
    return f"{value:.2f} ({value - 2 * error:.2f}…{value + 2 * error:.2f})"


if __name__ == "__main__":
    text = json.dumps([asdict(row) for row in measure_roads()], indent=1) + "\n"
    Path(sys.argv[1]).write_text(text, encoding="utf-8")
