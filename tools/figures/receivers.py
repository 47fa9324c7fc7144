"""Detection probability of the coherent receiver over coherent SNR."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from matplotlib.axes import Axes

from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)

_COLOURS: Final = (BLUE, VERMILION, GREEN)


@styled
def receiver_picture(record: Mapping[str, Any]) -> Drawing:
    """Curves of all kinds of frames with 95 % intervals, and that of the ideal detector.

    Parameters
    ----------
    record : ``detection``: rows of ``frame``, ``snr_db``, ``detection`` and ``ideal``
    """
    rows = record["detection"]
    frames = list(dict.fromkeys(row["frame"] for row in rows))
    figure = new_figure(5.0, 3.4)
    axes = figure.subplots()
    ideal = {row["snr_db"]: row["ideal"] for row in rows}
    axes.plot(*_sorted(ideal), color=GREY, linestyle=":", label="ideal detector")
    for frame, colour in zip(frames, _COLOURS, strict=True):
        _curve(axes, [row for row in rows if row["frame"] == frame], colour, frame)
    axes.legend(loc="lower right", fontsize=7)
    axes.set(xlabel="Coherent SNR (dB)", ylabel="Detection probability", ylim=(-0.03, 1.03))
    data = {
        "frame": [row["frame"] for row in rows],
        "SNR (dB)": [row["snr_db"] for row in rows],
        "detection probability": [row["detection"]["value"] for row in rows],
        "ideal": [row["ideal"] for row in rows],
    }
    return Drawing(figure=figure, data=data)


def _sorted(values: Mapping[float, float]) -> tuple[list[float], list[float]]:
    places = sorted(values)
    return places, [values[place] for place in places]


def _curve(axes: Axes, rows: list[Mapping[str, Any]], colour: str, name: str) -> None:
    found = [row["detection"] for row in rows]
    value = [estimate["value"] for estimate in found]
    below = [estimate["value"] - estimate["low"] for estimate in found]
    above = [estimate["high"] - estimate["value"] for estimate in found]
    axes.errorbar(
        [row["snr_db"] for row in rows],
        value,
        yerr=(below, above),
        color=colour,
        marker="o",
        markersize=3.5,
        elinewidth=0.8,
        label=name,
    )
