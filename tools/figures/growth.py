"""Growth of computing time with the size of the problem."""

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

CURVE_COLOURS = (BLUE, VERMILION, GREEN, ORANGE)


@styled
def growth_picture(
    panels: Mapping[str, Mapping[str, Sequence[tuple[float, float]]]], *, cost: str, note: str
) -> Drawing:
    """Seconds over size, log–log: one panel for every size, one line for every method.

    Parameters
    ----------
    panels : name of the size, then name of the method, then (size, s)
    cost : label of the vertical axis
    """
    figure = new_figure(3.4 * len(panels), 3.4)
    data: dict[str, list[float]] = {}
    methods = list(dict.fromkeys(method for lines in panels.values() for method in lines))
    all_axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axes, (size, lines) in zip(all_axes, panels.items(), strict=True):
        for method, points in lines.items():
            numbers, seconds = np.array(points, dtype=np.float64).T
            colour = CURVE_COLOURS[methods.index(method) % len(CURVE_COLOURS)]
            axes.plot(numbers, seconds, color=colour, marker="o", markersize=3.5, label=method)
            data[f"{size}, {method}"] = numbers.tolist()
            data[f"s, {size}, {method}"] = seconds.tolist()
        longest = max(lines.values(), key=len)
        last = longest[-1]
        line = np.array([longest[0][0], last[0]])
        axes.plot(line, last[1] * line / last[0], color=GREY, linestyle=":", label="linear")
        axes.set(xscale="log", yscale="log", xlabel=size.capitalize())
        if last[0] < 1e3 * longest[0][0]:  # over more decades powers of ten are clearer
            ticks = _apart([n for n, _ in longest])
            axes.set_xticks(ticks, [f"{n:g}" if n < 1e4 else f"{n / 1e6:.2f} M" for n in ticks])
            axes.minorticks_off()
    least = min(s for lines in panels.values() for points in lines.values() for _, s in points)
    all_axes[0].set_ylim(bottom=0.3 * least)
    all_axes[0].set_ylabel(cost)
    fullest = max(range(len(panels)), key=lambda n: len(list(panels.values())[n]))
    all_axes[fullest].legend(loc="best", fontsize=7)
    figure.suptitle(note, size=8.5)
    return Drawing(figure=figure, data=data)


def _apart(sizes: Sequence[float]) -> list[float]:
    """Sizes of which each is at least a fifth above the one before, so that labels have room."""
    kept: list[float] = []
    for size in sizes:
        if not kept or size >= 1.2 * kept[-1]:
            kept.append(size)
    return kept
