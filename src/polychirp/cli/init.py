"""``polychirp init`` — write a study to start from."""

import argparse
import shlex
from pathlib import Path
from typing import Any, Final

from polychirp.cli.radar_study import RADARS, profile_study, radar_study
from polychirp.cli.terminal import command_name, say
from polychirp.errors import InputError, RunError

TEMPLATES: Final = {
    "street": "two triangular radars that look at each other in a street",
    "chirp-sequence": "a 77-GHz radar with equal chirps, a pedestrian and an interferer",
    "pedestrian": "what the pedestrian loses to the interferer over drawn starts, and gets back",
    "tdm-mimo": "three transmitting elements that take turns, a virtual array of twelve channels",
    "road-users": "an adult, a child, a bicycle and a motorcycle with moving limbs and wheels",
    "elevation": "a raised transmitting element, which measures the height of a sign",
    "paper": "the paper's street with diverse waveforms",
}
"""Studies that `init` writes, by their names, and what they hold."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``init``."""
    parser = subparsers.add_parser(
        "init",
        help="write a study with comments",
        description="Write a small complete study with comments: an example, a well-known radar or "
        "your own.",
    )
    parser.add_argument(
        "path",
        nargs="?",
        default="study.toml",
        metavar="PATH",
        help="file to write (default: study.toml)",
    )
    for option, names in (("--template", TEMPLATES), ("--radar", RADARS)):
        default = " (default: street)" if option == "--template" else ""
        parser.add_argument(
            option,
            choices=tuple(names),
            help="; ".join(f"{name}: {text}" for name, text in names.items()) + default,
        )
    parser.add_argument(
        "--profile",
        metavar="FILE",
        help="a radar with the chirps of a file of TI's tools: mmWave Studio (.mmwave.json) or "
        "mmWave SDK (.cfg)",
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
    text = _text(arguments)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise RunError(f"'{path}' cannot be written: {error.strerror}") from error
    say(f"wrote {path}; next: {shlex.join([command_name(), 'check', str(path)])}")
    return 0


def _text(arguments: argparse.Namespace) -> str:
    """Text of the study that the options ask for; at most one of them may be given."""
    options = ("template", "radar", "profile")
    given = [f"--{name}" for name in options if getattr(arguments, name) is not None]
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)} each give a whole study; keep one of them")
    if arguments.radar is not None:
        return radar_study(arguments.radar)
    if arguments.profile is not None:
        from polychirp.capture.ti_profile import read_profile

        profile = read_profile(arguments.profile)
        for note in profile.notes:
            say(f"note: {note}")
        return profile_study(profile, Path(arguments.profile))
    return template(arguments.template or "street")


def template(name: str = "street") -> str:
    """Text of the study file of this name among `TEMPLATES`."""
    from importlib.resources import files

    return files("polychirp.cli").joinpath("templates", f"{name}.toml").read_text(encoding="utf-8")
