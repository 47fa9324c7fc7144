"""``polychirp roc`` — measure what a study's receiver detects, over SNR, and its false alarms."""

from __future__ import annotations

import argparse
import json
import math
import re
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.check import add_study_arguments, all_overrides
from polychirp.cli.progress import progress_bar
from polychirp.cli.terminal import add_option, figure_text, say, si_value, tables, usable_folder
from polychirp.cli.trials import (
    KEPT_TRIALS,
    add_workers,
    num_workers,
    refuse_other_files,
    shown,
)
from polychirp.errors import InputError

if TYPE_CHECKING:
    from rich.table import Table

    from polychirp.study.roc.plan import RocPlan
    from polychirp.study.roc.run import RocResult
    from polychirp.study.roc.summary import RocSummary

SNRS: Final = "8:26:2"
"""Default of ``--snr``, dB; chosen: from where an ideal detector with one channel finds hardly any
point to where all receivers find nearly all."""

TRIALS: Final = 100
"""Default number of frames at each SNR; chosen: a probability of one half is known within ±0.1."""

_MOST_SNRS: Final = 1000
"""Greatest number of SNRs, as in `study.roc.plan`."""

_FILES: Final = ("roc.png", "roc.csv", "false_alarms.csv", "provenance.json")
"""Names of the files that `_write` writes."""

KEPT_FILES: Final = KEPT_TRIALS
"""Part of the message that `cli.app` prints after an interrupt."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``roc``."""
    parser = subparsers.add_parser(
        "roc",
        help="measure what a study's receiver detects over SNR, and its false alarms",
        description="Measure the probability that a study's radar and receiver detect a point, "
        "over its coherent SNR, and the detections that noise alone causes, with 95 % intervals, "
        "beside the ideal detector. Points and noise are drawn anew in every frame; the street's "
        "bodies are left out. After an interruption, the same command continues with the missing "
        "frames; further SNRs and trials are added to those that are there.",
    )
    add_study_arguments(parser)
    parser.add_argument("--radar", metavar="NAME", help="the radar (default: the first victim)")
    parser.add_argument(
        "--receiver",
        action="append",
        default=[],
        metavar="KIND",
        help="coherent, range-doppler, decoding, mfsk, paper, auto or a plug-in, with the settings "
        "of the study's receiver; may be repeated: all read the same frames (default: the study's "
        "receiver)",
    )
    parser.add_argument(
        "--pfa",
        metavar="P,…",
        help="false-alarm probabilities per cell (default: that of the study's receiver)",
    )
    add_option(parser, "--snr", "DB,… | FIRST:LAST:STEP", SNRS, "coherent SNRs of the point, in dB")
    add_option(parser, "--trials", "N", TRIALS, "frames at each SNR")
    parser.add_argument(
        "--noise-trials", type=int, metavar="N", help="frames of noise alone (default: as --trials)"
    )
    parser.add_argument(
        "--strong",
        metavar="LEVEL",
        help="put a second point beside the tested one, this much stronger, as in --strong '40 dB'",
    )
    parser.add_argument(
        "--apart-range",
        metavar="R",
        help="distance of that point in range, nearer or farther (default: 4 range cells)",
    )
    parser.add_argument(
        "--apart-rate", metavar="V", help="difference of its range rate (default: 0 m/s)"
    )
    parser.add_argument(
        "--interferer",
        action="append",
        default=[],
        metavar="NAME",
        help="let another radar of the study transmit from its place, in free space; may be "
        "repeated",
    )
    parser.add_argument(
        "--out", metavar="DIR", help="folder of the results (default: out/NAME-HASH-roc)"
    )
    parser.add_argument(
        "--force", action="store_true", help="remove the frames and results in that folder first"
    )
    add_workers(parser)


def run(arguments: argparse.Namespace) -> int:
    """Check everything, compute the missing frames, store the estimates and print them."""
    from polychirp.config.load import load_study

    snrs = _snrs(arguments.snr)
    probabilities = _probabilities(arguments.pfa)
    strong, apart = _strong(arguments)
    count = num_workers(arguments)
    study = load_study(arguments.study, overrides=all_overrides(arguments))
    from polychirp.study.roc.plan import roc_plan

    plan = roc_plan(
        study,
        radar=arguments.radar,
        kinds=arguments.receiver,
        probabilities=probabilities,
        snrs_db=snrs,
        trials=arguments.trials,
        noise_trials=(
            arguments.trials if arguments.noise_trials is None else arguments.noise_trials
        ),
        interferers=arguments.interferer,
        strong=strong,
        apart=apart,
    )
    folder = usable_folder(arguments.out or Path("out") / f"{study.name}-{plan.key[:8]}-roc")
    from polychirp.study.monte_carlo.executor import LocalWorkers
    from polychirp.study.roc.run import LOG, run_roc

    refuse_other_files(folder, LOG)
    with progress_bar(study.name) as progress:
        result = run_roc(
            plan,
            folder=folder,
            executor=LocalWorkers(count=count),
            progress=progress,
            anew=arguments.force,
            results=[folder / name for name in _FILES],
        )
    _write(plan, result.summary, folder)
    if arguments.json:
        print(json.dumps(_without_nan(_record(plan, folder, result)), indent=2, allow_nan=False))
    else:
        _print(plan, result.summary)
        say(f"{result.num_new} new frames; stored in {folder}: {', '.join((*_FILES, LOG))}")
    return 0


