"""Words for what the tables, figures and pages show, each said in one way."""

from __future__ import annotations

from typing import Final

from polychirp.study.paper.results import (
    Mitigation,
    PaperClaim,
    PaperRow,
    Scenario,
    TargetRow,
    WaveformKind,
)

SCENARIO: Final[dict[Scenario, str]] = {
    "A": "no interference",
    "B": "indirect interference",
    "C": "direct interference",
    "all": "all four radars on",
}
WAVEFORM: Final[dict[WaveformKind, str]] = {
    "conventional": "conventional",
    "diverse": "diverse (the proposal)",
    "fixed-per-radar": "fixed, different per radar",
}
MITIGATION: Final[dict[Mitigation, str]] = {"none": "no mitigation", "blanking": "blanking"}


def timing(row: PaperRow) -> str:
    """Whether a row's radars start together."""
    return "in step" if row.synchronous else "random starts"


def variant_name(row: PaperRow) -> str:
    """The whole name of a row's case, without interferers' timing where there are none."""
    parts = [f"{row.scenario}: {SCENARIO[row.scenario]}", row.radar, WAVEFORM[row.waveform]]
    if row.scenario != "A":
        parts.append(timing(row))
    if row.mitigation != "none":
        parts.append(MITIGATION[row.mitigation])
    return " · ".join(parts)


def figure_name(claim: PaperClaim) -> str:
    """Name of the figure that answers a claim.

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
    """A number to some digits, or a dash where there is none.

    >>> decimal(None), decimal(6.499), decimal(-0.004), decimal(0.12, signed=True)
    ('–', '6.50', '0.00', '+0.12')
    """
    if value is None or value != value:  # noqa: PLR0124  # the only number unlike itself is NaN
        return "–"
    rounded = round(value, digits) + 0.0  # no minus before a zero
    return f"{rounded:{'+' if signed and rounded else ''}.{digits}f}".replace("-", "−")
