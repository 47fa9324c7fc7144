"""``polychirp study`` — run trials over a grid of parameters, on many workers and resumably."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.check import add_study_arguments, all_overrides
from polychirp.cli.progress import progress_bar
from polychirp.cli.stored import STUDY, drawn_files
from polychirp.cli.terminal import command_name, decibels, say, tables, usable_folder
from polychirp.cli.trials import (
    KEPT_TRIALS,
    WHY_UNRESOLVED,
    add_workers,
    margins_text,
    num_workers,
    refuse_other_files,
    shown,
)
from polychirp.errors import RunError

if TYPE_CHECKING:
    from rich.table import Table

    from polychirp.study.monte_carlo.plan import Plan
    from polychirp.study.monte_carlo.results import Results
    from polychirp.study.monte_carlo.run import Finished
    from polychirp.study.monte_carlo.summary import Summary
    from polychirp.study.monte_carlo.tasks import Executor

KEPT_FILES: Final = KEPT_TRIALS
"""Part of the message that `cli.app` prints after an interrupt."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``study``."""
    parser = subparsers.add_parser(
        "study",
        help="run many trials of a study, over a grid of its parameters",
        description="Run the trials of a study with a table [monte_carlo], at every point of its "
        "grid; print detection probability, ghosts and errors with 95 % intervals; store all as "
        "Zarr and CSV. After an interruption, the same command continues with the missing "
        "trials.",
    )
    add_study_arguments(parser)
    parser.add_argument(
        "--out", metavar="DIR", help="folder of the results (default: out/NAME-HASH-trials)"
    )
    parser.add_argument(
        "--force", action="store_true", help="remove the trials and results in that folder first"
    )
    add_workers(parser)
    parser.add_argument(
        "--cluster",
        metavar="WHERE",
        help="run on Dask: 'local', 'slurm', or the address of a scheduler, tcp://…",
    )


def run(arguments: argparse.Namespace) -> int:
    """Check all points, run the missing trials, store the results and print them."""
    from polychirp.config.monte_carlo import load_plan
    from polychirp.study.monte_carlo.plan import check_plan
    from polychirp.study.monte_carlo.run import LOG, run_plan

    executor = _executor(arguments)
    plan = load_plan(arguments.study, overrides=all_overrides(arguments), program=command_name())
    name = plan.points[0].study.name
    with progress_bar(name) as progress:
        check_plan(plan, progress=progress)
    folder = usable_folder(
        arguments.out or Path("out") / f"{name}-{plan.origin.study_hash[:8]}-trials"
    )
    refuse_other_files(folder, LOG)
    with progress_bar(name) as progress:
        finished = run_plan(
            plan,
            folder=folder,
            executor=executor,
            progress=progress,
            anew=arguments.force,
            drawn=drawn_files(folder, STUDY),
        )
    if arguments.json:
        print(json.dumps(_summary(name, plan, folder, finished), indent=2))
    else:
        _print_tables(name, plan, finished.results)
        _print_files(folder, finished)
    if finished.failures:
        raise RunError(
            "\n  ".join([f"trials that failed: {len(finished.failures)}", *finished.failures])
        )
    return 0


def _executor(arguments: argparse.Namespace) -> Executor:
    from polychirp.study.monte_carlo.dask_executor import DaskWorkers
    from polychirp.study.monte_carlo.executor import LocalWorkers

    count = num_workers(arguments, is_local=arguments.cluster in (None, "local"))
    if arguments.cluster is not None:
        return DaskWorkers(cluster=arguments.cluster, count=count)
    return LocalWorkers(count=count)


def _summary(name: str, plan: Plan, folder: Path, finished: Finished) -> dict[str, Any]:
    from polychirp.study.monte_carlo.summary import differences, summaries
    from polychirp.study.monte_carlo.tables import flat_row

    results = finished.results
    return {
        "study": name,
        "seed": plan.origin.seed,
        "study_hash": plan.origin.study_hash,
        "versions": plan.origin.versions,
        "platform": plan.origin.platform,
        "stored": str(folder),
        "axes": {axis.name: list(axis.labels) for axis in plan.axes},
        "new_trials": finished.num_new,
        "failures": list(finished.failures),
        "points": [flat_row(row, results) for row in summaries(results)],
        "differences": [flat_row(row, results) for row in differences(results)],
    }


