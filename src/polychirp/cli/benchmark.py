"""``polychirp benchmark`` — methods of mitigation on a named set of frames."""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.progress import progress_bar
from polychirp.cli.terminal import add_option, say, tables, usable_folder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table

    from polychirp.study.mitigation.benchmark import MethodResult

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
    ("clean: touched, %", "false_mitigation", 100.0, 2),
    ("ms", "seconds", 1000.0, 0),
)
"""Columns of the table: heading, measure, factor and digits; medians but for "10 %"."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``benchmark``."""
    parser = subparsers.add_parser(
        "benchmark",
        help="compare methods of mitigation on a named set of frames",
        description="Apply methods of mitigation to the frames of a named and versioned set, and "
        "measure what each gives back, between 'nothing' and the 'clean oracle'. The record "
        "benchmark.json has the measures of every frame, for comparison with those of others.",
    )
    add_option(parser, "--set", "NAME", "v1", "set of frames")
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
        "low-rank-hankel, which take seconds for a frame)",
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


def run(arguments: argparse.Namespace) -> int:
    """Check the names, measure all methods, store the record, the table and the figure."""
    from polychirp.report.figures.mitigation_benchmark import benchmark_picture
    from polychirp.study.mitigation.benchmark import (
        benchmark_record,
        chosen_families,
        run_benchmark,
    )
    from polychirp.study.mitigation.own_methods import methods_named

    methods = methods_named(tuple(arguments.method), tuple(arguments.own))
    families = chosen_families(arguments.set, arguments.family)
    folder = usable_folder(arguments.out or Path("out") / f"benchmark-{arguments.set}")
    with progress_bar("benchmark") as show:
        results = run_benchmark(
            methods,
            frame_set=arguments.set,
            families=families,
            num_frames=arguments.frames,
            progress=show,
        )
    folder.mkdir(parents=True, exist_ok=True)
    record = benchmark_record(results, methods, frame_set=arguments.set)
    text = json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False)
    (folder / "benchmark.json").write_text(text + "\n", encoding="utf-8")
    title = f"Set {arguments.set}, {arguments.frames} frames of each family"
    benchmark_picture(results, title=title).save(folder, "benchmark")
    console = tables()
    for family in families:
        console.print(_table(family, [one for one in results if one.family == family]))
    for result in results:
        if result.refusal:
            say(f"note: {result.family}: {result.refusal}")
    say(f"stored in {folder}: benchmark.json, benchmark.png, benchmark.csv")
    return 0


def _table(family: str, results: Sequence[MethodResult]) -> Table:
    """Medians of one family, methods in their order."""
    from rich.table import Table

    nothing = results[0]
    table = Table(title=f"{family}, medians over the frames", title_justify="left")
    table.add_column("method", min_width=18, no_wrap=True)
    for heading, *_ in _COLUMNS:
        table.add_column(heading, justify="right")
    table.add_column("worse, %", justify="right")
    for result in results:
        cells = []
        for heading, measure, factor, digits in _COLUMNS:
            low, median, _ = result.percentiles(measure) if result.frames else (math.nan,) * 3
            value = factor * (low if heading == "10 %" else median)
            cells.append("–" if math.isnan(value) else f"{round(value, digits) + 0.0:.{digits}f}")
        worse = result.share_worse(nothing)
        cells.append("–" if math.isnan(worse) else f"{100.0 * worse:.0f}")
        table.add_row(result.method, *cells)
    return table
