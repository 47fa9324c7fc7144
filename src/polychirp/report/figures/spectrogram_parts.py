"""Spectrograms of the parts of one frame, ramp by ramp."""

from collections.abc import Mapping
from functools import partial
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from polychirp.model.spectra import Spectrogram
from polychirp.receiver.overview.pooling import group_means, pooled
from polychirp.report.figures.drawing import Drawing, styled
from polychirp.report.figures.panels import Surface, columns_of, panels

MOST_COLUMNS: Final = 800
MOST_BEATS: Final = 256
"""Greatest numbers of times and beats that are drawn; chosen: a panel has fewer pixels. Further
cells are grouped, and the greatest of each group is drawn."""


@styled
def spectrogram_parts(maps: Mapping[str, Spectrogram], *, title: str) -> Drawing:
    """A spectrogram of each part; its data are the cells drawn.

    The horizontal axis counts ramps: each has the same width, whatever its duration, and pauses
    between ramps have none. So 16 long ramps show their course, and 512 short ones the ramps that
    other radars meet.
    """
    surfaces = {name: _surface(map_) for name, map_ in maps.items()}

    def mark(axes: Axes, name: str) -> None:
        del name
        axes.set_ylim(float(surfaces["all"].y[0]), float(surfaces["all"].y[-1]))

    figure = panels(surfaces, mark, title=title, xlabel="Ramp", ylabel="Beat (MHz)")
    return Drawing(figure=figure, data=columns_of(surfaces, "ramp", "beat_mhz"))


def _surface(map_: Spectrogram) -> Surface:
    ramps, windows, _ = map_.power.shape
    time = (np.arange(ramps)[:, None] + map_.share).ravel()
    few = partial(pooled, most=MOST_COLUMNS, axis=0)
    return Surface(
        x=group_means(time, most=MOST_COLUMNS),
        y=group_means(map_.beat, most=MOST_BEATS) / 1e6,
        power=pooled(few(map_.power.reshape(ramps * windows, -1)), most=MOST_BEATS, axis=1),
    )
