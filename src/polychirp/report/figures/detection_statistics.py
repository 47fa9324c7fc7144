"""The paper's figures 12 and 13: detection and accuracy over the number of targets."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    INK,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)
from polychirp.study.paper.results import (
    PAPER_ACCURACY,
    PAPER_TARGETS,
    Situation,
    StatisticsRow,
    WaveformKind,
)

_WAVEFORM_COLOUR: Final[dict[WaveformKind, str]] = {
    "conventional": VERMILION,
    "diverse": BLUE,
    "fixed-per-radar": GREEN,
}
_SITUATION_MARK: Final[dict[Situation, tuple[str, str]]] = {
    "alone": ("o", "-"),
    "interfered": ("s", "--"),
    "blanked": ("^", ":"),
}
_SITUATION_WORDS: Final = {
    "alone": "alone",
    "interfered": "two interferers",
    "blanked": "two interferers, blanked",
}
"""Words for each situation; above, the situations' markers and line styles."""

_PANELS: Final = {
    "detection": "Detection probability",
    "ghosts": "Ghosts in a frame",
    "range_rmse_m": "Range error, rms (m)",
    "azimuth_rmse_deg": "Azimuth error, rms (°)",
    "speed_rmse_kmh": "Speed error, rms (km/h)",
}
"""Fields of `StatisticsRow` that have a panel, and the labels of the panels."""

_GAINS: Final = {
    "detection_gain": "Detection probability,\nminus conventional",
    "ghosts_gain": "Ghosts in a frame,\nminus conventional",
}
"""Fields of paired differences, and the labels of their panels."""


@styled
def detection_statistics(rows: Sequence[StatisticsRow], *, targets: str = "points") -> Drawing:
    """Detection, ghosts and errors of every curve with 95 % intervals, and the paper's values.

    The last panels have differences between waveforms, trial by trial. ``targets`` says in the
    heading what the targets are.
    """
    figure = new_figure(12.4, 5.8)
    all_axes = figure.subplots(2, 4).ravel()
    curves = list(dict.fromkeys((row.waveform, row.situation) for row in rows))
    for axes, (field, label) in zip(all_axes, _PANELS.items(), strict=False):
        for number, curve in enumerate(curves):
            some = [row for row in rows if (row.waveform, row.situation) == curve]
            _curve(axes, some, field, curve, shift=0.06 * (number - len(curves) / 2))
        if field in PAPER_ACCURACY:
            place = PAPER_TARGETS, PAPER_ACCURACY[field]
            axes.plot(*place, marker="*", markersize=11, color=INK, linestyle="")
            _medians(axes, rows, field.replace("rmse", "median"))
            axes.set(yscale="log")
        _label(axes, rows, label)
    for axes, (field, label) in zip(all_axes[len(_PANELS) :], _GAINS.items(), strict=False):
        _gains(axes, rows, field)
        _label(axes, rows, label)
    all_axes[0].set(ylim=(-0.03, 1.03))
    _legend(all_axes)
    trials = " or ".join(str(count) for count in sorted({row.num_trials for row in rows}))
    figure.suptitle(f"Figs. 12 and 13 · {targets} in random traffic, {trials} trials", size=10)
    return Drawing(figure=figure, data=_data(rows))


def _label(axes: Axes, rows: Sequence[StatisticsRow], label: str) -> None:
    axes.set(xlabel="Targets", ylabel=label)
    axes.set_xticks(sorted({row.num_targets for row in rows}))


def _gains(axes: Axes, rows: Sequence[StatisticsRow], field: str) -> None:
    """Draw the differences of all curves that have them, and a line at zero."""
    paired = [row for row in rows if getattr(row, field) is not None]
    curves = list(dict.fromkeys((row.waveform, row.situation) for row in paired))
    for number, curve in enumerate(curves):
        some = [row for row in paired if (row.waveform, row.situation) == curve]
        _curve(axes, some, field, curve, shift=0.06 * (number - len(curves) / 2))
    axes.axhline(0.0, color=GREY, linewidth=0.5)


def _curve(
    axes: Axes,
    rows: Sequence[StatisticsRow],
    field: str,
    curve: tuple[WaveformKind, Situation],
    *,
    shift: float,
) -> None:
    values = np.array([getattr(row, field) for row in rows])
    middle, low, high = values.T
    marker, line = _SITUATION_MARK[curve[1]]
    axes.errorbar(
        np.array([row.num_targets for row in rows]) + shift,
        middle,
        yerr=np.maximum([middle - low, high - middle], 0.0),
        color=_WAVEFORM_COLOUR[curve[0]],
        marker=marker,
        markersize=4,
        linestyle=line,
        linewidth=1.2,
        elinewidth=0.8,
        label=f"{curve[0]}, {_SITUATION_WORDS[curve[1]]}",
    )


def _medians(axes: Axes, rows: Sequence[StatisticsRow], field: str) -> None:
    """Draw dashes at the medians of the absolute errors."""
    for waveform, colour in _WAVEFORM_COLOUR.items():
        some = [row for row in rows if row.waveform == waveform]
        axes.plot(
            [row.num_targets for row in some],
            [getattr(row, field) for row in some],
            marker="_",
            markersize=9,
            color=colour,
            linestyle="",
        )


def _legend(all_axes: Sequence[Axes]) -> None:
    """Draw the legend in the last panel, which has no curves, and a line at zero ghosts."""
    handles, labels = all_axes[0].get_legend_handles_labels()
    (star,) = (line for line in all_axes[len(_PANELS) - 1].lines if line.get_marker() == "*")
    median = Line2D([], [], marker="_", markersize=9, color=GREY, linestyle="")
    all_axes[-1].axis("off")
    all_axes[-1].legend(
        [*handles, median, star], [*labels, "medians", "the paper"], loc="center", fontsize=8.5
    )
    all_axes[1].axhline(0.0, color=GREY, linewidth=0.5)


def _data(rows: Sequence[StatisticsRow]) -> dict[str, list[Any]]:
    data: dict[str, list[Any]] = {
        "waveform": [row.waveform for row in rows],
        "situation": [row.situation for row in rows],
        "targets": [row.num_targets for row in rows],
        "num_trials": [row.num_trials for row in rows],
    }
    for field in (*_PANELS, "unexplained"):
        for n, what in enumerate(("", " low", " high")):
            data[f"{field}{what}"] = [getattr(row, field)[n] for row in rows]
    for field in _GAINS:
        for n, what in enumerate(("", " low", " high")):
            values = [getattr(row, field) for row in rows]
            data[f"{field}{what}"] = ["" if value is None else value[n] for value in values]
    for field in ("range_median_m", "azimuth_median_deg", "speed_median_kmh"):
        data[field] = [getattr(row, field) for row in rows]
    data["floor_rise_db"] = [row.floor_rise_db for row in rows]
    return data
