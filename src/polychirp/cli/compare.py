"""``polychirp compare`` — schemes over scenarios: one table of several studies with one grid."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.progress import progress_bar
from polychirp.cli.terminal import command_name, decibels, say, tables, usable_folder
from polychirp.cli.trials import KEPT_TRIALS, add_workers, num_workers, refuse_other_files, shown
from polychirp.errors import RunError

if TYPE_CHECKING:
    from polychirp.scoring.statistics import Estimate
    from polychirp.study.monte_carlo.comparison import Cell
    from polychirp.study.monte_carlo.plan import Plan
    from polychirp.study.monte_carlo.results import Results
    from polychirp.study.monte_carlo.tasks import Executor

KEPT_FILES: Final = KEPT_TRIALS
"""Part of the message that `cli.app` prints after an interrupt."""

_TABLES: Final = {
    "errors": "missed targets and ghosts in a frame",
    "detection": "detection probability",
    "ghosts": "ghosts in a frame",
    "lost": "share of frames lost, under rules from frame to frame",
}
"""Fields of `Cell` that are printed, with their titles; one that no cell knows is left out."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``compare``."""
    parser = subparsers.add_parser(
        "compare",
        help="compare schemes, such as waveforms or mitigations, over several studies",
        description="Run the trials of several studies that share one grid [monte_carlo], and "
        "print a table of its last axis (the schemes) over all studies and other axes, with 95 % "
        "intervals; store it as CSV, JSON and figure. After an interruption, the same command "
        "continues with the missing trials.",
    )
    parser.add_argument("study", nargs="+", metavar="STUDY", help="study files (TOML)")
    parser.add_argument(
        "--common",
        action="append",
        default=[],
        metavar="FILE",
        help="tables that complete those of every study: the grid, and what all radars share; of "
        "several files, each completes what those before it lack",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="PATH=VALUE",
        dest="overrides",
        help="change one value of every study, as in --set monte_carlo.trials=20; "
        "PATH=none removes an optional value or table, as in --set receiver.mitigation=none; "
        "may be repeated",
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        default="out/comparison",
        help="folder of the trials and the table (default: out/comparison)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON in SI units on stdout")
    add_workers(parser)


def run(arguments: argparse.Namespace) -> int:
    """Check all studies, run their missing trials, and compare the schemes."""
    from polychirp.config.monte_carlo import load_plan
    from polychirp.report.figures.comparison import scheme_comparison
    from polychirp.report.words import finite
    from polychirp.study.monte_carlo.comparison import comparison, refuse_unlike
    from polychirp.study.monte_carlo.plan import check_plan
    from polychirp.study.monte_carlo.run import LOG, run_plan

    executor = _executor(arguments)
    plans = [
        load_plan(
            path, overrides=arguments.overrides, program=command_name(), common=arguments.common
        )
        for path in arguments.study
    ]
    refuse_unlike(plans)
    for plan in plans:  # all of them, before the first trial of any
        with progress_bar(_name(plan)) as progress:
            check_plan(plan, progress=progress)
    out = usable_folder(Path(arguments.out))
    results: dict[str, Results] = {}
    failures: list[str] = []
    for plan in plans:
        name = _name(plan)
        folder = usable_folder(out / f"{name}-{plan.origin.study_hash[:8]}-trials")
        refuse_other_files(folder, LOG)
        with progress_bar(name) as progress:
            finished = run_plan(plan, folder=folder, executor=executor, progress=progress)
        results[name] = finished.results
        failures += finished.failures
    cells = comparison(results)
    rows = [finite(asdict(cell)) for cell in cells]
    (out / "comparison.json").write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    scheme_comparison(cells).save(out, "comparison")
    if arguments.json:
        print(json.dumps(rows, indent=2))
    else:
        _print_tables(plans, cells)
        _print_costs(plans[0])
        say(f"stored in {out}: comparison.csv, comparison.json, comparison.png")
    if failures:
        raise RunError("\n  ".join([f"trials that failed: {len(failures)}", *failures]))
    return 0


def _executor(arguments: argparse.Namespace) -> Executor:
    from polychirp.study.monte_carlo.executor import LocalWorkers

    return LocalWorkers(count=num_workers(arguments))


def _name(plan: Plan) -> str:
    return plan.points[0].study.name


def _print_tables(plans: Sequence[Plan], cells: Sequence[Cell]) -> None:
    from rich.table import Table

    groups = list(dict.fromkeys((cell.scenario, cell.condition) for cell in cells))
    schemes = list(dict.fromkeys(cell.scheme for cell in cells))
    of = {(cell.scenario, cell.condition, cell.scheme): cell for cell in cells}
    console = tables()
    for field, title in _TABLES.items():
        if all(math.isnan(getattr(cell, field).value) for cell in cells):
            continue
        table = Table(title=f"{title}, with 95 % intervals", title_justify="left")
        table.add_column(plans[0].axes[-1].name)
        for scenario, condition in groups:
            table.add_column("\n".join([scenario, *map(str, condition)]), justify="right")
        for scheme in schemes:
            row = [of.get((*group, scheme)) for group in groups]
            table.add_row(str(scheme), *(_cell(one, field) for one in row))
        console.print(table)
    most = max((cell.num_trials for cell in cells), default=0)
    console.print(
        f"Up to {most} trials in a cell; a trial counts as one draw. A star marks the scheme with "
        "the fewest errors under a condition, and all whose errors, trials paired, are not more."
    )


def _print_costs(plan: Plan) -> None:
    """Cost of every scheme in the first study, under its first condition."""
    from rich.table import Table

    from polychirp.study.processing_cost import processing_cost

    table = Table(title="cost of a frame of the first study", title_justify="left")
    table.add_column(plan.axes[-1].name)
    for column in ("receiver", "10⁶ multiplications", "memory, MB", "peak/mean", "duty"):
        table.add_column(column, justify="right")
    for point in plan.points[: len(plan.axes[-1].labels)]:
        cost = processing_cost(point.trial(0))
        table.add_row(
            str(point.labels[-1]),
            cost.receiver,
            f"{cost.multiplications / 1e6:.1f}",
            f"{cost.memory / 1e6:.1f}",
            f"{decibels(cost.peak_to_average)}",
            f"{cost.duty:.2f}",
        )
    tables().print(table)


def _cell(cell: Cell | None, field: str) -> str:
    if cell is None:
        return "–"
    estimate: Estimate = getattr(cell, field)
    star = "* " if field == "errors" and cell.is_among_the_best else ""
    return star + shown(estimate, digits=2)
