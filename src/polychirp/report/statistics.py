"""The paper's figures 12 and 13 as tables: one row per curve and number of targets."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from polychirp.report.words import WAVEFORM_WORDS, decimal
from polychirp.study.paper.results import (
    PAPER_ACCURACY,
    PAPER_TARGETS,
    Interval,
    PaperResults,
    Situation,
    StatisticsRow,
    StoredStatistics,
    WaveformKind,
)

SITUATION_WORDS: Final[dict[Situation, str]] = {
    "alone": "alone",
    "interfered": "two interferers starting together",
    "blanked": "two interferers starting together, blanked",
}

_BRIEF_WORDS: Final[dict[Situation, str]] = {
    "alone": "without interferers",
    "interfered": "beside two that start together",
    "blanked": "beside these with blanking",
}

STATISTICS_HEAD: Final = (
    "Waveform",
    "Situation",
    "Targets",
    "Trials",
    "Pd",
    "Ghosts in a frame",
    "Unexplained detections",
    "Range error (m)",
    "Azimuth error (°)",
    "Speed error (km/h)",
    "Floor rise (dB)",
)

STATISTICS_NOTE: Final = (
    f"The paper reports {PAPER_ACCURACY['range_rmse_m']} m, {PAPER_ACCURACY['azimuth_rmse_deg']}° "
    f"and {PAPER_ACCURACY['speed_rmse_kmh']} km/h at {PAPER_TARGETS} targets. Errors are rms errors"
    " of the targets found. Ghosts are detections where there is no body; unexplained detections "
    "are those ghosts that neither interference nor a mirror explains. Targets of this run are "
    "isotropic scatterers of 10 m², all visible; polychirp study runs the same on traced bodies."
)


def shown_statistics(results: PaperResults) -> Sequence[StatisticsRow]:
    """Points of figures 12 and 13: the stored ones, and those of the run that are not stored.

    The curves are those of the stored points alone, whose intervals are narrow.
    """
    stored = () if results.stored is None else results.stored.rows
    places = {(row.waveform, row.situation, row.num_targets) for row in stored}
    return stored + tuple(
        row
        for row in results.statistics
        if (row.waveform, row.situation, row.num_targets) not in places
    )


def origin(stored: StoredStatistics) -> str:
    """A sentence that says where stored points come from."""
    more = " or more" if any(row.num_trials > stored.num_trials for row in stored.rows) else ""
    return (
        f"Points of {stored.num_trials} trials{more} are stored results: polychirp "
        f"{stored.version} computed them on {stored.measured} with seed {stored.seed}."
    )


def statistics_rows(rows: Iterable[StatisticsRow]) -> Iterator[tuple[str, ...]]:
    """Table rows under `STATISTICS_HEAD`."""
    for row in rows:
        yield (
            WAVEFORM_WORDS[row.waveform],
            SITUATION_WORDS[row.situation],
            str(row.num_targets),
            str(row.num_trials),
            within(row.detection, 3),
            within(row.ghosts, 2),
            within(row.unexplained, 2),
            *(short(value) for value in (row.range_rmse_m, row.azimuth_rmse_deg)),
            short(row.speed_rmse_kmh),
            decimal(row.floor_rise_db, 1),
        )


_ERRORS: Final = {
    "range_rmse_m": ("range", "m", "range_median_m"),
    "azimuth_rmse_deg": ("azimuth", "°", "azimuth_median_deg"),
    "speed_rmse_kmh": ("speed", "km/h", "speed_median_kmh"),
}
"""Fields of rms errors: the quantity in words, its unit, and the field of the median."""

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
"""Columns for a terminal: errors are rms, with medians in brackets."""


def brief_rows(rows: Iterable[StatisticsRow]) -> Iterator[tuple[str, ...]]:
    """Table rows under `BRIEF_HEAD`."""
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
    """Sentences that compare the curves with the paper's claims; none if rows are missing."""
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
        f"Diverse waveform, {PAPER_TARGETS} points and two interferers: {errors}. Where "
        "the rms error is much larger than the median, a few points that share a cell of range and "
        "speed cause it. A point reflects at one place; a body reflects at many, and its "
        "error depends on which of them reflects.",
        "With two interferers that start together with the victim, the detection probability is "
        f"{within(conventional.detection, 3)} with {within(conventional.ghosts, 1)} ghosts in a "
        f"frame if all slopes are equal ({conventional.unexplained[0]:.1f} unexplained), and "
        f"{within(diverse.detection, 3)} with {within(diverse.ghosts, 1)} if the waveform is "
        f"diverse ({diverse.unexplained[0]:.1f} unexplained). The paper's figure 12 shows this "
        "case; it needs radars that start together and have equal slopes.",
        "With diverse slopes and no mitigation, interference raises the floor of the range spectra "
        f"by {diverse.floor_rise_db:.0f} dB, from that of noise alone. This masks weak targets; "
        "the targets here are stronger.",
    ]
    if diverse.detection_gain is not None and diverse.ghosts_gain is not None:
        found.append(
            "Both waveforms were tried on the same streets with the same noise. The difference of "
            f"detection probability is {within(diverse.detection_gain, 3)}, and that of ghosts in "
            f"a frame {within(diverse.ghosts_gain, 1)}, diverse minus conventional; "
            f"{_decided(diverse.detection_gain)}."
        )
    if ("diverse", "blanked") in at:
        blanked = at["diverse", "blanked"]
        found.append(f"With blanking, it raises the floor by {blanked.floor_rise_db:.1f} dB.")
    return found


