"""Figures 12 and 13 with 100 or 300 trials of every point, as the package stores them.

``python -m tools.experiments.paper_statistics FILE`` runs those of points, in ten minutes on two
cores; ``… FILE vehicles`` runs those of ray-traced vehicles, in four hours on two cores.
``--targets 1 4`` runs those with these numbers of targets alone. Finished numbers of targets are
stored one by one in the file, whose other rows stay. With ``--trials FOLDER``, a run that was
interrupted goes on with the trials that it left there.
"""

import argparse
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

TRIALS: Final[dict[StoredChannel, int]] = {"points": 100, "vehicles": 300}
"""Trials of each point."""

SEED: Final = 1
"""Seed of the trials."""


def measured(channel: StoredChannel, num_targets: int, folder: Path) -> tuple[StatisticsRow, ...]:
    """All curves at one number of targets; points have none with blanking, as in the paper."""
    curves = [curve for curve in CURVES if channel == "vehicles" or curve[1] != "blanked"]
    plan = statistics_plan(
        channel, trials=TRIALS[channel], num_targets=(num_targets,), curves=curves, seed=SEED
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


def main(file: Path, channel: StoredChannel, targets: tuple[int, ...], trials: Path | None) -> None:
    """Measure and store all numbers of targets, one after the other."""
    with tempfile.TemporaryDirectory() as fresh:
        for count in targets:
            folder = (trials or Path(fresh)) / f"{channel}-{count}"
            folder.mkdir(parents=True, exist_ok=True)
            store(measured(channel, count, folder), file)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("channel", choices=list(TRIALS), nargs="?", default="points")
    parser.add_argument("--targets", type=int, nargs="+", default=list(NUM_TARGETS))
    parser.add_argument("--trials", type=Path, metavar="FOLDER")
    given = parser.parse_args()
    main(given.file, given.channel, tuple(given.targets), given.trials)
