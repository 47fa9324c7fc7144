"""Figures 12 and 13 as a table: one line for every curve and number of targets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from polychirp.report.words import WAVEFORM, decimal
from polychirp.study.paper_results import PAPER_ACCURACY, PAPER_TARGETS, Interval, StatisticsRow

SITUATION: Final = {
    "alone": "alone",
    "interfered": "two interferers in step",
    "blanked": "two interferers in step, blanked",
}

STATISTICS_HEAD: Final = (
    "Waveform",
    "Situation",
    "Targets",
    "Trials",
    "Pd",
    "Ghosts in a frame",
    "False claims",
    "Range error (m)",
    "Azimuth error (°)",
    "Speed error (km/h)",
    "Floor rise (dB)",
)

STATISTICS_NOTE: Final = (
    f"The paper reads {PAPER_ACCURACY['range_rmse_m']} m, {PAPER_ACCURACY['azimuth_rmse_deg']}° "
    f"and {PAPER_ACCURACY['speed_rmse_kmh']} km/h at {PAPER_TARGETS} targets. Errors are rms, of "
    "targets found; ghosts are claims where nothing is, false claims those that nothing explains. "
    "Targets are isotropic scatterers of 10 m², all in sight; polychirp study runs the same on "
    "ray-traced bodies."
)


def statistics_rows(rows: Iterable[StatisticsRow]) -> Iterator[tuple[str, ...]]:
    """Cells under `STATISTICS_HEAD`."""
    for row in rows:
        yield (
            WAVEFORM[row.waveform],
            SITUATION[row.situation],
            str(row.num_targets),
            str(row.num_trials),
            within(row.detection, 3),
            within(row.ghosts, 2),
            within(row.false_claims, 2),
            *(short(value) for value in (row.range_rmse_m, row.azimuth_rmse_deg)),
            short(row.speed_rmse_kmh),
            decimal(row.floor_rise_db, 1),
        )


BRIEF_HEAD: Final = (
    "Waveform, situation",
    "Targets",
    "Pd",
    "Ghosts",
    "Range (m)",
    "Azimuth (°)",
    "Speed (km/h)",
    "Floor (dB)",
)
"""For a terminal: errors without their limits."""


def brief_rows(rows: Iterable[StatisticsRow]) -> Iterator[tuple[str, ...]]:
    """Cells under `BRIEF_HEAD`."""
    for row in rows:
        yield (
            f"{row.waveform}, {row.situation}",
            str(row.num_targets),
            within(row.detection, 2),
            within(row.ghosts, 1),
            *(f"{error[0]:.2g}" for error in (row.range_rmse_m, row.azimuth_rmse_deg)),
            f"{row.speed_rmse_kmh[0]:.2g}",
            decimal(row.floor_rise_db, 1),
        )


def within(interval: Interval, digits: int) -> str:
    """A value and its limits.

    >>> within((0.95, 0.871, 0.98), 2)
    '0.95 (0.87…0.98)'
    """
    value, low, high = (f"{number:.{digits}f}" for number in interval)
    return f"{value} ({low}…{high})"


def short(interval: Interval) -> str:
    """A value and its limits to two digits, however small.

    >>> short((0.000123, 0.00011, 0.2))
    '0.00012 (0.00011…0.2)'
    """
    value, low, high = (f"{number:.2g}" for number in interval)
    return f"{value} ({low}…{high})"
