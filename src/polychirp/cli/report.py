"""``polychirp report`` — one HTML page of a stored run or study."""

from __future__ import annotations

import argparse
from typing import Any, Final

from polychirp.cli.stored import STUDY, stored_results
from polychirp.cli.terminal import say, usable_folder

KEPT_FILES: Final = "figures that were drawn stay in the folder"
"""Part of the message that `cli.app` prints after an interrupt."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``report``."""
    parser = subparsers.add_parser(
        "report",
        help="write a stored run or study as one HTML page",
        description="Write report.html: one file that opens from disk, without network, with the "
        "range profiles, maps and street of a run, or the curves of a study. Its figures are "
        "beside it, in the folder figures, as PNG, SVG and CSV.",
    )
    parser.add_argument(
        "stored", metavar="PATH", help="the folder into which 'run' or 'study' stored its results"
    )
    parser.add_argument("--out", metavar="DIR", help="folder of the page (default: PATH's)")


def run(arguments: argparse.Namespace) -> int:
    """Write the page and print its path."""
    path = stored_results(arguments.stored)
    is_run = path.name != STUDY
    folder = usable_folder(arguments.out or path.parent)
    say(f"drawing the {'run' if is_run else 'study'} in '{path.parent}'")
    if is_run:
        from polychirp.report.run_page import write_run_page
        from polychirp.study.store.load import load_run

        print(write_run_page(load_run(path), folder))
    else:
        from polychirp.report.study_page import write_study_page
        from polychirp.study.monte_carlo.results import load_results, study_name

        results = load_results(path)
        print(write_study_page(results, folder, title=study_name(results)))
    return 0
