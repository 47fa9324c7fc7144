"""The tables of `polychirp paper` for a terminal."""

from collections.abc import Iterable, Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from polychirp.report.statistics import BRIEF_HEAD, brief_rows
from polychirp.report.verdict import false_detection_lines, verdicts
from polychirp.report.words import (
    MITIGATION_WORDS,
    WAVEFORM_WORDS,
    decimal,
    distinct,
    target_words,
    timing,
)
from polychirp.study.paper.results import GhostRow, PaperResults, PaperRow, StatisticsRow


def claims_table(results: PaperResults) -> Table:
    """Every claim of the paper with our truth, our detections, and the verdict."""
    table = _empty("The paper, side by side", ("Fig.", "Case", "The paper's claim"), "Verdict")
    for verdict in verdicts(results):
        claim = verdict.claim
        outcome = "as claimed" if verdict.holds else "\n".join(verdict.differences)
        table.add_row(
            claim.figure,
            f"{claim.scenario}, {claim.radar}\n{claim.waveform}",
            Text(claim.text),
            *_findings(verdict.row),
            Text(outcome, style="green" if verdict.holds else "yellow"),
        )
    return table


def variants_table(rows: Sequence[PaperRow]) -> Table:
    """All rows, each with its waveform, start times and mitigation, and what was detected."""
    table = _empty("Every case", ("Case", "Waveform", "Starts", "Receiver"))
    for row in distinct(rows):
        table.add_row(
            f"{row.scenario}, {row.radar}",
            WAVEFORM_WORDS[row.waveform],
            timing(row) if row.scenario != "A" else "–",
            MITIGATION_WORDS[row.mitigation],
            *_findings(row),
        )
    return table


def statistics_table(rows: Sequence[StatisticsRow]) -> Table:
    """Figures 12 and 13: every curve at every number of targets."""
    trials = " or ".join(str(count) for count in sorted({row.num_trials for row in rows}))
    title = f"Figures 12 and 13: points in random traffic, {trials} trials, 95 % intervals"
    return plain_table(title, BRIEF_HEAD, brief_rows(rows))


def plain_table(
    title: str, head: Sequence[str], rows: Iterable[Sequence[str]], *, num_words: int = 1
) -> Table:
    """A table whose first ``num_words`` columns are words and whose others are numbers."""
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for number, name in enumerate(head):
        table.add_column(name, justify="left" if number < num_words else "right")
    for cells in rows:
        table.add_row(*cells)
    return table


def _empty(title: str, first: tuple[str, ...], *last: str) -> Table:
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, show_lines=True)
    for name in (*first, "Truth (m)", "Found (m)", "Ghosts (m)"):
        table.add_column(name)
    table.add_column("Missed", justify="right")
    table.add_column("Floor rise (dB)", justify="right")
    for name in last:
        table.add_column(name)
    return table


def _ghost_words(ghost: GhostRow) -> str:
    power = decimal(ghost.power_over_strongest_target_db, 1, signed=True)
    return f"{ghost.kind} {decimal(ghost.range_m)}, {power} dB"


def _findings(row: PaperRow | None) -> list[Text]:
    """Cells: true targets, found targets, ghosts of interference, misses, and floor rise."""
    if row is None:
        return [Text("–")] * 5
    return [
        Text("\n".join(f"{target.name} {decimal(target.range_m)}" for target in row.targets)),
        Text("\n".join(target_words(t) for t in row.targets if t.detected) or "–"),
        Text("\n".join(false_detection_lines(row, _ghost_words))),
        Text(str(row.missed), style="yellow" if row.missed else ""),
        Text(decimal(row.floor_rise_db, 1)),
    ]
