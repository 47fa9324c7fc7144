"""Maps of the parts of one frame over range and azimuth, seen from above."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from polychirp.model.detection import Detections
from polychirp.model.spectra import RangeAzimuthMap
from polychirp.model.truth import Truth
from polychirp.receiver.overview.pooling import group_means, pooled
from polychirp.report.figures.drawing import VERMILION, Drawing, styled
from polychirp.report.figures.panels import Surface, columns_of, panels

MOST_RANGES: Final = 300
"""Greatest number of ranges that are drawn; chosen: a panel has as many pixels. Further cells are
grouped, and the greatest of each group is drawn."""


@styled
def range_azimuth_parts(
    maps: Mapping[str, RangeAzimuthMap], detections: Detections, truth: Truth, *, title: str
) -> Drawing:
    """A plan of the power of each part, with the visible targets; its data are the cells drawn.

    The radar is at the origin and looks up. The map has the range R and the cosine u to the left,
    and so has every mark: it is R u to the left, which is its place, and R √(1 − u²) ahead, which
    includes its height (`mapped`). Detections with an azimuth are drawn in the last plan.
    """
    *_, last = maps
    surfaces = {name: _surface(map_) for name, map_ in maps.items()}

    def mark(axes: Axes, name: str) -> None:
        axes.set_aspect("equal")
        shown = truth.is_visible & (truth.range <= maps[name].range[-1])
        across, ahead = mapped(truth.range[shown], truth.azimuth[shown], truth.elevation[shown])
        axes.plot(
            across,
            ahead,
            "o",
            markersize=15,
            markerfacecolor="none",
            markeredgecolor="white",
            linestyle="none",
            label="target",
        )
        if name == last:
            axes.plot(
                *mapped(detections.range, detections.azimuth, detections.elevation),
                "o",
                markersize=5,
                markerfacecolor="none",
                markeredgecolor=VERMILION,
                linestyle="none",
                label="detection",
            )
            axes.legend(loc="lower right", facecolor="0.3", labelcolor="white", markerscale=0.6)

    figure = panels(
        surfaces,
        mark,
        title=title,
        xlabel="Left ← across (m) → right",
        ylabel="Ahead (m)",
        height=2.6,  # half a circle, and its title
    )
    return Drawing(figure=figure, data=columns_of(surfaces, "right_m", "ahead_m"))


def place(
    range_: np.ndarray, azimuth: np.ndarray, elevation: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Places seen from above, m to the right and ahead; an elevation that is NaN counts as zero.

    >>> right, ahead = place(np.array([10.0]), np.radians([30.0]), np.radians([60.0]))
    >>> right.round(2), ahead.round(2)
    (array([-2.5]), array([4.33]))
    """
    level = range_ * np.cos(np.nan_to_num(elevation))
    return -level * np.sin(azimuth), level * np.cos(azimuth)


def mapped(
    range_: np.ndarray, azimuth: np.ndarray, elevation: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Places on the map, m to the right and ahead; an elevation that is NaN counts as zero.

    What is behind the radar stays behind it.

    >>> right, ahead = mapped(np.array([10.0]), np.radians([30.0]), np.radians([60.0]))
    >>> right.round(2), ahead.round(2)
    (array([-2.5]), array([9.68]))
    """
    sine = np.cos(np.nan_to_num(elevation)) * np.sin(azimuth)
    ahead = np.copysign(np.sqrt(1.0 - sine**2), np.cos(azimuth))
    return -range_ * sine, range_ * ahead


def _surface(map_: RangeAzimuthMap) -> Surface:
    distance = group_means(map_.range, most=MOST_RANGES)
    right, ahead = place(distance, np.arcsin(map_.sine)[:, None], np.zeros(1))
    return Surface(x=right, y=ahead, power=pooled(map_.power, most=MOST_RANGES, axis=1))