def _print_tables(name: str, plan: Plan, results: Results) -> None:
    from polychirp.study.margins import gates_of
    from polychirp.study.monte_carlo.summary import summaries

    rows = summaries(results)
    axes = [axis.name for axis in plan.axes]
    console = tables()
    console.print(_table(f"{name}: detections, with 95 % intervals", axes, rows, _detections))
    console.print(_table("errors of targets found, rms", axes, rows, _errors))
    console.print(_table("in the cells of the targets, medians", axes, rows, _levels))
    if any(not math.isnan(row.lost.value) for row in rows):
        console.print(_table("frames under a rule from frame to frame", axes, rows, _losses))
    console.print(
        "A trial counts as one draw, however many targets it has. Ghosts, and those of them that "
        f"nothing explains, are means per frame, {_thresholds(plan)}.",
    )
    gates = [gate for point in plan.points for gate in gates_of(point.study).values()]
    console.print(margins_text(gates))
    most = max((row.unresolved.value for row in rows), default=0.0)
    if most > 0.0:
        console.print(
            f"Detections with unresolved speeds were left out, up to {most:.2g} per frame in the "
            f"mean at one point: {WHY_UNRESOLVED}. The column 'unresolved' of summary.csv has the "
            "means of all points.",
        )


def _thresholds(plan: Plan) -> str:
    """Thresholds of the receivers of all points, as the end of a sentence."""
    from polychirp.receiver.settings import DetectorSettings

    receivers = [point.study.receiver for point in plan.points]
    rates = {one.false_alarm_probability for one in receivers if isinstance(one, DetectorSettings)}
    shown = []
    if rates:
        each = ", ".join(f"{rate:g}" for rate in sorted(rates))
        shown.append(f"at a false-alarm probability per cell of {each}")
    if any(one.kind == "paper" for one in receivers):
        shown.append("with the receiver 'paper' at its threshold, the mean of the profile")
    return ", and ".join(shown)


def _table(
    title: str, axes: list[str], rows: list[Summary], cells: Callable[[Summary], dict[str, str]]
) -> Table:
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    for column in (*axes, "radar"):
        table.add_column(column)
    for column in cells(rows[0]) if rows else ():
        table.add_column(column, justify="right")
    for row in rows:
        table.add_row(*(str(label) for label in row.labels), row.victim, *cells(row).values())
    return table


def _detections(row: Summary) -> dict[str, str]:
    return {
        "trials": str(row.num_trials),
        "Pd": shown(row.detection, digits=3),
        "out of sight": f"{row.out_of_sight.value:.2g}",
        "P(ghost)": shown(row.ghost, digits=3),
        "ghosts": shown(row.ghosts),
        "unexplained": shown(row.unexplained),
    }


def _errors(row: Summary) -> dict[str, str]:
    return {
        "range, m": shown(row.range_rmse),
        "speed, km/h": shown(row.range_rate_rmse, scale=3.6),
        "azimuth, °": shown(row.azimuth_rmse, scale=180 / math.pi),
        "elevation, °": shown(row.elevation_rmse, scale=180 / math.pi),
    }


def _levels(row: Summary) -> dict[str, str]:
    return {
        "SNR": _in_db(row.snr),
        "INR": _in_db(row.inr),
        "SINR": _in_db(row.sinr),
        "SINR, mitigated": _in_db(row.mitigated_sinr),
        "floor rise": _in_db(row.floor_rise),
    }


def _losses(row: Summary) -> dict[str, str]:
    return {
        "lost": shown(row.lost, digits=3),
        "longest loss, frames": shown(row.longest_loss),
        "until free, frames": shown(row.until_free),
    }


def _in_db(ratio: float) -> str:
    return decibels(ratio) if ratio > 0 else "–"


def _print_files(folder: Path, finished: Finished) -> None:
    parquet = "" if find_spec("pyarrow") else " (no Parquet: pyarrow is not installed)"
    say(f"{finished.num_new} new trials; stored in {folder}: {', '.join(finished.files)}{parquet}")
