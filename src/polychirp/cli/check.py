"""``polychirp check`` — read a study and say what its radars resolve."""

from __future__ import annotations

import argparse
import json
import math
import shlex
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.terminal import command_name, say, tables

if TYPE_CHECKING:
    from polychirp.study.check import Derived
    from polychirp.study.limits.derived_radar import DerivedRadar


def add_study_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that are common to all verbs that read a study."""
    parser.add_argument("study", metavar="STUDY", help="a study file (TOML)")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="PATH=VALUE",
        dest="overrides",
        help="change one value, as in --set 'radars.0.start_time=1 ms'; may be repeated",
    )
    parser.add_argument(
        "--seed", metavar="N", help="seed of all random draws, the same as --set seed=N"
    )
    parser.add_argument("--json", action="store_true", help="print JSON in SI units on stdout")


def all_overrides(arguments: argparse.Namespace) -> list[str]:
    """Changes ``PATH=VALUE`` to the study that the arguments ask for, that of the seed last."""
    seed = [] if arguments.seed is None else [f"seed={arguments.seed}"]
    return [*arguments.overrides, *seed]


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``check``."""
    parser = subparsers.add_parser(
        "check",
        help="read a study and print what its radars resolve",
        description="Read a study, say what prevents it from running, and print what follows from "
        "it: range and speed resolution, unambiguous directions, greatest range, beat band, "
        "memory, cost.",
    )
    add_study_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Check the study and print what its radars resolve."""
    from polychirp.config.load import load_study
    from polychirp.config.monte_carlo import refuse_bad_grid
    from polychirp.study.check import check

    changes = all_overrides(arguments)
    study = load_study(arguments.study, overrides=changes)
    derived = check(study)
    refuse_bad_grid(arguments.study, overrides=changes)
    if arguments.json:
        from dataclasses import asdict

        print(json.dumps({"study": study.name, "seed": study.seed, **asdict(derived)}, indent=2))
    else:
        _print_tables(study.name, derived)
        say(f"next: {next_command('run', arguments)}")
    return 0


def next_command(verb: str, arguments: argparse.Namespace) -> str:
    """Shell command that runs ``verb`` on the same study with the same changes."""
    changes = [word for change in all_overrides(arguments) for word in ("--set", change)]
    return shlex.join([command_name(), verb, arguments.study, *changes])


def _print_tables(name: str, derived: Derived) -> None:
    from rich.table import Table

    table = Table(title=f"{name}: what its radars resolve", title_justify="left")
    table.add_column("")
    for radar in derived.radars:
        table.add_column(radar.name, justify="right")
    columns = [_rows(radar, derived.victims) for radar in derived.radars]
    for label in columns[0]:
        cells = [column[label] for column in columns]
        if any(cell != _ABSENT for cell in cells):
            table.add_row(label, *cells)
    console = tables()
    console.print(table)
    for radar in derived.radars:
        if radar.name in derived.victims and derived.is_receiver_chosen:
            console.print(
                f"'{radar.name}' has the receiver '{radar.receiver}', as {radar.receiver_reason}."
            )
    console.print(
        f"Frames are computed for {_counted(len(derived.victims), 'radar')} of "
        f"{len(derived.radars)}; the scene is traced {_counted(derived.num_snapshots, 'time')}; "
        f"samples and their parts take {derived.memory / 1e6:.3g} MB.\n"
        f"A run takes roughly {derived.cost:.2g} s on one core; the first run also compiles its "
        "kernels, which takes a minute.",
    )


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _rows(radar: DerivedRadar, victims: tuple[str, ...]) -> dict[str, str]:
    return {
        "range resolution": _span(radar.range_resolution, 1e2, "cm"),
        "speed resolution": f"{3.6 * radar.speed_resolution:.3g} km/h",
        "unambiguous speed, by Doppler": _speed_limit(radar),
        "… and by beams or empty bands": f"±{3.6 * radar.unfolded_speed:.3g} km/h"
        if radar.unfolded_speed > radar.unambiguous_speed
        else _ABSENT,
        "transmitting elements": _code(*radar.code),
        "unambiguous azimuth": _window(radar.azimuth_window),
        "unambiguous elevation": _window(radar.elevation_window),
        "greatest range (IF pass band)": f"{radar.greatest_range:.3g} m"
        if radar.beat_band[1] > 0.0
        else _ABSENT,
        "range after which echoes repeat": f"{radar.greatest_range:.4g} m"
        if radar.beat_band[1] == 0.0 and radar.chips_per_ramp
        else _ABSENT,
        "greatest range (first sample)": f"{radar.greatest_range:.4g} m"
        if radar.beat_band[1] == 0.0 and not radar.chips_per_ramp
        else _ABSENT,
        "beat band": _prefixed_span(radar.beat_band, "Hz"),
        "chips per ramp": str(radar.chips_per_ramp) if radar.chips_per_ramp else _ABSENT,
        "peak to average power": f"{10 * math.log10(radar.peak_to_average):.2g} dB"
        if radar.chips_per_ramp
        else _ABSENT,
        "receiver": radar.receiver,
        "ramp": _prefixed_span(radar.ramp_duration, "s"),
        "frame": f"{_prefixed_span((radar.frame_duration,) * 2, 's')}, {radar.num_ramps} ramps",
        "samples per ramp": f"{_span(radar.samples_per_ramp, 1, '')} {radar.sampling}",
        "samples per frame and channel": str(radar.samples_per_frame),
        "memory": f"{radar.memory / 1e6:.3g} MB" if radar.name in victims else "– (no victim)",
    }


def _speed_limit(radar: DerivedRadar) -> str:
    if radar.num_ramps == 1:
        return "none: a single ramp"
    if not (radar.has_equal_sweeps or radar.has_subframes):
        return "no limit: sweeps differ"
    together = " by all subframes" if radar.has_subframes else ""
    return f"±{3.6 * radar.unambiguous_speed:.3g} km/h{together}"


def _code(num_sweeps: int, num_elements: int) -> str:
    """Number of elements, and length of the code by which they share the sweeps."""
    if num_elements == 1:
        return "1"
    empty = num_sweeps - num_elements
    bands = f" ({_counted(empty, 'band')} empty)" if empty else ""
    return f"{num_elements}, code of {num_sweeps} sweeps{bands}"


_ABSENT: Final = "–"
"""Cell of a quantity that a radar does not have; a row without any other cell is left out."""

_PREFIXES: Final = {"Hz": {"G": 1e9, "M": 1e6, "k": 1e3}, "s": {"": 1.0, "m": 1e-3, "µ": 1e-6}}
"""Prefixes that the table uses with each unit, from the greatest on."""


def _prefixed_span(limits: tuple[float, float], unit: str) -> str:
    """Limits with the greatest prefix at which the upper one is at least 1.

    >>> _prefixed_span((0.0, 7.5e6), "Hz"), _prefixed_span((40e-6, 40e-6), "s")
    ('0 … 7.5 MHz', '40 µs')
    """
    prefixes = _PREFIXES[unit]
    # the margin keeps 1 ms, computed as 0.999… ms, from being 1000 µs
    fits = (name for name, size in prefixes.items() if limits[1] >= size * (1 - 1e-9))
    prefix = next(fits, list(prefixes)[-1])
    return _span(limits, 1.0 / prefixes[prefix], prefix + unit)


def _window(angle: float | None) -> str:
    """The greatest angle to either side; a dash for an array that does not measure it."""
    return _ABSENT if angle is None else f"±{math.degrees(angle):.3g}°"


def _span(limits: tuple[float, float], scale: float, unit: str) -> str:
    low, high = (f"{scale * value:.4g}" for value in limits)
    return f"{low} {unit}".strip() if low == high else f"{low} … {high} {unit}".strip()
