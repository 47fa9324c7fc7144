"""Figures 12 and 13 with a hundred trials of every point, as the package stores them.

``python -m tools.experiments.paper_statistics FILE`` runs them, an hour on two cores.
"""

import sys
import tempfile
from datetime import date
from pathlib import Path
from typing import Final

import polychirp
from polychirp.study.monte_carlo.executor import LocalWorkers
from polychirp.study.paper.results import StoredStatistics
from polychirp.study.paper.statistics import CURVES, run_statistics, statistics_plan
from polychirp.study.paper.stored_statistics import write_statistics
from polychirp.threads import num_cores

TRIALS: Final = 100
"""Trials of each point."""

SEED: Final = 1
"""Seed of the trials."""


def measured() -> StoredStatistics:
    """Points of the curves without blanking, which the paper does not use."""
    curves = [curve for curve in CURVES if curve[1] != "blanked"]
    plan = statistics_plan(trials=TRIALS, curves=curves, seed=SEED)
    with tempfile.TemporaryDirectory() as folder:
        rows = run_statistics(plan, folder=Path(folder), executor=LocalWorkers(count=num_cores()))
    return StoredStatistics(
        measured=date.today().isoformat(), version=polychirp.__version__, seed=SEED, rows=rows
    )


if __name__ == "__main__":
    write_statistics(measured(), Path(sys.argv[1]))
