"""Plotly figures of a look, as plain dicts that the browser draws."""

from collections.abc import Mapping
from textwrap import wrap
from typing import Any, Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.live.look import Look
from polychirp.receiver.overview.pooling import group_means, pooled
from polychirp.report.figures.detections_plan import MARKS
from polychirp.report.figures.drawing import BLUE, GREEN, GREY, INK, VERMILION
from polychirp.report.figures.panels import GREATEST_SPAN_DB
from polychirp.report.figures.range_rate_parts import folded_rates
from polychirp.study.trial import VictimResult
from polychirp.units import to_db

LINES: Final[Mapping[str, dict[str, Any]]] = {
    "all": {"color": None, "width": 1.2},
    "echo": {"color": BLUE, "width": 2},
    "interference": {"color": VERMILION, "width": 2},
    "noise": {"color": GREY, "width": 1, "dash": "dot"},
}
"""Lines of the range profile; that of all samples has the colour of the text."""

SYMBOLS: Final[Mapping[str, str]] = {
    "target": "circle-open",
    "body": "square-open",
    "clutter": "circle",
    "multipath": "square",
    "direct": "x",
    "indirect": "cross",
    "front-end": "triangle-down",
    "folded": "square-open-dot",
    "unexplained": "diamond",
}
"""Plotly's symbols of the causes of detections."""

MOST_CELLS: Final = 180
"""Greatest number of cells along each axis of a map; chosen: a panel on a phone has twice as many
pixels, and the picture is sent in some 10 ms."""

LEGEND_WIDTH: Final = 28
"""Greatest number of characters in a line of the legend; chosen: two columns fit over the plot."""

LIGHT_INK, DARK_INK = INK, "#dddddd"
"""Colour of text and lines on light and on dark pages."""


def range_profile(look: Look, seen: VictimResult | None, *, is_dark: bool) -> dict[str, Any]:
    """Power over range, the greatest over range rates: all samples, echo, interference, noise."""
    ink = DARK_INK if is_dark else LIGHT_INK
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            "name": name,
            "x": np.round(profile.range, 3),
            "y": dbm(profile.power),
            "line": {**LINES[name], "color": LINES[name]["color"] or ink},
            "hovertemplate": "%{x:.2f} m, %{y:.1f} dBm<extra>" + name + "</extra>",
        }
        for name, profile in look.profiles.items()
    ]
    shapes = []
    if seen is not None:
        found = seen.detections
        traces += _detections(seen, found.range, dbm(found.power))
        shapes = [_target_line(float(r)) for r in seen.truth.range[seen.truth.is_visible]]
    return _figure(
        traces,
        is_dark=is_dark,
        xaxis={"title": "Range (m)", "range": [0, float(look.map.range[-1])]},
        yaxis={"title": "Power (dBm)"},
        shapes=shapes,
    )


def range_rate(look: Look, seen: VictimResult | None, *, is_dark: bool) -> dict[str, Any]:
    """Map over range rate and range, with targets and detections.

    In a map that is periodic they are where their echoes appear.
    """
    map_ = look.map
    power = pooled(pooled(map_.power, most=MOST_CELLS, axis=0), most=MOST_CELLS, axis=1)
    traces = [
        _heat(
            x=group_means(map_.range_rate, most=MOST_CELLS),
            y=group_means(map_.range, most=MOST_CELLS),
            z=dbm(power).T,
            hover="%{x:.1f} m/s, %{y:.1f} m: %{z:.0f} dBm<extra></extra>",
        )
    ]
    if seen is not None:
        truth, found = seen.truth, seen.detections
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": "target",
                "x": folded_rates(truth.range_rate, map_)[truth.is_visible],
                "y": truth.range[truth.is_visible],
                "text": [n for n, v in zip(truth.name, truth.is_visible, strict=True) if v],
                "marker": {
                    "symbol": "circle-open",
                    "size": 20,
                    "color": "white",
                    "line": {"width": 2},
                },
                "hovertemplate": "%{text}<extra>target</extra>",
            }
        )
        traces += _detections(seen, folded_rates(found.range_rate, map_), found.range)
    return _figure(
        traces,
        is_dark=is_dark,
        xaxis={"title": "Range rate (m/s), positive = away"},
        yaxis={"title": "Range (m)"},
        has_legend=False,
    )


