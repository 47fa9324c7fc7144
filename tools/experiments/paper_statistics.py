"""Figures 12 and 13 with a hundred trials of every point, as the package stores them.

``python -m tools.experiments.paper_statistics FILE`` runs those of points, an hour on two cores;
``… FILE vehicles [TARGETS ...]`` runs those of ray-traced vehicles, 75 minutes on two cores, or
those with the given numbers of targets alone. Finished numbers of targets are stored one by one in
the file, whose other rows stay.
"""

import sys
import tempfile
from datetime import date
from pathlib import Path
from typing import Final

import polychirp
from polychirp.study.monte_carlo.executor import LocalWorkers
from polychirp.study.paper.results import StatisticsRow, StoredStatistics
from polychirp.study.paper.statistics import CURVES, NUM_TARGETS, run_statistics, statistics_plan
from polychirp.study.paper.stored_statistics import (
    StoredChannel,
    statistics_from,
    write_statistics,
)
from polychirp.threads import num_cores

TRIALS: Final = 100
"""Trials of each point."""

SEED: Final = 1
"""Seed of the trials."""


def measured(channel: StoredChannel, num_targets: int, folder: Path) -> tuple[StatisticsRow, ...]:
    """All curves at one number of targets; points have none with blanking, as in the paper."""
    curves = [curve for curve in CURVES if channel == "vehicles" or curve[1] != "blanked"]
    plan = statistics_plan(
        channel, trials=TRIALS, num_targets=(num_targets,), curves=curves, seed=SEED
    )
    return run_statistics(plan, folder=folder, executor=LocalWorkers(count=num_cores()))


def store(rows: tuple[StatisticsRow, ...], file: Path) -> None:
    """Write rows into a file, in the place of those with the same number of targets."""
    old = statistics_from(file.read_text(encoding="utf-8")).rows if file.exists() else ()
    anew = {row.num_targets for row in rows}
    every = (*(row for row in old if row.num_targets not in anew), *rows)
    write_statistics(
        StoredStatistics(
            measured=date.today().isoformat(),
            version=polychirp.__version__,
            seed=SEED,
            rows=tuple(sorted(every, key=lambda row: row.num_targets)),
        ),
        file,
    )


def main(file: Path, channel: StoredChannel, targets: tuple[int, ...]) -> None:
    """Measure and store all numbers of targets, one after the other."""
    for count in targets:
        with tempfile.TemporaryDirectory() as folder:
            store(measured(channel, count, Path(folder)), file)


if __name__ == "__main__":
    main(
        Path(sys.argv[1]),
        "vehicles" if "vehicles" in sys.argv[2:] else "points",
        tuple(int(word) for word in sys.argv[2:] if word.isdigit()) or NUM_TARGETS,
    )
