"""Verdicts: whether a row shows what the paper claims; only comparisons of ready numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from polychirp.study.paper.results import (
    INTERFERENCE_GHOSTS,
    GhostRow,
    PaperClaim,
    PaperResults,
    PaperRow,
)

AGREEMENT: Final = 0.3
"""m, within which a range is the paper's: one and a half cells of 800 MHz, which is also what can
be read off the paper's figures."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """One claim, the row that answers it (none if it was not computed), and what differs."""

    claim: PaperClaim
    row: PaperRow | None
    differences: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Whether our row shows what the paper claims."""
        return not self.differences


def interference_ghosts(row: PaperRow) -> tuple[GhostRow, ...]:
    """The row's ghosts that another radar made."""
    return tuple(ghost for ghost in row.ghosts if ghost.kind in INTERFERENCE_GHOSTS)


def row_of(results: PaperResults, claim: PaperClaim) -> PaperRow | None:
    """The row that answers a claim: no mitigation, all radars in step where both were run."""
    candidates = [
        row
        for row in results.rows
        if (row.scenario, row.radar, row.waveform) == (claim.scenario, claim.radar, claim.waveform)
        and row.mitigation == "none"
    ]
    return min(candidates, key=lambda row: not row.synchronous, default=None)


def verdicts(results: PaperResults) -> tuple[Verdict, ...]:
    """Every claim with its answer, in the paper's order."""
    return tuple(_verdict(claim, row_of(results, claim)) for claim in results.claims)


def _verdict(claim: PaperClaim, row: PaperRow | None) -> Verdict:
    found = ("this case was not computed",) if row is None else _differences(claim, row)
    return Verdict(claim=claim, row=row, differences=found)


def _differences(claim: PaperClaim, row: PaperRow) -> tuple[str, ...]:
    return (
        *_missing_targets(claim, row),
        *_different_ghosts(claim, interference_ghosts(row)),
    )


def _missing_targets(claim: PaperClaim, row: PaperRow) -> list[str]:
    found = [t.range_m + (t.range_error_m or 0.0) for t in row.targets if t.detected]
    return [
        f"no target is found at {expected:.2f} m"
        for expected in claim.target_ranges_m
        if not any(abs(range_ - expected) <= AGREEMENT for range_ in found)
    ]


def _different_ghosts(claim: PaperClaim, ghosts: tuple[GhostRow, ...]) -> list[str]:
    found = []
    if len(ghosts) != claim.num_ghosts:
        found.append(f"{counted(len(ghosts), 'ghost')}, where the paper has {claim.num_ghosts}")
    found += [
        f"no ghost at {expected:.2f} m"
        for expected in claim.ghost_ranges_m
        if not any(abs(ghost.range_m - expected) <= AGREEMENT for ghost in ghosts)
    ]
    if claim.is_ghost_strongest and not any(g.power_over_strongest_target_db > 0 for g in ghosts):
        found.append("no ghost stands above the targets")
    return found


def counted(number: int, noun: str) -> str:
    """A number and its noun.

    >>> counted(0, "ghost"), counted(1, "ghost"), counted(2, "ghost")
    ('no ghosts', '1 ghost', '2 ghosts')
    """
    return f"{number or 'no'} {noun}{'' if number == 1 else 's'}"
