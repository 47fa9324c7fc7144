"""How the cost of a snapshot grows with what is in the scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from polychirp.report.figures.drawing import BLUE, GREY, VERMILION, Drawing, new_figure, styled

COLOURS = (BLUE, VERMILION)


@styled
def scaling_picture(
    panels: Mapping[str, Mapping[str, Sequence[tuple[float, float]]]], *, note: str
) -> Drawing:
    """Seconds over size, log–log: one panel for every size, one line for every tracer.

    Parameters
    ----------
    panels : name of the size, then name of the tracer, then (size, s)
    """
    figure = new_figure(3.4 * len(panels), 3.4)
    data: dict[str, list[float]] = {}
    all_axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axes, (size, lines) in zip(all_axes, panels.items(), strict=True):
        for colour, (tracer, points) in zip(COLOURS, lines.items(), strict=False):
            numbers, seconds = np.array(points, dtype=np.float64).T
            axes.plot(numbers, seconds, color=colour, marker="o", label=tracer)
            data[f"{size}, {tracer}"] = numbers.tolist()
            data[f"s, {size}, {tracer}"] = seconds.tolist()
        first = next(iter(lines.values()))
        line = np.array([first[0][0], first[-1][0]])
        axes.plot(line, first[0][1] * line / line[0], color=GREY, linestyle=":", label="linear")
        axes.set(xscale="log", yscale="log", xlabel=size.capitalize())
        axes.set_xticks([n for n, _ in first], [f"{n:g}" for n, _ in first])
        axes.minorticks_off()
    all_axes[0].set_ylabel("CPU time of a snapshot (s)")
    all_axes[-1].legend(loc="best")
    figure.suptitle(note, size=8.5)
    return Drawing(figure=figure, data=data)
