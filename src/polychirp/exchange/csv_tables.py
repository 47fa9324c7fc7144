"""Tables as CSV files, one folder for each victim."""

import csv
from pathlib import Path
from typing import Any

import numpy as np

from polychirp.exchange.columns import tables_of
from polychirp.study.csv_cells import safe_cell
from polychirp.study.store.load import StoredRun


def write_csv(run: StoredRun, folder: Path) -> list[Path]:
    """Write ``victim-0/detections.csv`` and so on, and return their paths.

    Numbers are in SI and have all their digits. A name that a spreadsheet takes for a formula gets
    an apostrophe before it. Samples are not written: they would be large.
    """
    written = []
    for number, victim in enumerate(run.victims):
        inner = folder / f"victim-{number}"
        inner.mkdir(parents=True, exist_ok=True)
        for name, table in tables_of(victim).items():
            path = inner / f"{name}.csv"
            with path.open("w", encoding="utf-8", newline="") as file:
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow(table)
                columns = [np.asarray(values).tolist() for values in table.values()]
                writer.writerows(
                    [_cell(value) for value in row] for row in zip(*columns, strict=True)
                )
            written.append(path)
    return written


def _cell(value: Any) -> str:
    return str(int(value)) if isinstance(value, bool) else str(safe_cell(value))
