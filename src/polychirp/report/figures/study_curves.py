"""Curves of a study over one axis of its grid, and paired differences, with 95 % intervals."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from polychirp.errors import InputError, no_such
from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)
from polychirp.scoring.statistics import Estimate
from polychirp.study.monte_carlo.grid import Label
from polychirp.study.monte_carlo.results import Results
from polychirp.study.monte_carlo.summary import Difference, Summary, differences, summaries

COLOURS: Final = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, INK)
MARKERS: Final = "os^Dv<>"
"""Colours and markers of curves, in their order; further curves begin again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """An estimate that has a panel: its label, and the factor from SI to the label's unit."""

    label: str
    scale: float = 1.0
    is_share: bool = False
    is_log: bool = False


QUANTITIES: Final[Mapping[str, Quantity]] = {
    "detection": Quantity(label="Detection probability", is_share=True),
    "ghosts": Quantity(label="Ghosts in a frame"),
    "missed": Quantity(label="Missed in a frame"),
    "range_rmse": Quantity(label="Range error, rms (m)", is_log=True),
    "range_rate_rmse": Quantity(label="Speed error, rms (km/h)", scale=3.6, is_log=True),
    "azimuth_rmse": Quantity(label="Azimuth error, rms (°)", scale=180.0 / math.pi, is_log=True),
}
"""Panels of the curves, by the names of `Summary`."""

DIFFERENCES: Final = ("detection", "ghosts", "range_rmse", "range_rate_rmse", "azimuth_rmse")
"""Panels of the differences, by the names of `Difference`."""


@styled
def study_curves(results: Results, *, over: str, title: str) -> Drawing:
    """Estimates of every curve over the axis ``over``, with 95 % intervals; one row per point.

    `run_plan` and `load_results` give the results.

    A curve is one radar and one label on every other axis. An axis of numbers is drawn to scale,
    one of names in its order. `InputError` is raised if the grid has no such axis.
    """
    number = axis_number(results, over)
    labels = results.axes[number][1]
    places = places_of(labels)
    figure = new_figure(10.5, 6.2)
    panels = dict(zip(QUANTITIES, figure.subplots(2, 3).ravel(), strict=True))
    curves = _curves(summaries(results), number)
    styles = dict(zip(curves, cycle(zip(COLOURS, MARKERS, strict=True)), strict=False))
    shift = 0.012 * (max(places) - min(places) or 1.0)
    for field, axes in panels.items():
        for n, (name, rows) in enumerate(curves.items()):
            x = np.array([places[labels.index(row.labels[number])] for row in rows])
            x = x + shift * (n - 0.5 * (len(curves) - 1))
            _draw(axes, x, rows, field, styles[name])
        _finish(axes, labels, places, over)
        quantity = QUANTITIES[field]
        axes.set(ylabel=quantity.label)
        if quantity.is_share:
            axes.set_ylim(-0.03, 1.03)
        if quantity.is_log and _has_positive(curves.values(), field):
            axes.set_yscale("log")
    _legend(figure, styles)
    figure.suptitle(title, x=0.01, ha="left", weight="bold", size=11)
    return Drawing(figure=figure, data=_table(results, summaries(results), tuple(QUANTITIES)))


@styled
def study_differences(results: Results, *, over: str, title: str) -> Drawing:
    """Differences to the first label of the axis ``over``, of the same trials, with 95 % intervals.

    Equal trials of two points have the same street and noise, so that intervals of the differences
    are smaller than those of the estimates: they decide which label is better. `InputError` is
    raised if the grid has no such axis, or the axis has one label.
    """
    number = axis_number(results, over)
    labels = results.axes[number][1]
    if len(labels) < 2:
        raise InputError(f"the axis '{over}' has one value; differences need two")
    rows = [row for row in differences(results) if row.axis == over]
    figure = new_figure(10.5, 6.2)
    panels = figure.subplots(2, 3).ravel()
    curves = _curves(rows, number)
    styles = dict(zip(curves, cycle(zip(COLOURS, MARKERS, strict=True)), strict=False))
    places = [float(n) for n in range(1, len(labels))]
    for field, axes in zip(DIFFERENCES, panels, strict=False):
        axes.axhline(0.0, color=GREY, linewidth=0.8)
        for n, (name, some) in enumerate(curves.items()):
            x = np.array([places[labels.index(row.other) - 1] for row in some])
            x = x + 0.05 * (n - 0.5 * (len(curves) - 1))
            _draw(axes, x, some, field, styles[name], line="")
        _finish(axes, labels[1:], places, over)
        axes.set_xlim(places[0] - 0.5, places[-1] + 0.5)
        axes.set(ylabel=f"Δ {QUANTITIES[field].label[0].lower()}{QUANTITIES[field].label[1:]}")
    panels[-1].set_axis_off()
    _legend(figure, styles)
    figure.suptitle(f"{title}, less '{labels[0]}'", x=0.01, ha="left", weight="bold", size=11)
    return Drawing(figure=figure, data=_table(results, rows, DIFFERENCES))


