"""One frame of a radar: power over range and range rate, and a plan of its detections."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from polychirp.axes import BoolArray
from polychirp.model.detection import Detections
from polychirp.model.spectra import RangeRateMap
from polychirp.report.figures.drawing import GREY, ORANGE, SKY, Drawing, new_figure, styled
from polychirp.report.figures.panels import COLOUR_SPAN_DB
from polychirp.report.figures.range_azimuth_parts import place
from polychirp.units import to_db


@styled
def range_rate_picture(
    map_: RangeRateMap, detections: Detections, *, title: str, note: str
) -> Drawing:
    """Range-rate map with its detections, and a plan of the detections; its data are the map.

    The map keeps the echoes of bodies at rest: if the radar is at rest, they form the bright column
    at zero. The colours begin at the median, the noise, and end `COLOUR_SPAN_DB` above it. ``note``
    is written in small print under the figure.
    """
    figure = new_figure(13.0, 5.4)
    left, right = figure.subplots(1, 2, width_ratios=[1.12, 1.0])
    _draw_map(figure, left, map_)
    still = np.abs(detections.range_rate) < 1.5 * (map_.range_rate[1] - map_.range_rate[0])
    _draw_detections(left, (detections.range_rate, detections.range), still)
    from_above = place(detections.range, detections.azimuth, detections.elevation)
    _draw_detections(right, from_above, still)
    greatest = float(map_.range[-1])
    left.set(xlabel="Range rate (m/s), positive = away", ylabel="Range (m)", ylim=(0.0, greatest))
    left.set_title("Power over range and range rate")
    _draw_plan(right, greatest)
    figure.suptitle(title, x=0.01, ha="left", weight="bold", size=11)
    figure.supxlabel(note, x=0.01, ha="left", fontsize=8, color=GREY)
    right.legend(loc="lower right")
    rate, distance = np.meshgrid(map_.range_rate, map_.range, indexing="ij")
    return Drawing(
        figure=figure,
        data={
            "range_m": distance.ravel(),
            "range_rate_m_per_s": rate.ravel(),
            "power_dbfs": to_db(map_.power).ravel(),
        },
    )


def _draw_map(figure: Figure, axes: Axes, map_: RangeRateMap) -> None:
    level = to_db(map_.power)
    lowest = float(np.median(level))
    image = axes.pcolormesh(
        map_.range_rate,
        map_.range,
        level.T,
        vmin=lowest,
        vmax=lowest + COLOUR_SPAN_DB,
        shading="nearest",
        rasterized=True,
    )
    axes.grid(visible=False)
    figure.colorbar(image, ax=axes, extend="both", label="Power, mean of channels (dBFS)", pad=0.02)


def _draw_detections(axes: Axes, where: tuple[np.ndarray, np.ndarray], still: BoolArray) -> None:
    for mask, marker, colour, label in (
        (~still, "o", ORANGE, "detected, moving"),
        (still, "s", SKY, "detected, at rest"),
    ):
        axes.plot(
            where[0][mask],
            where[1][mask],
            marker,
            markerfacecolor="none",
            markeredgecolor=colour,
            markeredgewidth=1.3,
            markersize=7,
            label=label,
            linestyle="none",
        )


def _draw_plan(axes: Axes, greatest: float) -> None:
    axes.plot([0.0], [0.0], "^", color=GREY, markersize=11, clip_on=False)
    for sine in (-0.5, 0.0, 0.5):
        reach = np.array([0.0, greatest])
        axes.plot(-reach * sine, reach * np.sqrt(1.0 - sine**2), color="0.85", linewidth=0.8)
    axes.set(
        xlabel="Left ← across (m) → right",
        ylabel="Ahead (m)",
        xlim=(-0.6 * greatest, 0.6 * greatest),
        ylim=(0.0, greatest),
        aspect="equal",
    )
    axes.set_title("Detections from above")
