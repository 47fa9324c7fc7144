"""Tables for docs/validation of the detections of the coherent receiver.

``python -m tools.pages.receiver_table FILE`` draws frames of points in noise, reads them and
stores the rates as JSON; ``bench/receivers.py`` draws the figure.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from tools.experiments.receivers import (
    Curve,
    NoiseRow,
    PointsRow,
    close_points,
    detection_probability,
    false_detections,
    passing_points,
    ten_points,
)
from tools.pages.markdown import table, within

RECORD: Final = "receiver.json"
"""File with the numbers of the tables, in the folder of the pages."""


_FIELDS: Final = {
    "frame": "frame",
    "points": "case",
    "frames": "num_trials",
    "found": "found",
    "missed per frame": "missed",
    "false per frame": "false",
    "most false in a frame": "most_false",
}
"""Heads of columns, and the fields of `PointsRow` that they show."""


def receiver_tables(folder: Path) -> dict[str, str]:
    """Blocks of the page by their names."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    return {
        "receiver-detection": _detection(record["detection"]),
        "receiver-noise": _noise(record["noise"]),
        "receiver-points": _compared(
            record["points"], "frame", "frames", "missed per frame", "false per frame"
        ),
        "receiver-passing": _compared(
            record["passing"],
            *("frame", "frames", "found", "false per frame", "most false in a frame"),
        ),
        "receiver-close": _compared(
            record["close"], "frame", "points", "frames", "found", "false per frame"
        ),
    }


def _detection(rows: Sequence[Mapping[str, Any]]) -> str:
    """One line for every SNR, one column for every frame."""
    frames = list(dict.fromkeys(row["frame"] for row in rows))
    cells = {(row["snr_db"], row["frame"]): within(row["detection"], 2) for row in rows}
    ideal = {row["snr_db"]: f"{row['ideal']:.2f}" for row in rows}
    body = [
        (f"{snr:g}", ideal[snr], *(cells[snr, frame] for frame in frames)) for snr in sorted(ideal)
    ]
    return table(("coherent SNR, dB", "ideal detector", *frames), body)


def _noise(rows: Sequence[Mapping[str, Any]]) -> str:
    head = ("frame", "probability", "frames", "expected per frame", "measured per frame")
    body = [
        (
            row["frame"],
            f"{row['probability']:.0e}".replace("e-0", "e-"),
            str(row["num_trials"]),
            f"{row['expected']:.2f}",
            within(row["measured"], 2),
        )
        for row in rows
    ]
    return table(head, body)


def _compared(rows: Sequence[Mapping[str, Any]], *heads: str) -> str:
    """One line for every row, with the columns of these heads."""
    return table(heads, [[_cell(row[_FIELDS[head]]) for head in heads] for row in rows])


def _cell(value: Any) -> str:
    return within(value, 2) if isinstance(value, Mapping) else str(value)


def as_record(rows: Sequence[Curve | NoiseRow | PointsRow]) -> list[dict[str, Any]]:
    """Rows of the record, to five digits."""
    return [{name: _rounded(value) for name, value in asdict(row).items()} for row in rows]


def _rounded(value: object) -> object:
    if isinstance(value, dict):
        return {name: _rounded(part) for name, part in value.items()}
    return float(f"{value:.5g}") if isinstance(value, float) else value


def record() -> dict[str, Any]:
    """All numbers of the page."""
    return {
        "detection": as_record(detection_probability()),
        "noise": as_record(false_detections()),
        "points": as_record(ten_points()),
        "passing": as_record(passing_points()),
        "close": as_record(close_points()),
    }


if __name__ == "__main__":
    text = json.dumps(record(), indent=1, ensure_ascii=False) + "\n"
    Path(sys.argv[1]).write_text(text, encoding="utf-8")
