"""Figures 12 and 13 on three channels, as a table for docs/validation.

``python -m tools.pages.statistics_table FILE`` runs some trials with vehicles of a few points each
and stores the results as JSON. Points and ray-traced vehicles are the stored ones of
`polychirp paper`.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from polychirp.study.monte_carlo.executor import LocalWorkers
from polychirp.study.paper.results import StatisticsRow
from polychirp.study.paper.statistics import Channel, run_statistics, statistics_plan
from polychirp.study.paper.stored_statistics import read_statistics
from polychirp.threads import num_cores
from tools.pages.markdown import table

RECORD: Final = "statistics.json"
"""File with the numbers of the table, in the folder of the pages."""

NUM_TARGETS: Final = (1, 4, 10)
"""Numbers of targets in the table, of points and of vehicles of a few points."""

TRIALS: Final = 20
"""Trials of each point with vehicles of a few points; chosen: some minutes on two cores."""

_HEAD: Final = (
    "channel",
    "waveform",
    "situation",
    "targets",
    "trials",
    "Pd",
    "ghosts in a frame",
    "range, m",
    "azimuth, °",
    "speed, km/h",
    "floor, dB",
)


def statistics_table(folder: Path) -> str:
    """One line for every channel, waveform, situation and number of targets."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    points = [row for row in read_statistics().rows if _is_shown(row)]
    traced = written(read_statistics("vehicles").rows, "vehicles")
    return table(_HEAD, [_cells(row) for row in written(points, "points") + record + traced])


def _is_shown(row: StatisticsRow) -> bool:
    return row.num_targets in NUM_TARGETS


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    return (
        row["channel"],
        row["waveform"],
        row["situation"],
        str(row["num_targets"]),
        str(row["num_trials"]),
        _within(row["detection"], ".2f"),
        _within(row["ghosts"], ".1f"),
        *(
            _within(row[name], ".2g")
            for name in ("range_rmse_m", "azimuth_rmse_deg", "speed_rmse_kmh")
        ),
        f"{row['floor_rise_db']:.1f}",
    )


def _within(interval: list[float], digits: str) -> str:
    value, low, high = (format(number, digits) for number in interval)
    return f"{value} ({low}…{high})"


def written(rows: Iterable[StatisticsRow], channel: Channel) -> list[dict[str, Any]]:
    """Rows of the record, to five digits."""
    return [
        {"channel": channel, **{key: _rounded(value) for key, value in asdict(row).items()}}
        for row in rows
    ]


def _rounded(value: object) -> object:
    if isinstance(value, float):
        return float(f"{value:.5g}")
    return [_rounded(part) for part in value] if isinstance(value, tuple) else value


def record() -> list[dict[str, Any]]:
    """Rows with vehicles of a few points."""
    plan = statistics_plan("point-vehicles", trials=TRIALS, num_targets=NUM_TARGETS)
    with tempfile.TemporaryDirectory() as folder:
        rows = run_statistics(plan, folder=Path(folder), executor=LocalWorkers(count=num_cores()))
    return written(rows, "point-vehicles")


if __name__ == "__main__":
    text = json.dumps(record(), indent=1, ensure_ascii=False) + "\n"
    Path(sys.argv[1]).write_text(text, encoding="utf-8")
