"""Curves of a study over one axis of its grid, and paired differences, with 95 % intervals."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from polychirp.axes import FloatArray
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
from polychirp.report.figures.grid_axis import draw_ticks, grid_axis
from polychirp.scoring.statistics import Estimate
from polychirp.study.monte_carlo.grid import Label
from polychirp.study.monte_carlo.results import Results
from polychirp.study.monte_carlo.summary import Difference, Summary, differences, summaries
from polychirp.study.monte_carlo.tables import UNIT_SUFFIXES

Line = Literal["-", "--", ":", "-.", ""]
"""Line of a curve as matplotlib names it; empty if no line joins its points."""

COLOURS: Final = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, INK)
MARKERS: Final = "os^Dv<>"
LINES: Final[tuple[Line, ...]] = ("-", "--", ":", "-.")
"""Colours, markers and lines of curves, in their order (`styles_of`)."""

LEGEND_COLUMNS: Final = 3
"""Number of columns of the legend; chosen: three names of curves are about as wide as a figure."""

LEAST_SPAN: Final = 0.5
"""Least span of values of which `y_limits` takes account, as a share of the greatest value; chosen:
differences of values that are equal to a few percent are not blown up to the whole axis."""

LEAST_DECADES: Final = 0.3
"""As `LEAST_SPAN`, on a logarithmic axis, in decades: a factor of two."""

Curve = tuple[str, tuple[Label, ...]]
"""A curve: its radar, and its labels on all axes of the grid but one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """Colour, marker and line of one curve."""

    colour: str
    marker: str
    line: Line


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
    "elevation_rmse": Quantity(
        label="Elevation error, rms (°)", scale=180.0 / math.pi, is_log=True
    ),
}
"""Panels of the curves, by the names of `Summary`; the last one if an array measures elevations."""

DIFFERENCES: Final = tuple(name for name in QUANTITIES if name != "missed")
"""Panels of the differences, by the names of `Difference`; the last one as in `QUANTITIES`."""


@styled
def study_curves(results: Results, *, over: str, title: str) -> Drawing:
    """Estimates of every curve over the axis ``over``, with 95 % intervals; one row per point.

    `run_plan` and `load_results` give the results.

    A curve is one radar and one label on every other axis. An axis of numbers is drawn to scale if
    its labels are told apart there (`grid_axis`). An axis of names is drawn in its order, and no
    line joins its points. Intervals that are far wider than the values are apart end at the frame
    (`y_limits`). `InputError` is raised if the grid has no such axis.
    """
    number = axis_number(results, over)
    rows = summaries(results)
    curves = _curves(rows, number)
    labels = results.axes[number][1]
    axis = grid_axis(labels)
    place = dict(zip(labels, axis.places, strict=True))
    styles = styles_of(curves, with_lines=axis.are_numbers)
    offsets = axis.offsets(len(curves), most=0.02 * axis.span)
    fields = _measured(rows, tuple(QUANTITIES))
    figure, panels = _panels(len(fields), axis.width, num_curves=len(curves))
    is_cut = []
    for field, axes in zip(fields, panels, strict=True):
        quantity = QUANTITIES[field]
        for (name, some), offset in zip(curves.items(), offsets, strict=True):
            x = np.array([place[row.labels[number]] for row in some])
            _draw(axes, offset + x, some, field, styles[name])
        draw_ticks(axes, axis, over)
        axes.set(ylabel=quantity.label)
        if quantity.is_log and _has_positive(rows, field):
            axes.set_yscale("log")
        if quantity.is_share:
            axes.set_ylim(-0.03, 1.03)
        else:
            is_cut.append(_limit(axes, rows, field))
    _finish(figure, styles, title=title, is_cut=any(is_cut))
    return Drawing(figure=figure, data=_table(results, rows, fields))


