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
from polychirp.report.figures.place_labels import Label, write_labels
from polychirp.report.figures.range_azimuth_parts import place

MARKS: Final[Mapping[str, tuple[str, str, str]]] = {
    "target": ("o", GREEN, "target found"),
    "body": ("s", BLUE, "body, not on a target's visible metal"),
    "clutter": (".", GREY, "clutter"),
    "folded": ("d", BLUE, "echo at a folded range rate"),
    "multipath": ("s", ORANGE, "ghost: own echo via a mirror"),
    "direct": ("X", VERMILION, "ghost: direct interference"),
    "indirect": ("P", VERMILION, "ghost: indirect interference"),
    "front-end": ("v", PURPLE, "ghost: own front end"),
    "unexplained": ("d", INK, "ghost: unexplained"),
}
"""Marker, colour and label of the causes of detections."""

BESIDE: Final = "beside"
"""Cause of a detection in this figure alone: an echo of a target beside its visible metal, whose
nature is "body"."""

PLAN_MARKS: Final[Mapping[str, tuple[str, str, str]]] = {
    "target": MARKS["target"],
    BESIDE: ("s", GREEN, "target, beside its visible metal"),
    **MARKS,
    "body": ("s", BLUE, "another body"),
}
"""`MARKS` for this figure, which has the names of the targets and tells these from other bodies."""

HOLLOW: Final = ("target", BESIDE, "body", "folded")
"""Causes whose marks are hollow: echoes of bodies, whose visible metal is seen through them."""

LEAST_SPAN: Final = 2.0
"""Least span of the axes of range, m, and of range rate, m/s; chosen: the error of a good detection
is some centimetres, and looks as small as it is. At a tenth of it, it would look like a miss."""


@styled
def detections_plan(detections: Detections, truth: Truth, score: Score, *, title: str) -> Drawing:
    """Detections with their causes over the visible metal of the targets; its data are both.

    Light points are the places on the targets' visible metal. Targets out of sight, which do not
    count as missed, are grey. The strongest ghost of each other radar has its name. Detections
    without an azimuth are in the right panel only.
    """
    figure = new_figure(12.0, 5.4)
    left, right = figure.subplots(1, 2)
    causes = _causes(score, truth)
    for axes, metal, found in (
        (
            left,
            place(truth.place_range, truth.place_azimuth, truth.place_elevation),
            place(detections.range, detections.azimuth, detections.elevation),
        ),
        (
            right,
            (truth.place_range_rate, truth.place_range),
            (detections.range_rate, detections.range),
        ),
    ):
        axes.plot(*metal, ".", color=SKY, markersize=3, linestyle="none", label="visible metal")
        _draw_detections(axes, found, causes)
    left.plot([0.0], [0.0], "^", color=GREY, markersize=10, clip_on=False)
    left.set(xlabel="Left ← across (m) → right", ylabel="Ahead (m)")
    left.set_aspect("equal", adjustable="datalim")
    left.margins(0.08)
    left.set_title("From above")
    right.set(xlabel="Range rate (m/s), positive = away", ylabel="Range (m)")
    right.set_title("Range and range rate")
    _widen(right)
    figure.suptitle(title, x=0.01, ha="left", weight="bold", size=11)
    figure.legend(*right.get_legend_handles_labels(), loc="outside lower center", ncols=5)
    figure.draw_without_rendering()  # labels need the final places of what they shall not cover
    write_labels(left, _names_of_targets(truth, score), _marks(left))
    write_labels(right, _names_of_radars(detections, score), _marks(right))
    return Drawing(figure=figure, data=_data(detections, score))


def _causes(score: Score, truth: Truth) -> np.ndarray:
    """Key of `PLAN_MARKS` of every detection."""
    pairs = zip(score.nature, score.body, strict=True)
    return np.array(
        [BESIDE if what == "body" and body in truth.name else what for what, body in pairs]
    )


def _draw_detections(axes: Axes, where: tuple[np.ndarray, np.ndarray], causes: np.ndarray) -> None:
    for cause, (marker, colour, label) in PLAN_MARKS.items():
        shown = causes == cause
        if np.any(shown):
            axes.plot(
                where[0][shown],
                where[1][shown],
                marker,
                color=colour,
                markerfacecolor="none" if cause in HOLLOW else colour,
                markersize=7,
                linestyle="none",
                label=label,
            )


def _widen(axes: Axes) -> None:
    """Give both axes at least `LEAST_SPAN`, about the middle of what they show."""
    for limits, set_limits in ((axes.get_xlim(), axes.set_xlim), (axes.get_ylim(), axes.set_ylim)):
        low, high = limits
        missing = max(LEAST_SPAN - (high - low), 0.0)
        set_limits(low - 0.5 * missing, high + 0.5 * missing)


def _marks(axes: Axes) -> np.ndarray:
    """Places of all marks in the axes' data, ``(mark, xy)``."""
    return np.concatenate([line.get_xydata() for line in axes.lines])


def _names_of_targets(truth: Truth, score: Score) -> list[Label]:
    """Names of the visible targets at their nearest points, and what became of them."""
    across, ahead = place(truth.range, truth.azimuth, truth.elevation)
    labels = []
    for n in np.flatnonzero(truth.is_visible).tolist():
        ending, colour = _result(score, n)
        text = _plain(truth.name[n]) + ending
        labels.append(Label(text=text, point=(float(across[n]), float(ahead[n])), colour=colour))
    return labels


def _result(score: Score, target: int) -> tuple[str, str]:
    """Text that follows a target's name, and its colour."""
    if score.is_detected[target]:
        return "", GREEN
    return (", missed", VERMILION) if score.is_in_sight[target] else (", out of sight", GREY)


def _names_of_radars(detections: Detections, score: Score) -> list[Label]:
    """Name of every radar that causes ghosts, at its strongest one."""
    strongest: dict[str, int] = {}
    for n, radar in enumerate(score.radar):  # detections are in the order of their power
        if radar is not None:
            strongest.setdefault(radar, n)
    return [
        Label(
            text=f"of {_plain(radar)}",
            point=(float(detections.range_rate[n]), float(detections.range[n])),
            colour=VERMILION,
        )
        for radar, n in strongest.items()
    ]


def _plain(name: str) -> str:
    """A name in which matplotlib sees no formula."""
    return name.replace("$", r"\$")


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
