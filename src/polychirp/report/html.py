"""The page of `polychirp paper`: one HTML file that needs no other file and no network."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from polychirp.report.answer import QUESTION, answer, conclusions, headline_pair
from polychirp.report.correlation import (
    CORRELATION_CAPTIONS,
    NUM_WORD_COLUMNS,
    SHAPE_HEAD,
    peak_head,
    peak_rows,
    shape_rows,
)
from polychirp.report.errata import ERRATA
from polychirp.report.page_data import causes, row_key, rows_data
from polychirp.report.page_parts import (
    Cell,
    Table,
    figure_of,
    lines_cell,
    number_cell,
    rendered,
    text_cell,
    words_and_numbers,
)
from polychirp.report.statistics import (
    STATISTICS_HEAD,
    STATISTICS_NOTE,
    findings,
    origin,
    shown_statistics,
    statistics_rows,
    traced_findings,
)
from polychirp.report.street_model import street_model
from polychirp.report.verdict import (
    Verdict,
    counted,
    false_detection_lines,
    interference_ghosts,
    verdicts,
)
from polychirp.report.words import (
    MITIGATION_WORDS,
    SCENARIO_WORDS,
    WAVEFORM_WORDS,
    decimal,
    distinct,
    figure_name,
    target_words,
    timing,
    variant_name,
)
from polychirp.study.paper.results import (
    GhostRow,
    PaperResults,
    PaperRow,
    StatisticsRow,
    WaveformKind,
)
from polychirp.study.section_v.cases import CorrelationResults

PAGE_TITLE: Final = "FMCW chirp diversity against mutual interference: the paper and polychirp"

FIGURE_CAPTIONS: Final[dict[str, str]] = {
    "fig04a": "Sixteen equal sweeps. Short-time spectrum in closed form, window 20 µs.",
    "fig04b": "Sixteen sweeps, each with its own bandwidth and duration, on the axes of 4a.",
    "fig08-plan": "The street from above: sectors show the directions of the radars' beams, "
    "not their range; arrows show the velocities of the vehicles.",
    "fig08-view": "The surfaces that the rays of the channel meet, coloured by material; vehicles "
    "with a radar have the radar's colour.",
    "fig12-13": "Detection, ghosts and errors over the number of targets with 95 % intervals. "
    "Dashes: medians; stars: values of the paper at ten targets. The last two panels have the "
    "differences from the conventional waveform, trial by trial: they decide, since intervals of "
    "two curves may overlap although one is above the other in every trial.",
    "fig12-13-traced": "The same on ray-traced vehicles in a street with buildings: errors are "
    "those of bodies, against the nearest visible metal, and most ghosts are echoes by way of the "
    "road and the buildings.",
    "fig11-both": "Equal slopes and diverse slopes at the same radar, on the same street and with "
    "the same noise.",
    "floor-and-masking": "The cost of every variant: diversity removes ghosts and raises the "
    "floor; blanking lowers it again.",
}
"""Captions by figure name; `page` adds those of figures 9 to 11."""
FINDING_COLUMNS: Final = (
    "True targets",
    "Found",
    "Ghosts of interference",
    "Missed",
    "Floor rise (dB)",
)
"""Columns that the tables of claims and of variants share."""

SECTION_FIGURES: Final[Mapping[str, Sequence[str]]] = {
    "waveforms": ("fig04a", "fig04b"),
    "street": ("fig08-plan", "fig08-view"),
    "correlation": ("fig06", "fig07-as-printed", "fig07-baseband", "slope-law"),
    "statistics": ("fig12-13", "fig12-13-traced"),
    "cost": ("floor-and-masking",),
}
"""Figures of the sections of the page; all others are range profiles."""

PHOTOS: Final = ("fig04a", "fig04b", "fig08-plan", "fig08-view")
"""Figures with many colours, which are not inverted on a dark page."""

WAVEFORM_LABELS: Final[Mapping[WaveformKind, str]] = {
    "conventional": "conventional",
    "diverse": "diverse",
    "fixed-per-radar": "fixed slopes",
}
"""Short names of the waveforms, for buttons."""

WIDE_FIGURES: Final = (FIGURE_CAPTIONS | CORRELATION_CAPTIONS).keys() - {"slope-law"}
"""Figures that take the whole width of the page; others stand side by side."""


def page(results: PaperResults, pictures: Mapping[str, bytes]) -> str:
    """The whole page as HTML; ``pictures`` are PNG files by figure name."""
    answers = verdicts(results)
    captions = (
        FIGURE_CAPTIONS
        | CORRELATION_CAPTIONS
        | {figure_name(v.claim): f"Paper: {v.claim.text}. Here: {_outcome(v)}." for v in answers}
    )
    return rendered(
        "page.html",
        title=PAGE_TITLE,
        data=_data(results),
        question=QUESTION,
        answer=answer(results, answers),
        conclusions=conclusions(results),
        cards=[_card(verdict, pictures) for verdict in answers],
        controls=_controls(results),
        groups=_figure_groups(pictures, captions),
        correlation=_correlation(results.correlation),
        statistics=_statistics(results),
        cases=_cases(results.rows),
        errata=ERRATA,
        facts={
            "seed": str(results.seed),
            "computed in": f"{decimal(results.wall_time_s, 1)} s",
            **dict(results.versions),
        },
        notes=results.notes,
    )


def _data(results: PaperResults) -> dict[str, Any]:
    """The numbers that the page's scripts draw."""
    return {
        "rows": rows_data(results.rows),
        "causes": causes(),
        "headline": _headline(results),
        "street": street_model(results.scene),
    }