def traced_findings(rows: Sequence[StatisticsRow]) -> list[str]:
    """Sentences about ray-traced vehicles at the greatest number of targets that rows have."""
    most = max(row.num_targets for row in rows)
    at = {(row.waveform, row.situation): row for row in rows if row.num_targets == most}

    def found(waveform: WaveformKind) -> str:
        return ", ".join(
            f"{within(at[waveform, situation].detection, 3)} {words}"
            for situation, words in _BRIEF_WORDS.items()
            if (waveform, situation) in at
        )

    diverse = at["diverse", "interfered"]
    return [
        f"Of {most} vehicles in sight, these shares are found. Equal slopes: "
        f"{found('conventional')}. Diverse slopes: {found('diverse')}.",
        "Errors beside interferers with diverse slopes are "
        + ", ".join(
            f"{short(getattr(diverse, field))} {unit} rms in {name}"
            for field, (name, unit, _) in _ERRORS.items()
        )
        + ": a body reflects from its strongest place, not from its nearest metal.",
        f"A frame has {within(at['diverse', 'alone'].ghosts, 0)} ghosts of its own signal with "
        f"diverse slopes, and {within(at['conventional', 'alone'].ghosts, 0)} with equal ones: "
        "echoes by way of the road and the buildings.",
    ]


def _decided(difference: Interval) -> str:
    """Meaning of a paired difference of detection probabilities, in words."""
    _, low, high = difference
    if low > 0:
        return "diverse slopes detect more targets"
    if high < 0:
        return "diverse slopes detect fewer targets"
    return "the trials do not decide which waveform detects more targets"


def _beside(row: StatisticsRow, field: str) -> str:
    """Relation of an error's whole interval to the paper's error, in words."""
    _, low, high = getattr(row, field)
    if high < PAPER_ACCURACY[field]:
        return "below"
    return "above" if low > PAPER_ACCURACY[field] else "not significantly different from"


def within(interval: Interval, digits: int) -> str:
    """A value and the limits of its interval, with ``digits`` decimals.

    >>> within((0.95, 0.871, 0.98), 2)
    '0.95 (0.87…0.98)'
    """
    return _with_limits(*(decimal(number, digits) for number in interval))


def short(interval: Interval) -> str:
    """A value and the limits of its interval, to two significant digits.

    >>> short((0.000123, 0.00011, 0.2))
    '0.00012 (0.00011…0.2)'
    >>> short((0.00012, math.nan, math.nan))
    '0.00012'
    """
    return _with_limits(*("–" if math.isnan(number) else f"{number:.2g}" for number in interval))


def _with_limits(value: str, low: str, high: str) -> str:
    """The value alone if its limits are unknown, as those of a single trial are."""
    return value if (low, high) == ("–", "–") else f"{value} ({low}…{high})"
