"""``polychirp run`` — run a study, store it, print what was found."""

from __future__ import annotations

import argparse
import json
import math
import shlex
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.check import add_study_arguments, all_overrides, next_command
from polychirp.cli.progress import progress_bar
from polychirp.cli.stored import LOG, RUN, STUDY, drawn_files
from polychirp.cli.terminal import command_name, decibels, figure_text, say, tables, usable_folder
from polychirp.cli.trials import WHY_UNRESOLVED, margins_text
from polychirp.errors import InputError

if TYPE_CHECKING:
    from rich.table import Table

    from polychirp.study.spec import Study
    from polychirp.study.trial import Trial, VictimResult

_COUNTS: Final = ("targets", "found", "missed", "out of sight", "ghosts", "other echoes")
"""Columns of the table of detections that are numbers of `_counts`."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``run``."""
    parser = subparsers.add_parser(
        "run",
        help="run a study",
        description="Run a study; store samples, their parts, detections and truth as Zarr; "
        "print targets found, missed, and ghosts.",
    )
    add_study_arguments(parser)
    parser.add_argument(
        "--out", metavar="DIR", help="folder of the results (default: out/NAME-HASH)"
    )
    parser.add_argument(
        "--force",
        action="store_true",
        help="replace the results of another study in that folder, and remove their figures",
    )
    parser.add_argument(
        "--maps",
        action="store_true",
        help="also draw the range-rate map of each part of the samples (echo, direct, noise …)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Check the study, run it, store the results and print them."""
    from polychirp.config.load import MONTE_CARLO, load_study, read_toml
    from polychirp.study.check import check
    from polychirp.study.folders import remove_results
    from polychirp.study.margins import gates_of
    from polychirp.study.provenance import provenance
    from polychirp.study.store.save import save_run

    study = load_study(arguments.study, overrides=all_overrides(arguments))
    check(study)
    origin = provenance(study)
    folder = arguments.out or Path("out") / f"{study.name}-{origin.study_hash[:8]}"
    path = _place_of_run(usable_folder(folder))
    replaces_other = _holds_other_results(path, study_hash=origin.study_hash)
    if replaces_other and not arguments.force:
        raise InputError(
            f"'{path.parent}' holds the results of another study; choose another folder with "
            "--out, or replace them with --force"
        )
    # this import loads the kernels, which takes time, and so follows all refusals
    from polychirp.study.trial import run_trial

    with progress_bar(study.name) as progress:
        trial = run_trial(study, progress=progress)
    if replaces_other:
        for drawn in drawn_files(path.parent, RUN):
            remove_results(drawn)
    save_run(path, trial, provenance=origin)
    if arguments.maps:
        _draw_maps(study, trial, path.parent)
    if arguments.json:
        from polychirp.report.words import finite

        print(json.dumps(finite(_summary(study, path, trial)), indent=2, allow_nan=False))
    else:
        _print_table(trial)
        print(margins_text(gates_of(study).values()))
        for note in (*_history(trial), *_unresolved(trial), *_behind(trial)):
            say(note)
        say(f"stored in {path}")
        say(f"to draw it: {shlex.join([command_name(), 'plot', str(path.parent)])}")
        if MONTE_CARLO in read_toml(Path(arguments.study)):
            say(f"next: {next_command('study', arguments)}")
    return 0


def _draw_maps(study: Study, trial: Trial, folder: Path) -> None:
    """Write the maps of every victim's parts, as a picture and as a table."""
    from polychirp.report.figures.range_rate_parts import range_rate_parts
    from polychirp.study.part_views import part_maps

    for victim in trial.victims:
        maps = part_maps(study.receiver, victim.frame, victim.parts)
        title = figure_text(f"{study.name}: what '{victim.name}' receives")
        name = f"maps-{victim.name}"
        drawing = range_rate_parts(maps, victim.detections, victim.truth, title=title)
        drawing.save(folder, name)
        say(f"drew {folder / name}.png")


def _place_of_run(folder: Path) -> Path:
    """Place of the run in the folder of its results.

    A folder that is a store itself, or that holds the trials of a study, is refused: the run in it
    would hide what is there from ``plot``, ``report`` and ``export``.
    """
    if folder.name == RUN or (folder / "zarr.json").is_file():
        raise InputError(
            f"--out: '{folder}' is the place of a run and not of the folder around it; name that "
            f"folder, '{folder.parent}', in which '{RUN}' is made"
        )
    if (folder / LOG).exists() or (folder / STUDY).exists():
        raise InputError(
            f"--out: '{folder}' holds the trials of a study, which a run beside them would hide; "
            f"name another folder, such as '{folder / 'run'}'"
        )
    return folder / RUN


def _holds_other_results(path: Path, *, study_hash: str) -> bool:
    """True if there are results of another study at ``path``."""
    from polychirp.study.store.load import stored_hash

    return path.exists() and stored_hash(path) != study_hash


def _summary(study: Study, path: Path, trial: Trial) -> dict[str, Any]:
    from polychirp.study.margins import gates_of

    gates = gates_of(study)
    return {
        "study": study.name,
        "seed": study.seed,
        "stored": str(path),
        "victims": [
            {
                "name": victim.name,
                **{key.replace(" ", "_"): count for key, count in _counts(victim).items()},
                "floor_rise": victim.score.floor_rise,
                "detected_targets": _targets(victim, found=True),
                "ghosts_of_radars": _ghosts_of_radars(victim),
                "undetected_targets": _targets(victim, found=False),
                "levels": _levels(victim),
                "extents": _extents(victim),
                "margins": asdict(gates[victim.name]),
                **_frames(trial, victim.name),
            }
            for victim in trial.victims
        ],
    }


def _frames(trial: Trial, name: str) -> dict[str, Any]:
    """Frames of a radar under a rule from frame to frame; empty under other rules."""
    history = trial.frames
    if history is None:
        return {}
    number = history.names.index(name)
    return {
        "frames": {
            "interval": history.interval,
            "inr": history.inr[:, number].tolist(),
            "hit_ramps": history.hit_ramps[:, number].tolist(),
            "lost": history.is_lost[:, number].tolist(),
            "longest_loss": int(history.longest_loss[number]),
            "until_free": int(history.frames_until_free[number]),
        }
    }


def _history(trial: Trial) -> Iterator[str]:
    """A sentence for each radar on its frames under a rule from frame to frame."""
    history = trial.frames
    if history is None:
        return
    for victim in trial.victims:
        number = history.names.index(victim.name)
        lost = int(history.is_lost[:, number].sum())
        yield (
            f"'{victim.name}' lost {lost} of {len(history.is_lost)} frames to interference, up to "
            f"{history.longest_loss[number]} in a row; the last one is simulated here"
        )


def _counts(victim: VictimResult) -> dict[str, int]:
    """Numbers of targets, of ghosts and of other echoes.

    Targets are found, missed, or out of sight: no receiver could find these (`scoring.sight`).
    """
    score = victim.score
    return {
        "targets": len(victim.truth.name),
        "found": int((score.is_detected & score.is_in_sight).sum()),
        "missed": score.num_missed,
        "out of sight": int((~score.is_in_sight).sum()),
        "ghosts": len(score.ghosts),
        "other echoes": len(score.other_echoes),
        "unresolved": score.num_unresolved,
    }


def _ghosts_of_radars(victim: VictimResult) -> dict[str, int]:
    """Number of the ghosts that each other radar causes; radars without any are left out."""
    return dict(Counter(radar for radar in victim.score.radar if radar is not None))


def _targets(victim: VictimResult, *, found: bool) -> list[str]:
    names = zip(victim.truth.name, victim.score.is_detected, strict=True)
    return [name for name, is_detected in names if bool(is_detected) is found]


def _levels(victim: VictimResult) -> dict[str, dict[str, float]]:
    """Power ratios in the cell of each target, found or not."""
    score = victim.score
    return {
        name: {key: float(getattr(score, key)[n]) for key in ("snr", "inr", "mitigated_sinr")}
        for n, name in enumerate(victim.truth.name)
    }


def _extents(victim: VictimResult) -> dict[str, dict[str, float]]:
    """Number of detections on each target found, and their extent in SI beside the visible one."""
    score = victim.score
    names = ("length", "width", "range_rate_span")
    out = {}
    for n, is_found in enumerate(score.is_detected.tolist()):
        if not is_found:
            continue
        visible = victim.truth.extent(n)
        out[victim.truth.name[n]] = {
            "points": int(score.num_points[n]),
            **{name: float(getattr(score, name)[n]) for name in names},
            **{f"visible_{name}": float(getattr(visible, name)) for name in names},
        }
    return out


def _unresolved(trial: Trial) -> Iterator[str]:
    """A sentence for each radar whose receiver left detections out."""
    for victim in trial.victims:
        if count := victim.score.num_unresolved:
            what = "detection with an unresolved speed was"
            if count > 1:
                what = "detections with unresolved speeds were"
            yield f"note: {count} {what} left out of the frame of '{victim.name}': {WHY_UNRESOLVED}"


def _behind(trial: Trial) -> Iterator[str]:
    """A sentence for each missed target behind an array, which takes its echo for one in front."""
    for victim in trial.victims:
        is_missed = victim.score.is_in_sight & ~victim.score.is_detected
        for number in is_missed.nonzero()[0]:
            name, azimuth = victim.truth.name[number], math.degrees(victim.truth.azimuth[number])
            if abs(azimuth) > 90.0:
                in_front = math.copysign(180.0, azimuth) - azimuth
                yield (
                    f"note: '{name}' is behind the array of '{victim.name}', at {azimuth:.0f}° of "
                    f"azimuth; the array sees it at {in_front:.0f}°, which is not on the target"
                )


def _print_table(trial: Trial) -> None:
    from rich.table import Table

    counts = Table(title="detections of each radar", title_justify="left")
    errors = Table(title="targets found", title_justify="left")
    counts.add_column("radar")
    for column in (*_COUNTS, "floor rise"):
        counts.add_column(column, justify="right")
    levels = Table(title="in the cells of the targets, found or not", title_justify="left")
    for column in ("radar", "target"):
        errors.add_column(column)
        levels.add_column(column)
    levels.add_column("is")
    for column in ("SNR", "INR", "SINR", "SINR, mitigated"):
        levels.add_column(column, justify="right")
    columns = ["range", "range error", "speed error", "azimuth error", "points", "extent"]
    has_elevation = any(_measures_elevation(victim) for victim in trial.victims)
    for column in columns + ["elevation", "elevation error"] * has_elevation:
        errors.add_column(column, justify="right")
    for victim in trial.victims:
        rise = decibels(victim.score.floor_rise)
        numbers = _counts(victim)
        counts.add_row(victim.name, *(str(numbers[column]) for column in _COUNTS), rise)
        for row in _error_rows(victim):
            errors.add_row(victim.name, *row[: len(errors.columns) - 1])
        for row in _level_rows(victim):
            levels.add_row(victim.name, *row)
    console = tables()
    console.print(counts)
    if any(victim.score.ghosts for victim in trial.victims):
        console.print(_ghosts(trial))
    if errors.row_count:
        console.print(errors)
    if levels.row_count:
        console.print(levels)


def _ghosts(trial: Trial) -> Table:
    """Table of the ghosts of every radar, with the radars that cause them."""
    from rich.table import Table

    table = Table(title="ghosts", title_justify="left")
    for column in ("radar", "cause", "of radar"):
        table.add_column(column)
    for column in ("number", "strongest at", "closing at"):
        table.add_column(column, justify="right")
    for victim in trial.victims:
        for row in _ghost_rows(victim):
            table.add_row(victim.name, *row)
    return table


def _ghost_rows(victim: VictimResult) -> Iterator[tuple[str, ...]]:
    """Cause, radar, number and place of the strongest of the ghosts of each cause and radar."""
    found, score = victim.detections, victim.score
    of_cause: dict[tuple[str, str], list[int]] = {}
    for n in score.ghosts:
        of_cause.setdefault((score.nature[n], score.radar[n] or "–"), []).append(n)
    for cause, numbers in of_cause.items():
        strongest = max(numbers, key=lambda n: float(found.power[n]))
        yield (
            *cause,
            str(len(numbers)),
            f"{found.range[strongest]:.2f} m",
            f"{-3.6 * found.range_rate[strongest]:.1f} km/h",
        )


def _level_rows(victim: VictimResult) -> Iterator[tuple[str, ...]]:
    """Name of every visible target, whether it is found, and power ratios in its cell in dB.

    A target with a folded echo is seen with a range rate that it does not have, and so missed.
    """
    truth, score = victim.truth, victim.score
    ratios = (score.snr, score.inr, score.snr / (1.0 + score.inr), score.mitigated_sinr)
    folded = {score.body[n] for n in score.numbers("folded")}
    for number, name in enumerate(truth.name):
        if truth.is_visible[number]:
            shown = (float(ratio[number]) for ratio in ratios)
            found, in_sight = score.is_detected[number], score.is_in_sight[number]
            missed = "missed: folded" if name in folded else "missed"
            state = "found" if found else missed if in_sight else "out of sight"
            yield (name, state, *(decibels(ratio) if ratio > 0 else "–" for ratio in shown))


def _error_rows(victim: VictimResult) -> Iterator[tuple[str, ...]]:
    """Every target found, as text: name, range, errors, extents, elevation and its error."""
    truth, score = victim.truth, victim.score
    for number, name in enumerate(truth.name):
        if score.is_detected[number]:
            yield (
                name,
                f"{truth.range[number]:.2f} m",
                f"{score.range_error[number]:+.3f} m",
                f"{3.6 * score.range_rate_error[number]:+.3f} km/h",
                _degrees(score.azimuth_error[number]),
                f"{score.num_points[number]:.0f}",
                _extent_words(victim, number),
                _degrees(truth.elevation[number]),
                _degrees(score.elevation_error[number]),
            )


def _extent_words(victim: VictimResult, number: int) -> str:
    """Length and width of a target's detections, and those of its visible metal: a text in m."""
    score, visible = victim.score, victim.truth.extent(number)
    pairs = ((score.length[number], visible.length), (score.width[number], visible.width))
    found, seen = ("×".join(_size(pair[n]) for pair in pairs) for n in (0, 1))
    if visible.length == visible.width == 0.0:
        return f"{found} m of a point"
    return f"{found} of {seen} m"


def _size(value: float) -> str:
    """A length in m; a dash for the width that a radar of one channel does not measure."""
    return "–" if math.isnan(value) else f"{value:.1f}"


def _measures_elevation(victim: VictimResult) -> bool:
    """True if a target was found with an elevation."""
    score = victim.score
    return any(
        is_detected and not math.isnan(error)
        for is_detected, error in zip(score.is_detected, score.elevation_error, strict=True)
    )


def _degrees(angle: float) -> str:
    """Angle or its error with its unit; a dash for an array that does not measure it."""
    return "–" if math.isnan(angle) else f"{math.degrees(angle):+.2f}°"
