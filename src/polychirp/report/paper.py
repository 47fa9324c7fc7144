"""The files that `polychirp paper` writes: figures, their data, the record and the page."""

import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from polychirp.report.answer import headline_pair
from polychirp.report.figures.correlation import correlation_drawings
from polychirp.report.figures.detection_statistics import detection_statistics
from polychirp.report.figures.drawing import Drawing
from polychirp.report.figures.floor_and_masking import floor_and_masking
from polychirp.report.figures.profile_pair import profile_pair
from polychirp.report.figures.range_profile import common_limits, range_profile
from polychirp.report.figures.spectrogram import band_of, span_of, spectrogram
from polychirp.report.figures.street_plan import street_plan
from polychirp.report.figures.street_view import street_view
from polychirp.report.html import page
from polychirp.report.record import results_json
from polychirp.report.verdict import row_of
from polychirp.report.words import figure_name
from polychirp.study.paper.results import PaperClaim, PaperResults


def write_paper(
    results: PaperResults,
    folder: Path,
    *,
    progress: Callable[[str], None] = lambda _: None,
) -> Path:
    """Write all files of a run into ``folder``; gives the path of the page, ``report.html``.

    The other files are ``results.json``, and every figure as ``figures/NAME.png`` and
    ``figures/NAME.svg``, with its data in ``figures/NAME.csv``. ``progress`` is called with the
    name of each file before it is written.
    """
    figures = folder / "figures"
    figures.mkdir(parents=True, exist_ok=True)
    progress("results.json")
    record = json.dumps(results_json(results), indent=1, allow_nan=False, ensure_ascii=False)
    (folder / "results.json").write_text(record + "\n", encoding="utf-8")
    pictures: dict[str, bytes] = {}
    for name, draw in _drawings(results):
        progress(f"figures/{name}.png")
        pictures[name] = draw().save(figures, name, formats=("png", "svg"))
    progress("report.html")
    report = folder / "report.html"
    report.write_text(page(results, pictures), encoding="utf-8")
    return report


def _drawings(results: PaperResults) -> Iterator[tuple[str, Callable[[], Drawing]]]:
    """Names of the figures and functions that draw them, in the paper's order, then our own."""
    both = (results.conventional, results.diverse)  # figures 4a and 4b have the same axes
    band, span = band_of(*both), span_of(*both)
    for name, schedule, title in (
        ("fig04a", results.conventional, "Fig. 4a · conventional triangular sweep"),
        ("fig04b", results.diverse, "Fig. 4b · triangular sweep with time and frequency diversity"),
    ):
        yield name, partial(spectrogram, schedule, title=title, band=band, span=span)
    yield "fig08-plan", partial(street_plan, results.scene)
    yield "fig08-view", partial(street_view, results.scene)
    if results.correlation is not None:
        yield from correlation_drawings(results.correlation)
    pair = headline_pair(results)
    if pair is not None:
        yield "fig11-both", partial(profile_pair, *pair, heading="Figs. 11a and 11b on one scale")
    for claim in results.claims:
        if row_of(results, claim) is not None:
            yield figure_name(claim), partial(_profile, results, claim)
    curves = results.statistics if results.stored is None else results.stored.rows
    if curves:
        yield "fig12-13", partial(detection_statistics, curves)
    if results.traced is not None:
        yield (
            "fig12-13-traced",
            partial(detection_statistics, results.traced.rows, targets="ray-traced vehicles"),
        )
    if any(row.scenario != "A" for row in results.rows):
        yield "floor-and-masking", partial(floor_and_masking, results.rows)


def _profile(results: PaperResults, claim: PaperClaim) -> Drawing:
    """A panel of figures 9 to 11; the panels of one figure, such as 10a and 10b, share a scale."""
    number = claim.figure[:-1]
    row = row_of(results, claim)
    panels = [row_of(results, other) for other in results.claims if other.figure[:-1] == number]
    assert row is not None
    limits = common_limits(panel for panel in panels if panel is not None)
    return range_profile(row, heading=f"Fig. {claim.figure}", limits=limits)
