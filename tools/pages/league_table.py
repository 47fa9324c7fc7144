"""Tables and figure for docs/validation/league.md: schemes over scenarios.

``python -m tools.pages.league_table FILE`` runs the studies of studies/league, or continues them in
out/league, measures detections on noise alone, and stores both as JSON.
"""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from polychirp.cli.app import main
from polychirp.config.monte_carlo import load_plan
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.rng import Streams
from polychirp.scoring.statistics import poisson_mean
from polychirp.study.monte_carlo.plan import Plan
from polychirp.study.roc.frames import frame_with
from tools.pages.markdown import table, within
from tools.sources import ROOT

RECORD: Final = "league.json"
"""File with the numbers of the tables, in the folder of the pages."""

LEAGUE: Final = ROOT / "studies" / "league"
SCENARIOS: Final = ("oncoming", "car-park")
"""Study files of the league in the order of the table."""

RUN: Final = ROOT / "out" / "league"
"""Folder of the trials."""

NOISE_FRAMES: Final = 40
"""Number of frames of noise alone for each scheme."""

NOISE_PROBABILITY: Final = 1e-4
"""Stated false-alarm probability for these frames: 100 times that of the league, since its own
would need thousands of frames."""


def measured() -> dict[str, Any]:
    """Record of the league: its cells, and detections on noise alone."""
    files = [str(LEAGUE / f"{name}.toml") for name in SCENARIOS]
    common = LEAGUE / "common.toml"
    code = main(["compare", *files, "--common", str(common), "--out", str(RUN), "--workers", "1"])
    if code:
        raise SystemExit(code)
    shutil.copy(RUN / "comparison.png", ROOT / "docs" / "images" / "league.png")
    cells = json.loads((RUN / "comparison.json").read_text(encoding="utf-8"))
    return {"cells": cells, "noise": _on_noise(load_plan(files[0], common=common))}


def _on_noise(plan: Plan) -> list[dict[str, Any]]:
    """Detections in a frame of noise for every scheme, and the number that the receiver states."""
    rows = []
    first = plan.points[0].labels[0]
    for point in plan.points:
        if point.labels[0] != first:
            continue
        receiver = point.study.receiver
        assert isinstance(receiver, CoherentReceiver)
        loose = replace(receiver, false_alarm_probability=NOISE_PROBABILITY, most_detections=150)
        found, stated = [], []
        for number in range(NOISE_FRAMES):
            study = replace(point.trial(number), traffic=None)
            frame = frame_with(study, (), streams=Streams(study.seed))
            found.append(float(loose.detect(frame).num_detections))
            stated.append(loose.expected_false_detections(frame))
        mean = poisson_mean(np.array(found))
        rows.append(
            {
                "scheme": point.labels[-1],
                "found": {"value": mean.value, "low": mean.low, "high": mean.high},
                "stated": sum(stated) / len(stated),
            }
        )
    return rows


def league_tables(folder: Path) -> dict[str, str]:
    """Blocks of the page: ``league`` and ``league-noise``."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    return {"league": _cells_table(record["cells"]), "league-noise": _noise_table(record["noise"])}


def _cells_table(cells: Sequence[Mapping[str, Any]]) -> str:
    head = (
        "scenario",
        "starts",
        "scheme",
        "targets found",
        "ghosts in a frame",
        "of these, unexplained",
        "missed and ghosts in a frame",
        "among the best",
    )
    rows = [
        (
            str(cell["scenario"]).removeprefix("league-"),
            ", ".join(cell["condition"]),
            cell["scheme"],
            within(cell["detection"], 2),
            within(cell["ghosts"], 1),
            within(cell["unexplained"], 1),
            within(cell["errors"], 1),
            "" if cell["behind"]["low"] > 0 else "yes",
        )
        for cell in cells
    ]
    return table(head, rows)


def _noise_table(rows: Sequence[Mapping[str, Any]]) -> str:
    head = ("scheme", "detections in a frame of noise", "stated by the receiver")
    return table(
        head, [(row["scheme"], within(row["found"], 2), f"{row['stated']:.2f}") for row in rows]
    )


if __name__ == "__main__":
    text = json.dumps(measured(), indent=1, ensure_ascii=False) + "\n"
    Path(sys.argv[1]).write_text(text, encoding="utf-8")
