"""Shared by all commands: text on the terminal, output folders that work, values of options."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.errors import InputError, RunError

if TYPE_CHECKING:
    from rich.console import Console

FILE_WIDTH: Final = 150
"""Columns of a table that goes to a file or a pipe, which have no width of their own; chosen so
that the widest table, of the paper's claims, wraps little."""


def command_name() -> str:
    """Name that this program was called by: ``polychirp``, or the path of the script ``run``."""
    return os.environ.get("POLYCHIRP_NAME", "polychirp")


def printable(text: str) -> str:
    r"""The text without characters that control a terminal; line ends stay.

    >>> printable("a\x1b[31mb\nc")
    'a[31mb\nc'
    """
    if text.isprintable():
        return text
    import unicodedata

    return "".join(c for c in text if c == "\n" or unicodedata.category(c) not in ("Cc", "Cf"))


def figure_text(text: str) -> str:
    r"""The text for a figure, where a pair of ``$`` would begin a formula.

    >>> figure_text("a$b$")
    'a\\$b\\$'
    """
    return printable(text).replace("$", r"\$")


def decibels(ratio: float) -> str:
    """The ratio in dB, without a minus before a zero.

    >>> decibels(0.999), decibels(10.0)
    ('0.0 dB', '10.0 dB')
    """
    from polychirp.units import to_db

    return f"{round(float(to_db(ratio)), 1) + 0.0:.1f} dB"


def say(text: str) -> None:
    """Print progress, notes or a result's place on stderr."""
    print(printable(text), file=sys.stderr)


def tables() -> Console:
    """A console for results on stdout; it shows text as it is, without markup or control codes."""
    from rich.console import Console

    class Plain(Console):
        def render_str(self, text: str, **options: Any) -> Any:
            return super().render_str(printable(text), **options)

    return Plain(
        width=None if sys.stdout.isatty() else FILE_WIDTH,
        markup=False,
        emoji=False,
        highlight=False,
    )


def usable_folder(name: str | Path, *, option: str = "--out") -> Path:
    """The folder that results go to, refused before the work if it cannot be one.

    Raises
    ------
    InputError
        A file is in its place.
    RunError
        It may not be written.
    """
    folder = Path(name)
    for place in (folder, *folder.parents):
        if place.exists():
            if not place.is_dir():
                raise InputError(f"{option}: '{place}' is a file; name a folder")
            _try_to_write(place, option=option)
            break
    return folder


def _try_to_write(folder: Path, *, option: str) -> None:
    """Refuse a folder where no file can be made; rights alone do not tell, as on a full disk."""
    import tempfile

    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise RunError(
            f"{option}: '{folder}' cannot be written ({error.strerror}); name another folder"
        ) from None


def usable_file(name: str, *, option: str) -> Path:
    """The file that a result goes to, refused before the work if it cannot be written.

    Raises
    ------
    InputError
        Its folder does not exist, or a folder has its name.
    RunError
        It may not be written.
    """
    path = Path(name)
    if not path.parent.is_dir():
        raise InputError(
            f"{option}: there is no folder '{path.parent}' for '{path.name}'; make it first"
        )
    if path.is_dir():
        raise InputError(f"{option}: '{path}' is a folder; name a file")
    if not path.exists():
        _try_to_write(path.parent, option=option)
    elif not os.access(path, os.W_OK):
        raise RunError(f"{option}: '{path}' cannot be written; name another file")
    return path


def si_value(arguments: argparse.Namespace, name: str, unit: str) -> float:
    """An option's value in SI."""
    from polychirp.units import Unit

    try:
        return Unit(unit).read(getattr(arguments, name))
    except InputError as error:
        raise InputError(f"--{name.replace('_', '-')}: {error}") from None


def positive_value(arguments: argparse.Namespace, name: str, unit: str) -> float:
    """An option's value in SI, refused if it is not above zero."""
    value = si_value(arguments, name, unit)
    if not value > 0:
        raise InputError(f"--{name.replace('_', '-')}: use a value above zero")
    return value
