"""Loss of each method of mitigation to the clean oracle, by the family of frames."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from polychirp.report.figures.drawing import Drawing, new_figure, styled
from polychirp.study.mitigation.benchmark import ORACLE, PERCENTILES, MethodResult

GREATEST_LOSS: Final = 30.0
"""Loss at which the colour scale ends, dB; chosen."""

_MEDIAN: Final = PERCENTILES.index(50)


@styled
def benchmark_picture(results: Sequence[MethodResult], *, title: str) -> Drawing:
    """Median SINR along range of every method and family below that of the clean oracle, in dB.

    A method that refuses a family has an empty cell. The data are one row for each cell.
    """
    families = list(dict.fromkeys(result.family for result in results))
    methods = list(dict.fromkeys(result.method for result in results))
    sinr = {(r.method, r.family): r.percentiles("sinr_range")[_MEDIAN] for r in results}
    loss = np.array(
        [[sinr[ORACLE, family] - sinr[method, family] for family in families] for method in methods]
    )
    figure = new_figure(2.9 + 0.85 * len(families), 1.9 + 0.26 * len(methods))
    axes = figure.subplots()
    image = axes.imshow(
        np.ma.masked_invalid(loss), vmin=0.0, vmax=GREATEST_LOSS, cmap="cividis_r", aspect="auto"
    )
    for row, line in enumerate(loss):
        for column, value in enumerate(line):
            if not np.isnan(value):
                colour = "white" if value > 0.6 * GREATEST_LOSS else "black"
                shown = f"{value + 0.0:.1f}"
                axes.text(column, row, shown, ha="center", va="center", color=colour, size=7)
    axes.set_xticks(range(len(families)), families, rotation=30, ha="right")
    axes.set_yticks(range(len(methods)), methods)
    axes.grid(visible=False)
    figure.colorbar(image, label="Loss of SINR to the clean frame (dB)")
    figure.suptitle(title, size=10)
    figure.set_layout_engine("constrained")
    return Drawing(figure=figure, data=_columns(methods, families, loss))


def _columns(methods: Sequence[str], families: Sequence[str], loss: Any) -> dict[str, list[Any]]:
    cells = [(method, family) for method in methods for family in families]
    return {
        "method": [method for method, _ in cells],
        "family": [family for _, family in cells],
        "sinr_loss_db": [float(value) for value in np.ravel(loss)],
    }
