"""Schemes over scenarios: detection probability and ghosts with 95 % intervals."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from polychirp.report.figures.drawing import BLUE, GREY, Drawing, new_figure, styled
from polychirp.study.monte_carlo.comparison import Cell, columns

_ROWS: Final = (("detection", "Detection probability"), ("ghosts", "Ghosts in a frame"))
"""Fields of `Cell` with their labels, one row of panels each."""


@styled
def scheme_comparison(cells: Sequence[Cell]) -> Drawing:
    """One column of panels for every scenario and condition; schemes are on the vertical axis.

    Filled marks are schemes whose errors (missed targets and ghosts) are not more than those of the
    best one, trials paired; empty ones have more. Bars are 95 % intervals.
    """
    groups = list(dict.fromkeys((cell.scenario, cell.condition) for cell in cells))
    schemes = list(dict.fromkeys(cell.scheme for cell in cells))
    figure = new_figure(2.0 + 2.1 * len(groups), 1.6 + 2 * 0.24 * len(schemes))
    panels = figure.subplots(2, len(groups), sharey=True, squeeze=False)
    for row, (field, label) in zip(panels, _ROWS, strict=True):
        for axes, group in zip(row, groups, strict=True):
            mine = [cell for cell in cells if (cell.scenario, cell.condition) == group]
            _draw(axes, mine, schemes, field)
            axes.set_xlabel(label)
            if field == "detection":
                axes.set_xlim(-0.03, 1.03)
                axes.set_title("\n".join([group[0], ", ".join(map(str, group[1]))]), fontsize=9)
            else:
                axes.set_xlim(left=-0.05 * axes.get_xlim()[1])
        row[0].set_yticks(range(len(schemes)), [str(scheme) for scheme in schemes])
    panels[0, 0].invert_yaxis()  # the axes share it: the first scheme is above
    return Drawing(figure=figure, data=columns(cells))


def _draw(axes: Axes, cells: Sequence[Cell], schemes: Sequence[object], field: str) -> None:
    for cell in cells:
        estimate = getattr(cell, field)
        reach = np.array([[estimate.value - estimate.low], [estimate.high - estimate.value]])
        axes.errorbar(
            [estimate.value],
            [schemes.index(cell.scheme)],
            xerr=np.nan_to_num(np.maximum(reach, 0.0)),
            color=BLUE,
            marker="o",
            markersize=4.5,
            markerfacecolor=BLUE if cell.is_among_the_best else "white",
            elinewidth=1.0,
        )
    axes.grid(axis="y", color=GREY, alpha=0.25)