def beats_over_time(look: Look, *, is_dark: bool) -> dict[str, Any]:
    """Spectrogram of the first channel, ramp by ramp, before mitigation."""
    seen = look.spectrogram
    ramps, windows, _ = seen.power.shape
    time = (np.arange(ramps)[:, None] + seen.share).ravel()
    power = pooled(seen.power.reshape(ramps * windows, -1), most=3 * MOST_CELLS, axis=0)
    return _figure(
        [
            _heat(
                x=group_means(time, most=3 * MOST_CELLS),
                y=seen.beat / 1e6,
                z=dbm(power).T,
                hover="ramp %{x:.1f}, %{y:.2f} MHz: %{z:.0f} dBm<extra></extra>",
            )
        ],
        is_dark=is_dark,
        xaxis={"title": "Ramp"},
        yaxis={"title": "Beat (MHz)"},
        has_legend=False,
    )


def dbm(power: FloatArray) -> FloatArray:
    """Power in dBm, to a tenth of a dB."""
    return np.asarray(np.round(to_db(np.maximum(power, 1e-30)) + 30.0, 1))


def _detections(seen: VictimResult, x: FloatArray, y: FloatArray) -> list[dict[str, Any]]:
    """Markers of the detections, by their causes."""
    nature = np.array(seen.score.nature)
    origin = np.array([name or "no body" for name in seen.score.origin])
    return [
        {
            "type": "scatter",
            "mode": "markers",
            "name": "<br>".join(wrap(label, LEGEND_WIDTH)),
            "x": x[nature == cause],
            "y": y[nature == cause],
            "text": origin[nature == cause].tolist(),
            "marker": {
                "symbol": SYMBOLS[cause],
                "size": 10,
                "color": colour,
                "line": {"width": 2, "color": colour},
            },
            "hovertemplate": "%{x:.2f}, %{y:.2f}: %{text}<extra>" + label + "</extra>",
        }
        for cause, (_, colour, label) in MARKS.items()
        if np.any(nature == cause)
    ]


def _heat(*, x: FloatArray, y: FloatArray, z: FloatArray, hover: str) -> dict[str, Any]:
    top = float(np.quantile(z, 0.9995))
    return {
        "type": "heatmap",
        "x": np.round(x, 3),
        "y": np.round(y, 3),
        "z": np.ascontiguousarray(z),
        "zmin": top - GREATEST_SPAN_DB,
        "zmax": top,
        "colorscale": "Cividis",
        "colorbar": {"title": {"text": "dBm"}, "thickness": 10},
        "hovertemplate": hover,
    }


def _target_line(range_: float) -> dict[str, Any]:
    return {
        "type": "line",
        "x0": range_,
        "x1": range_,
        "y0": 0,
        "y1": 1,
        "yref": "paper",
        "line": {"color": GREEN, "width": 1, "dash": "dash"},
    }


def _figure(
    traces: list[dict[str, Any]],
    *,
    is_dark: bool,
    xaxis: dict[str, Any],
    yaxis: dict[str, Any],
    shapes: list[dict[str, Any]] | None = None,
    has_legend: bool = True,
) -> dict[str, Any]:
    ink, grid = (DARK_INK, "#444444") if is_dark else (LIGHT_INK, "#e2e2e2")
    for axis in (xaxis, yaxis):
        axis["title"] = {"text": axis["title"], "standoff": 4}
        axis.update({"gridcolor": grid, "zeroline": False, "automargin": True})
    return {
        "data": traces,
        "layout": {
            "margin": {"l": 50, "r": 10, "t": 10, "b": 40},
            "paper_bgcolor": "rgba(0,0,0,0)",
            "plot_bgcolor": "rgba(0,0,0,0)",
            "font": {"color": ink, "size": 12},
            "xaxis": xaxis,
            "yaxis": yaxis,
            "shapes": shapes or [],
            "showlegend": has_legend,
            "legend": {
                "orientation": "h",
                "y": 1.02,
                "yanchor": "bottom",
                "x": 0,
                "font": {"size": 10},
            },
            "uirevision": "same",  # zoom and pan stay while the data change
        },
        "config": {"displayModeBar": False, "responsive": True},
    }
