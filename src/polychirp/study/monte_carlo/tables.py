"""Results of a study of many trials as tables: CSV, and Parquet too if pyarrow is installed.

Units are SI; SINR and floor rise are power ratios.
"""

import csv
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, fields
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np

from polychirp.scoring.statistics import Estimate
from polychirp.study.csv_cells import safe_cell
from polychirp.study.monte_carlo.grid import Label
from polychirp.study.monte_carlo.records import NATURES, TRIALS_ARE_KEPT, write_errors
from polychirp.study.monte_carlo.results import Results
from polychirp.study.monte_carlo.summary import Difference, Summary, differences, summaries

Row = Mapping[str, Label | None]

UNIT_SUFFIXES: Final[Mapping[str, str]] = {
    "range_rmse": "_m",
    "range_rate_rmse": "_m_per_s",
    "azimuth_rmse": "_rad",
    "elevation_rmse": "_rad",
}
"""Endings that columns of `Summary` and `Difference` get in tables; others are ratios."""


FILES: Final = (
    "provenance.json",
    *(
        f"{table}.{end}"
        for table in ("summary", "differences", "victims", "targets")
        for end in ("csv", "parquet")
    ),
)
"""Names of the files that `save_tables` writes; those of Parquet if pyarrow is installed."""


def save_tables(folder: Path, results: Results) -> list[str]:
    """Write all tables, and return the names of the files.

    A point is one combination of values on the axes of the study's grid. ``summary`` has a row for
    each point and victim. ``differences`` has one for each victim and each pair of points of which
    one has the first value of an axis, the other has another value, and all else is equal.
    ``victims`` has one for each victim of each trial, ``targets`` one for each target of these.
    ``provenance.json`` holds the study, its hash, versions and platform. A file that cannot be
    written completely keeps its former content. `RunError` is raised if a table cannot be written.
    """
    tables: dict[str, list[Row]] = {
        "summary": [flat_row(row, results) for row in summaries(results)],
        "differences": [flat_row(row, results) for row in differences(results)],
        "victims": list(_victim_rows(results)),
        "targets": list(_target_rows(results)),
    }
    origin = json.dumps(asdict(results.origin), indent=2, ensure_ascii=False, sort_keys=True)
    writers: dict[str, Callable[[Path], None]] = {
        "provenance.json": partial(_write_text, text=f"{origin}\n")
    }
    for name, rows in tables.items():
        writers[f"{name}.csv"] = partial(_write_csv, rows=rows)
        if find_spec("pyarrow") is not None:
            writers[f"{name}.parquet"] = partial(_write_parquet, rows=rows, provenance=origin)
    for name, write in writers.items():
        _write_whole(folder / name, write)
    return list(writers)


def _write_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Write a file under a temporary name, then rename it, so that no reader finds half a file."""
    unfinished = path.with_name(f"{path.name}.unfinished")
    try:
        with write_errors(path, advice=TRIALS_ARE_KEPT):
            write(unfinished)
            unfinished.replace(path)
    finally:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)


def flat_row(estimates: Summary | Difference, results: Results) -> Row:
    """A summary or difference as one flat row; NaN becomes None."""
    return {**_point(estimates.labels, results), **_flat(estimates)}


def _point(labels: Iterable[Label], results: Results) -> dict[str, Label | None]:
    return dict(zip((name for name, _ in results.axes), labels, strict=True))


def _flat(row: Summary | Difference) -> dict[str, Label | None]:
    flat: dict[str, Label | None] = {}
    for field in fields(row):
        value = getattr(row, field.name)
        name = f"{field.name}{UNIT_SUFFIXES.get(field.name, '')}"
        if isinstance(value, Estimate):
            flat[name] = _known(value.value)
            flat[f"{name}_low"] = _known(value.low)
            flat[f"{name}_high"] = _known(value.high)
        elif field.name != "labels":
            flat[name] = _known(value)
    return flat


def _known(value: Any) -> Label | None:
    return None if isinstance(value, float) and math.isnan(value) else value


def _trials(results: Results) -> Iterator[tuple[tuple[int, int, int], dict[str, Label | None]]]:
    """Indices (point, trial, victim) and first columns of each victim of each finished trial."""
    was_run = ~np.isnan(results.num_detections[..., 0])
    for point, trial, victim in np.argwhere(was_run).tolist():
        yield (
            (point, trial, victim),
            {
                **_point(results.labels(point), results),
                "trial": trial,
                "seed": int(results.seed[trial]),
                "victim": results.victim[victim],
            },
        )


def _victim_rows(results: Results) -> Iterator[Row]:
    for place, row in _trials(results):
        counts = results.num_detections[place].astype(int).tolist()
        detected = results.detected[place]
        yield {
            **row,
            "in_sight": int(np.sum(~np.isnan(detected))),
            "found": int(np.nansum(detected)),
            "missed": int(np.sum(detected == 0.0)),
            "detections": sum(counts),
            **{f"detections_{name}": n for name, n in zip(NATURES, counts, strict=True)},
            "unresolved": int(results.num_unresolved[place]),
            "floor_rise": _known(float(results.floor_rise[place])),
        }


def _target_rows(results: Results) -> Iterator[Row]:
    columns = {
        "range_m": results.range,
        "range_rate_m_per_s": results.range_rate,
        "azimuth_rad": results.azimuth,
        "elevation_rad": results.elevation,
        "range_error_m": results.range_error,
        "range_rate_error_m_per_s": results.range_rate_error,
        "azimuth_error_rad": results.azimuth_error,
        "elevation_error_rad": results.elevation_error,
        "detection_sinr": results.detection_sinr,
        "snr": results.snr,
        "inr": results.inr,
        "sinr": results.snr / (1.0 + results.inr),
        "mitigated_sinr": results.mitigated_sinr,
        "num_points": results.num_points,
        "length_m": results.length,
        "width_m": results.width,
        "range_rate_span_m_per_s": results.range_rate_span,
        "visible_length_m": results.visible_length,
        "visible_width_m": results.visible_width,
        "visible_range_rate_span_m_per_s": results.visible_range_rate_span,
    }
    for place, row in _trials(results):
        for number, name in enumerate(results.target):
            if not math.isnan(results.range[(*place, number)]):
                detected = _known(float(results.detected[(*place, number)]))
                yield {
                    **row,
                    "target": name,
                    "detected": None if detected is None else int(detected),
                    **{
                        key: _known(float(values[(*place, number)]))
                        for key, values in columns.items()
                    },
                }


def _write_text(path: Path, *, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _write_csv(path: Path, *, rows: list[Row]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if rows:
            writer.writerow(rows[0])
        writer.writerows([safe_cell(value) for value in row.values()] for row in rows)


def _write_parquet(path: Path, *, rows: list[Row], provenance: str) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    table = pa.Table.from_pylist([dict(row) for row in rows])
    parquet.write_table(table.replace_schema_metadata({"provenance": provenance}), path)
