"""Detections of one frame over the truth: from above, and over range and range rate."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from polychirp.model.detection import Detections
from polychirp.model.score import Score
from polychirp.model.truth import Truth
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
from polychirp.report.figures.range_azimuth_parts import place

MARKS: Final[Mapping[str, tuple[str, str, str]]] = {
    "target": ("o", GREEN, "target found"),
    "body": ("s", BLUE, "another body"),
    "clutter": (".", GREY, "clutter"),
    "multipath": ("s", ORANGE, "ghost: own echo via a mirror"),
    "direct": ("X", VERMILION, "ghost: direct interference"),
    "indirect": ("P", VERMILION, "ghost: indirect interference"),
    "front-end": ("v", PURPLE, "ghost: own front end"),
    "unexplained": ("d", INK, "ghost: unexplained"),
}
"""Marker, colour and label of the causes of detections."""


@styled
def detections_plan(detections: Detections, truth: Truth, score: Score, *, title: str) -> Drawing:
    """Detections with their causes over the visible metal of the targets; its data are both.

    Light points are the places on the targets' visible metal. The strongest ghost of each other
    radar has its name. Detections without an azimuth are in
    the right panel only.
    """
    figure = new_figure(12.0, 5.4)
    left, right = figure.subplots(1, 2)
    nature = np.array(score.nature)
    for axes, metal, found in (
        (
            left,
            place(truth.place_range, truth.place_azimuth),
            place(detections.range, detections.azimuth),
        ),
        (
            right,
            (truth.place_range_rate, truth.place_range),
            (detections.range_rate, detections.range),
        ),
    ):
        axes.plot(*metal, ".", color=SKY, markersize=3, linestyle="none", label="visible metal")
        _draw_detections(axes, found, nature)
    left.plot([0.0], [0.0], "^", color=GREY, markersize=10, clip_on=False)
    left.set(xlabel="Left ← across (m) → right", ylabel="Ahead (m)")
    left.set_aspect("equal", adjustable="datalim")
    left.margins(0.08)
    left.set_title("From above")
    right.set(xlabel="Range rate (m/s), positive = away", ylabel="Range (m)")
    right.set_title("Range and range rate")
    for n in np.flatnonzero(truth.is_visible):
        name = truth.name[n].replace("$", r"\$")
        colour = GREEN if score.is_detected[n] else VERMILION
        where = place(truth.range[n], truth.azimuth[n])
        label = name if score.is_detected[n] else f"{name}, missed"
        left.annotate(label, where, (6, -10), textcoords="offset points", size=8.5, color=colour)
    _name_radars(right, (detections.range_rate, detections.range), score)
    figure.suptitle(title, x=0.01, ha="left", weight="bold", size=11)
    figure.legend(*right.get_legend_handles_labels(), loc="outside lower center", ncols=5)
    return Drawing(figure=figure, data=_data(detections, score))


def _draw_detections(axes: Axes, where: tuple[np.ndarray, np.ndarray], nature: np.ndarray) -> None:
    for name, (marker, colour, label) in MARKS.items():
        shown = nature == name
        if np.any(shown):
            axes.plot(
                where[0][shown],
                where[1][shown],
                marker,
                color=colour,
                markerfacecolor="none" if name in ("target", "body") else colour,
                markersize=7,
                linestyle="none",
                label=label,
            )


def _name_radars(axes: Axes, where: tuple[np.ndarray, np.ndarray], score: Score) -> None:
    """Write the name of every radar that causes ghosts beside its strongest one."""
    named: set[str] = set()
    for n, radar in enumerate(score.radar):  # detections are in the order of their power
        if radar is not None and radar not in named:
            named.add(radar)
            place, text = (where[0][n], where[1][n]), "of " + radar.replace("$", r"\$")
            axes.annotate(
                text, place, (7, 4), textcoords="offset points", size=8.5, color=VERMILION
            )


def _data(detections: Detections, score: Score) -> dict[str, Any]:
    return {
        "range_m": detections.range,
        "range_rate_m_per_s": detections.range_rate,
        "azimuth_rad": detections.azimuth,
        "elevation_rad": detections.elevation,
        "power_w": detections.power,
        "snr": detections.snr,
        "nature": list(score.nature),
        "body": [body or "" for body in score.body],
        "radar": [radar or "" for radar in score.radar],
    }
