"""How the cost of a radar's frame grows with what it hears."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)

COLOURS = (BLUE, VERMILION, GREEN, ORANGE)


@styled
def synthesis_growth_picture(
    panels: Mapping[str, Mapping[str, Sequence[tuple[float, float]]]], *, note: str
) -> Drawing:
    """Seconds over size, log–log: one panel for every size, one line for every way.

    Parameters
    ----------
    panels : name of the size, then name of the way, then (size, s)
    """
    figure = new_figure(3.4 * len(panels), 3.4)
    data: dict[str, list[float]] = {}
    all_axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axes, (size, lines) in zip(all_axes, panels.items(), strict=True):
        for colour, (way, points) in zip(COLOURS, lines.items(), strict=False):
            numbers, seconds = np.array(points, dtype=np.float64).T
            axes.plot(numbers, seconds, color=colour, marker="o", markersize=3.5, label=way)
            data[f"{size}, {way}"] = numbers.tolist()
            data[f"s, {size}, {way}"] = seconds.tolist()
        last = list(lines.values())[-1][-1]
        longest = np.array(sorted({n for points in lines.values() for n, _ in points}))
        axes.plot(longest, last[1] * longest / last[0], color=GREY, linestyle=":", label="linear")
        axes.set(xscale="log", yscale="log", xlabel=size.capitalize())
        if longest[-1] < 1_000:
            axes.set_xticks(longest, [f"{n:g}" for n in longest])
            axes.minorticks_off()
        axes.legend(loc="lower right", fontsize=7)
    least = min(s for lines in panels.values() for points in lines.values() for _, s in points)
    all_axes[0].set_ylim(bottom=0.3 * least)
    all_axes[0].set_ylabel("CPU time of a frame (s)")
    figure.suptitle(note, size=8.5)
    return Drawing(figure=figure, data=data)