def axis_number(results: Results, name: str) -> int:
    """Number of the grid's axis of this name; `InputError` names those that there are."""
    names = [axis for axis, _ in results.axes]
    if not names:
        raise InputError("this study has one point and no axis to draw its results over")
    if name not in names:
        raise InputError(no_such("axis", name, names))
    return names.index(name)


def places_of(labels: Sequence[Label]) -> list[float]:
    """Places of labels on an axis: numbers themselves, and 0, 1, 2 … for names."""
    if all(isinstance(label, int | float) for label in labels):
        return [float(label) for label in labels]
    return [float(n) for n in range(len(labels))]


def _curves(rows: Sequence[Any], number: int) -> dict[tuple[str, tuple[Label, ...]], list[Any]]:
    """Rows by radar and by the labels on all axes but one."""
    curves: dict[tuple[str, tuple[Label, ...]], list[Any]] = {}
    for row in rows:
        others = tuple(label for n, label in enumerate(row.labels) if n != number)
        curves.setdefault((row.victim, others), []).append(row)
    return curves


def _draw(
    axes: Axes,
    x: np.ndarray,
    rows: Sequence[Any],
    field: str,
    style: tuple[str, str],
    *,
    line: str = "-",
) -> None:
    scale = QUANTITIES[field].scale
    estimates: list[Estimate] = [getattr(row, field) for row in rows]
    middle = scale * np.array([one.value for one in estimates])
    low = scale * np.array([one.low for one in estimates])
    high = scale * np.array([one.high for one in estimates])
    axes.errorbar(
        x,
        middle,
        yerr=np.maximum([middle - low, high - middle], 0.0),
        color=style[0],
        marker=style[1],
        markersize=4,
        linestyle=line,
        linewidth=1.2,
        elinewidth=0.8,
    )


def _has_positive(curves: Any, field: str) -> bool:
    """True if all values that are known are positive, so that a logarithmic axis shows them."""
    values = [getattr(row, field).value for rows in curves for row in rows]
    known = [value for value in values if not math.isnan(value)]
    return bool(known) and min(known) > 0.0


def _finish(axes: Axes, labels: Sequence[Label], places: Sequence[float], over: str) -> None:
    axes.set(xlabel=over.replace("$", r"\$"))
    if len(labels) <= 12:
        axes.set_xticks(places, [str(label).replace("$", r"\$") for label in labels])
    if max(len(str(label)) for label in labels) > 8:
        axes.tick_params(axis="x", rotation=20)


def _legend(figure: Any, styles: Mapping[Any, tuple[str, str]]) -> None:
    handles, names = [], []
    for (victim, others), (colour, marker) in styles.items():
        handles.append(Line2D([], [], color=colour, marker=marker, markersize=4, linewidth=1.2))
        names.append(", ".join([*(str(label) for label in others), victim]).replace("$", r"\$"))
    figure.legend(handles, names, loc="outside lower center", ncols=3)


def _table(
    results: Results, rows: Sequence[Summary | Difference], quantities: Sequence[str]
) -> dict[str, list[Any]]:
    data: dict[str, list[Any]] = {
        name: [row.labels[n] for row in rows] for n, (name, _) in enumerate(results.axes)
    }
    data["radar"] = [row.victim for row in rows]
    data["trials"] = [row.num_trials for row in rows]
    ends: dict[str, Callable[[Estimate], float]] = {
        "": lambda one: one.value,
        "_low": lambda one: one.low,
        "_high": lambda one: one.high,
    }
    for name in quantities:
        for end, of in ends.items():
            data[f"{name}{end}"] = [of(getattr(row, name)) for row in rows]
    return data
