"""The page of `polychirp paper`: one file that opens from disk, asks nobody, and can be mailed."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Final

from polychirp.report.correlation import CAPTIONS as CORRELATION_CAPTIONS
from polychirp.report.correlation import (
    NUM_WORDS,
    SHAPE_HEAD,
    peak_head,
    peak_rows,
    shape_rows,
)
from polychirp.report.errata import ERRATA
from polychirp.report.statistics import (
    STATISTICS_HEAD,
    STATISTICS_NOTE,
    findings,
    statistics_rows,
)
from polychirp.report.verdict import Verdict, counted, interference_ghosts, verdicts
from polychirp.report.words import (
    MITIGATION,
    SCENARIO,
    WAVEFORM,
    decimal,
    figure_name,
    target_words,
    timing,
    variant_name,
)
from polychirp.study.paper.results import PaperResults, PaperRow, StatisticsRow
from polychirp.study.section_v.cases import CorrelationResults

PAGE: Final = Template(
    """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
$style</style>
</head>
<body>
$body
</body>
</html>
"""
)

TITLE: Final = "FMCW chirp diversity against mutual interference: the paper and polychirp"

CAPTIONS: Final[dict[str, str]] = {
    "fig04a": "Sixteen sweeps, all alike. Short-time spectrum in closed form, window 20 µs.",
    "fig04b": "Sixteen sweeps, each with a bandwidth and a duration of its own.",
    "fig08-plan": "The street from above: sectors show where the radars look, arrows where the "
    "vehicles go.",
    "fig08-view": "The same street as the rays meet it, coloured by material; vehicles with a "
    "radar are painted.",
    "fig12-13": "Detection, ghosts and errors over the number of targets, each with its 95 % "
    "interval, dashes: medians; stars are what the paper reads at ten.",
    "floor-and-masking": "The price of every variant: what diversity takes from ghosts it adds to "
    "the floor, and what blanking gives back.",
}
FINDINGS: Final = (
    "Our truth",
    "Found",
    "Ghosts of interference",
    "Missed",
    "Floor rise (dB)",
)
"""Columns that every table of rows shares."""

WIDE: Final = frozenset(
    {
        "fig04a",
        "fig04b",
        "fig08-plan",
        "fig08-view",
        "fig12-13",
        "floor-and-masking",
        *(name for name in CORRELATION_CAPTIONS if name != "slope-law"),
    }
)


def page(results: PaperResults, pictures: Mapping[str, bytes]) -> str:
    """The whole page; ``pictures`` are PNG files by the name of their figure."""
    answers = verdicts(results)
    captions = (
        CAPTIONS
        | CORRELATION_CAPTIONS
        | {figure_name(v.claim): f"Paper: {v.claim.text}. Here: {_outcome(v)}." for v in answers}
    )
    figures = [_figure(name, picture, captions.get(name, "")) for name, picture in pictures.items()]
    body = [
        f"<h1>{escape(TITLE)}</h1>",
        f'<p class="lead">{escape(_summary(answers))}</p>',
        _section("What the paper claims, and what we find", _claims(answers)),
        _section("Figures", _element("div", figures, kind="figures")),
        *_correlation(results.correlation),
        *_statistics(results.statistics),
        _section("Every case", *_cases(results.rows)),
        _section("Where the paper errs or is silent", *_errata()),
        _section("Where these numbers come from", *_provenance(results)),
    ]
    style = Path(__file__).with_name("page.css").read_text(encoding="utf-8")
    return PAGE.substitute(title=escape(TITLE), style=style, body="\n".join(body))


def _summary(answers: Sequence[Verdict]) -> str:
    holding = sum(answer.holds for answer in answers)
    if holding == len(answers):
        return f"All {len(answers)} claims of the paper's figures 9 to 11 hold here."
    return f"{holding} of {len(answers)} claims of the paper's figures 9 to 11 hold here."


def _outcome(answer: Verdict) -> str:
    return "as claimed" if answer.holds else "; ".join(answer.differences)


def _correlation(results: CorrelationResults | None) -> list[str]:
    """Section V, where it was run."""
    if results is None:
        return []
    peaks = [
        [*map(_cell, row[:NUM_WORDS]), *map(_number, row[NUM_WORDS:])] for row in peak_rows(results)
    ]
    shapes = [[_cell(name), *map(_number, cells)] for name, *cells in shape_rows(results)]
    notes = [f"<li>{escape(note)}</li>" for note in results.notes]
    return [
        _section(
            "Section V: correlation, highest peaks in dB",
            _table(peak_head(results), peaks),
            _table(SHAPE_HEAD, shapes),
            _element("ul", notes),
        )
    ]


def _statistics(rows: Sequence[StatisticsRow]) -> list[str]:
    """Figures 12 and 13, where they were run."""
    if not rows:
        return []
    lines = [[*map(_cell, row[:2]), *map(_number, row[2:])] for row in statistics_rows(rows)]
    return [
        _section(
            "Figures 12 and 13: points in random traffic, with 95 % intervals",
            _element("ul", [f"<li>{escape(finding)}</li>" for finding in findings(rows)]),
            _table(STATISTICS_HEAD, lines),
            f'<p class="soft">{escape(STATISTICS_NOTE)}</p>',
        )
    ]


# ── parts of the page ─────────────────────────────────────────────────────────


def _claims(answers: Sequence[Verdict]) -> str:
    head = ("Fig.", "Case", "The paper's claim", "Verdict", *FINDINGS)
    lines = []
    for answer in answers:
        row = answer.row
        kind = "good" if answer.holds else "bad"
        lines.append(
            [
                _cell(answer.claim.figure),
                _cell(f"{answer.claim.scenario}, {answer.claim.radar}, {answer.claim.waveform}"),
                _cell(answer.claim.text),
                _cell(_outcome(answer), f"verdict {kind}"),
                *_findings(row),
            ]
        )
    return _table(head, lines)


def _findings(row: PaperRow | None) -> list[str]:
    """Cells under `FINDINGS`."""
    if row is None:
        return [_cell("–") for _ in FINDINGS]
    return [
        _lines(f"{t.name}: {decimal(t.range_m)} m" for t in row.targets),
        _lines(target_words(t) for t in row.targets if t.detected),
        _lines(
            f"{g.kind} {decimal(g.range_m)} m "
            f"({decimal(g.power_over_strongest_target_db, 1, signed=True)} dB)"
            for g in interference_ghosts(row)
        ),
        _number(str(row.missed)),
        _number(decimal(row.floor_rise_db, 1)),
    ]


def _figure(name: str, picture: bytes, caption: str) -> str:
    data = base64.b64encode(picture).decode("ascii")
    text = escape(caption)
    return (
        f'<figure id="{escape(name)}" class="{"wide" if name in WIDE else "panel"}">'
        f'<img src="data:image/png;base64,{data}" alt="{text}">'
        f"<figcaption>{text} <span>Data: figures/{escape(name)}.csv</span></figcaption></figure>"
    )


def _cases(rows: Sequence[PaperRow]) -> list[str]:
    """A table per scenario and victim, and one fold per row."""
    parts = []
    for scenario, radar in dict.fromkeys((row.scenario, row.radar) for row in rows):
        chosen = [row for row in rows if (row.scenario, row.radar) == (scenario, radar)]
        parts.append(f"<h3>{escape(f'{scenario}: {SCENARIO[scenario]} at {radar}')}</h3>")
        parts.append(_variants(chosen))
        parts += [_fold(row) for row in chosen]
    return parts


def _variants(rows: Sequence[PaperRow]) -> str:
    lines = [
        [
            _cell(WAVEFORM[row.waveform]),
            _cell(timing(row) if row.scenario != "A" else "–"),
            _cell(MITIGATION[row.mitigation]),
            *_findings(row),
        ]
        for row in rows
    ]
    return _table(("Waveform", "Starts", "Receiver", *FINDINGS), lines)


def _fold(row: PaperRow) -> str:
    """Targets and ghosts of one row, one by one."""
    targets = [
        [
            _cell(target.name),
            _number(decimal(target.range_m)),
            _number(decimal(target.closing_speed_mps)),
            _number(decimal(target.azimuth_deg)),
            _cell("found" if target.detected else "missed", "good" if target.detected else "bad"),
            _number(decimal(target.range_error_m, 3, signed=True)),
            _number(decimal(target.speed_error_mps, 3, signed=True)),
            _number(decimal(target.azimuth_error_deg, 2, signed=True)),
            _number(decimal(target.snr_db, 1)),
        ]
        for target in row.targets
    ]
    ghosts = [
        [
            _cell(ghost.kind),
            _number(decimal(ghost.range_m)),
            _number(decimal(ghost.closing_speed_mps)),
            _number(decimal(ghost.azimuth_deg)),
            _number(decimal(ghost.power_over_strongest_target_db, 1, signed=True)),
        ]
        for ghost in row.ghosts
    ]
    errors = ("Range error (m)", "Speed error (m/s)", "Azimuth error (°)", "SNR (dB)")
    place = ("Range (m)", "Closing speed (m/s)", "Azimuth (°)")
    parts = [_table(("Target", *place, "", *errors), targets)]
    if ghosts:
        parts.append(_table(("Ghost", *place, "Over the strongest target (dB)"), ghosts))
    parts.append(
        f'<p class="soft">{escape(counted(row.other_echoes, "further detection"))} '
        "from walls, road, trees and other bodies, which are there.</p>"
    )
    return (
        f"<details><summary>{escape(variant_name(row))}: "
        f"{escape(counted(row.missed, 'missed target'))}, "
        f"{escape(counted(len(row.ghosts), 'ghost'))}</summary>{''.join(parts)}</details>"
    )


def _errata() -> list[str]:
    return [f"<h3>{escape(title)}</h3><p>{escape(text)}</p>" for title, text in ERRATA]


def _provenance(results: PaperResults) -> list[str]:
    facts = {
        "seed": str(results.seed),
        "computed in": f"{decimal(results.wall_time_s, 1)} s",
        **dict(results.versions),
    }
    pairs = "".join(
        f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in facts.items()
    )
    notes = [f"<li>{escape(note)}</li>" for note in results.notes]
    return [f"<dl>{pairs}</dl>", *([_element("ul", notes)] if notes else [])]


# ── words of HTML ─────────────────────────────────────────────────────────────


def _section(title: str, *parts: str) -> str:
    return f"<section><h2>{escape(title)}</h2>\n{''.join(parts)}</section>"


def _element(name: str, parts: Iterable[str], *, kind: str = "") -> str:
    attribute = f' class="{kind}"' if kind else ""
    return f"<{name}{attribute}>{''.join(parts)}</{name}>"


def _cell(text: str, kind: str = "") -> str:
    return _element("td", [escape(text)], kind=kind)


def _lines(texts: Iterable[str]) -> str:
    """One text per line, or a dash for none."""
    return _element("td", ["<br>".join(escape(text) for text in texts) or "–"], kind="lines")


def _number(text: str) -> str:
    return _cell(text, "number")


def _table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """A table that scrolls by itself where the window is narrow; cells are ready HTML."""
    titles = "".join(f'<th scope="col">{escape(title)}</th>' for title in head)
    rows = "".join(f"<tr>{''.join(line)}</tr>\n" for line in lines)
    return (
        f'<div class="scroll"><table><thead><tr>{titles}</tr></thead>'
        f"<tbody>{rows}</tbody></table></div>"
    )
