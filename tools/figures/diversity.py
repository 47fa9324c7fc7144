"""Suppression of a direct interferer by diversity, over spread and over number of sweeps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes

from polychirp.report.figures.drawing import BLUE, GREY, VERMILION, Drawing, new_figure, styled


@styled
def diversity_picture(record: Mapping[str, Any]) -> Drawing:
    """Suppression relative to a ghost of equal ramps that start together, in dB.

    Parameters
    ----------
    record : ``spreads`` and ``sweeps``; and ``over_spread`` and ``over_sweeps``: for each kind of
        diversity one row of ``matched_mean``, ``matched_peak``, ``per_sweep`` and ``law`` (dB) for
        each of them
    """
    figure = new_figure(8.0, 3.6)
    left, right = figure.subplots(1, 2, sharey=True)
    data: dict[str, Sequence[Any]] = {"what": [], "over": [], "size": [], "strongest cell, dB": [],
                                      "mean of cells, dB": []}  # fmt: skip
    _lines(left, record["spreads"], record["over_spread"], "spread", data)
    _lines(right, record["sweeps"], record["over_sweeps"], "sweeps", data)
    law = [row["law"] for row in next(iter(record["over_sweeps"].values()))]
    right.plot(record["sweeps"], law, color=GREY, linestyle=":", label="10 log B T$_{frame}$")
    left.set(xscale="log", xlabel="Spread of the draws, ±", ylabel="Suppression of the ghost (dB)")
    right.set(xscale="log", xlabel="Triangles in a frame")
    right.set_xticks(record["sweeps"], [str(count) for count in record["sweeps"]])
    right.minorticks_off()
    for axes in (left, right):
        axes.legend(loc="lower right", fontsize=7)
    return Drawing(figure=figure, data=data)


def _lines(
    axes: Axes,
    sizes: Sequence[float],
    lines: Mapping[str, Sequence[Mapping[str, float]]],
    over: str,
    data: dict[str, Any],
) -> None:
    """Draw strongest cell and mean of cells, one colour for each kind of diversity."""
    for colour, (name, rows) in zip((VERMILION, BLUE), lines.items(), strict=False):
        peak, mean = ([row[key] for row in rows] for key in ("matched_peak", "matched_mean"))
        axes.plot(sizes, peak, color=colour, marker="o", markersize=3.5, label=f"{name}, strongest")
        axes.plot(sizes, mean, color=colour, linestyle="--", label=f"{name}, mean")
        data["what"] += [name] * len(sizes)
        data["over"] += [over] * len(sizes)
        data["size"] += list(sizes)
        data["strongest cell, dB"] += peak
        data["mean of cells, dB"] += mean
