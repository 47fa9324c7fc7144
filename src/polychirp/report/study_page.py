"""The page of a stored study: its curves, and the estimates of every point."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from polychirp.report.figures.study_curves import study_curves, study_differences
from polychirp.report.page_parts import Table, figure_of, rendered, words_and_numbers
from polychirp.report.statistics import short, within
from polychirp.report.verdict import counted
from polychirp.report.words import decimal
from polychirp.study.monte_carlo.results import Results
from polychirp.study.monte_carlo.summary import Summary, summaries
from polychirp.units import to_db

POINT_HEAD: Final = (
    "Radar",
    "Trials",
    "Detection probability",
    "Ghosts in a frame",
    "Range error, rms (m)",
    "Speed error, rms (km/h)",
    "Floor rise, median (dB)",
)
"""Columns of the table of points, after those of the axes."""


def write_study_page(results: Results, folder: Path, *, title: str) -> Path:
    """Write ``report.html`` and the files of its figures into ``folder``; gives its path."""
    files = folder / "figures"
    files.mkdir(parents=True, exist_ok=True)
    shown = []
    for axis, labels in results.axes:
        drawn = {f"curves-{axis}": (study_curves, f"Every estimate over {axis}.")}
        if len(labels) > 1:
            caption = f"Differences from the first {axis}, of the same trials."
            drawn[f"differences-{axis}"] = (study_differences, caption)
        for name, (draw, caption) in drawn.items():
            # a pair of dollars would enclose a formula
            drawing = draw(results, over=axis, title=title.replace("$", r"\$"))
            picture = drawing.save(files, name, formats=("png", "svg"))
            shown.append(figure_of(name, picture, caption=caption, is_wide=True))
    page = folder / "report.html"
    page.write_text(study_page(results, shown, title=title), encoding="utf-8")
    return page


def study_page(results: Results, figures: Sequence[Mapping[str, str]], *, title: str) -> str:
    """The page as HTML, with figures of `figure_of`."""
    rows = summaries(results)
    axes = [axis for axis, _ in results.axes]
    return rendered(
        "study.html",
        title=title,
        data={"rows": [], "causes": {}, "headline": None, "street": None},
        answer=[_sentence(rows)],
        figures=figures,
        points=Table(
            (*axes, *POINT_HEAD),
            [words_and_numbers(_cells(row), num_words=len(axes) + 1) for row in rows],
        ),
        facts={
            "points": str(len(results.study_hash)),
            "axes": ", ".join(axes) or "–",
            "seed": str(results.origin.seed),
            "study": results.origin.study_hash[:12],
            **dict(results.origin.versions),
        },
    )


def _sentence(rows: Sequence[Summary]) -> str:
    """Span of the detection probability over all points."""
    if not rows:
        return "No trial was run."
    known = [row.detection.value for row in rows if not math.isnan(row.detection.value)]
    trials = f"{counted(sum(row.num_trials for row in rows), 'trial')} of all points and radars"
    if not known:
        return f"{trials}: no target is in sight."
    low, high = decimal(min(known)), decimal(max(known))
    return f"{trials}: the detection probability is {low if low == high else f'{low} to {high}'}."


def _cells(row: Summary) -> list[str]:
    errors = ((row.range_rmse, 1.0), (row.range_rate_rmse, 3.6))
    return [
        *map(str, row.labels),
        row.victim,
        str(row.num_trials),
        within((row.detection.value, row.detection.low, row.detection.high), 3),
        within((row.ghosts.value, row.ghosts.low, row.ghosts.high), 2),
        *(short((scale * one.value, scale * one.low, scale * one.high)) for one, scale in errors),
        decimal(float(to_db(row.floor_rise)), 1),
    ]
