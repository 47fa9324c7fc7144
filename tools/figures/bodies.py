"""Cross sections of all bodies over aspect, drawn from their record.

``python -m tools.figures.bodies RECORD FOLDER`` writes ``bodies.png``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.report.figures.drawing import (
    BLUE,
    GREEN,
    GREY,
    INK,
    VERMILION,
    Drawing,
    new_figure,
    styled,
)

PANELS: Final = {
    "Cars": ("sedan", "sedan with fittings", "hatchback with fittings", "TR 38.901, a car"),
    "Vans and trucks": ("van", "van with fittings", "truck", "articulated truck"),
    "Road users": (
        "adult who walks",
        "child who walks",
        "bicycle with rider",
        "motorcycle with rider",
    ),
    "Street furniture": ("bollard", "traffic sign"),
}
"""Bodies of every panel."""

COLOURS: Final = (BLUE, VERMILION, GREEN, INK)

SMOOTHING: Final = 5
"""Neighbours to either side over which powers are averaged: 5 degrees."""


def smoothed(level: Sequence[float]) -> FloatArray:
    """Levels in dB whose powers are averaged over `SMOOTHING` neighbours to either side."""
    power = 10.0 ** (np.asarray(level) / 10.0)
    shifts = range(-SMOOTHING, SMOOTHING + 1)
    return np.asarray(10.0 * np.log10(np.mean([np.roll(power, n) for n in shifts], axis=0)))


@styled
def body_picture(record: Sequence[Mapping[str, Any]]) -> Drawing:
    """One polar panel for each group of bodies; ahead is up, the left side is on the left."""
    rows = {row["name"]: row for row in record}
    figure = new_figure(12.4, 4.0)
    panels = figure.subplots(1, len(PANELS), subplot_kw={"projection": "polar"})
    data: dict[str, FloatArray] = {}
    for axes, (title, names) in zip(panels, PANELS.items(), strict=True):
        for name, colour in zip(names, COLOURS, strict=False):
            level = smoothed(rows[name]["level"])
            aspect = np.radians(np.linspace(0.0, 360.0, level.size, endpoint=False))
            data["aspect (deg)"], data[f"RCS of {name} (dBsm)"] = np.degrees(aspect), level
            closed = np.append(np.arange(level.size), 0)
            axes.plot(aspect[closed], level[closed], color=colour, linewidth=1.0, label=name)
        axes.set_theta_zero_location("N")
        axes.set_ylim(-25.0, 40.0)
        axes.set_yticks([-20.0, 0.0, 20.0, 40.0], ["−20", "0", "20", "40 dBsm"])
        axes.tick_params(labelsize=7)
        axes.grid(visible=True, color=GREY, alpha=0.3)
        axes.set_title(title)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), fontsize=7)
    return Drawing(figure=figure, data=data)


def main() -> None:
    """Write the figure of a record into a folder, as the command line names them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("record", type=Path)
    parser.add_argument("folder", type=Path)
    given = parser.parse_args()
    record = json.loads(given.record.read_text(encoding="utf-8"))
    (given.folder / "bodies.png").write_bytes(body_picture(record).png())


if __name__ == "__main__":
    main()
