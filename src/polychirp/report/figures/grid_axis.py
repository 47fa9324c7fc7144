"""Places of the labels of a grid's axis: numbers by their values, names in their order."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.study.monte_carlo.grid import Label
from polychirp.units import Unit

LEAST_GAP: Final = 0.08
"""Least distance of neighbouring labels, as a share of their span, at which they are told apart.
Chosen: a slanted label is 14 points wide, and the labels of a panel of `USUAL_WIDTH` span 160."""

USUAL_WIDTH: Final = 3.5
"""Width of a panel with its own labels to the left, inches."""

SLANT: Final = 40.0
"""Angle of labels that would overlap if they were level, degrees; chosen: easy to read."""

LETTER: Final = 5.6
"""Mean width of a letter of a label, points: 0.62 of its size."""

_NUMBER: Final = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")

_MIXED_UNITS: Final = ("Hz", "S/s", "Hz/s", "s", "m", "m/s", "rad", "W", "ppm")
"""Units of `Unit` in which a study file may write values of one axis in several ways."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GridAxis:
    """Labels of an axis and their places on it.

    Parameters
    ----------
    labels : the labels as text, in the order of the grid
    places : coordinate of each label
    are_numbers : true if the labels are numbers, so that a line between neighbours has a meaning
    note : what the reader must know about the places; empty if they are the values
    """

    labels: tuple[str, ...]
    places: tuple[float, ...]
    are_numbers: bool
    note: str = ""

    @property
    def gap(self) -> float:
        """Least distance of neighbours; 1 for a single label."""
        return min(np.diff(sorted(self.places)), default=1.0)

    @property
    def span(self) -> float:
        """Distance of the outermost labels; 1 for a single label."""
        return max(self.places) - min(self.places) or 1.0

    @property
    def width(self) -> float:
        """Width of a panel, inches, in which names do not overlap; numbers may be left out."""
        return USUAL_WIDTH if self.are_numbers else max(USUAL_WIDTH, 1.3 + 0.2 * len(self.labels))

    def offsets(self, count: int, *, most: float) -> FloatArray:
        """Offsets of ``count`` points about one place, that do not reach the next place.

        Neighbouring points are at most ``most`` apart.
        """
        step = min(most, 0.6 * self.gap / max(count, 1))
        return np.asarray(step * (np.arange(count) - 0.5 * (count - 1)), dtype=np.float64)


def grid_axis(labels: Sequence[Label]) -> GridAxis:
    """Places of labels: numbers to scale, if all are told apart there, and names in their order.

    Numbers that are not told apart have places by their logarithms, or else by their order.

    >>> grid_axis(["0 s", "1 ms", "20 ms"]).places
    (0.0, 1.0, 2.0)
    >>> grid_axis(["0 s", "10 ms", "20 ms"]).places
    (0.0, 0.01, 0.02)
    >>> grid_axis([1, 10, 1000]).note
    'logarithmic'
    >>> grid_axis(["blanking", "none"]).places
    (0.0, 1.0)
    """
    texts = tuple(str(label) for label in labels)
    values = numbers_of(labels)
    if values is None:
        places = tuple(float(n) for n in range(len(labels)))
        return GridAxis(labels=texts, places=places, are_numbers=False)
    scales = {"": values}
    if min(values) > 0.0:
        scales["logarithmic"] = [math.log10(value) for value in values]
    for note, some in scales.items():
        axis = GridAxis(labels=texts, places=tuple(some), are_numbers=True, note=note)
        # many labels are close even if they are equally spaced; ticks then leave some out
        if axis.gap >= min(LEAST_GAP, 0.5 / max(len(labels) - 1, 1)) * axis.span:
            return axis
    ranks = tuple(float(n) for n in np.argsort(np.argsort(values)))
    return GridAxis(labels=texts, places=ranks, are_numbers=True, note="not to scale")


def numbers_of(labels: Sequence[Label]) -> list[float] | None:
    """Labels as numbers of one unit, or None if they are names.

    Values in different units are converted to SI. Those of one unit are not: levels in dB are drawn
    to the scale of dB.
    """
    found = [_NUMBER.fullmatch(str(label)) for label in labels]
    matches = [match for match in found if match]
    if len(matches) < len(found):
        return None
    if len({match[2] for match in matches}) == 1:
        return [float(match[1]) for match in matches]
    for symbol in _MIXED_UNITS:
        try:
            return [Unit(symbol).parse(label) for label in labels]
        except InputError:
            continue
    return None


def draw_ticks(axes: Axes, axis: GridAxis, name: str) -> None:
    """Write the labels and the name below axes; slant them if they would overlap otherwise.

    Numbers that are too close to the one before are left out.
    """
    shown: list[int] = []
    for n in np.argsort(axis.places).tolist():
        apart = axis.places[n] - axis.places[shown[-1]] if shown else math.inf
        if not axis.are_numbers or apart >= LEAST_GAP * axis.span:
            shown.append(n)
    texts = [axis.labels[n].replace("$", r"\$") for n in shown]
    axes.set_xticks([axis.places[n] for n in shown], texts)
    gap = min(np.diff([axis.places[n] for n in shown]), default=axis.span) / axis.span
    points = 72.0 * (axis.width - 1.2) * gap
    if LETTER * (1 + max(len(text) for text in texts)) > points:
        for text in axes.get_xticklabels():
            text.set(rotation=SLANT, ha="right", rotation_mode="anchor")
    note = f" ({axis.note})" if axis.note else ""
    axes.set(xlabel=name.replace("$", r"\$") + note)