def _headline(results: PaperResults) -> dict[str, Any] | None:
    """The rows of the first picture, and the strongest ghost in it."""
    pair = headline_pair(results)
    if pair is None:
        return None
    ghosts = interference_ghosts(pair[0])
    strongest = max(ghosts, key=lambda one: one.power_over_strongest_target_db, default=None)
    return {
        "conventional": row_key(pair[0]),
        "diverse": row_key(pair[1]),
        "ghost": strongest and {"range": round(strongest.range_m, 2)},
    }


def _outcome(answer: Verdict) -> str:
    return "as claimed" if answer.holds else "; ".join(answer.differences)


def _correlation(results: CorrelationResults | None) -> dict[str, Any] | None:
    """Tables and notes of section V, if it was run."""
    if results is None:
        return None
    peaks = [words_and_numbers(row, num_words=NUM_WORD_COLUMNS) for row in peak_rows(results)]
    shapes = [words_and_numbers(row, num_words=1) for row in shape_rows(results)]
    return {
        "peaks": Table(peak_head(results), peaks),
        "shapes": Table(SHAPE_HEAD, shapes),
        "notes": results.notes,
    }


def _statistics(results: PaperResults) -> dict[str, Any] | None:
    """Tables and findings of figures 12 and 13, if they were run."""
    if not results.statistics:
        return None
    stored, traced = results.stored, results.traced
    return {
        "origin": stored and origin(stored),
        "findings": findings(shown_statistics(results)),
        "table": _statistics_table(results.statistics),
        "stored": stored and _statistics_table(stored.rows),
        "traced_findings": traced and [origin(traced), *traced_findings(traced.rows)],
        "traced": traced and _statistics_table(traced.rows),
        "note": STATISTICS_NOTE,
    }


def _statistics_table(rows: Sequence[StatisticsRow]) -> Table:
    lines = [words_and_numbers(row, num_words=2) for row in statistics_rows(rows)]
    return Table(STATISTICS_HEAD, lines)


def _card(verdict: Verdict, pictures: Mapping[str, bytes]) -> dict[str, Any]:
    """A claim, its verdict and the numbers behind it, for a card."""
    claim, row = verdict.claim, verdict.row
    name = figure_name(claim)
    return {
        "figure": claim.figure,
        "case": f"{SCENARIO_WORDS[claim.scenario]} · {claim.radar} · {claim.waveform}",
        "claim": claim.text,
        "holds": verdict.holds,
        "differences": verdict.differences,
        "numbers": dict(zip(FINDING_COLUMNS, _findings(row), strict=True)) if row else {},
        "link": name if name in pictures else None,
        "row": row_key(row) if row and row.map is not None else None,
    }


def _controls(results: PaperResults) -> list[dict[str, Any]]:
    """Groups of radio buttons that choose a row: name, title, values with labels, first value."""
    shown = [row for row in results.rows if row.map is not None]
    if not shown:
        return []
    first = (headline_pair(results) or shown)[0]
    return [
        {"name": name, "title": title, "chosen": chosen, "options": dict(options)}
        for name, title, chosen, options in (
            ("case", "Scenario", _case(first), ((_case(r), _case_words(r)) for r in shown)),
            (
                "waveform",
                "Waveform",
                first.waveform,
                ((r.waveform, WAVEFORM_LABELS[r.waveform]) for r in shown),
            ),
            ("mitigation", "Mitigation", "none", ((r.mitigation, r.mitigation) for r in shown)),
            ("start", "Starts", "together", (("together", "together"), ("random", "at random"))),
        )
    ]


