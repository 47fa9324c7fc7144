"""Verdicts: comparison of computed rows with the claims of the paper."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from polychirp.report.words import decimal, target_words
from polychirp.study.paper.results import (
    INTERFERENCE_GHOSTS,
    GhostRow,
    PaperClaim,
    PaperResults,
    PaperRow,
)

RANGE_AGREEMENT: Final = 0.3
"""Largest difference from a range of the paper that counts as agreement, m; chosen: one and a half
range cells at a bandwidth of 800 MHz, and the accuracy with which the paper's figures can be read.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """One claim, the row to compare with it (None if not computed), and the differences."""

    claim: PaperClaim
    row: PaperRow | None
    differences: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """True if our row shows what the paper claims."""
        return not self.differences


def interference_ghosts(row: PaperRow) -> tuple[GhostRow, ...]:
    """The row's ghosts that another radar caused."""
    return tuple(ghost for ghost in row.ghosts if ghost.kind in INTERFERENCE_GHOSTS)


def other_false_detections(row: PaperRow) -> list[str]:
    """Numbers of the row's ghosts of each other cause than interference, such as "2 multipath"."""
    kinds = [ghost.kind for ghost in row.ghosts if ghost.kind not in INTERFERENCE_GHOSTS]
    return [f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds)]


def false_detection_lines(row: PaperRow, ghost_words: Callable[[GhostRow], str]) -> list[str]:
    """Ghosts of interference in words; then numbers of the row's ghosts of other causes."""
    lines = [ghost_words(ghost) for ghost in interference_ghosts(row)]
    return [*(lines or ["none"]), *(f"besides {other}" for other in other_false_detections(row))]


def row_in_words(row: PaperRow) -> str:
    """True and detected targets, ghosts of interference and other false detections of a row."""
    there = ", ".join(f"{target.name} at {decimal(target.range_m)} m" for target in row.targets)
    found = ", ".join(target_words(target) for target in row.targets if target.detected) or "none"
    ghosts = ", ".join(
        f"{ghost.kind} at {decimal(ghost.range_m)} m" for ghost in interference_ghosts(row)
    )
    others = ", ".join(
        f"{ghost.kind} at {decimal(ghost.range_m)} m"
        for ghost in row.ghosts
        if ghost.kind not in INTERFERENCE_GHOSTS
    )
    besides = f"; besides: {others}" if others else ""
    return f"{there}; found {found}; ghosts: {ghosts or 'none'}{besides}"


def row_of(results: PaperResults, claim: PaperClaim) -> PaperRow | None:
    """The row to compare with a claim: without mitigation, if possible of synchronous radars."""
    candidates = [
        row
        for row in results.rows
        if (row.scenario, row.radar, row.waveform) == (claim.scenario, claim.radar, claim.waveform)
        and row.mitigation == "none"
    ]
    return min(candidates, key=lambda row: not row.synchronous, default=None)


def verdicts(results: PaperResults) -> tuple[Verdict, ...]:
    """Verdicts on all claims, in the paper's order."""
    return tuple(_verdict(claim, row_of(results, claim)) for claim in results.claims)


def _verdict(claim: PaperClaim, row: PaperRow | None) -> Verdict:
    found = ["this case was not computed"]
    if row is not None:
        found = [*_missing_targets(claim, row), *_different_ghosts(claim, interference_ghosts(row))]
    return Verdict(claim=claim, row=row, differences=tuple(found))


def _missing_targets(claim: PaperClaim, row: PaperRow) -> list[str]:
    found = [t.range_m + (t.range_error_m or 0.0) for t in row.targets if t.detected]
    return [
        f"no target is found at {expected:.2f} m"
        for expected in claim.target_ranges_m
        if not any(abs(range_ - expected) <= RANGE_AGREEMENT for range_ in found)
    ]


def _different_ghosts(claim: PaperClaim, ghosts: tuple[GhostRow, ...]) -> list[str]:
    found = []
    if len(ghosts) != claim.num_ghosts:
        found.append(f"{counted(len(ghosts), 'ghost')}, where the paper has {claim.num_ghosts}")
    found += [
        f"no ghost at {expected:.2f} m"
        for expected in claim.ghost_ranges_m
        if not any(abs(ghost.range_m - expected) <= RANGE_AGREEMENT for ghost in ghosts)
    ]
    if claim.is_ghost_strongest and not any(g.power_over_strongest_target_db > 0 for g in ghosts):
        found.append("no ghost is stronger than the targets")
    return found


def counted(number: int, noun: str) -> str:
    """A number with its noun, which is plural where needed.

    >>> counted(0, "ghost"), counted(1, "ghost"), counted(2, "ghost")
    ('no ghosts', '1 ghost', '2 ghosts')
    """
    return f"{number or 'no'} {noun}{'' if number == 1 else 's'}"
