"""Power over range of the parts of one frame."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from polychirp.model.detection import Detections
from polychirp.model.spectra import RangePower
from polychirp.model.truth import Truth
from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)
from polychirp.report.figures.range_profile import spread
from polychirp.units import to_db

STYLES: Final[Mapping[str, dict[str, Any]]] = {
    "echo": {"color": BLUE},
    "multipath": {"color": SKY},
    "direct": {"color": VERMILION},
    "indirect": {"color": ORANGE},
    "noise": {"color": GREY, "linestyle": ":"},
    "leakage": {"color": PURPLE},
    "distortion": {"color": PURPLE, "linestyle": "--"},
    "all": {"color": INK, "linewidth": 0.8},
    "all, mitigated": {"color": GREEN, "linewidth": 1.8},
}
"""Colour and line of each part."""


@styled
def range_power_parts(
    profiles: Mapping[str, RangePower], detections: Detections, truth: Truth, *, title: str
) -> Drawing:
    """Power over range of each part, with targets as lines and detections as circles.

    The curves are the greatest values over range rates. A detection stands at its own range and
    power. The data are the curves.
    """
    *_, last = profiles
    range_ = profiles[last].range
    figure = new_figure(9.0, 4.8)
    axes = figure.add_subplot()
    for name, profile in profiles.items():
        axes.plot(range_, _dbm(profile.power), label=name, **STYLES[name])
    limits = _limits(profiles)
    _mark_targets(axes, truth, range_, limits)
    inside = detections.range <= range_[-1]
    axes.plot(
        detections.range[inside],
        _dbm(detections.power[inside]),
        "o",
        markerfacecolor="none",
        markeredgecolor=INK,
        linestyle="none",
        label="detection",
    )
    axes.set(
        xlim=(0.0, range_[-1]),
        ylim=limits,
        xlabel="Range (m)",
        ylabel="Power, greatest over range rates (dBm)",
    )
    figure.suptitle(title, x=0.01, ha="left", weight="bold", size=11)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=5)
    data: dict[str, Any] = {"range_m": range_}
    for name, profile in profiles.items():
        data[f"{name.replace(', ', '_')}_dbm"] = _dbm(profile.power)
    return Drawing(figure=figure, data=data)


def _dbm(power: np.ndarray) -> np.ndarray:
    return np.asarray(to_db(np.maximum(power, 1e-300)) + 30.0)


def _limits(profiles: Mapping[str, RangePower]) -> tuple[float, float]:
    """Ends of the power axis: 10 dB below the weakest floor, and the greatest value, dBm."""
    shown = {name: _dbm(profile.power) for name, profile in profiles.items()}
    floor = float(np.median(shown["noise"] if "noise" in shown else shown["all"]))
    top = max(float(np.max(level)) for level in shown.values())
    return 10.0 * np.floor((floor - 10.0) / 10.0), 10.0 * np.ceil((top + 3.0) / 10.0)


def _mark_targets(
    axes: Axes, truth: Truth, range_: np.ndarray, limits: tuple[float, float]
) -> None:
    """Draw a line at every visible target, with its name above the axes."""
    chosen = np.flatnonzero(truth.is_visible & (truth.range <= range_[-1]))
    chosen = chosen[np.argsort(truth.range[chosen])]
    labels = spread([float(truth.range[n]) for n in chosen], apart=range_[-1] / 28.0)
    for n, place in zip(chosen, labels, strict=True):
        axes.axvline(truth.range[n], color=GREEN, linewidth=0.8, alpha=0.7, zorder=1)
        axes.annotate(
            truth.name[n].replace("$", r"\$"),
            xy=(truth.range[n], limits[1]),
            xytext=(place, limits[1] + 0.02 * (limits[1] - limits[0])),
            rotation=38,
            rotation_mode="anchor",
            size=8.5,
            color=GREEN,
            annotation_clip=False,
        )
