"""Table for docs/validation of the coherent receiver on ray-traced streets.

``python -m tools.pages.street_table FILE`` traces the streets and stores the rates as JSON.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Final

from polychirp.threads import num_cores
from tools.experiments.traced_streets import traced_streets
from tools.pages.markdown import table, within

RECORD: Final = "streets.json"
"""File with the numbers of the table, in the folder of the pages."""


def street_table(folder: Path) -> str:
    """One line for every residue margin, waveform and radar."""
    rows = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    body = [
        (
            f"{row['margin_db']:.0f}",
            row["waveform"],
            row["radar"],
            str(row["num_trials"]),
            "; ".join(f"{name} {within(one, 3)}" for name, one in row["found"].items()),
            within(row["with_ghosts"], 2),
            within(row["unexplained"], 2),
            f"{row['detections']['value']:.0f}",
            f"{row['seconds']:.1f}",
        )
        for row in rows
    ]
    head = ("margin, dB", "waveform", "radar", "frames", "found", "two indirect ghosts or more")
    return table((*head, "unexplained per frame", "detections per frame", "s per frame"), body)


if __name__ == "__main__":
    exact = json.dumps([asdict(row) for row in traced_streets(num_processes=num_cores())])
    rows = json.loads(exact, parse_float=lambda digits: float(f"{float(digits):.5g}"))
    text = json.dumps(rows, indent=1, ensure_ascii=False) + "\n"
    Path(sys.argv[1]).write_text(text, encoding="utf-8")
