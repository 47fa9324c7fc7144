"""Wording and formats of numbers that tables, figures and pages share."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from polychirp.study.paper.results import (
    Mitigation,
    PaperClaim,
    PaperRow,
    Scenario,
    TargetRow,
    WaveformKind,
)

SCENARIO_WORDS: Final[dict[Scenario, str]] = {
    "A": "no interference",
    "B": "indirect interference",
    "C": "direct interference",
    "all": "all four radars on",
}
WAVEFORM_WORDS: Final[dict[WaveformKind, str]] = {
    "conventional": "conventional",
    "diverse": "diverse (the proposal)",
    "fixed-per-radar": "fixed slope, different for each radar",
}
MITIGATION_WORDS: Final[dict[Mitigation, str]] = {"none": "no mitigation", "blanking": "blanking"}


def timing(row: PaperRow) -> str:
    """Relation between the start times of a row's radars, in words."""
    return "starting together" if row.synchronous else "random starts"


def distinct(rows: Iterable[PaperRow]) -> list[PaperRow]:
    """Rows without those that repeat another one: in scenario A no interferer starts."""
    return [row for row in rows if row.scenario != "A" or row.synchronous]


def variant_name(row: PaperRow) -> str:
    """Full name of a row's case; the timing is left out where nothing interferes."""
    parts = [
        f"{row.scenario}: {SCENARIO_WORDS[row.scenario]}",
        row.radar,
        WAVEFORM_WORDS[row.waveform],
    ]
    if row.scenario != "A":
        parts.append(timing(row))
    if row.mitigation != "none":
        parts.append(MITIGATION_WORDS[row.mitigation])
    return " · ".join(parts)


def figure_name(claim: PaperClaim) -> str:
    """Name of the figure of the row that is compared with a claim.

    >>> from polychirp.study.paper.results import paper_claims
    >>> figure_name(paper_claims(radar_1="v1", radar_2="v2")[0])
    'fig09a'
    """
    return f"fig{claim.figure:0>3}"


def target_words(target: TargetRow) -> str:
    """A found target with the range at which it was found.

    >>> target_words(TargetRow(name="car", range_m=6.5, closing_speed_mps=0.0, azimuth_deg=0.0,
    ...     detected=True, range_error_m=0.02))
    'car: 6.52 m'
    """
    return f"{target.name}: {decimal(target.range_m + (target.range_error_m or 0.0))} m"


def decimal(value: float | None, digits: int = 2, *, signed: bool = False) -> str:
    """A number with ``digits`` decimals, or a dash for None and NaN.

    >>> decimal(None), decimal(6.499), decimal(-0.004), decimal(0.12, signed=True)
    ('–', '6.50', '0.00', '+0.12')
    """
    if value is None or value != value:  # noqa: PLR0124  # NaN differs from itself
        return "–"
    rounded = round(value, digits) + 0.0  # no minus before a zero
    return f"{rounded:{'+' if signed and rounded else ''}.{digits}f}".replace("-", "−")


def finite(value: Any) -> Any:
    """The same value with plain Python numbers, and None for NaN and infinity."""
    if isinstance(value, Mapping):
        return {str(key): finite(inner) for key, inner in value.items()}
    if isinstance(value, str) or value is None:
        return value
    if isinstance(value, Sequence):
        return [finite(inner) for inner in value]
    if hasattr(value, "item"):  # a NumPy number
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
