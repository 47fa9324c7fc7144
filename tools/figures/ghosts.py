"""Probability of a direct ghost: measured with intervals, beside closed forms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from matplotlib.axes import Axes

from polychirp.report.figures.drawing import BLUE, GREY, VERMILION, Drawing, new_figure, styled

_PANELS: Final = {
    "start": ("Spread of starts (µs)", 1e6),
    "clock": ("Spread of clocks, ± (ppm)", 1e6),
    "slope": ("Difference of slopes", 1.0),
    "number": ("Interferers", 1.0),
}


@styled
def ghost_picture(record: Sequence[Mapping[str, Any]]) -> Drawing:
    """P(direct ghost in a frame) over starts, clocks, slopes and number of interferers.

    Parameters
    ----------
    record : rows with ``axis``, ``value``, ``waveform``, ``theory``, ``theory_of_ridges`` (the
        closed form with cross-pairing ridges) and ``direct``: value, low, high
    """
    figure = new_figure(10.0, 2.8)
    drawn: list[Mapping[str, Any]] = []
    panels = figure.subplots(1, len(_PANELS), sharey=True)
    for axes, (axis, (label, scale)) in zip(panels, _PANELS.items(), strict=True):
        for waveform, colour, mark in (("conventional", VERMILION, "o"), ("diverse", BLUE, "s")):
            rows = [row for row in record if (row["axis"], row["waveform"]) == (axis, waveform)]
            if rows:
                _points(axes, rows, scale, colour, mark, waveform)
            drawn += rows
        axes.set(xlabel=label, ylim=(-0.04, 1.04))
        if axis != "number":
            axes.set_xscale("log")
    panels[0].set_ylabel("P(direct ghost in a frame)")
    panels[0].legend(loc="upper right", fontsize=7)
    data = {
        "varied": [row["axis"] for row in drawn],
        "value": [row["value"] for row in drawn],
        "waveform": [row["waveform"] for row in drawn],
        "closed form": [row["theory"] for row in drawn],
        "with cross-pairing ridges": [row["theory_of_ridges"] for row in drawn],
        "measured": [row["direct"]["value"] for row in drawn],
        "low": [row["direct"]["low"] for row in drawn],
        "high": [row["direct"]["high"] for row in drawn],
    }
    return Drawing(figure=figure, data=data)


def _points(
    axes: Axes, rows: Sequence[Mapping[str, Any]], scale: float, colour: str, mark: str, label: str
) -> None:
    values = [scale * row["value"] for row in rows]
    middle = [row["direct"]["value"] for row in rows]
    below = [row["direct"]["value"] - row["direct"]["low"] for row in rows]
    above = [row["direct"]["high"] - row["direct"]["value"] for row in rows]
    if label == "conventional":
        theory = [row["theory"] for row in rows]
        with_ridges = [row["theory_of_ridges"] for row in rows]
        axes.plot(values, theory, color=GREY, linestyle="--", label="closed form")
        axes.plot(values, with_ridges, color=GREY, linestyle=":", label="with cross-pairing ridges")
    axes.errorbar(
        values,
        middle,
        yerr=[below, above],
        color=colour,
        marker=mark,
        markersize=3.5,
        linestyle="",
        capsize=2,
        label=label,
    )
