"""Tables and figure for docs/validation/league.md: schemes over scenarios.

``python -m tools.pages.league_table FILE`` runs the studies of studies/league, or continues them in
out/league and out/league-mitigation, measures detections on noise alone and the cost of each
scheme, and stores all as JSON. A second argument is the number of trials: the trials that are there
are counted, and missing ones are run.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from polychirp.config.monte_carlo import load_plan
from polychirp.receiver.selection import receiver_for
from polychirp.report.figures.comparison import scheme_comparison
from polychirp.rng import Streams
from polychirp.scoring.statistics import poisson_mean
from polychirp.study.monte_carlo.comparison import Cell, comparison
from polychirp.study.monte_carlo.executor import LocalWorkers
from polychirp.study.monte_carlo.plan import Plan
from polychirp.study.monte_carlo.run import run_plan
from polychirp.study.processing_cost import processing_cost
from polychirp.study.roc.frames import frame_with
from polychirp.study.roc.yardsticks import num_cells
from polychirp.threads import num_cores
from tools.pages.markdown import table, within
from tools.sources import ROOT

RECORD: Final = "league.json"
"""File with the numbers of the tables, in the folder of the pages."""

LEAGUE: Final = ROOT / "studies" / "league"
SCENARIOS: Final = ("oncoming", "junction", "paper-b", "paper-c", "car-park", "dense")
MITIGATED: Final = ("oncoming", "junction")
"""Study files of the league, and those of its comparison of mitigations, in the tables' order."""

TRIALS: Final = {
    **dict.fromkeys(("oncoming", "paper-b", "paper-c"), 25),
    "junction": 20,
    "car-park": 6,
    "dense": 2,
}
"""Number of trials of each cell, fewer where a trial takes long."""

FEWEST_DRAWN: Final = 5
"""Number of trials of a cell below which the figure leaves it out: its intervals are too wide."""

MITIGATION_TRIALS: Final = 8
"""Number of trials of each cell of the comparison of mitigations."""

NOISE_FRAMES: Final = 60
FIRST_NOISE_FRAME: Final = 1000
"""Number of frames of noise alone for each waveform, and the first draw of them, far from those by
which the schemes' false-alarm probabilities were set."""

NOISE_FACTOR: Final = 100.0
"""Factor of the false-alarm probability in these frames, since that of the league would need
thousands of frames."""


def measured(trials: Mapping[str, int]) -> dict[str, Any]:
    """Record of the league: its cells, those with mitigation, noise alone, and cost."""
    league = [_cells(name, ("common",), "league", trials[name]) for name in SCENARIOS]
    mitigated = [
        _cells(name, ("mitigation", "common"), "league-mitigation", MITIGATION_TRIALS)
        for name in MITIGATED
    ]
    cells = [cell for several in league for cell in several]
    drawn = [cell for cell in cells if cell.num_trials >= FEWEST_DRAWN]
    (ROOT / "docs" / "images" / "league.png").write_bytes(scheme_comparison(drawn).png())
    plan = _plan(SCENARIOS[0], ("common",), 1)
    return {
        "cells": [_known(asdict(cell)) for cell in cells],
        "mitigation": [_known(asdict(cell)) for several in mitigated for cell in several],
        "noise": _on_noise(plan),
        "cost": _costs(plan),
    }


def _plan(name: str, common: Sequence[str], trials: int) -> Plan:
    return load_plan(
        LEAGUE / f"{name}.toml",
        common=[LEAGUE / f"{one}.toml" for one in common],
        overrides=[f"monte_carlo.trials={trials}"],
    )


def _cells(name: str, common: Sequence[str], folder: str, trials: int) -> list[Cell]:
    plan = _plan(name, common, trials)
    own = plan.points[0].study.name
    out = ROOT / "out" / folder / f"{own}-{plan.origin.study_hash[:8]}-trials"
    finished = run_plan(plan, folder=out, executor=LocalWorkers(count=num_cores()))
    if finished.failures:
        raise SystemExit("\n".join(finished.failures))
    return comparison({own: finished.results})


def _known(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _known(one) for key, one in value.items()}
    return None if isinstance(value, float) and math.isnan(value) else value


