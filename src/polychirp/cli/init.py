"""``polychirp init`` — write a study to start from."""

import argparse
import shlex
from pathlib import Path
from typing import Any, Final

from polychirp.cli.terminal import command_name, say
from polychirp.errors import InputError, RunError

TEMPLATES: Final = {
    "street": "two triangular radars that look at each other in a street",
    "chirp-sequence": "a 77-GHz radar with equal chirps, a pedestrian and an interferer",
    "tdm-mimo": "three transmitting elements that take turns, a virtual array of twelve channels",
    "elevation": "a raised transmitting element, which measures the height of a sign",
    "paper": "the paper's street with diverse waveforms",
}
"""Studies that `init` writes, by their names, and what they hold."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``init``."""
    parser = subparsers.add_parser(
        "init",
        help="write a study with comments",
        description="Write a small complete study, with a comment on every field.",
    )
    parser.add_argument(
        "path",
        nargs="?",
        default="study.toml",
        metavar="PATH",
        help="file to write (default: study.toml)",
    )
    parser.add_argument(
        "--template",
        choices=tuple(TEMPLATES),
        default="street",
        help="; ".join(f"{name}: {text}" for name, text in TEMPLATES.items())
        + " (default: street)",
    )
    parser.add_argument("--force", action="store_true", help="replace the file if it exists")


def run(arguments: argparse.Namespace) -> int:
    """Write the study file."""
    path = Path(arguments.path)
    if path.is_dir():
        path /= "study.toml"
    if path.exists() and not arguments.force:
        raise InputError(
            f"'{path}' exists already; choose another name, or replace it with --force"
        )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(template(arguments.template), encoding="utf-8")
    except OSError as error:
        raise RunError(f"'{path}' cannot be written: {error.strerror}") from error
    say(f"wrote {path}; next: {shlex.join([command_name(), 'check', str(path)])}")
    return 0


def template(name: str = "street") -> str:
    """Text of the study file of this name among `TEMPLATES`."""
    from importlib.resources import files

    return files("polychirp.cli").joinpath("templates", f"{name}.toml").read_text(encoding="utf-8")
