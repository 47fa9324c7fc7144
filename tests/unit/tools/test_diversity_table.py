"""The table of diversities, from rows to Markdown."""

from __future__ import annotations

import json
from pathlib import Path

from tools.experiments.diversity import Suppression
from tools.figures.diversity import diversity_picture
from tools.pages.diversity_table import RECORD, diversity_table, in_decibels


def row(family: str, *, peak: float) -> dict[str, object]:
    (found,) = in_decibels(
        [
            Suppression(
                family=family,
                matched_mean=peak / 10,
                matched_peak=peak,
                per_sweep=1.0,
                duty=0.0051,
                law=1e-7,
                num_draws=2,
            )
        ]
    )
    return {**found, "slow_ambiguity": -5.5, "fast_ambiguity": -7.0}


def test_suppression_is_in_decibels_and_what_is_not_received_says_so(tmp_path: Path) -> None:
    families = [row("drawn", peak=1e-6), row("apart", peak=1e-14)]
    (tmp_path / RECORD).write_text(json.dumps({"families": families}), encoding="utf-8")
    *_, drawn, apart = diversity_table(tmp_path).splitlines()
    assert drawn == "| drawn | 70.0 | 60.0 | 0.0 | 0.51 | −5.5 | −7.0 |"
    assert apart == "| apart | not received | not received | 0.0 | 0.51 | −5.5 | −7.0 |"


def test_the_picture_shows_every_row_beside_the_law() -> None:
    rows = [row("a", peak=1e-3), row("b", peak=1e-5)]
    record = {
        "spreads": [1e-3, 1e-2],
        "over_spread": {"T": rows, "B": rows},
        "sweeps": [1, 2],
        "over_sweeps": {"both": rows},
    }
    drawing = diversity_picture(record)
    assert drawing.data["strongest cell, dB"] == [30.0, 50.0] * 3
    labels = [text.get_text() for text in drawing.figure.axes[1].get_legend().get_texts()]
    assert labels[-1].startswith("10 log B T")
