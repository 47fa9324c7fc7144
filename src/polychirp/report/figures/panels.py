"""Maps of several parts of one frame beside each other, with a common scale of colours."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from polychirp.axes import FloatArray
from polychirp.report.figures.drawing import new_figure
from polychirp.units import to_db

COLUMNS: Final = 3
"""Number of panels beside each other."""

COLOUR_SPAN_DB: Final = 45.0
"""Span of the colour scale above the noise, dB; chosen: weak echoes are visible, strong ones
saturate."""

GREATEST_SPAN_DB: Final = 60.0
"""Greatest span of the common scale of several maps, dB; chosen: an echo 50 dB below the strongest
one is told from its surroundings."""

SHARE_BELOW: Final = 0.9995
"""Share of the cells of each map that the common scale covers; chosen: a few cells saturate."""

WIDTH, HEIGHT = 4.3, 3.6
"""Size of a panel, inches."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surface:
    """Power over two coordinates, for one panel.

    Parameters
    ----------
    x, y : coordinates of the cells, of one axis each, or ``(x, y)``
    power : W, ``(x, y)``
    """

    x: FloatArray
    y: FloatArray
    power: FloatArray

    @property
    def level(self) -> FloatArray:
        """The power in dBm."""
        return np.asarray(to_db(np.maximum(self.power, 1e-300)) + 30.0)


def panels(
    surfaces: Mapping[str, Surface],
    mark: Callable[[Axes, str], None],
    *,
    title: str,
    xlabel: str,
    ylabel: str,
    height: float = HEIGHT,
) -> Figure:
    """A figure with a panel for each surface; ``mark`` draws over the panel of a name.

    ``height`` is that of a panel, inches.

    The colours end at the strongest cells of all surfaces (`SHARE_BELOW`). They begin at the median
    of the part ``noise``, or of the last surface if there is none, but at most `GREATEST_SPAN_DB`
    lower than they end.
    """
    *_, last = surfaces
    lowest = float(np.median(surfaces.get("noise", surfaces[last]).level))
    highest = max(float(np.quantile(one.level, SHARE_BELOW)) for one in surfaces.values())
    scale = Normalize(max(lowest, highest - GREATEST_SPAN_DB), highest)
    columns = min(COLUMNS, len(surfaces))
    rows = -(-len(surfaces) // columns)
    figure = new_figure(WIDTH * columns + 1.0, height * rows + 0.4)
    places = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for axes, (name, surface) in zip(places, surfaces.items(), strict=False):
        axes.pcolormesh(
            *_grid(surface), surface.level, norm=scale, shading="gouraud", rasterized=True
        )
        axes.grid(visible=False)
        axes.set_title(name)
        axes.tick_params(labelbottom=True)
        mark(axes, name)
    for axes in places[len(surfaces) :]:
        axes.set_axis_off()
    figure.colorbar(ScalarMappable(scale), ax=places, extend="both", label="Power (dBm)")
    figure.supxlabel(xlabel, size=10)
    figure.supylabel(ylabel, size=10)
    figure.suptitle(title, x=0.01, ha="left", weight="bold", size=11)
    return figure


def _grid(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Coordinates of every cell, ``(x, y)`` each."""
    if surface.x.ndim > 1:
        return surface.x, surface.y
    across, along = np.meshgrid(surface.x, surface.y, indexing="ij")
    return across, along


def columns_of(surfaces: Mapping[str, Surface], x: str, y: str) -> dict[str, Any]:
    """All cells as a table: the two coordinates, and the power of each surface in W.

    All surfaces have the same coordinates.
    """
    *_, last = surfaces
    across, along = _grid(surfaces[last])
    data: dict[str, Any] = {x: across.ravel(), y: along.ravel()}
    for name, surface in surfaces.items():
        data[f"{name.replace(', ', '_')}_w"] = surface.power.ravel()
    return data