def _snrs(text: str) -> tuple[float, ...]:
    """SNRs in dB of a list with commas or of FIRST:LAST:STEP, the last one included."""
    dashed = re.fullmatch(r"([\d.]+)-([\d.]+)", text)
    if dashed:
        raise InputError(
            f"--snr: '{text}' is not a range; write it like {dashed[1]}:{dashed[2]}:2, with the "
            "step"
        )
    ends = text.split(":")
    if len(ends) == 1:
        return tuple(_number("--snr", word) for word in text.split(","))
    if len(ends) != 3:
        raise InputError(f"--snr: '{text}' is neither a list nor a range; write it like {SNRS}")
    first, last, step = (_number("--snr", word) for word in ends)
    if not (step > 0 and last >= first):
        raise InputError(
            f"--snr: '{text}' has no values; write the lower end first, and a step above 0"
        )
    count = (last - first) / step
    if count > _MOST_SNRS:
        raise InputError(f"--snr: '{text}' has more than {_MOST_SNRS} values; use a larger step")
    return tuple(first + n * step for n in range(math.floor(count + 1e-9) + 1))


def _number(option: str, text: str) -> float:
    try:
        value = float(text.strip().removesuffix("dB"))
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        example = "12,14,16" if option == "--snr" else "1e-4,1e-6"
        raise InputError(f"{option}: '{text}' is not a number; write values like {example}")
    return value


def _probabilities(text: str | None) -> tuple[float, ...]:
    return () if text is None else tuple(_number("--pfa", word) for word in text.split(","))


def _strong(
    arguments: argparse.Namespace,
) -> tuple[float | None, tuple[float | None, float | None]]:
    """Ratio of the strong point's power, None without one, and its distance."""
    distances = [
        None if getattr(arguments, name) is None else si_value(arguments, name, unit)
        for name, unit in (("apart_range", "m"), ("apart_rate", "m/s"))
    ]
    if arguments.strong is None:
        if distances != [None, None]:
            raise InputError(
                "--apart-range, --apart-rate: they place the point of --strong; add --strong, as "
                "in --strong '40 dB'"
            )
        return None, (None, None)
    if any(value is not None and value < 0 for value in distances):
        raise InputError("--apart-range, --apart-rate: use 0 or more; both signs are drawn")
    return si_value(arguments, "strong", "dB"), (distances[0], distances[1])


def _write(plan: RocPlan, summary: RocSummary, folder: Path) -> None:
    """Write the figure, the tables and the provenance: the files `_FILES`."""
    from polychirp.report.figures.drawing import csv_of
    from polychirp.report.figures.roc import noise_data, roc_picture

    title = figure_text(f"{plan.study.name}, radar '{plan.radar}': {_situation(plan)}")
    note = (
        "Intervals are those of 95 %; a triangle is an upper limit, where there was no detection. "
        "SNR: all samples of all channels added in phase."
    )
    roc_picture(summary, title=title, note=note).save(folder, "roc")
    (folder / "false_alarms.csv").write_text(csv_of(noise_data(summary)), encoding="utf-8")
    origin = {**asdict(plan.origin), "measurement": plan.key}
    (folder / "provenance.json").write_text(json.dumps(origin, indent=2), encoding="utf-8")


def _situation(plan: RocPlan) -> str:
    """The tested point, and all that is beside it, in words."""
    from polychirp.units import to_db

    words = ["one point"]
    if plan.strong is not None:
        apart = plan.strong.apart
        words.append(
            f"a point {float(to_db(plan.strong.ratio)):g} dB stronger, {apart.range:.3g} m and "
            f"{apart.range_rate:.3g} m/s away"
        )
    others = [radar.name for radar in plan.study.radars[1:]]
    if others:
        words.append(f"interference by {', '.join(others)}")
    return " with ".join((words[0], " and ".join(words[1:]))) if words[1:] else words[0]


def _print(plan: RocPlan, summary: RocSummary) -> None:
    console = tables()
    console.print(f"{plan.study.name}, radar '{plan.radar}': {_situation(plan)}")
    for number in range(len(summary.curves)):
        console.print(_curve_table(summary, number))
    console.print(_needed_table(summary))
    console.print(_noise_table(summary, has_others=len(plan.study.radars) > 1))
    console.print(_notes(plan, summary))