def _first_condition(plan: Plan) -> Sequence[Any]:
    return plan.points[: len(plan.axes[-1].labels)]


def _on_noise(plan: Plan) -> list[dict[str, Any]]:
    """Detections in a frame of noise for every waveform, and the number that is stated for it."""
    rows: list[dict[str, Any]] = []
    seen: list[Any] = []
    for point in _first_condition(plan):
        maker = (point.study.radars[0].waveform, point.study.receiver.kind)
        if maker in seen:  # rules do not change what a radar without others receives
            continue
        seen.append(maker)
        found, stated, kind = [], [], ""
        probability = NOISE_FACTOR * point.study.receiver.false_alarm_probability
        for number in range(FIRST_NOISE_FRAME, FIRST_NOISE_FRAME + NOISE_FRAMES):
            study = replace(point.trial(number), traffic=None)
            frame = frame_with(study, (), streams=Streams(study.seed))
            settings = replace(
                study.receiver, false_alarm_probability=probability, most_detections=150
            )
            receiver = receiver_for(settings, frame.schedule)
            kind = receiver.kind
            found.append(float(receiver.detect(frame).num_detections))
            stated.append(probability * num_cells(receiver, frame))
        mean = poisson_mean(np.array(found))
        rows.append(
            {
                "scheme": point.labels[-1],
                "receiver": kind,
                "probability": point.study.receiver.false_alarm_probability,
                "found": {"value": mean.value, "low": mean.low, "high": mean.high},
                "stated": sum(stated) / len(stated),
            }
        )
    return rows


def _costs(plan: Plan) -> list[dict[str, Any]]:
    return [
        {"scheme": point.labels[-1], **asdict(processing_cost(point.trial(0)))}
        for point in _first_condition(plan)
    ]


def league_tables(folder: Path) -> dict[str, str]:
    """Blocks of the page: ``league``, ``league-mitigation``, ``league-noise``, ``league-cost``."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    return {
        "league": _cells_table(record["cells"], "starts"),
        "league-mitigation": _cells_table(record["mitigation"], "mitigation"),
        "league-noise": _noise_table(record["noise"]),
        "league-cost": _cost_table(record["cost"]),
    }


def _cells_table(cells: Sequence[Mapping[str, Any]], condition: str) -> str:
    head = (
        *("scenario", condition, "scheme", "trials", "targets found", "ghosts in a frame"),
        *("missed and ghosts in a frame", "among the best", "frames lost"),
    )
    rows = [
        (
            str(cell["scenario"]).removeprefix("league-"),
            ", ".join(cell["condition"]),
            cell["scheme"],
            str(cell["num_trials"]),
            within(cell["detection"], 2),
            within(cell["ghosts"], 1),
            within(cell["errors"], 1),
            "" if cell["behind"]["low"] is not None and cell["behind"]["low"] > 0 else "yes",
            "" if cell["lost"]["value"] is None else within(cell["lost"], 2),
        )
        for cell in cells
    ]
    return table(head, rows)


def _noise_table(rows: Sequence[Mapping[str, Any]]) -> str:
    head = ("scheme", "receiver", "probability in the league", "detections in a frame", "stated")
    return table(
        head,
        [
            (
                *(row["scheme"], row["receiver"], f"{row['probability']:.3g}"),
                *(within(row["found"], 2), f"{row['stated']:.2f}"),
            )
            for row in rows
        ],
    )


def _cost_table(rows: Sequence[Mapping[str, Any]]) -> str:
    head = ("scheme", "receiver", "10⁶ complex multiplications", "memory, MB", "peak/mean, dB")
    return table(
        head,
        [
            (
                row["scheme"],
                row["receiver"],
                f"{row['multiplications'] / 1e6:.1f}",
                f"{row['memory'] / 1e6:.1f}",
                f"{10.0 * math.log10(row['peak_to_average']):.1f}",
            )
            for row in rows
        ],
    )


if __name__ == "__main__":
    count = {name: int(sys.argv[2]) for name in SCENARIOS} if len(sys.argv) > 2 else TRIALS
    text = json.dumps(measured(count), indent=1, ensure_ascii=False) + "\n"
    Path(sys.argv[1]).write_text(text, encoding="utf-8")
