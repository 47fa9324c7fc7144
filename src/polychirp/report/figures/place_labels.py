"""Labels beside points of a figure, clear of each other and of all marks."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import Bbox

from polychirp.axes import FloatArray

REACHES: Final = (6.0, 14.0, 24.0, 36.0, 50.0, 66.0)
"""Distances of a label from its point, to the side and up or down each, in points; tried in this
order. Chosen: the steps are about the height of a label, and the farthest passes a cluster of
six labels."""

MARK_RADIUS: Final = 3.5
"""Radius of a mark that labels keep clear of, in points: half of the greatest marker's size."""

FAR: Final = 20.0
"""Distance in points from which on a thin line joins a label to its point; chosen: nearer labels
need none."""

LABEL_SIZE: Final = 8.5
"""Size of the labels' letters, in points."""

COST_OF_LABEL: Final = 10
"""Number of marks that a label would rather cover than another label, or the frame; chosen."""

Offset = tuple[float, float]
"""Distance of a label from its point to the right and up, in points."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """A text beside a point of some axes, given in their data."""

    text: str
    point: tuple[float, float]
    colour: str


def write_labels(axes: Axes, labels: Sequence[Label], marks: FloatArray) -> None:
    """Write each label at the nearest place that is clear of earlier labels and of all marks.

    If there is none, the label stands where it covers least. The axes have their final size and
    limits (`Figure.draw_without_rendering`).

    Parameters
    ----------
    marks : places of the marks in the axes' data, ``(mark, xy)``; NaN where there is none
    """
    known = marks[np.all(np.isfinite(marks), axis=1)]
    pixels = np.reshape(axes.transData.transform(known), (-1, 2))
    taken: list[Bbox] = []
    for label in labels:
        boxes = _boxes(axes, label)
        offset = min(boxes, key=lambda one: _cost(axes, boxes[one], pixels, taken))
        taken.append(boxes[offset])
        _write(axes, label, offset)


def _boxes(axes: Axes, label: Label) -> dict[Offset, Bbox]:
    """The box of a label in pixels at every offset, the nearest first, and first right below."""
    text = axes.text(*label.point, label.text, size=LABEL_SIZE)
    size = text.get_window_extent().size
    text.remove()
    point = axes.transData.transform(label.point)
    per_point = axes.figure.dpi / 72.0
    boxes = {}
    for reach, right, up in product(REACHES, (1, -1), (-1, 1)):
        near = point + per_point * reach * np.array([right, up])
        corner = near + size * np.array([0.0 if right > 0 else -1.0, -0.5])
        boxes[right * reach, up * reach] = Bbox([corner, corner + size])
    return boxes


def _cost(axes: Axes, box: Bbox, marks: FloatArray, taken: Sequence[Bbox]) -> float:
    """Number of marks that a box covers; a label, and the frame, count as many marks each."""
    wide = box.padded(MARK_RADIUS * axes.figure.dpi / 72.0)
    covered = np.sum(np.all((marks > wide.min) & (marks < wide.max), axis=1))
    leaves = np.any(box.min < axes.bbox.min) or np.any(box.max > axes.bbox.max)
    return float(covered + COST_OF_LABEL * (box.count_overlaps(taken) + leaves))


def _write(axes: Axes, label: Label, offset: Offset) -> None:
    line = {"arrowstyle": "-", "color": label.colour, "linewidth": 0.5, "alpha": 0.6}
    text = axes.annotate(
        label.text,
        label.point,
        offset,
        textcoords="offset points",
        size=LABEL_SIZE,
        color=label.colour,
        ha="left" if offset[0] > 0 else "right",
        va="center",
        arrowprops=line if abs(offset[0]) > FAR else None,
    )
    text.set_in_layout(False)  # it was placed for the final layout, and must not change it
