"""Table for docs/validation of the suppression by each family of waveforms.

``python -m tools.pages.diversity_table FILE`` draws pairs of radars of every family of
waveforms and stores their mutual interference as JSON; ``bench/diversity.py`` draws the figure.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from polychirp.units import to_db
from tools.experiments.diversity import (
    FAMILIES,
    SPREADS,
    SWEEPS,
    Suppression,
    compare_families,
    over_spread,
    over_sweeps,
    side_lobes,
)
from tools.pages.markdown import table

RECORD: Final = "diversity.json"
"""File with the numbers of the table, in the folder of the pages."""

_HEAD: Final = (
    "both radars play",
    "matched, mean, dB",
    "matched, strongest, dB",
    "per sweep, dB",
    "duty, %",
    "side lobe below 3 m/s, dB",
    "side lobe above, dB",
)

NO_INTERFERENCE: Final = 100.0
"""Suppression from which the table shows no number, dB; chosen."""


def diversity_table(folder: Path) -> str:
    """One row for every family."""
    rows = json.loads((folder / RECORD).read_text(encoding="utf-8"))["families"]
    return table(_HEAD, [_cells(row) for row in rows])


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    suppression = (row[name] for name in ("matched_mean", "matched_peak", "per_sweep"))
    return (
        row["family"],
        *(
            f"{value + 0.0:.1f}" if value < NO_INTERFERENCE else "not received"
            for value in suppression
        ),
        f"{row['duty']:.2f}",
        f"{row['slow_ambiguity']:.1f}".replace("-", "−"),
        f"{row['fast_ambiguity']:.1f}".replace("-", "−"),
    )


def in_decibels(rows: Iterable[Suppression]) -> list[dict[str, Any]]:
    """Rows of the record: suppression in dB, duty in per cent."""
    return [
        {
            "family": row.family,
            "matched_mean": _suppressed(row.matched_mean),
            "matched_peak": _suppressed(row.matched_peak),
            "per_sweep": _suppressed(row.per_sweep),
            "law": _suppressed(row.law),
            "duty": round(100.0 * row.duty, 3),
            "draws": row.num_draws,
        }
        for row in rows
    ]


def _suppressed(ratio: float) -> float:
    return round(abs(float(to_db(ratio))), 2) if ratio <= 1.0 else -round(float(to_db(ratio)), 2)


def record() -> dict[str, Any]:
    """All numbers of the page."""
    families = in_decibels(compare_families())
    for row in families:
        slow, fast = side_lobes(FAMILIES[row["family"]])
        row["slow_ambiguity"] = round(float(to_db(slow)), 2)
        row["fast_ambiguity"] = round(float(to_db(fast)), 2)
    return {
        "families": families,
        "spreads": SPREADS,
        "over_spread": {name: in_decibels(rows) for name, rows in over_spread().items()},
        "sweeps": SWEEPS,
        "over_sweeps": {name: in_decibels(rows) for name, rows in over_sweeps().items()},
    }


if __name__ == "__main__":
    text = json.dumps(record(), indent=1, ensure_ascii=False) + "\n"
    Path(sys.argv[1]).write_text(text, encoding="utf-8")
