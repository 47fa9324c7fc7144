"""Range-rate maps of the parts of one frame."""

from collections.abc import Mapping
from functools import partial
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from polychirp.axes import FloatArray
from polychirp.model.detection import Detections
from polychirp.model.spectra import RangeRateMap
from polychirp.model.truth import Truth
from polychirp.receiver.overview.pooling import group_means, pooled
from polychirp.report.figures.drawing import VERMILION, Drawing, styled
from polychirp.report.figures.panels import Surface, columns_of, panels

MOST_CELLS: Final = 300
"""Greatest number of cells along each axis of a map that is drawn; chosen: a panel has as many
pixels. Further cells are grouped, and the greatest of each group is drawn."""


@styled
def range_rate_parts(
    maps: Mapping[str, RangeRateMap], detections: Detections, truth: Truth, *, title: str
) -> Drawing:
    """A range-rate map of each part, with the visible targets; its data are the cells drawn.

    Detections are drawn in the last map. In maps that are periodic, the range rates of targets and
    detections are folded into the span of the maps, so that they lie on their cells; a diamond
    marks a detection whose own range rate is outside of that span.
    """
    *_, last = maps
    surfaces = {name: _surface(map_) for name, map_ in maps.items()}

    def mark(axes: Axes, name: str) -> None:
        mark_targets(axes, truth, maps[name])
        if name == last:
            _mark_detections(axes, detections, maps[name])
        axes.set_xlim(maps[name].range_rate[0], maps[name].range_rate[-1])

    figure = panels(
        surfaces,
        mark,
        title=title,
        xlabel="Range rate (m/s), positive = away",
        ylabel="Range (m)",
    )
    # outside of the maps, whose echoes it would cover; dark as they are, since circles are white
    figure.legend(
        *figure.axes[len(maps) - 1].get_legend_handles_labels(),
        loc="outside upper right",
        ncols=3,
        facecolor="0.15",
        labelcolor="white",
        markerscale=0.6,
    )
    return Drawing(figure=figure, data=columns_of(surfaces, "range_rate_m_per_s", "range_m"))


def _surface(map_: RangeRateMap) -> Surface:
    few = partial(pooled, most=MOST_CELLS)
    return Surface(
        x=group_means(map_.range_rate, most=MOST_CELLS),
        y=group_means(map_.range, most=MOST_CELLS),
        power=few(few(map_.power, axis=0), axis=1),
    )


def folded_rates(range_rate: FloatArray, map_: RangeRateMap) -> FloatArray:
    """Range rates from which whole spans of the map are subtracted, so that a cell has each.

    Those within half a cell of the map are among its cells and stay as they are, and so do all
    where the map is not periodic: it has no echoes of range rates beyond it.
    """
    if not map_.is_periodic:
        return range_rate
    step = map_.range_rate[1] - map_.range_rate[0]
    first, span = map_.range_rate[0] - 0.5 * step, step * map_.range_rate.size
    return np.asarray(range_rate - span * np.floor((range_rate - first) / span))


def mark_targets(axes: Axes, truth: Truth, map_: RangeRateMap) -> None:
    """Draw circles about the visible targets within a map."""
    shown = truth.is_visible & (truth.range <= map_.range[-1])
    axes.plot(
        folded_rates(truth.range_rate, map_)[shown],
        truth.range[shown],
        "o",
        markersize=17,
        markerfacecolor="none",
        markeredgecolor="white",
        linestyle="none",
        label="target",
    )


def _mark_detections(axes: Axes, detections: Detections, map_: RangeRateMap) -> None:
    rate = folded_rates(detections.range_rate, map_)
    is_folded = rate != detections.range_rate
    for mask, marker, label in (
        (~is_folded, "o", "detection"),
        (is_folded, "D", "detection at another range rate, folded"),
    ):
        if np.any(mask):
            axes.plot(
                rate[mask],
                detections.range[mask],
                marker,
                markerfacecolor="none",
                markeredgecolor=VERMILION,
                linestyle="none",
                label=label,
            )
