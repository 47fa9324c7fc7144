"""Common to the commands that run many trials: workers, kept files, estimates as text."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.terminal import say
from polychirp.errors import InputError

if TYPE_CHECKING:
    from polychirp.scoring.association import Gate
    from polychirp.scoring.statistics import Estimate

KEPT_TRIALS: Final = (
    "finished trials are kept, and the same command continues with the missing trials"
)
"""A sentence on the trials that are kept after an interrupt."""

WHY_UNRESOLVED: Final = (
    "not every subframe has them, or two speeds explain them almost equally well; a greater SNR, "
    "or intervals of the subframes with less in common, would resolve more"
)
"""Reason why a receiver leaves detections out, and what helps, as the end of a sentence."""


def add_workers(parser: Any) -> None:
    """Add the option ``--workers``."""
    parser.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help="number of worker processes, of one thread each (default: one for each core)",
    )


def num_workers(arguments: argparse.Namespace, *, is_local: bool = True) -> int:
    """Number of workers that the arguments ask for; local ones are limited for each core."""
    from polychirp.study.monte_carlo.executor import WORKERS_PER_CORE
    from polychirp.threads import num_cores

    count = num_cores() if arguments.workers is None else int(arguments.workers)
    if count < 1:
        raise InputError(f"--workers is {count}; use 1 or more")
    most = WORKERS_PER_CORE * num_cores()
    if not is_local or count <= most:
        return count
    say(
        f"note: --workers is {count}, but at most {WORKERS_PER_CORE} start for each core, "
        f"here {most}"
    )
    return most


def refuse_other_files(folder: Path, log: str) -> None:
    """Refuse a folder that holds files but not the log of trials that is called ``log``."""
    if folder.exists() and any(folder.iterdir()) and not (folder / log).exists():
        raise InputError(f"--out: '{folder}' holds files but no log of trials; name another folder")


def margins_text(gates: Iterable[Gate]) -> str:
    """A sentence on the margins of detections, as the least and the greatest of several."""
    gates = list(gates)

    def within(name: str, scale: float, unit: str) -> str:
        values = [f"{scale * getattr(gate, name):.3g}" for gate in gates]
        least, most = min(values, key=float), max(values, key=float)
        return f"{least}{unit}" if least == most else f"{least} to {most}{unit}"

    margins = (
        within("range", 1.0, " m"),
        within("range_rate", 1.0, " m/s"),
        within("azimuth", 180.0 / math.pi, "°"),
        within("elevation", 180.0 / math.pi, "°"),
    )
    return (
        f"A detection is on a target within {margins[0]}, {margins[1]}, {margins[2]} of azimuth "
        f"and, where the array measures it, {margins[3]} of elevation of its visible metal."
    )


def shown(estimate: Estimate, *, scale: float = 1.0, digits: int = 2) -> str:
    """The estimate and, on the next line, the limits of its interval: 0.812 and 0.774–0.845."""
    if math.isnan(estimate.value):
        return "–"
    value, low, high = (scale * v for v in (estimate.value, estimate.low, estimate.high))
    limits = "" if math.isnan(low) else f"\n{_short(low, digits)}–{_short(high, digits)}"
    return f"{_short(value, digits)}{limits}"


def _short(value: float, digits: int) -> str:
    """The value with ``digits`` decimals; with two significant digits below 10^(1 − digits).

    A value that is nothing beside these decimals is 0.
    """
    if abs(value) < 1e-3 * 10.0**-digits or abs(value) >= 10.0**-digits * 10:
        return f"{round(value, digits) + 0.0:.{digits}f}"  # no minus before a zero
    return f"{value:.2g}"