def _case(row: PaperRow) -> str:
    return f"{row.scenario}|{row.radar}"


def _case_words(row: PaperRow) -> str:
    return f"{row.scenario}: {SCENARIO_WORDS[row.scenario]}, {row.radar}"


def _figure_groups(
    pictures: Mapping[str, bytes], captions: Mapping[str, str]
) -> dict[str, list[dict[str, str]]]:
    """Figures of every section of the page."""
    sections = {name: section for section, names in SECTION_FIGURES.items() for name in names}
    groups: dict[str, list[dict[str, str]]] = {name: [] for name in (*SECTION_FIGURES, "profiles")}
    for name, picture in pictures.items():
        groups[sections.get(name, "profiles")].append(
            figure_of(
                name,
                picture,
                caption=captions.get(name, ""),
                is_wide=name in WIDE_FIGURES,
                is_photo=name in PHOTOS,
            )
        )
    return groups


def _ghost_words(ghost: GhostRow) -> str:
    power = decimal(ghost.power_over_strongest_target_db, 1, signed=True)
    return f"{ghost.kind} {decimal(ghost.range_m)} m ({power} dB)"


def _findings(row: PaperRow | None) -> list[Cell]:
    """Cells under `FINDING_COLUMNS`."""
    if row is None:
        return [text_cell("–") for _ in FINDING_COLUMNS]
    return [
        lines_cell(f"{t.name}: {decimal(t.range_m)} m" for t in row.targets),
        lines_cell(target_words(t) for t in row.targets if t.detected),
        lines_cell(false_detection_lines(row, _ghost_words)),
        number_cell(str(row.missed)),
        number_cell(decimal(row.floor_rise_db, 1)),
    ]


def _cases(rows: Sequence[PaperRow]) -> list[dict[str, Any]]:
    """A table for every scenario and victim, and a section to unfold for every row."""
    cases = []
    for scenario, radar in dict.fromkeys((row.scenario, row.radar) for row in rows):
        chosen = distinct(r for r in rows if (r.scenario, r.radar) == (scenario, radar))
        cases.append(
            {
                "title": f"{scenario}: {SCENARIO_WORDS[scenario]} at {radar}",
                "variants": _variants(chosen),
                "folds": [_fold(row) for row in chosen],
            }
        )
    return cases


def _variants(rows: Sequence[PaperRow]) -> Table:
    lines = [
        [
            text_cell(WAVEFORM_WORDS[row.waveform]),
            text_cell(timing(row) if row.scenario != "A" else "–"),
            text_cell(MITIGATION_WORDS[row.mitigation]),
            *_findings(row),
        ]
        for row in rows
    ]
    return Table(("Waveform", "Starts", "Receiver", *FINDING_COLUMNS), lines)


def _fold(row: PaperRow) -> dict[str, Any]:
    """Section of one row: tables of its targets and of its ghosts."""
    targets = [
        [
            text_cell(target.name),
            number_cell(decimal(target.range_m)),
            number_cell(decimal(target.closing_speed_mps)),
            number_cell(decimal(target.azimuth_deg)),
            text_cell(
                "found" if target.detected else "missed", "good" if target.detected else "bad"
            ),
            number_cell(decimal(target.range_error_m, 3, signed=True)),
            number_cell(decimal(target.speed_error_mps, 3, signed=True)),
            number_cell(decimal(target.azimuth_error_deg, 2, signed=True)),
            number_cell(decimal(target.snr_db, 1)),
        ]
        for target in row.targets
    ]
    ghosts = [
        [
            text_cell(ghost.kind),
            text_cell(ghost.radar or "–"),
            number_cell(decimal(ghost.range_m)),
            number_cell(decimal(ghost.closing_speed_mps)),
            number_cell(decimal(ghost.azimuth_deg)),
            number_cell(decimal(ghost.power_over_strongest_target_db, 1, signed=True)),
        ]
        for ghost in row.ghosts
    ]
    errors = ("Range error (m)", "Speed error (m/s)", "Azimuth error (°)", "SNR (dB)")
    place = ("Range (m)", "Closing speed (m/s)", "Azimuth (°)")
    tables = [Table(("Target", *place, "Result", *errors), targets)]
    if ghosts:
        tables.append(
            Table(
                ("Ghost", "Of radar", *place, "Power relative to the strongest target (dB)"), ghosts
            )
        )
    missed, found = counted(row.missed, "missed target"), counted(len(row.ghosts), "ghost")
    return {
        "summary": f"{variant_name(row)}: {missed}, {found}",
        "tables": tables,
        "others": counted(row.other_echoes, "further detection"),
    }
