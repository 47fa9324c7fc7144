"""Common to all commands: text on the terminal, checks of output places, values of options."""

import argparse
import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from polychirp.errors import InputError, RunError

if TYPE_CHECKING:
    from rich.console import Console

FILE_WIDTH: Final = 150
"""Width in characters of tables that go to a file or a pipe, which have no width of their own.
Chosen: the widest table, that of the paper's claims, wraps few lines."""


def command_name() -> str:
    """Name by which this program was called: ``polychirp``, or the path of the script ``run``."""
    return os.environ.get("POLYCHIRP_NAME", "polychirp")


def printable(text: str) -> str:
    r"""The text without characters that control a terminal, except for line ends.

    >>> printable("a\x1b[31mb\nc")
    'a[31mb\nc'
    """
    if text.isprintable():
        return text
    import unicodedata

    return "".join(c for c in text if c == "\n" or unicodedata.category(c) not in ("Cc", "Cf"))


def figure_text(text: str) -> str:
    r"""The text for a figure, with ``$`` escaped, as a pair of them would enclose a formula.

    >>> figure_text("a$b$")
    'a\\$b\\$'
    """
    return printable(text).replace("$", r"\$")


def decibels(ratio: float) -> str:
    """The power ratio in dB, as text; a level that is rounded to zero has no minus sign.

    >>> decibels(0.999), decibels(10.0), decibels(math.nan)
    ('0.0 dB', '10.0 dB', '–')
    """
    from polychirp.units import to_db

    if math.isnan(ratio):
        return "–"
    return f"{round(float(to_db(ratio)), 1) + 0.0:.1f} dB"


def say(text: str) -> None:
    """Print progress, notes or a result's place on stderr."""
    print(printable(text), file=sys.stderr)


def tables() -> "Console":
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
    """The folder for results; it is refused, before the computation, if it cannot be used.

    `InputError` is raised if the folder or one of its parents is a file, and `RunError` if no file
    can be created in it.
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
    """Refuse a folder in which no file can be created; permissions alone do not show that."""
    import tempfile

    try:
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        raise RunError(
            f"{option}: '{folder}' cannot be written ({error.strerror}); name another folder"
        ) from None


def usable_file(name: str, *, option: str) -> Path:
    """The file for a result; it is refused, before the computation, if it cannot be written.

    `InputError` is raised if the file's folder does not exist, or a folder has the file's name, and
    `RunError` if the file cannot be written.
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


def add_option(parser: Any, name: str, metavar: str, default: str | int, text: str) -> None:
    """Add the option ``name``, a value of its default's type; the help ends with the default."""
    parser.add_argument(
        name,
        metavar=metavar,
        type=type(default),
        default=default,
        help=f"{text} (default: {default})",
    )


def si_value(
    arguments: argparse.Namespace, name: str, unit: str, *, bounds: tuple[str, str] = ("", "")
) -> float:
    """Value in SI of the option ``name``, whose text has a unit of the quantity of ``unit``.

    The least and the greatest value are ``bounds``, or else those of the quantity.
    """
    from polychirp.units import Unit

    least, greatest = bounds
    try:
        return Unit(unit, least=least, greatest=greatest).read(getattr(arguments, name))
    except InputError as error:
        raise InputError(f"--{name.replace('_', '-')}: {error}") from None


def positive_value(arguments: argparse.Namespace, name: str, unit: str) -> float:
    """Value of the option ``name`` in SI; it is refused if it is not above zero."""
    value = si_value(arguments, name, unit)
    if not value > 0:
        raise InputError(f"--{name.replace('_', '-')}: use a value above zero")
    return value
