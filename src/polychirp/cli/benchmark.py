"""``polychirp benchmark`` — methods of mitigation on a named set of frames."""

from __future__ import annotations

import argparse
import json
import math
import statistics
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.progress import progress_bar
from polychirp.cli.terminal import add_option, say, tables, usable_folder
from polychirp.cli.trials import add_workers, num_workers
from polychirp.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table

    from polychirp.study.mitigation.benchmark import BenchmarkPlan, MethodResult

    _Column = tuple[str, int, Sequence[float]]

_COLUMNS: Final = (
    ("SINR range, dB", "sinr_range", 1.0, 1),
    ("10 %", "sinr_range", 1.0, 1),
    ("SINR rate, dB", "sinr_velocity", 1.0, 1),
    ("EVM, %", "evm", 100.0, 1),
    ("phase, deg", "phase_error", 180.0 / math.pi, 1),
    ("floor, dB", "floor_rise", 1.0, 1),
    ("Pd", "detection", 1.0, 2),
    ("ghosts", "ghosts", 1.0, 0),
    ("missed", "missed", 1.0, 2),
)
"""Columns of the table of what is given back: heading, measure, factor and digits; medians but for
"10 %"."""

_DETECTION_COLUMNS: Final = (
    ("precision, %", "precision", 100.0, 1),
    ("recall, %", "recall", 100.0, 1),
    ("F, %", "f_score", 100.0, 1),
    ("clean: touched, %", "false_mitigation", 100.0, 2),
    ("clean: EVM, %", "clean_evm", 100.0, 2),
)
"""Columns of the table of detection and harm: medians."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``benchmark``."""
    parser = subparsers.add_parser(
        "benchmark",
        help="compare methods of mitigation on a named set of frames",
        description="Apply methods of mitigation to the frames of a named and versioned set, and "
        "measure what each gives back, between 'nothing' and the 'clean oracle'. The record "
        "benchmark.json has the measures of every frame, for comparison with those of others.",
    )
    add_option(parser, "--set", "NAME", "v2", "set of frames, v1 or v2")
    parser.add_argument(
        "--family",
        action="append",
        default=[],
        metavar="NAME",
        help="family of frames of the set; may be repeated (default: all)",
    )
    add_option(parser, "--frames", "N", 8, "frames of every family")
    parser.add_argument(
        "--method",
        action="append",
        default=[],
        metavar="NAME",
        help="method; may be repeated (default: all but stft-filled, dual-sparsity and "
        "low-rank-hankel, which take seconds to a minute for a frame)",
    )
    add_option(
        parser, "--slow-frames", "N", 0, "frames of every family for those three, if not named"
    )
    parser.add_argument(
        "--known-bursts",
        action="store_true",
        help="measure each method that detects bursts first once more, with the bursts known",
    )
    parser.add_argument(
        "--own",
        action="append",
        default=[],
        metavar="NAME=MODULE:OBJECT",
        help="a method of your own, with a function 'mitigate(frame)'; may be repeated",
    )
    parser.add_argument(
        "--out", metavar="DIR", help="folder of the results (default: out/benchmark-SET)"
    )
    add_workers(parser)


def run(arguments: argparse.Namespace) -> int:
    """Check the names, measure all methods, store the record, the tables and the figure."""
    from polychirp.report.figures.mitigation_benchmark import benchmark_picture
    from polychirp.study.mitigation.benchmark import (
        benchmark_record,
        benchmark_times,
        run_benchmark,
    )

    plan = _plan(arguments)
    workers = num_workers(arguments)
    folder = usable_folder(arguments.out or Path("out") / f"benchmark-{arguments.set}")
    with progress_bar("benchmark") as show:
        results = run_benchmark(plan, workers=workers, progress=show)
    folder.mkdir(parents=True, exist_ok=True)
    _store(folder / "benchmark.json", benchmark_record(results, plan))
    _store(folder / "times.json", benchmark_times(results))
    title = f"Set {arguments.set}, {arguments.frames} frames of each family"
    benchmark_picture(results, title=title).save(folder, "benchmark")
    for family in plan.families:
        _print_tables(family, [one for one in results if one.family == family], plan.num_frames)
    for result in results:
        if result.refusal:
            say(f"note: {result.family}: {result.refusal}")
    say(f"stored in {folder}: benchmark.json, times.json, benchmark.png, benchmark.csv")
    return 0


def _plan(arguments: argparse.Namespace) -> BenchmarkPlan:
    """The plan that the arguments ask for."""
    from polychirp.study.mitigation.benchmark import BenchmarkPlan
    from polychirp.study.mitigation.own_methods import METHODS, SLOW_METHODS, methods_named

    methods = methods_named(tuple(arguments.method), tuple(arguments.own))
    fewer = {}
    if arguments.slow_frames < 0:
        raise InputError(f"--slow-frames is {arguments.slow_frames}; use 0 or more")
    if arguments.slow_frames:
        slow = [name for name in METHODS if name in SLOW_METHODS and name not in methods]
        methods |= methods_named(tuple(slow), ()) if slow else {}
        fewer = {name: min(arguments.slow_frames, arguments.frames) for name in slow}
    return BenchmarkPlan(
        methods=methods,
        frame_set=arguments.set,
        families=tuple(arguments.family),
        num_frames=arguments.frames,
        fewer=fewer,
        knows_bursts=arguments.known_bursts,
    )


def _store(path: Path, record: Any) -> None:
    text = json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def _print_tables(family: str, results: Sequence[MethodResult], num_frames: int) -> None:
    """Medians of one family, methods in their order: what they give back, and their harm."""
    nothing = results[0]
    worse = [100.0 * result.share_worse(nothing) for result in results]
    times = [
        1000.0 * statistics.median(result.seconds) if result.seconds else math.nan
        for result in results
    ]
    harm = (("worse, %", 0, worse), ("CPU, ms", 0, times))
    names = [_name(result, num_frames) for result in results]
    for title, columns in (
        (f"{family}, medians over the frames", _values(results, _COLUMNS)),
        (f"{family}, detection and harm", (*_values(results, _DETECTION_COLUMNS), *harm)),
    ):
        tables().print(_table(title, names, columns))


def _name(result: MethodResult, num_frames: int) -> str:
    """Name of a method, with the number of its frames if it has fewer than others."""
    count = len(result.frames)
    return result.method if result.refusal or count == num_frames else f"{result.method} ({count})"


def _values(
    results: Sequence[MethodResult], columns: Sequence[tuple[str, str, float, int]]
) -> list[_Column]:
    """Heading, digits and values of columns; NaN where a method has none."""
    of_column: list[_Column] = []
    for heading, measure, factor, digits in columns:
        place = 0 if heading == "10 %" else 1
        values = [factor * result.percentiles(measure)[place] for result in results]
        of_column.append((heading, digits, values))
    return of_column


def _table(title: str, names: Sequence[str], columns: Sequence[_Column]) -> Table:
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    table.add_column("method", min_width=18, no_wrap=True)
    for heading, *_ in columns:
        table.add_column(heading, justify="right")
    for number, name in enumerate(names):
        cells = [(values[number], digits) for _, digits, values in columns]
        shown = [
            "–" if math.isnan(value) else f"{round(value, digits) + 0.0:.{digits}f}"
            for value, digits in cells
        ]
        table.add_row(name, *shown)
    return table
