"""The table and the picture of ghosts, from rows."""

from __future__ import annotations

import json
from pathlib import Path

from polychirp.scoring.statistics import wilson
from tools.experiments.ghosts import GhostRow
from tools.figures.ghosts import ghost_picture
from tools.pages.ghost_table import RECORD, as_record, ghost_table


def row(axis: str, value: float, waveform: str = "conventional") -> GhostRow:
    return GhostRow(
        axis=axis,
        value=value,
        waveform=waveform,
        theory=0.25,
        theory_of_ridges=0.5,
        direct=wilson(0.3, 60),
        any_ghost=wilson(0.4, 60),
        ghosts=wilson(0.4, 60),
        detection=wilson(0.95, 60),
        predicted=15,
        lost=0,
        extra=3,
        ridges=3,
        num_trials=60,
    )


def test_a_row_says_closed_form_measurement_and_how_trials_agree(tmp_path: Path) -> None:
    rows = as_record([row("start", 0.02e-6), row("clock", 3e-7, "diverse")])
    (tmp_path / RECORD).write_text(json.dumps(rows), encoding="utf-8")
    *_, start, clock = ghost_table(tmp_path).splitlines()
    assert start.startswith("| starts within 0.02 µs | conventional | 0.250 | 0.500 | 0.300 |")
    assert start.endswith("| 0.20…0.43 | 15 of 60 | 0 | 3 | 3 | 0.40 | 0.4 | 95 % |")
    assert clock.startswith("| clocks within ±0.3 ppm | diverse |")


def test_the_picture_has_a_panel_for_each_of_what_is_varied() -> None:
    rows = [row(axis, 1e-6) for axis in ("start", "clock", "slope", "number")]
    drawing = ghost_picture(as_record([*rows, row("start", 1e-6, "diverse")]))
    assert len(drawing.figure.axes) == 4
    assert drawing.data["waveform"].count("diverse") == 1
    assert drawing.data["measured"] == [0.3] * 5
    assert drawing.data["with cross-pairing ridges"] == [0.5] * 5
