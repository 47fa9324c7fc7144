"""Detection probability over SNR beside the ideal detector, and detections in noise alone."""

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

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
from polychirp.scoring.statistics import Estimate
from polychirp.study.roc.summary import CurvePoint, NoiseRow, RocSummary

_COLOURS: Final = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, INK)
"""Colours of the curves, in their order; further curves begin again."""


@styled
def roc_picture(summary: RocSummary, *, title: str, note: str) -> Drawing:
    """Every receiver's curve with 95 % intervals beside the ideal detector's, and its false alarms.

    The left panel has the ideal detector as a dotted line, and that with the receiver's windows,
    where they are, as a dashed one. The right panel has the detections per frame of noise, the
    greatest number by the stated false-alarm probability as a bar, and, where there was none, the
    upper limit of the interval as an arrow.

    The data are one row for every curve and SNR.
    """
    figure = new_figure(8.6, 4.6)
    left, right = figure.subplots(1, 2, width_ratios=(1.7, 1.0))
    for number, curve in enumerate(summary.curves):
        colour = _COLOURS[number % len(_COLOURS)]
        points = summary.of_curve(number)
        line = summary.lines[number]
        left.plot(line.snr_db, line.ideal, color=colour, linestyle=":", linewidth=1.0)
        if _has_windows(summary, number):
            left.plot(line.snr_db, line.windowed, color=colour, linestyle="--", linewidth=1.0)
        _curve(left, points, colour, curve.label)
        _false_alarms(right, summary.noise[number], colour)
    left.plot([], [], color=GREY, linestyle=":", label="ideal detector")
    if any(_has_windows(summary, number) for number in range(len(summary.curves))):
        left.plot([], [], color=GREY, linestyle="--", label="ideal, with the windows")
    left.set(xlabel="Coherent SNR (dB)", ylabel="Detection probability", ylim=(-0.03, 1.03))
    left.xaxis.set_major_locator(MaxNLocator(integer=True))
    left.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=7.5)
    right.plot([], [], color=GREY, marker="_", markersize=14, linestyle="", label="stated, at most")
    right.set(yscale="log", ylabel="Detections in a frame of noise")
    right.set_xticks(
        range(len(summary.curves)),
        [curve.label.replace(", ", "\n") for curve in summary.curves],
        fontsize=7.5,
    )
    right.set_xlim(-0.6, len(summary.curves) - 0.4)
    right.legend(loc="best", fontsize=7.5)
    figure.suptitle(title, size=10)
    figure.text(0.01, 0.01, note, color=GREY, size=7.5, va="bottom")
    figure.set_layout_engine("constrained", rect=(0.0, 0.04, 1.0, 0.96))  # room for the note
    return Drawing(figure=figure, data=curve_data(summary))


def _has_windows(summary: RocSummary, curve: int) -> bool:
    """True if the receiver's windows change the ideal detector's curve."""
    points = summary.of_curve(curve)
    return any(p.ideal_windowed < p.ideal for p in points)


def curve_data(summary: RocSummary) -> dict[str, list[Any]]:
    """Columns with one row for every curve and SNR."""
    points = summary.points
    curves = [summary.curves[point.curve] for point in points]
    return {
        "receiver": [curve.kind for curve in curves],
        "false_alarm_probability": [curve.probability for curve in curves],
        "snr_db": [point.snr_db for point in points],
        "frames": [point.num_trials for point in points],
        **_columns("detection", [point.detection for point in points]),
        "ideal": [point.ideal for point in points],
        "ideal_with_windows": [point.ideal_windowed for point in points],
        **_columns("other_detections", [point.others for point in points]),
    }


def noise_data(summary: RocSummary) -> dict[str, list[Any]]:
    """Columns with one row for every curve, of frames without a point."""
    rows = summary.noise
    curves = [summary.curves[row.curve] for row in rows]
    return {
        "receiver": [curve.kind for curve in curves],
        "false_alarm_probability": [curve.probability for curve in curves],
        "frames": [row.num_trials for row in rows],
        **_columns("detections", [row.detections for row in rows]),
        "stated_at_most": [row.stated for row in rows],
        "cells": [row.num_cells for row in rows],
        **_columns("detections_per_cell", [row.per_cell for row in rows]),
        **_columns("chance", [row.chance for row in rows]),
    }


def _columns(name: str, estimates: Sequence[Estimate]) -> dict[str, list[float]]:
    return {
        name: [one.value for one in estimates],
        f"{name}_low": [one.low for one in estimates],
        f"{name}_high": [one.high for one in estimates],
    }


def _curve(axes: Axes, points: Sequence[CurvePoint], colour: str, label: str) -> None:
    value, low, high = np.array(
        [(p.detection.value, p.detection.low, p.detection.high) for p in points]
    ).T
    axes.errorbar(
        [point.snr_db for point in points],
        value,
        yerr=np.maximum([value - low, high - value], 0.0),
        color=colour,
        marker="o",
        markersize=3.5,
        elinewidth=0.8,
        label=label,
    )


def _false_alarms(axes: Axes, row: NoiseRow, colour: str) -> None:
    found, place = row.detections, row.curve
    if math.isfinite(row.stated):
        axes.plot(place, row.stated, color=GREY, marker="_", markersize=14)
    if found.value > 0.0:
        reach = [[found.value - found.low], [found.high - found.value]]
        axes.errorbar(place, found.value, yerr=reach, color=colour, marker="o", markersize=4)
    else:
        axes.plot(place, found.high, color=colour, marker="v", markersize=6)
