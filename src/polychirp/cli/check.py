"""``polychirp check`` — read a study and say what its radars resolve."""

from __future__ import annotations

import argparse
import json
import math
import shlex
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.terminal import command_name, decibels, say, tables

if TYPE_CHECKING:
    from rich.table import Table

    from polychirp.study.check import Derived
    from polychirp.study.limits.derived_radar import DerivedRadar
    from polychirp.study.spec import Study


def add_study_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that are common to all verbs that read a study."""
    parser.add_argument("study", metavar="STUDY", help="a study file (TOML)")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="PATH=VALUE",
        dest="overrides",
        help="change one value, as in --set 'radars.0.start_time=1 ms'; "
        "PATH=none removes an optional value or table, as in --set receiver.mitigation=none; "
        "may be repeated",
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
        "it: range, speed and angle resolution, unambiguous directions, greatest range, beat band, "
        "powers, SNRs of points, memory, cost.",
    )
    add_study_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Check the study and print what its radars resolve."""
    from polychirp.config.load import load_study, radar_tables
    from polychirp.config.monte_carlo import refuse_bad_grid
    from polychirp.study.check import check

    changes = all_overrides(arguments)
    study = load_study(arguments.study, overrides=changes)
    derived = check(study)
    refuse_bad_grid(arguments.study, overrides=changes)
    left_out = list(_left_out(study, radar_tables(arguments.study, overrides=changes)))
    if arguments.json:
        from dataclasses import asdict

        found = asdict(derived)
        found["notes"] = [*derived.notes, *left_out]
        print(json.dumps({"study": study.name, "seed": study.seed, **found}, indent=2))
    else:
        _print_tables(study, derived)
        for note in (*derived.notes, *left_out):
            say(f"note: {note}")
        say(f"next: {next_command('run', arguments)}")
    return 0


def next_command(verb: str, arguments: argparse.Namespace) -> str:
    """Shell command that runs ``verb`` on the same study with the same changes."""
    changes = [word for change in all_overrides(arguments) for word in ("--set", change)]
    return shlex.join([command_name(), verb, arguments.study, *changes])


_POWER_KEYS: Final = ("transmit_power", "transmit_gain", "receive_gain", "noise_figure")
"""Keys of a radar that the SNR or the level of its samples depends on, without its antennas'."""


def _left_out(study: Study, given: Sequence[dict[str, Any]]) -> Iterator[str]:
    """A sentence on keys of powers that the radars' tables ``given`` leave out, and their values.

    Radars that leave out the same keys share a sentence.
    """
    from polychirp.config.quantity import write_quantity
    from polychirp.model.antenna import ElementPattern
    from polychirp.model.radar import Radar
    from polychirp.units import Unit

    usual = Radar(name="")
    level = {
        key: write_quantity(getattr(usual, key), Unit("W" if key == "transmit_power" else "dB"))
        for key in _POWER_KEYS
    }
    gain = write_quantity(ElementPattern().peak_gain, Unit("dB"))
    radars: dict[tuple[str, ...], list[str]] = {}
    for radar, table in zip(study.radars, given, strict=False):
        keys = [f"{key} = {level[key]}" for key in _POWER_KEYS if key not in table]
        if "peak_gain" not in table.get("array", {}).get("pattern", {}):
            keys.append(f"array.pattern.peak_gain = {gain}")
        radars.setdefault(tuple(keys), []).append(f"'{radar.name}'")
    for missing, names in radars.items():
        if missing:
            yield (
                f"{_listed(names)} {'has' if len(names) == 1 else 'have'} the paper's "
                f"{_listed(missing)}, as the study gives no other"
            )


def _listed(words: Sequence[str]) -> str:
    """Words with commas and an "and"; of more than four, the first three and the number of others.

    >>> _listed(["a", "b", "c"]), _listed(["a"] * 9)
    ('a, b and c', 'a, a, a and 6 more')
    """
    if len(words) == 1:
        return words[0]
    if len(words) > 5:
        return f"{', '.join(words[:3])} and {len(words) - 3} more"
    return f"{', '.join(words[:-1])} and {words[-1]}"


def _print_tables(study: Study, derived: Derived) -> None:
    from rich.table import Table

    table = Table(title=f"{study.name}: what its radars resolve", title_justify="left")
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
    if derived.echoes:
        console.print(_echoes(derived))
        console.print(
            "The SNR is that of all samples and channels in phase, by the radar equation; windows "
            "of a receiver take some dB of it."
        )
    for radar in derived.radars:
        if radar.name in derived.victims and derived.is_receiver_chosen:
            console.print(
                f"'{radar.name}' has the receiver '{radar.receiver}', as {radar.receiver_reason}."
            )
    console.print(
        f"Frames are computed for {_counted(len(derived.victims), 'radar')} of "
        f"{len(derived.radars)}; the scene is traced {_counted(derived.num_snapshots, 'time')}; "
        f"samples and their parts take {derived.memory / 1e6:.3g} MB.\n"
        f"A run takes roughly {derived.cost:.2g} s on one core{_compilation(study)}.",
    )


def _compilation(study: Study) -> str:
    """Part of a sentence on the kernels that are not compiled yet; empty if all are."""
    from polychirp.kernel_cache import expected_duration, is_enabled, missing
    from polychirp.study.kernel_parts import PARTS, parts_of
    from polychirp.study.random_draw import sample_street

    parts = [PARTS[name] for name in missing(parts_of(sample_street(study)))]
    if not (parts and is_enabled()):
        return ""
    duration = expected_duration(parts)
    return f"; the first one also compiles kernels, which takes {duration:.0f} s or more"


def _echoes(derived: Derived) -> Table:
    """Table of the SNRs of points by the radar equation."""
    from rich.table import Table

    table = Table(title="echoes of points in free space", title_justify="left")
    for column in ("radar", "target"):
        table.add_column(column)
    for column in ("range", "SNR of a coherent frame"):
        table.add_column(column, justify="right")
    for echo in derived.echoes:
        level = decibels(echo.snr) if echo.snr > 0 else _ABSENT
        table.add_row(echo.radar, echo.target, f"{echo.range:.2f} m", level)
    return table


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
        "azimuth resolution (3-dB beam)": _width(radar.azimuth_beamwidth),
        "elevation resolution (3-dB beam)": _width(radar.elevation_beamwidth),
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
        "peak EIRP of an element": _dbm(radar.eirp),
        "antenna gain of an element": f"{_level(radar.antenna_gain):.3g} dB",
        "noise figure": f"{_level(radar.noise_figure):.3g} dB",
        "noise of a sample, at the antenna": _dbm(radar.sample_noise),
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


def _level(ratio: float) -> float:
    from polychirp.units import to_db

    return float(to_db(ratio))


def _dbm(power: float) -> str:
    """A power in dBm as text; a dash for none, as of a radar that only receives."""
    return f"{_level(power) + 30.0:.1f} dBm" if power > 0.0 else _ABSENT


def _width(angle: float | None) -> str:
    """An angle; a dash for an array that does not measure it."""
    return _ABSENT if angle is None else f"{math.degrees(angle):.3g}°"


def _window(angle: float | None) -> str:
    """The greatest angle to either side; a dash for an array that does not measure it."""
    return _ABSENT if angle is None else f"±{math.degrees(angle):.3g}°"


def _span(limits: tuple[float, float], scale: float, unit: str) -> str:
    low, high = (f"{scale * value:.4g}" for value in limits)
    return f"{low} {unit}".strip() if low == high else f"{low} … {high} {unit}".strip()
