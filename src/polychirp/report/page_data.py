"""The numbers that the scripts of a page draw: range profiles, range-rate maps and their marks."""

import base64
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.report.figures.detections_plan import MARKS
from polychirp.report.figures.range_profile import MAX_RANGE
from polychirp.study.paper.results import PaperRow, RowMap

LEVEL_STEP_DB: Final = 0.5
"""Difference between neighbouring levels of a map, dB; chosen: a byte per cell then covers 127 dB,
and the eye does not tell neighbouring colours apart."""


def rows_data(rows: Iterable[PaperRow]) -> list[dict[str, Any]]:
    """Values for JSON of all rows that have a map, without repetitions.

    Rows without interference are the same for all starts, and only those of common starts are kept.
    """
    shown = [row for row in rows if row.scenario != "A" or row.synchronous]
    return [_row(row, row.map) for row in shown if row.map is not None]


def row_key(row: PaperRow) -> str:
    """Name of a row in the page; the values of the explorer's controls make the same.

    Rows without interference have no start.
    """
    start = "together" if row.synchronous else "random"
    parts = (row.scenario, row.radar, row.waveform, row.mitigation)
    return "|".join(parts if row.scenario == "A" else (*parts, start))


def _row(row: PaperRow, map_: RowMap) -> dict[str, Any]:
    inside = (row.profile_range >= 0.0) & (row.profile_range <= MAX_RANGE)
    return {
        "key": row_key(row),
        "reach": MAX_RANGE,
        "floor_rise": tenths(row.floor_rise_db),
        "noise": tenths(row.noise_floor_db),
        "profile": {
            "range": rounded(row.profile_range[inside], 3),
            "power": rounded(row.profile_power_db[inside], 1),
        },
        "targets": [
            {
                "name": target.name,
                **ranges(range_, target.range_m),
                "speed": round(-float(rate), 2),
                "found": target.detected,
            }
            for target, range_, rate in zip(
                row.targets, map_.target_range, map_.target_range_rate, strict=True
            )
        ],
        "marks": detection_marks(
            range_=map_.detection_range,
            in_profile=row.detection_range,
            range_rate=map_.detection_range_rate,
            power_db=map_.detection_power_db,
            causes=map_.detection_cause,
            origins=map_.detection_origin,
        ),
        "map": map_data(range_=map_.range, range_rate=map_.range_rate, power_db=map_.power_db),
    }


def detection_marks(
    *,
    range_: FloatArray,
    range_rate: FloatArray,
    power_db: FloatArray,
    causes: Sequence[str],
    origins: Sequence[str],
    folded: FloatArray | None = None,
    in_profile: FloatArray | None = None,
) -> list[dict[str, Any]]:
    """Detections as values for JSON; a script draws them by their ``cause``, a key of `causes`.

    ``folded`` are the range rates at which they are in the map, and ``in_profile`` the ranges at
    which they are in the profile, where it is that of another instant than the map; by default both
    are their own.
    """
    return [
        {
            **ranges(r, other),
            **speeds(rate, place),
            "power": tenths(float(power)),
            "cause": cause,
            "origin": origin,
        }
        for r, other, rate, place, power, cause, origin in zip(
            range_,
            range_ if in_profile is None else in_profile,
            range_rate,
            range_rate if folded is None else folded,
            power_db,
            causes,
            origins,
            strict=True,
        )
    ]


def ranges(in_map: float, in_profile: float) -> dict[str, float]:
    """Range in a map as a value for JSON, and that in a profile of another instant.

    >>> ranges(13.18, 13.18), ranges(13.18, 13.65)
    ({'range': 13.18}, {'range': 13.18, 'profile_range': 13.65})
    """
    own = {"range": round(float(in_map), 2)}
    return own if in_profile == in_map else {**own, "profile_range": round(float(in_profile), 2)}


def speeds(range_rate: float, folded: float) -> dict[str, float]:
    """Closing speed as a value for JSON, and that at which it is ``folded`` into a map, if another.

    >>> speeds(-3.0, -3.0), speeds(-15.2, 1.3)
    ({'speed': 3.0}, {'speed': 15.2, 'folded': -1.3})
    """
    own = {"speed": round(-float(range_rate), 2)}
    return own if folded == range_rate else {**own, "folded": round(-float(folded), 2)}


def map_data(*, range_: FloatArray, range_rate: FloatArray, power_db: FloatArray) -> dict[str, Any]:
    """A map as values for JSON: its axes, and a byte for each cell in `LEVEL_STEP_DB`.

    Closing speeds grow from row to row of ``cells``, which are bytes in base 64: level
    ``low + step · byte`` in dBm. Cells that are more than 127 dB below the strongest have ``low``.
    The colours begin at ``floor``, the median.
    """
    power = power_db[::-1]
    low = math.floor(float(power.max())) + 1.0 - 255 * LEVEL_STEP_DB
    steps = np.clip(np.rint((power - low) / LEVEL_STEP_DB), 0, 255).astype(np.uint8)
    return {
        "range": [round(float(range_[0]), 3), round(float(range_[-1]), 3)],
        "speed": [round(-float(range_rate[-1]), 3), round(-float(range_rate[0]), 3)],
        "shape": list(steps.shape),
        "low": low,
        "step": LEVEL_STEP_DB,
        "floor": tenths(float(np.median(power))),
        "top": tenths(float(np.quantile(power, 0.9995))),
        "cells": base64.b64encode(steps.tobytes()).decode("ascii"),
    }


def causes() -> Mapping[str, Mapping[str, str]]:
    """Label, colour and shape of the mark of every cause of a detection."""
    return {
        cause: {"label": label, "colour": colour, "shape": marker}
        for cause, (marker, colour, label) in MARKS.items()
    }


def rounded(values: FloatArray, digits: int) -> list[float]:
    """Values with ``digits`` decimals; NaN and infinity are not allowed."""
    return [round(float(value), digits) for value in values]


def tenths(value: float) -> float | None:
    """A value with one decimal; None for NaN and infinity, as JSON has neither."""
    return round(value, 1) if math.isfinite(value) else None
