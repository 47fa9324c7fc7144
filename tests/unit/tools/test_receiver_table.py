"""The tables of the coherent receiver, from the stored record to Markdown."""

from __future__ import annotations

import json
from pathlib import Path

from tools.figures.receivers import receiver_picture
from tools.pages.receiver_table import RECORD, receiver_tables

FOLDER = Path(__file__).parents[3] / "docs" / "validation"


def test_every_row_of_the_record_is_a_row_of_a_table() -> None:
    tables = receiver_tables(FOLDER)
    record = json.loads((FOLDER / RECORD).read_text(encoding="utf-8"))
    assert set(tables) >= {"receiver-detection", "receiver-noise", "receiver-points"}
    lines = tables["receiver-noise"].splitlines()
    assert len(lines) == 2 + len(record["noise"])
    assert all(line.count("|") == lines[0].count("|") for line in lines)


def test_the_picture_has_a_curve_for_every_frame_and_the_ideal_detector() -> None:
    record = json.loads((FOLDER / RECORD).read_text(encoding="utf-8"))
    drawing = receiver_picture(record)
    (axes,) = drawing.figure.axes
    assert len(axes.get_legend_handles_labels()[1]) == 4
