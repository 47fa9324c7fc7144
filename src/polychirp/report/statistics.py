"""Figures 12 and 13 as a table: one line for every curve and number of targets."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from polychirp.report.words import WAVEFORM, decimal
from polychirp.study.paper.results import PAPER_ACCURACY, PAPER_TARGETS, Interval, StatisticsRow

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


_ERRORS: Final = {
    "range_rmse_m": ("range", "m", "range_median_m"),
    "azimuth_rmse_deg": ("azimuth", "°", "azimuth_median_deg"),
    "speed_rmse_kmh": ("speed", "km/h", "speed_median_kmh"),
}
"""Fields of rms errors: in words, their unit, and the field of the median."""

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
"""For a terminal: errors are rms, and medians in brackets."""


def brief_rows(rows: Iterable[StatisticsRow]) -> Iterator[tuple[str, ...]]:
    """Cells under `BRIEF_HEAD`."""
    for row in rows:
        yield (
            f"{row.waveform}, {row.situation}",
            str(row.num_targets),
            within(row.detection, 2),
            within(row.ghosts, 1),
            *(
                f"{getattr(row, field)[0]:.1g} ({getattr(row, median):.1g})"
                for field, (_, _, median) in _ERRORS.items()
            ),
            decimal(row.floor_rise_db, 1),
        )


def findings(rows: Sequence[StatisticsRow]) -> list[str]:
    """What the curves say of the paper's claims, in sentences; none where rows are missing."""
    at = {(row.waveform, row.situation): row for row in rows if row.num_targets == PAPER_TARGETS}
    if not {("conventional", "interfered"), ("diverse", "interfered")} <= at.keys():
        return []
    conventional, diverse = at["conventional", "interfered"], at["diverse", "interfered"]
    errors = "; ".join(
        f"{name} {getattr(diverse, field)[0]:.2g} {unit} rms (median "
        f"{getattr(diverse, median):.2g}), {_beside(diverse, field)} the paper's "
        f"{PAPER_ACCURACY[field]:g} {unit}"
        for field, (name, unit, median) in _ERRORS.items()
    )
    found = [
        f"Diverse, {PAPER_TARGETS} points and two interferers: {errors}. Where rms and median are "
        "far apart, points that share a cell of range and speed make the difference. Points have "
        "one place; bodies have many, and their errors are those of the place that reflects.",
        f"Interferers in step leave the conventional waveform a detection probability of "
        f"{within(conventional.detection, 2)} with {within(conventional.ghosts, 1)} ghosts in a "
        f"frame, the diverse one {within(diverse.detection, 2)} with {within(diverse.ghosts, 1)}. "
        "That is the paper's figure 12, and it needs radars in step with equal slopes.",
        f"Diversity alone leaves a floor {diverse.floor_rise_db:.0f} dB above the noise, under "
        "which weak targets are masked; these targets stand above it.",
    ]
    if ("diverse", "blanked") in at:
        blanked = at["diverse", "blanked"]
        found.append(f"Blanking takes that floor down to {blanked.floor_rise_db:.1f} dB.")
    return found


def _beside(row: StatisticsRow, field: str) -> str:
    """How an error compares, as far as its interval tells."""
    _, low, high = getattr(row, field)
    if high < PAPER_ACCURACY[field]:
        return "below"
    return "above" if low > PAPER_ACCURACY[field] else "not told from"


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