@styled
def study_differences(results: Results, *, over: str, title: str) -> Drawing:
    """Differences to the first label of the axis ``over``, of the same trials, with 95 % intervals.

    Equal trials of two points have the same street and noise, so that intervals of the differences
    are smaller than those of the estimates: they decide which label is better. Places and limits
    are those of `study_curves`, but every panel shows zero. `InputError` is raised if the grid has
    no such axis, or the axis has one label.
    """
    number = axis_number(results, over)
    labels = results.axes[number][1]
    if len(labels) < 2:
        raise InputError(f"the axis '{over}' has one value; differences need two")
    rows = [row for row in differences(results) if row.axis == over]
    curves = _curves(rows, number)
    axis = grid_axis(labels[1:])
    place = dict(zip(labels[1:], axis.places, strict=True))
    styles = styles_of(curves, with_lines=False)
    offsets = axis.offsets(len(curves), most=0.15 * axis.gap)
    fields = _measured(rows, DIFFERENCES)
    figure, panels = _panels(len(fields), axis.width, num_curves=len(curves))
    is_cut = []
    for field, axes in zip(fields, panels, strict=True):
        axes.axhline(0.0, color=GREY, linewidth=0.8)
        for (name, some), offset in zip(curves.items(), offsets, strict=True):
            x = np.array([place[row.labels[number]] for row in some])
            _draw(axes, offset + x, some, field, styles[name])
        draw_ticks(axes, axis, over)
        axes.set_xlim(min(axis.places) - 0.5 * axis.gap, max(axis.places) + 0.5 * axis.gap)
        axes.set(ylabel=f"Δ {QUANTITIES[field].label[0].lower()}{QUANTITIES[field].label[1:]}")
        is_cut.append(_limit(axes, rows, field, has_zero=True))
    title = f"{title}, less '{labels[0]}'"
    _finish(figure, styles, title=title, is_cut=any(is_cut))
    return Drawing(figure=figure, data=_table(results, rows, fields))


def axis_number(results: Results, name: str) -> int:
    """Number of the grid's axis of this name; `InputError` names those that there are."""
    names = [axis for axis, _ in results.axes]
    if not names:
        raise InputError("this study has one point and no axis to draw its results over")
    if name not in names:
        raise InputError(no_such("axis", name, names))
    return names.index(name)


def styles_of(curves: Iterable[Curve], *, with_lines: bool) -> dict[Curve, Style]:
    """Style of every curve; 49 curves differ in colour or marker, also where they have no line."""
    styles = {}
    for n, curve in enumerate(curves):
        turn, colour = divmod(n, len(COLOURS))
        styles[curve] = Style(
            colour=COLOURS[colour],
            marker=MARKERS[(colour + turn) % len(MARKERS)],
            line=LINES[turn % len(LINES)] if with_lines else "",
        )
    return styles


def y_limits(
    values: FloatArray, low: FloatArray, high: FloatArray, *, least_span: float
) -> tuple[float, float] | None:
    """Ends of an axis that shows all values, and of their intervals what is near the values.

    The axis goes beyond the values by their span, or by ``least_span`` if that is more, but not
    beyond all intervals: of two trials, an interval can be a hundred times as wide as all values
    are apart. None is returned if there are no values, or if all are zero.

    >>> values = np.array([1.0, 2.0])
    >>> y_limits(values, values - 100.0, values + 0.5, least_span=0.0)
    (0.0, 2.5)
    """
    is_known = np.isfinite(values)
    if not np.any(is_known):
        return None
    known, low, high = values[is_known], low[is_known], high[is_known]
    span = max(float(np.ptp(known)), least_span)
    bottom = max(float(np.fmin(low, known).min()), float(known.min()) - span)
    top = min(float(np.fmax(high, known).max()), float(known.max()) + span)
    return (bottom, top) if bottom < top else None


def _measured(rows: Sequence[Any], fields: Sequence[str]) -> tuple[str, ...]:
    """The fields without that of elevations if no array measures any."""
    is_measured = any(math.isfinite(row.elevation_rmse.value) for row in rows)
    return tuple(name for name in fields if is_measured or name != "elevation_rmse")


