"""How often there is a direct ghost: measured with intervals, over closed forms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from matplotlib.axes import Axes

from polychirp.report.figures.drawing import (
    BLUE,
    GREY,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)

_PANELS: Final = {
    "start": ("Spread of starts (µs)", 1e6),
    "clock": ("Spread of clocks, ± (ppm)", 1e6),
    "slope": ("Difference of slopes", 1.0),
    "number": ("Interferers", 1.0),
}


@styled
def ghost_picture(record: Sequence[Mapping[str, Any]]) -> Drawing:
    """P(direct ghost in a frame) over what keeps two radars apart, one panel for each.

    Parameters
    ----------
    record : rows with ``axis``, ``value``, ``waveform``, ``theory``, ``theory_of_arms``
        and ``direct``: value, low, high
    """
    figure = new_figure(10.0, 2.8)
    data: dict[str, list[Any]] = {name: [] for name in _COLUMNS}
    panels = figure.subplots(1, len(_PANELS), sharey=True)
    for axes, (axis, (label, scale)) in zip(panels, _PANELS.items(), strict=True):
        for waveform, colour, mark in (("conventional", VERMILION, "o"), ("diverse", BLUE, "s")):
            rows = [row for row in record if (row["axis"], row["waveform"]) == (axis, waveform)]
            if rows:
                _points(axes, rows, scale, colour, mark, waveform)
            for row in rows:
                _note(data, row)
        axes.set(xlabel=label, ylim=(-0.04, 1.04))
        if axis != "number":
            axes.set_xscale("log")
    panels[0].set_ylabel("P(direct ghost in a frame)")
    panels[0].legend(loc="upper right", fontsize=7)
    return Drawing(figure=figure, data=data)


_COLUMNS: Final = (
    "varied",
    "value",
    "waveform",
    "closed form",
    "with arms",
    "measured",
    "low",
    "high",
)


def _points(
    axes: Axes,
    rows: Sequence[Mapping[str, Any]],
    scale: float,
    colour: str,
    mark: str,
    label: str,
) -> None:
    values = [scale * row["value"] for row in rows]
    middle = [row["direct"]["value"] for row in rows]
    below = [row["direct"]["value"] - row["direct"]["low"] for row in rows]
    above = [row["direct"]["high"] - row["direct"]["value"] for row in rows]
    if label == "conventional":
        theory = [row["theory"] for row in rows]
        arms = [row["theory_of_arms"] for row in rows]
        axes.plot(values, theory, color=GREY, linestyle="--", label="closed form")
        axes.plot(values, arms, color=GREY, linestyle=":", label="with arms")
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


def _note(data: Mapping[str, list[Any]], row: Mapping[str, Any]) -> None:
    direct = row["direct"]
    entry = (
        row["axis"],
        row["value"],
        row["waveform"],
        row["theory"],
        row["theory_of_arms"],
        direct["value"],
        direct["low"],
        direct["high"],
    )
    for name, value in zip(_COLUMNS, entry, strict=True):
        data[name].append(value)
