"""Figures 9 to 11: a range profile of one radar with true targets, detections and ghosts."""

import math
from collections.abc import Iterable
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from polychirp.axes import FloatArray
from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    INK,
    LABEL_BOX,
    ORANGE,
    PURPLE,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)
from polychirp.report.verdict import RANGE_AGREEMENT
from polychirp.report.words import variant_name
from polychirp.study.paper.results import GhostKind, PaperRow

MAX_RANGE: Final = 30.0
"""Greatest range that is drawn, m: the paper's greatest target range."""

FLOOR_PLACE: Final = 23.0
"""Range at which the height of the floor over thermal noise is shown, m; chosen: behind the targets
and before the farthest ghosts of the paper."""

LEAST_HEIGHT_DB: Final = 15.0
"""Height of the floor over thermal noise from which on it is shown, dB; chosen: lower ones need no
arrow."""

LABEL_APART: Final = 0.75
"""Least distance between the upright labels of ghosts, m; chosen: their height."""

GHOST_MARKS: Final[dict[GhostKind, tuple[str, str, str]]] = {
    "direct": ("X", VERMILION, "ghost: direct interference"),
    "indirect": ("P", VERMILION, "ghost: indirect interference"),
    "multipath": ("s", ORANGE, "ghost: own echo via a mirror"),
    "front-end": ("v", PURPLE, "ghost: own front end"),
    "unexplained": ("d", PURPLE, "ghost: unexplained"),
}
"""Marker, colour and label of each kind of ghost."""


def common_limits(rows: Iterable[PaperRow]) -> tuple[float, float]:
    """Ends of a power axis on which all rows fit, dBm, so that figures can be compared.

    The ends are multiples of 10 dB. Values more than 20 dB below the noise do not extend the axis.
    """
    rows = tuple(rows)
    lowest = min(
        max(float(row.profile_power_db[_shown(row)].min()), row.noise_floor_db - 20.0)
        for row in rows
    )
    highest = max(float(row.profile_power_db[_shown(row)].max()) for row in rows)
    lowest = min(lowest, *(row.noise_floor_db for row in rows))
    return 10.0 * math.floor((lowest - 3.0) / 10.0), 10.0 * math.ceil((highest + 4.0) / 10.0)


@styled
def range_profile(row: PaperRow, *, heading: str, limits: tuple[float, float]) -> Drawing:
    """Beamformed range profile of a row over 0–30 m; its data are the profile.

    Parameters
    ----------
    heading : text before the name of the case, such as "Fig. 10a"
    limits : ends of the power axis, dBm; see `common_limits`
    """
    shown = _shown(row)
    range_, power = row.profile_range[shown], row.profile_power_db[shown]
    figure = new_figure(8.0, 4.9)
    axes = figure.add_subplot()
    axes.plot(range_, power, color=BLUE, label="range profile")
    axes.axhline(row.noise_floor_db, color=GREY, linestyle=":", label="thermal noise floor")
    label = "the paper's threshold, eq. 12, not used here"
    axes.axhline(row.mean_threshold_db, color=GREY, linestyle="--", linewidth=0.9, label=label)
    _mark_truth(axes, row, limits)
    _mark_detections(axes, row, range_, power)
    _mark_ghosts(axes, row, range_, power)
    _label_peaks(axes, row, range_, power, limits)
    mark_floor(axes, row, range_, power)
    axes.set(
        xlim=(0.0, MAX_RANGE),
        ylim=limits,
        xlabel="Range (m)",
        ylabel="Power at the converter (dBm)",
    )
    figure.suptitle(f"{heading} · {variant_name(row)}", x=0.01, ha="left", weight="bold", size=11)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return Drawing(figure=figure, data={"range_m": range_, "power_dbm": power})


def _shown(row: PaperRow) -> FloatArray:
    return np.asarray((row.profile_range >= 0.0) & (row.profile_range <= MAX_RANGE))


