"""The answer of `polychirp paper` in a few sentences, made of its results."""

from collections.abc import Sequence
from typing import Final

from polychirp.report.verdict import Verdict, counted, interference_ghosts, row_of
from polychirp.report.words import decimal
from polychirp.study.paper.results import Mitigation, PaperResults, PaperRow, WaveformKind

QUESTION: Final = (
    "Car radars that start their chirps together and with equal slopes take each other's signals "
    "for echoes, and detect targets that do not exist. The paper proposes that every sweep has "
    "another bandwidth and another duration. Here its street and its radars are simulated, from "
    "the metal of the cars to the list of detections, and each of its claims is compared with the "
    "results."
)
"""Introduction of the page."""


def headline_pair(results: PaperResults) -> tuple[PaperRow, PaperRow] | None:
    """The rows with the paper's strongest ghost: conventional, and diverse; None if not computed.

    They are those of figures 11a and 11b.
    """
    for claim in results.claims:
        if not claim.is_ghost_strongest:
            continue
        row = row_of(results, claim)
        other = row and same_case(results, row, waveform="diverse")
        if row and other:
            return row, other
    return None


def same_case(
    results: PaperResults,
    row: PaperRow,
    *,
    waveform: WaveformKind | None = None,
    mitigation: Mitigation | None = None,
    synchronous: bool | None = None,
) -> PaperRow | None:
    """The row that differs from a row in what is given only; None if it was not computed."""
    wanted = (
        row.scenario,
        row.radar,
        waveform or row.waveform,
        mitigation or row.mitigation,
        row.synchronous if synchronous is None else synchronous,
    )
    for one in results.rows:
        if (one.scenario, one.radar, one.waveform, one.mitigation, one.synchronous) == wanted:
            return one
    return None


def answer(results: PaperResults, verdicts: Sequence[Verdict]) -> list[str]:
    """The answer in three sentences; the first alone if the rows for the others are missing."""
    sentences = [summary(verdicts)]
    pair = headline_pair(results)
    if pair is None:
        return sentences
    conventional, diverse = pair
    sentences.append(f"{_with_equal_slopes(conventional)}; {_with_diverse_slopes(diverse)}.")
    sentences.append(_price(results, diverse))
    return sentences


def summary(verdicts: Sequence[Verdict]) -> str:
    """Number of claims that hold, as a sentence."""
    holding = sum(one.holds for one in verdicts)
    if holding == len(verdicts):
        return f"All {len(verdicts)} claims of the paper's figures 9 to 11 hold here."
    return f"{holding} of {len(verdicts)} claims of the paper's figures 9 to 11 hold here."


def _with_equal_slopes(row: PaperRow) -> str:
    ghosts = interference_ghosts(row)
    if not ghosts:
        return f"With equal slopes and a common start, {row.radar} detects no ghost"
    strongest = max(ghosts, key=lambda ghost: ghost.power_over_strongest_target_db)
    over = strongest.power_over_strongest_target_db
    relation = "stronger" if over > 0 else "weaker"
    return (
        f"With equal slopes and a common start, {row.radar} detects a ghost at "
        f"{decimal(strongest.range_m)} m that is {decimal(abs(over), 0)} dB {relation} than the "
        "strongest target"
    )


def _with_diverse_slopes(row: PaperRow) -> str:
    count = len(interference_ghosts(row))
    return f"with diverse slopes it detects {counted(count, 'ghost')} of interference"


def _price(results: PaperResults, row: PaperRow) -> str:
    rise = decimal(row.floor_rise_db, 0)
    sentence = f"Diversity spreads the interference and raises the floor by {rise} dB"
    blanked = same_case(results, row, mitigation="blanking")
    if blanked is None:
        return f"{sentence}."
    return f"{sentence}; blanking lowers this rise to {decimal(blanked.floor_rise_db, 1)} dB."


def conclusions(results: PaperResults) -> list[str]:
    """Consequences for a designer of radars, with the numbers of the rows that show them."""
    pair = headline_pair(results)
    if pair is None:
        return []
    conventional, diverse = pair
    found = [
        "Suppression of ghosts is not removal of interference: the energy stays, below the targets "
        f"of this street, and raises the floor by {decimal(diverse.floor_rise_db, 0)} dB."
    ]
    apart = same_case(results, conventional, synchronous=False)
    if apart is not None:
        count = len(interference_ghosts(apart))
        found.append(
            "Ghosts need equal slopes and starts within 0.2 µs of each other: with equal slopes "
            f"and random starts, {apart.radar} detects {counted(count, 'ghost')} of interference."
        )
    fixed = same_case(results, conventional, waveform="fixed-per-radar")
    if fixed is not None:
        count = len(interference_ghosts(fixed))
        found.append(
            "A fixed slope for each radar, without any change from sweep to sweep, leaves "
            f"{counted(count, 'ghost')} of interference and raises the floor by "
            f"{decimal(fixed.floor_rise_db, 0)} dB."
        )
    blanked = same_case(results, diverse, mitigation="blanking")
    if blanked is not None:
        found.append(
            "Blanking of the samples in which chirps cross lowers the rise of the floor from "
            f"{decimal(diverse.floor_rise_db, 0)} dB to {decimal(blanked.floor_rise_db, 1)} dB. "
            "Diversity and blanking belong together."
        )
    return found
