"""Table for docs/validation of the power that each mechanism adds in the paper's street.

``python -m tools.pages.mechanism_table FILE`` traces the street with all mechanisms and without
each of them, and stores the powers as JSON.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Final

import numpy as np

from polychirp.channel.tracers.composite import Composite
from polychirp.study.paper.scenarios import paper_study
from polychirp.study.spec import scene_of
from polychirp.units import to_db
from tools.experiments.mechanisms import Mechanisms, compare_mechanisms
from tools.pages.markdown import table

RECORD: Final = "mechanisms.json"
"""File with the numbers of the table, in the folder of the pages."""

LEAST_SHARE: Final = -60.0
"""Share below which the table shows no number, dB; chosen."""


def mechanism_table(folder: Path) -> str:
    """The stored powers: one row for every transmitter and receiver with a path.

    The share of a mechanism is the power of the field that it adds; two fields that cancel may both
    have large shares.
    """
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    head = ("from", "to", "power, dBm", "paths", *(f"{name}, dB" for name in record["share"]))
    rows = [
        (
            sender,
            receiver,
            f"{record['power'][i][j]:.1f}",
            f"{record['paths'][i][j]}",
            *(_cell(share[i][j]) for share in record["share"].values()),
        )
        for i, sender in enumerate(record["radars"])
        for j, receiver in enumerate(record["radars"])
        if record["power"][i][j] is not None
    ]
    return table(head, rows)


def _cell(level: float | None) -> str:
    return "–" if level is None else f"{level:.1f}"


def write_mechanisms(found: Mechanisms, path: Path) -> None:
    """Store powers in dBm and shares in dB, null where the table shows no number."""

    def levels(ratios: np.ndarray, least: float) -> list[list[float | None]]:
        rounded = np.round(to_db(np.nan_to_num(ratios)), 1)
        return [[float(x) if x > least else None for x in row] for row in rounded]

    record = {
        "radars": found.radars,
        "power": levels(found.power * 1e3, -300.0),
        "paths": found.num_paths.astype(int).tolist(),
        "share": {name: levels(share, LEAST_SHARE) for name, share in found.share.items()},
    }
    path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    street = scene_of(paper_study("conventional"))
    write_mechanisms(compare_mechanisms(street, Composite(diffuse=True)), Path(sys.argv[1]))