def _panels(count: int, width: float, *, num_curves: int) -> tuple[Figure, list[Axes]]:
    """A figure of two rows of panels of this width, inches."""
    columns = -(-count // 2)
    figure = new_figure(columns * width, _height(num_curves))
    panels = figure.subplots(2, columns).ravel().tolist()
    for empty in panels[count:]:
        empty.remove()
    return figure, panels[:count]


def _height(num_curves: int) -> float:
    """Height of a figure, inches, whose panels do not shrink for a legend of many rows."""
    return 6.2 + 0.2 * max(-(-num_curves // LEGEND_COLUMNS) - 4, 0)


def _curves(rows: Sequence[Any], number: int) -> dict[Curve, list[Any]]:
    """Rows by radar and by the labels on all axes but one."""
    curves: dict[Curve, list[Any]] = {}
    for row in rows:
        others = tuple(label for n, label in enumerate(row.labels) if n != number)
        curves.setdefault((row.victim, others), []).append(row)
    return curves


def _draw(axes: Axes, x: FloatArray, rows: Sequence[Any], field: str, style: Style) -> None:
    along = np.argsort(x)  # a grid may have its numbers in any order
    middle, low, high = (column[along] for column in _estimates(rows, field))
    axes.errorbar(
        x[along],
        middle,
        yerr=np.maximum([middle - low, high - middle], 0.0),
        color=style.colour,
        marker=style.marker,
        markersize=4,
        linestyle=style.line,
        linewidth=1.2,
        elinewidth=0.8,
    )


def _estimates(rows: Sequence[Any], field: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values of a quantity and both ends of their intervals, in the unit of its label."""
    estimates: list[Estimate] = [getattr(row, field) for row in rows]
    scale = QUANTITIES[field].scale
    return (
        scale * np.array([one.value for one in estimates]),
        scale * np.array([one.low for one in estimates]),
        scale * np.array([one.high for one in estimates]),
    )


def _has_positive(rows: Sequence[Any], field: str) -> bool:
    """True if all values that are known are positive, so that a logarithmic axis shows them."""
    values = [getattr(row, field).value for row in rows]
    known = [value for value in values if not math.isnan(value)]
    return bool(known) and min(known) > 0.0


def _limit(axes: Axes, rows: Sequence[Any], field: str, *, has_zero: bool = False) -> bool:
    """Set `y_limits`, with zero among the values or not; return whether they cut off intervals."""
    values, low, high = _estimates(rows, field)
    if has_zero:
        values, low, high = (np.append(column, 0.0) for column in (values, low, high))
    least_span = LEAST_SPAN * float(np.nanmax(np.abs(values), initial=0.0))
    is_log = axes.get_yscale() == "log"
    if is_log:
        values, low, high = (np.log10(np.maximum(column, 1e-300)) for column in (values, low, high))
        least_span = LEAST_DECADES
    limits = y_limits(values, low, high, least_span=least_span)
    if limits is None:
        return False
    bottom, top = limits
    margin = 0.05 * (top - bottom)
    ends = np.array([bottom - margin, top + margin])
    axes.set_ylim(*(10.0**ends if is_log else ends))
    return bool(np.any(low < bottom) or np.any(high > top))


def _finish(figure: Figure, styles: Mapping[Curve, Style], *, title: str, is_cut: bool) -> None:
    """Add the title and the legend, which says what the bars are."""
    handles, names = [], []
    for (victim, others), style in styles.items():
        handles.append(
            Line2D(
                [],
                [],
                color=style.colour,
                marker=style.marker,
                linestyle=style.line,
                markersize=4,
                linewidth=1.2,
            )
        )
        names.append(", ".join([*(str(label) for label in others), victim]).replace("$", r"\$"))
    beyond = "; those that reach the frame go on beyond it" if is_cut else ""
    bars = f"Bars are 95 % intervals{beyond}"
    figure.legend(handles, names, title=bars, loc="outside lower center", ncols=LEGEND_COLUMNS)
    figure.suptitle(title, x=0.01, ha="left", weight="bold", size=11)


def _table(
    results: Results, rows: Sequence[Summary | Difference], quantities: Sequence[str]
) -> dict[str, list[Any]]:
    """Estimates in SI, in columns with the names of the tables of `polychirp study`."""
    data: dict[str, list[Any]] = {
        name: [row.labels[n] for row in rows] for n, (name, _) in enumerate(results.axes)
    }
    data["victim"] = [row.victim for row in rows]
    data["num_trials"] = [row.num_trials for row in rows]
    ends: dict[str, Callable[[Estimate], float]] = {
        "": lambda one: one.value,
        "_low": lambda one: one.low,
        "_high": lambda one: one.high,
    }
    for name in quantities:
        column = f"{name}{UNIT_SUFFIXES.get(name, '')}"
        for end, of in ends.items():
            data[f"{column}{end}"] = [of(getattr(row, name)) for row in rows]
    return data
