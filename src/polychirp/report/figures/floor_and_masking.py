"""The cost of diversity: floor rise, misses and ghosts of every variant side by side."""

from collections.abc import Callable, Sequence
from typing import Final

from matplotlib.axes import Axes

from polychirp.errors import InputError
from polychirp.report.figures.drawing import BLUE, VERMILION, Column, Drawing, new_figure, styled
from polychirp.report.verdict import interference_ghosts
from polychirp.report.words import SCENARIO_WORDS, WAVEFORM_WORDS, timing
from polychirp.study.paper.results import PaperRow

MEASURES: Final[tuple[tuple[str, str, Callable[[PaperRow], float]], ...]] = (
    ("floor_rise_db", "Floor rise (dB)", lambda row: row.floor_rise_db),
    ("missed", "Missed targets", lambda row: row.missed),
    ("interference_ghosts", "Ghosts of interference", lambda row: len(interference_ghosts(row))),
)
"""Column of the data, axis label and function of each measure."""
RECEIVER_MARKS: Final = {
    "none": ("o", BLUE, "no mitigation"),
    "blanking": ("D", VERMILION, "blanking"),
}
"""Marker, colour and label of each mitigation."""


@styled
def floor_and_masking(rows: Sequence[PaperRow]) -> Drawing:
    """Dot plots of all rows with interference: a panel per scenario, victim and measure.

    `InputError` is raised if no row has interference.
    """
    rows = [row for row in rows if row.scenario != "A"]
    if not rows:
        raise InputError("no row has interference; give rows of scenario B or C")
    cases = list(dict.fromkeys((row.scenario, row.radar) for row in rows))
    rank = list(WAVEFORM_WORDS).index
    ordered = sorted(rows, key=lambda row: (rank(row.waveform), not row.synchronous))
    places = list(dict.fromkeys((row.waveform, timing(row)) for row in ordered))

    figure = new_figure(10.5, 0.9 + len(cases) * (0.7 + 0.3 * len(places)))
    grid = figure.subplots(len(cases), len(MEASURES), sharex="col", sharey=True, squeeze=False)
    for line, (scenario, radar) in zip(grid, cases, strict=True):
        chosen = [row for row in rows if (row.scenario, row.radar) == (scenario, radar)]
        for axes, (_, _, measure) in zip(line, MEASURES, strict=True):
            _dots(axes, chosen, places, measure)
        line[0].set_title(f"{scenario}: {SCENARIO_WORDS[scenario]} at {radar}")
        line[0].set_yticks(
            range(len(places)), [f"{WAVEFORM_WORDS[waveform]}, {when}" for waveform, when in places]
        )
    grid[0, 0].set_ylim(len(places) - 0.5, -0.5)
    for axes, (_, label, _) in zip(grid[-1], MEASURES, strict=True):
        axes.set_xlabel(label)
        right = max(axes.get_xlim()[1], 1.0)  # an axis also where all counts are zero
        axes.set_xlim(-0.05 * right, right)
        if label != MEASURES[0][1]:
            axes.xaxis.get_major_locator().set_params(integer=True)
    figure.legend(
        *grid[0, 0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=len(RECEIVER_MARKS),
    )
    return Drawing(figure=figure, data=_table(rows))


def _dots(
    axes: Axes,
    rows: Sequence[PaperRow],
    places: Sequence[tuple[str, str]],
    measure: Callable[[PaperRow], float],
) -> None:
    """Draw one mark per row; marks of the two receivers are apart, so that none hides another."""
    for shift, (mitigation, (marker, colour, label)) in zip(
        (-0.14, 0.14), RECEIVER_MARKS.items(), strict=True
    ):
        chosen = [row for row in rows if row.mitigation == mitigation]
        axes.plot(
            [measure(row) for row in chosen],
            [places.index((row.waveform, timing(row))) + shift for row in chosen],
            linestyle="none",
            marker=marker,
            color=colour,
            label=label,
            clip_on=False,
            zorder=3,
        )


def _table(rows: Sequence[PaperRow]) -> dict[str, Column]:
    table: dict[str, Column] = {
        "scenario": [row.scenario for row in rows],
        "radar": [row.radar for row in rows],
        "waveform": [row.waveform for row in rows],
        "synchronous": [row.synchronous for row in rows],
        "mitigation": [row.mitigation for row in rows],
    }
    for name, _, measure in MEASURES:
        table[name] = [measure(row) for row in rows]
    return table
