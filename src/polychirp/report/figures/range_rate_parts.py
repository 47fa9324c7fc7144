"""Range-rate maps of the parts of one frame, with a common scale of colours."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from polychirp.axes import FloatArray
from polychirp.model.detection import Detections
from polychirp.model.spectra import RangeRateMap
from polychirp.model.truth import Truth
from polychirp.report.figures.drawing import VERMILION, Drawing, new_figure, styled
from polychirp.report.figures.range_rate import COLOUR_SPAN_DB
from polychirp.units import to_db

COLUMNS: Final = 3
"""Number of maps beside each other."""


@styled
def range_rate_parts(
    maps: Mapping[str, RangeRateMap], detections: Detections, truth: Truth, *, title: str
) -> Drawing:
    """A range-rate map of each part, with the visible targets; its data are the maps.

    Detections are drawn in the last map. The range rates of targets are folded into the span of the
    maps. The colours begin at the median of the part ``noise``, or of the last map if there is
    none, and end `COLOUR_SPAN_DB` above it.
    """
    *_, last = maps
    lowest = float(np.median(_level(maps.get("noise", maps[last]))))
    rows = -(-len(maps) // COLUMNS)
    figure = new_figure(4.3 * COLUMNS, 3.6 * rows)
    places = figure.subplots(rows, COLUMNS, squeeze=False, sharex=True, sharey=True).ravel()
    scale = Normalize(lowest, lowest + COLOUR_SPAN_DB)
    for axes, (name, map_) in zip(places, maps.items(), strict=False):
        axes.pcolormesh(
            map_.range_rate,
            map_.range,
            _level(map_).T,
            norm=scale,
            shading="nearest",
            rasterized=True,
        )
        axes.grid(visible=False)
        axes.set_title(name)
        axes.tick_params(labelbottom=True)
        _draw_targets(axes, truth, map_)
    _draw_detections(places[len(maps) - 1], detections)
    for axes in places[len(maps) :]:
        axes.set_axis_off()
    figure.colorbar(
        ScalarMappable(scale), ax=places, extend="both", label="Power, mean of channels (dBW)"
    )
    figure.supxlabel("Range rate (m/s), positive = away", size=10)
    figure.supylabel("Range (m)", size=10)
    figure.suptitle(title, x=0.01, ha="left", weight="bold", size=11)
    return Drawing(figure=figure, data=_data(maps))


def _level(map_: RangeRateMap) -> FloatArray:
    return np.asarray(to_db(np.maximum(map_.power, 1e-300)))


def _draw_targets(axes: Axes, truth: Truth, map_: RangeRateMap) -> None:
    """Circles about the visible targets within the map."""
    step = map_.range_rate[1] - map_.range_rate[0]
    first, span = map_.range_rate[0], step * map_.range_rate.size
    folded = first + np.mod(truth.range_rate - first, span)
    shown = truth.is_visible & (truth.range <= map_.range[-1])
    axes.plot(
        folded[shown],
        truth.range[shown],
        "o",
        markersize=17,
        markerfacecolor="none",
        markeredgecolor="white",
        linestyle="none",
        label="target",
    )


def _draw_detections(axes: Axes, detections: Detections) -> None:
    axes.plot(
        detections.range_rate,
        detections.range,
        "o",
        markerfacecolor="none",
        markeredgecolor=VERMILION,
        linestyle="none",
        label="detection",
    )
    axes.legend(loc="lower right", facecolor="0.3", labelcolor="white", markerscale=0.6)


def _data(maps: Mapping[str, RangeRateMap]) -> dict[str, list[object]]:
    data: dict[str, list[object]] = {
        name: [] for name in ("part", "range_m", "range_rate_m_per_s", "power_w")
    }
    for name, map_ in maps.items():
        rate, distance = np.meshgrid(map_.range_rate, map_.range, indexing="ij")
        data["part"] += [name] * rate.size
        data["range_m"] += distance.ravel().tolist()
        data["range_rate_m_per_s"] += rate.ravel().tolist()
        data["power_w"] += map_.power.ravel().tolist()
    return data