def _mark_truth(axes: Axes, row: PaperRow, limits: tuple[float, float]) -> None:
    """Draw a line at every target; names above the axes are moved apart where targets are close."""
    targets = sorted(
        (t for t in row.targets if 0.0 <= t.range_m <= MAX_RANGE), key=lambda t: t.range_m
    )
    places = spread([t.range_m for t in targets], apart=1.0)
    span = limits[1] - limits[0]
    for target, place in zip(targets, places, strict=True):
        colour = GREEN if target.detected else VERMILION
        axes.axvline(target.range_m, color=colour, linewidth=0.9, alpha=0.75, zorder=1)
        axes.annotate(
            f"{target.name}  {target.range_m:.2f} m{'' if target.detected else '  missed'}",
            xy=(target.range_m, limits[1]),
            xytext=(place, limits[1] + 0.02 * span),
            rotation=38,
            rotation_mode="anchor",
            ha="left",
            va="bottom",
            size=8.5,
            color=colour,
            annotation_clip=False,
        )
    if targets:
        axes.plot([], [], color=GREEN, linewidth=0.9, label="true target")


def _mark_detections(axes: Axes, row: PaperRow, range_: FloatArray, power: FloatArray) -> None:
    """Mark detections on the profile; their powers are estimates of single points, and differ."""
    places = row.detection_range[row.detection_range <= MAX_RANGE]
    if places.size:
        axes.plot(
            places,
            np.interp(places, range_, power),
            linestyle="none",
            marker="o",
            markerfacecolor="none",
            markeredgecolor=INK,
            label="detection",
        )


def _mark_ghosts(axes: Axes, row: PaperRow, range_: FloatArray, power: FloatArray) -> None:
    """Mark ghosts on the profile, since a row has their power only relative to a target's."""
    for number, (kind, (marker, colour, label)) in enumerate(GHOST_MARKS.items()):
        places = [g.range_m for g in row.ghosts if g.kind == kind and g.range_m <= MAX_RANGE]
        if places:
            axes.plot(
                places,
                np.interp(places, range_, power),
                linestyle="none",
                marker=marker,
                markersize=9,
                markeredgecolor="white",
                color=colour,
                label=label,
                zorder=5.0 - 0.1 * number,  # direct ghosts are not hidden by weaker ones
            )


def _label_peaks(
    axes: Axes,
    row: PaperRow,
    range_: FloatArray,
    power: FloatArray,
    limits: tuple[float, float],
) -> None:
    """Write the range below every ghost, and below the strongest peak if it is no ghost or target.

    A ghost beside a stronger one has no label, which would be drawn over the other.
    """
    strongest = float(range_[np.argmax(power)])
    labels: dict[float, tuple[str, str]] = {}
    for ghost in row.ghosts:  # strongest first
        if all(abs(ghost.range_m - place) > RANGE_AGREEMENT for place in labels):
            labels[ghost.range_m] = (f"{ghost.range_m:.2f} m", GHOST_MARKS[ghost.kind][1])
    named = [*labels, *(target.range_m for target in row.targets)]
    if all(abs(strongest - place) > RANGE_AGREEMENT for place in named):
        labels[strongest] = (f"strongest peak {strongest:.2f} m", INK)
    shown = sorted(place for place in labels if place <= MAX_RANGE)
    foot = limits[0] + 0.02 * (limits[1] - limits[0])
    for place, at in zip(shown, spread(shown, apart=LABEL_APART), strict=True):
        label, colour = labels[place]
        axes.annotate(
            label,
            (place, float(np.interp(place, range_, power))),
            (at, foot),
            rotation=90,
            ha="center",
            va="bottom",
            size=8.5,
            color=colour,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.5, "alpha": 0.6},
        )


def mark_floor(axes: Axes, row: PaperRow, range_: FloatArray, power: FloatArray) -> None:
    """Draw an arrow from thermal noise to the profile at `FLOOR_PLACE`, if it is long."""
    level = float(np.interp(FLOOR_PLACE, range_, power))
    height = level - row.noise_floor_db
    if height < LEAST_HEIGHT_DB:
        return
    axes.annotate(
        "",
        (FLOOR_PLACE, level),
        (FLOOR_PLACE, row.noise_floor_db),
        arrowprops={"arrowstyle": "<->", "color": INK, "linewidth": 1.2},
    )
    middle = (FLOOR_PLACE, level - 0.5 * height)
    axes.annotate(
        f"+{height:.0f} dB",
        middle,
        (6, 0),
        textcoords="offset points",
        weight="bold",
        bbox=LABEL_BOX,
    )


def spread(places: list[float], *, apart: float) -> list[float]:
    """Ascending places, moved to the right where neighbours would be closer than ``apart``.

    >>> spread([1.0, 1.2, 5.0], apart=1.0)
    [1.0, 2.0, 5.0]
    """
    moved: list[float] = []
    for place in places:
        moved.append(max(place, moved[-1] + apart) if moved else place)
    return moved
