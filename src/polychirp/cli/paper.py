"""``polychirp paper`` — run the paper's scenarios, and show its claims beside our results."""

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.progress import progress_bar
from polychirp.cli.terminal import add_option, say, tables, usable_folder
from polychirp.errors import InputError

if TYPE_CHECKING:
    from polychirp.study.paper.results import PaperRow, StatisticsRow

KEPT_FILES: Final = (
    "files that were written stay in the folder; the same command starts from the beginning"
)
"""Part of the message that `cli.app` prints after an interrupt."""

MARK: Final = "written-by-polychirp-paper.txt"
"""Name of the file that marks a folder of statistics as written by this command."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``paper``."""
    parser = subparsers.add_parser(
        "paper",
        help="run the paper's scenarios and compare the results with its claims",
        description="Run scenarios A, B and C of the paper, with conventional, diverse and "
        "fixed-per-radar waveforms; print the paper's claims beside the results; write "
        "results.json, figures with their data, and report.html.",
    )
    add_option(parser, "--out", "DIR", "out/paper", "folder of the results")
    parser.add_argument("--seed", type=int, default=1, help="seed of all random draws (default: 1)")
    parser.add_argument("--json", action="store_true", help="print results.json instead of tables")


def run(arguments: argparse.Namespace) -> int:
    """Run the scenarios, write the results and print the tables."""
    if arguments.seed < 0:
        raise InputError(f"--seed: {arguments.seed} is negative; use 0 or more")
    folder = usable_folder(arguments.out)
    _refuse_other_statistics(folder / "statistics")
    from dataclasses import replace

    from polychirp.study.kernel_parts import OF_PAPER, compile_parts

    with progress_bar("paper") as progress:
        compile_parts(OF_PAPER, progress=progress)
        from polychirp.report.paper import write_paper
        from polychirp.study.paper.scenarios import run_paper
        from polychirp.study.paper.stored_statistics import read_statistics

        started = time.perf_counter()
        results = run_paper(seed=arguments.seed, progress=progress, show=_say_row)
        statistics = _statistics(folder / "statistics", seed=arguments.seed, progress=progress)
        results = replace(
            results,
            statistics=statistics,
            stored=read_statistics(),
            traced=read_statistics("vehicles"),
            wall_time_s=time.perf_counter() - started,
        )
        page = write_paper(results, folder, progress=lambda name: progress(name, 1, 1))
    if arguments.json:
        print((folder / "results.json").read_text(encoding="utf-8"), end="")
        return 0
    _print_tables(results)
    say(f"\n{results.wall_time_s:.0f} s; open {page}")
    return 0


def _refuse_other_statistics(folder: Path) -> None:
    """Refuse, before the run, to write over a folder that this command did not write."""
    if folder.is_dir() and any(folder.iterdir()) and not (folder / MARK).exists():
        raise InputError(
            f"--out: '{folder}' holds files that polychirp paper did not write; name another "
            "folder, or move it away"
        )


def _statistics(
    folder: Path, *, seed: int, progress: Callable[[str, int, int], None]
) -> tuple["StatisticsRow", ...]:
    """Rows of figures 12 and 13 at the paper's number of targets, from few trials.

    They are always run anew and then kept in ``folder``.
    """
    from polychirp.study.monte_carlo.executor import LocalWorkers
    from polychirp.study.monte_carlo.run import LOG
    from polychirp.study.paper.results import PAPER_TARGETS
    from polychirp.study.paper.statistics import TRIALS, run_statistics, statistics_plan
    from polychirp.threads import num_cores

    folder.mkdir(parents=True, exist_ok=True)
    (folder / MARK).write_text(
        "polychirp paper writes this folder, and replaces its files at every run.\n",
        encoding="utf-8",
    )
    (folder / LOG).unlink(missing_ok=True)
    return run_statistics(
        statistics_plan(trials=TRIALS, num_targets=(PAPER_TARGETS,), seed=seed),
        folder=folder,
        executor=LocalWorkers(count=num_cores()),
        progress=progress,
    )


def _say_row(row: "PaperRow") -> None:
    """Print a case of the paper on stderr as soon as it is computed."""
    from polychirp.report.verdict import row_in_words
    from polychirp.report.words import variant_name

    say(f"{variant_name(row)}: {row_in_words(row)}")


def _print_tables(results: Any) -> None:
    from polychirp.report.statistics import findings, origin, shown_statistics, traced_findings
    from polychirp.report.tables import claims_table, statistics_table, variants_table

    console = tables()
    console.print(claims_table(results))
    console.print(variants_table(results.rows))
    console.print(statistics_table(results.statistics))
    if results.stored is not None:
        console.print(f"- {origin(results.stored)}")
    for finding in findings(shown_statistics(results)):
        console.print(f"- {finding}")
    if results.traced is not None:
        console.print("\nThe same on ray-traced vehicles:")
        for finding in [origin(results.traced), *traced_findings(results.traced.rows)]:
            console.print(f"- {finding}")
