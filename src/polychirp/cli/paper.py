"""``polychirp paper`` — the paper's scenarios, its claims beside what comes out."""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from polychirp.cli.progress import progress_bar
from polychirp.errors import InputError

if TYPE_CHECKING:
    from polychirp.study.paper.results import StatisticsRow


def add_parser(subparsers: Any) -> None:
    """Add this verb."""
    parser = subparsers.add_parser(
        "paper",
        help="the paper's scenarios and figures, beside its claims",
        description="Run scenarios A, B and C of the paper, with conventional, diverse and "
        "fixed-per-radar waveforms; print the paper's claims beside what comes out; write "
        "results.json, figures with their data, and report.html.",
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        default="out/paper",
        help="folder of the results (default: %(default)s)",
    )
    parser.add_argument("--seed", type=int, default=1, help="of all random draws (default: 1)")
    parser.add_argument("--json", action="store_true", help="print results.json instead of tables")


def run(arguments: argparse.Namespace) -> int:
    """Run, write, print."""
    if arguments.seed < 0:
        raise InputError(f"--seed: {arguments.seed} is negative; use 0 or more")
    folder = Path(arguments.out)
    for parent in (folder, *folder.parents):
        if parent.exists() and not parent.is_dir():
            raise InputError(f"--out: '{parent}' is a file; name a folder")
    from polychirp.study.kernel_parts import OF_PAPER, compile_parts

    with progress_bar("paper") as progress:
        compile_parts(OF_PAPER, progress=progress)
        from polychirp.report.paper import write_paper
        from polychirp.study.paper.scenarios import run_paper

        started = time.perf_counter()
        results = run_paper(seed=arguments.seed, progress=progress)
        statistics = _statistics(folder / "statistics", seed=arguments.seed, progress=progress)
        results = replace(results, statistics=statistics, wall_time_s=time.perf_counter() - started)
        page = write_paper(results, folder, progress=lambda name: progress(name, 1, 1))
    if arguments.json:
        print((folder / "results.json").read_text(encoding="utf-8"), end="")
        return 0
    _print_tables(results)
    print(f"\n{results.wall_time_s:.0f} s; open {page}", file=sys.stderr)
    return 0


def _statistics(
    folder: Path, *, seed: int, progress: Callable[[str, int, int], None]
) -> tuple[StatisticsRow, ...]:
    """Figures 12 and 13 from few trials, drawn anew; all that they found stays in ``folder``."""
    from polychirp.study.monte_carlo.executor import LocalWorkers, num_cores
    from polychirp.study.paper.statistics import TRIALS, run_statistics, statistics_plan

    shutil.rmtree(folder, ignore_errors=True)
    return run_statistics(
        statistics_plan(trials=TRIALS, seed=seed),
        folder=folder,
        executor=LocalWorkers(count=num_cores()),
        progress=progress,
    )


def _print_tables(results: Any) -> None:
    from rich.console import Console

    from polychirp.report.statistics import findings
    from polychirp.report.tables import claims_table, statistics_table, variants_table

    console = Console(width=None if sys.stdout.isatty() else 140)
    console.print(claims_table(results))
    console.print(variants_table(results.rows))
    console.print(statistics_table(results.statistics))
    for finding in findings(results.statistics):
        console.print(f"- {finding}", highlight=False)
