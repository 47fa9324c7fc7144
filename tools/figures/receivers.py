"""Detection probability of the coherent and of the joint receiver over coherent SNR."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from matplotlib.axes import Axes

from polychirp.report.figures.drawing import BLUE, GREY, VERMILION, Drawing, new_figure, styled

_COLOURS: Final = {"coherent": BLUE, "joint": VERMILION}


@styled
def receiver_picture(record: Mapping[str, Any]) -> Drawing:
    """One panel for every kind of frame: both receivers with 95 % intervals, and the ideal one.

    Parameters
    ----------
    record : ``detection``: rows of ``frame``, ``receiver``, ``snr_db``, ``detection`` and ``ideal``
    """
    rows = record["detection"]
    frames = list(dict.fromkeys(row["frame"] for row in rows))
    figure = new_figure(8.0, 3.2)
    panels = figure.subplots(1, len(frames), sharey=True, squeeze=False)[0]
    ideal = {row["snr_db"]: row["ideal"] for row in rows}
    for axes, frame in zip(panels, frames, strict=True):
        axes.plot(*_sorted(ideal), color=GREY, linestyle=":", label="ideal detector")
        for receiver, colour in _COLOURS.items():
            mine = [r for r in rows if (r["frame"], r["receiver"]) == (frame, receiver)]
            _curve(axes, mine, colour, receiver)
        axes.set(title=frame, xlabel="Coherent SNR (dB)")
    # the last panel has room: the joint receiver is not measured there
    panels[-1].legend(loc="lower right", fontsize=7)
    panels[0].set(ylabel="Detection probability", ylim=(-0.03, 1.03))
    data = {
        "frame": [row["frame"] for row in rows],
        "receiver": [row["receiver"] for row in rows],
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
        label=f"{name} receiver",
    )
