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
        ticks = _apart([n for n, _ in max(lines.values(), key=len)])
        axes.set_xticks(ticks, [f"{n:g}" if n < 1e4 else f"{n / 1e6:.2f} M" for n in ticks])
        axes.minorticks_off()
    all_axes[0].set_ylabel("CPU time of a snapshot (s)")
    all_axes[0].legend(loc="center right", bbox_to_anchor=(1.0, 0.4))
    figure.suptitle(note, size=8.5)
    return Drawing(figure=figure, data=data)


def _apart(sizes: Sequence[float]) -> list[float]:
    """Sizes of which each is a fifth greater than the one before, so that labels have room."""
    kept: list[float] = []
    for size in sizes:
        if not kept or size >= 1.2 * kept[-1]:
            kept.append(size)
    return kept
