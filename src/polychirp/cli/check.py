"""``polychirp check`` — read a study and say what its radars resolve."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from polychirp.study.check import Derived, DerivedRadar


def add_study_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what every verb takes that reads a study."""
    parser.add_argument("study", metavar="STUDY", help="a study file (TOML)")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="PATH=VALUE",
        dest="overrides",
        help="change one value, as in --set 'radars.0.start_time=1 ms'; may be repeated",
    )
    parser.add_argument("--seed", metavar="N", help="the same as --set seed=N")
    parser.add_argument("--json", action="store_true", help="print JSON in SI units on stdout")


def all_overrides(arguments: argparse.Namespace) -> list[str]:
    """Changes to the study, the seed last."""
    seed = [] if arguments.seed is None else [f"seed={arguments.seed}"]
    return [*arguments.overrides, *seed]


def add_parser(subparsers: Any) -> None:
    """Add this verb."""
    parser = subparsers.add_parser(
        "check",
        help="read a study and print what its radars resolve",
        description="Read a study, refuse it if it cannot run, and print what follows from it: "
        "range and speed resolution, greatest range, beat band, memory, cost.",
    )
    add_study_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Check and print."""
    from polychirp.config.load import load_study
    from polychirp.study.check import check

    study = load_study(arguments.study, overrides=all_overrides(arguments))
    derived = check(study)
    if arguments.json:
        from dataclasses import asdict

        print(json.dumps({"study": study.name, "seed": study.seed, **asdict(derived)}, indent=2))
    else:
        _print_tables(study.name, derived)
    return 0


def _print_tables(name: str, derived: Derived) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{name}: what its radars resolve", title_justify="left")
    table.add_column("")
    for radar in derived.radars:
        table.add_column(radar.name, justify="right")
    columns = [_rows(radar, derived.victims) for radar in derived.radars]
    for label in columns[0]:
        table.add_row(label, *(column[label] for column in columns))
    console = Console(file=sys.stderr)
    console.print(table)
    console.print(
        f"{len(derived.victims)} frame(s) of {len(derived.radars)} radar(s), "
        f"{derived.num_snapshots} snapshots of the scene, "
        f"{derived.memory / 1e6:.3g} MB of samples and parts,\n"
        f"about {derived.cost:.2g} s on one core (a rough guess: see study.check.Derived)",
        highlight=False,
    )


def _rows(radar: DerivedRadar, victims: tuple[str, ...]) -> dict[str, str]:
    return {
        "range resolution": _span(radar.range_resolution, 1e2, "cm"),
        "speed resolution": f"{3.6 * radar.speed_resolution:.3g} km/h",
        "unambiguous speed (equal sweeps)": f"±{3.6 * radar.unambiguous_speed:.3g} km/h",
        "greatest range (IF pass band)": f"{radar.greatest_range:.3g} m",
        "beat band": _span(radar.beat_band, 1e-3, "kHz"),
        "ramp": _span(radar.ramp_duration, 1e3, "ms"),
        "frame": f"{1e3 * radar.frame_duration:.4g} ms, {radar.num_ramps} ramps",
        "samples per ramp": _span(radar.samples_per_ramp, 1, ""),
        "samples per frame and channel": str(radar.samples_per_frame),
        "memory": f"{radar.memory / 1e6:.3g} MB" if radar.name in victims else "(no victim)",
    }


def _span(limits: tuple[float, float], scale: float, unit: str) -> str:
    low, high = (f"{scale * value:.4g}" for value in limits)
    return f"{low} {unit}".strip() if low == high else f"{low} … {high} {unit}".strip()
