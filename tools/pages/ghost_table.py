"""Table for docs/validation of the probability of ghosts, measured and by closed forms.

``python -m tools.pages.ghost_table FILE`` runs some thousand short trials on all cores and
stores their results as JSON; ``bench/ghosts.py`` draws the figure.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from polychirp.scoring.statistics import Estimate
from polychirp.study.monte_carlo.executor import LocalWorkers
from tools.experiments.ghosts import GhostRow, cases, measure_ghosts
from tools.pages.markdown import table

RECORD: Final = "ghosts.json"
"""File with the numbers of the table, in the folder of the pages."""

_HEAD: Final = (
    "varied",
    "waveform",
    "its point in the map, closed form",
    "or a cross-pairing ridge of it",
    "P(direct ghost), measured",
    "95 % interval",
    "due",
    "lost",
    "extra",
    "of those, on ridges",
    "P(any ghost)",
    "ghosts in a frame",
    "targets found",
)

_LABELS: Final = {
    "start": ("starts within {:g} µs", 1e6),
    "clock": ("clocks within ±{:g} ppm", 1e6),
    "slope": ("slopes apart by {:g}", 1.0),
    "number": ("{:g} of 4 cars transmit", 1.0),
}


def ghost_table(folder: Path) -> str:
    """One row for every case."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    return table(_HEAD, [_cells(row) for row in record])


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    text, scale = _LABELS[row["axis"]]
    direct = row["direct"]
    return (
        text.format(float(f"{scale * row['value']:.3g}")),
        row["waveform"],
        f"{row['theory']:.3f}",
        f"{row['theory_of_ridges']:.3f}",
        f"{direct['value']:.3f}",
        f"{direct['low']:.2f}…{direct['high']:.2f}",
        f"{row['predicted']} of {row['num_trials']}",
        str(row["lost"]),
        str(row["extra"]),
        str(row["ridges"]),
        f"{row['any_ghost']['value']:.2f}",
        f"{row['ghosts']['value']:.1f}",
        f"{100 * row['detection']['value']:.0f} %",
    )


def as_record(rows: Iterable[GhostRow]) -> list[dict[str, Any]]:
    """Rows of the record, rounded to four decimals."""

    def plain(value: Any) -> Any:
        return round(value, 4) if isinstance(value, float) else value

    record = []
    for row in rows:
        entry = {name: plain(value) for name, value in asdict(row).items()}
        entry["value"] = row.value
        for name, value in entry.items():
            if isinstance(getattr(row, name), Estimate):
                entry[name] = {limit: plain(number) for limit, number in value.items()}
        record.append(entry)
    return record


if __name__ == "__main__":
    workers = LocalWorkers(count=os.cpu_count() or 1)
    content = as_record(measure_ghosts(cases(), executor=workers))
    text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    Path(sys.argv[1]).write_text(text, encoding="utf-8")
