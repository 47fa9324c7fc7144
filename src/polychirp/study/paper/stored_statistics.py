"""The stored points of figures 12 and 13: 60 to 300 trials each, which take hours to run.

``./run validation fig12-13`` and ``./run validation fig12-13-traced`` write the files beside this
module: points in free space, and ray-traced vehicles on a street with buildings.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, fields
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, Literal

from polychirp.study.paper.results import Interval, StatisticsRow, StoredStatistics

StoredChannel = Literal["points", "vehicles"]
"""Channels of `paper.statistics` whose points are stored."""

STORED: Final[dict[StoredChannel, str]] = {
    "points": "statistics.json",
    "vehicles": "traced_statistics.json",
}
"""Names of the files, in this package."""

_INTERVALS: Final = tuple(
    field.name for field in fields(StatisticsRow) if "Interval" in str(field.type)
)
"""Fields of a row that hold a value and the limits of its interval."""


def read_statistics(channel: StoredChannel = "points") -> StoredStatistics:
    """The points of one channel that this package holds.

    >>> sorted({row.num_targets for row in read_statistics().rows})
    [1, 4, 7, 10]
    """
    file = files("polychirp.study.paper").joinpath(STORED[channel])
    return statistics_from(file.read_text(encoding="utf-8"))


def statistics_from(text: str) -> StoredStatistics:
    """The points of a file's text."""
    found = json.loads(text)
    return StoredStatistics(**(found | {"rows": tuple(map(_row, found["rows"]))}))


def write_statistics(stored: StoredStatistics, file: Path) -> None:
    """Write points to a file, with five digits."""
    text = json.dumps(_rounded(asdict(stored)), indent=1, ensure_ascii=False)
    file.write_text(text + "\n", encoding="utf-8")


def _row(record: dict[str, Any]) -> StatisticsRow:
    intervals = {name: _interval(record[name]) for name in _INTERVALS}
    return StatisticsRow(**(record | intervals))


def _interval(numbers: Sequence[float] | None) -> Interval | None:
    if numbers is None:
        return None
    value, low, high = numbers
    return value, low, high


def _rounded(value: Any) -> Any:
    """The same with numbers of five digits."""
    if isinstance(value, dict):
        return {name: _rounded(part) for name, part in value.items()}
    if isinstance(value, tuple | list):
        return [_rounded(part) for part in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value