def _curve_table(summary: RocSummary, number: int) -> Table:
    from rich.table import Table

    points = summary.of_curve(number)
    is_windowed = any(point.ideal_windowed < point.ideal for point in points)
    table = Table(title=f"receiver {summary.curves[number].label}", title_justify="left")
    for column in ("SNR", "frames", "Pd", "ideal"):
        table.add_column(column, justify="right")
    if is_windowed:
        table.add_column("ideal, windows", justify="right")
    table.add_column("other detections", justify="right")
    for point in points:
        table.add_row(
            f"{point.snr_db:g} dB",
            str(point.num_trials),
            shown(point.detection, digits=3),
            f"{point.ideal:.3f}",
            *([f"{point.ideal_windowed:.3f}"] if is_windowed else []),
            shown(point.others),
        )
    return table


def _needed_table(summary: RocSummary) -> Table:
    from rich.table import Table

    table = Table(title="SNR at which half of the points are detected", title_justify="left")
    table.add_column("receiver")
    for column in ("measured", "ideal", "loss", "of which windows"):
        table.add_column(column, justify="right")
    for row in summary.needed:
        value = row.snr_db.value
        limits = "\n" + "–".join(_decibels(end) for end in (row.snr_db.low, row.snr_db.high))
        table.add_row(
            summary.curves[row.curve].label,
            f"{_decibels(value)} dB{limits}" if math.isfinite(value) else "not in this range",
            f"{row.ideal_db:.1f} dB",
            f"{value - row.ideal_db:.1f} dB" if math.isfinite(value) else "–",
            f"{row.windowed_db - row.ideal_db:.1f} dB" if math.isfinite(row.windowed_db) else "–",
        )
    return table


def _decibels(level: float) -> str:
    return f"{level:.1f}" if math.isfinite(level) else "?"


def _noise_table(summary: RocSummary, *, has_others: bool) -> Table:
    from rich.table import Table

    title = "frames of noise and interference" if has_others else "frames of noise alone"
    table = Table(title=title, title_justify="left")
    table.add_column("receiver")
    for column in ("frames", "detections per frame", "stated, at most", "cells", "per cell"):
        table.add_column(column, justify="right")
    table.add_column("Pd without a point", justify="right")
    for row in summary.noise:
        table.add_row(
            summary.curves[row.curve].label,
            str(row.num_trials),
            shown(row.detections),
            f"{row.stated:.3g}" if math.isfinite(row.stated) else "–",
            f"{row.num_cells:.0f}",
            shown(row.per_cell),
            shown(row.chance, digits=3),
        )
    return table


def _notes(plan: RocPlan, summary: RocSummary) -> str:
    """Meaning of the printed numbers, in sentences."""
    limits = {
        curve.kind: f"{limit.range:.2g} m and {limit.range_rate:.2g} m/s ({curve.kind})"
        for curve, limit in zip(summary.curves, summary.limits, strict=True)
    }
    looks = sorted(set(summary.looks))
    window = plan.window
    paper = (
        " The receiver 'paper' states no probability: its ideal detector has as many false "
        "detections per cell as were measured."
        if any(curve.kind == "paper" for curve in summary.curves)
        else ""
    )
    steps = (
        " Each channel counts twice for the receiver 'mfsk', once for each sequence of steps."
        if any(curve.kind == "mfsk" for curve in summary.curves)
        else ""
    )
    return (
        "SNR: energy of the point in all samples of all channels over the noise power of a sample. "
        f"Points: {window.least_range:.3g} to {window.greatest_range:.3g} m, range rates to "
        f"±{window.greatest_speed:.3g} m/s, azimuths to ±60°, steady power. "
        f"Detected: errors up to {', '.join(limits.values())}. Ideal: the detector that knows "
        f"the place of the point and adds the powers of {' or '.join(map(str, looks))} channels, "
        f"at the stated false-alarm probability per cell.{paper}{steps} "
        "Intervals are those of 95 %."
    )


def _record(plan: RocPlan, folder: Path, result: RocResult) -> dict[str, Any]:
    """All estimates in SI units, except for SNRs in dB."""
    summary = result.summary
    return {
        "study": plan.study.name,
        "radar": plan.radar,
        "seed": plan.study.seed,
        "measurement": plan.key,
        "stored": str(folder),
        "new_frames": result.num_new,
        "interferers": [radar.name for radar in plan.study.radars[1:]],
        "strong": None if plan.strong is None else asdict(plan.strong),
        "window": asdict(plan.window),
        "curves": [
            {
                "receiver": curve.kind,
                "false_alarm_probability": curve.probability,
                "looks": summary.looks[number],
                "points": [asdict(point) for point in summary.of_curve(number)],
                "noise": {
                    **asdict(summary.noise[number]),
                    "per_cell": asdict(summary.noise[number].per_cell),
                },
                "needed": asdict(summary.needed[number]),
            }
            for number, curve in enumerate(summary.curves)
        ],
    }


def _without_nan(value: Any) -> Any:
    """The value with None in place of NaN, which JSON does not have."""
    if isinstance(value, dict):
        return {key: _without_nan(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(entry) for entry in value]
    return None if isinstance(value, float) and math.isnan(value) else value
