"""``polychirp plot`` — figures of a stored run or study."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.cli.stored import OF_RUNS, OF_STUDIES, STUDY, stored_results
from polychirp.cli.terminal import figure_text, say, usable_folder
from polychirp.errors import InputError

if TYPE_CHECKING:
    from polychirp.report.figures.drawing import Drawing

KEPT_FILES: Final = "figures that were drawn stay in the folder"
"""Part of the message that `cli.app` prints after an interrupt."""

SPECTROGRAM: Final = "spectrogram"
"""Figure of a run that shows one channel."""

FILES: Final = ("png", "svg", "pdf")
"""Formats of the figures."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``plot``."""
    parser = subparsers.add_parser(
        "plot",
        help="draw a stored run or study",
        description="Draw figures of a stored run or study; the data of each are written beside it "
        "as CSV.",
        epilog=f"figures of a run: {', '.join(OF_RUNS)}. Figures of a study: "
        f"{', '.join(OF_STUDIES)}. All are drawn if none is named.",
    )
    parser.add_argument(
        "stored", metavar="PATH", help="the folder into which 'run' or 'study' stored its results"
    )
    parser.add_argument("figures", metavar="FIGURE", nargs="*", default=[], help="figures to draw")
    parser.add_argument("--radar", metavar="NAME", help="of a run: draw this radar alone")
    parser.add_argument(
        "--channel", metavar="N", type=int, help="of a run: channel of the spectrogram (default: 0)"
    )
    parser.add_argument(
        "--over", metavar="AXIS", help="of a study: axis of its grid to draw over (default: each)"
    )
    parser.add_argument(
        "--format",
        metavar="FORMAT",
        choices=FILES,
        action="append",
        help=f"{', '.join(FILES)}; may be repeated (default: png)",
    )
    parser.add_argument("--out", metavar="DIR", help="folder of the figures (default: PATH's)")


def run(arguments: argparse.Namespace) -> int:
    """Draw the figures and print the paths of their files."""
    path = stored_results(arguments.stored)
    is_run = path.name != STUDY
    known = OF_RUNS if is_run else OF_STUDIES
    _refuse_unknown(arguments.figures, known, is_run=is_run)
    _refuse_options(arguments, is_run=is_run)
    folder = usable_folder(arguments.out or path.parent)
    wanted = tuple(arguments.figures) or known
    drawings = _of_run if is_run else _of_study
    folder.mkdir(parents=True, exist_ok=True)
    for name, drawing in drawings(path, wanted, arguments):
        drawing.save(folder, name, formats=tuple(arguments.format or FILES[:1]))
        for end in (*(arguments.format or FILES[:1]), "csv"):
            print(folder / f"{name}.{end}")
    return 0


def _refuse_unknown(names: list[str], known: tuple[str, ...], *, is_run: bool) -> None:
    for name in names:
        if name not in known:
            what = "a run" if is_run else "a study"
            raise InputError(f"there is no figure '{name}' of {what}; there are {', '.join(known)}")


def _refuse_options(arguments: argparse.Namespace, *, is_run: bool) -> None:
    """Refuse options that have no effect on figures of what is stored."""
    here, there = ("run", "study") if is_run else ("study", "run")
    for option in ("over",) if is_run else ("radar", "channel"):
        if getattr(arguments, option) is not None:
            raise InputError(
                f"--{option}: '{arguments.stored}' is a {here}, and only figures of a {there} take "
                "this option; leave it out"
            )
    if arguments.channel is not None and arguments.figures and SPECTROGRAM not in arguments.figures:
        raise InputError(
            f"--channel: of the figures of a run only '{SPECTROGRAM}' shows one channel; leave it "
            "out, or name that figure"
        )


def _of_run(
    path: Path, wanted: tuple[str, ...], arguments: argparse.Namespace
) -> Iterator[tuple[str, Drawing]]:
    """Name of each file and its drawing, for every radar."""
    from polychirp.report.run_plots import draw, figures_of
    from polychirp.study.store.load import load_run

    stored = load_run(path)
    victims = [stored.victim(arguments.radar)] if arguments.radar else list(stored.victims)
    study = stored.study
    for victim in victims:
        number = [one.name for one in stored.victims].index(victim.name)
        for name in wanted:
            if not arguments.figures and name not in figures_of(victim):
                continue
            say(f"drawing {name} of '{victim.name}'")
            options = {"channel": arguments.channel or 0} if name == SPECTROGRAM else {}
            title = figure_text(f"{study.name} · radar '{victim.name}'")
            drawing = draw(name, victim, study.receiver, title=title, **options)
            yield name if len(stored.victims) == 1 else f"{name}-{number}", drawing


def _of_study(
    path: Path, wanted: tuple[str, ...], arguments: argparse.Namespace
) -> Iterator[tuple[str, Drawing]]:
    """Name of each file and its drawing, for every axis of the grid."""
    from polychirp.report.figures.study_curves import (
        axis_number,
        study_curves,
        study_differences,
    )
    from polychirp.study.monte_carlo.results import load_results, study_name

    results = load_results(path)
    axis_number(results, arguments.over or (results.axes[0][0] if results.axes else ""))
    drawn = {"curves": study_curves, "differences": study_differences}
    for name in wanted:
        for axis, labels in results.axes:
            is_chosen = arguments.over in (None, axis)
            if is_chosen and (name == "curves" or len(labels) > 1):
                title = figure_text(f"{study_name(results)}, over {axis}")
                yield f"{name}-{axis}", drawn[name](results, over=axis, title=title)
