"""The command ``polychirp``: its verbs, its errors in one sentence, its exit codes."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from typing import Final, NoReturn

from polychirp.errors import InputError, ModelWarning, PolychirpError

VERBS: Final = (
    "init",
    "check",
    "run",
    "study",
    "process",
    "rcs",
    "correlate",
    "paper",
    "view",
    "warm-up",
)
"""In the order of the help; a verb without a module is not offered."""

_STOPPED: Final = 130
"""What a shell calls a program that was interrupted."""

_EPILOG: Final = """\
start with:
  polychirp init study.toml     write a study with comments
  polychirp check study.toml    see what its radars resolve
  polychirp run study.toml      run it

exit codes: 0 done, 2 bad input, 3 refused by physics or engine, 4 failed while running
"""


class Parser(argparse.ArgumentParser):
    """Refuses arguments with one sentence, like everything else."""

    def error(self, message: str) -> NoReturn:
        """Raise `InputError`, which `main` prints."""
        raise InputError(f"{message}; see '{self.prog} --help'")


class Version(argparse.Action):
    """Prints the version and ends; looks it up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *unused: object) -> NoReturn:
        """Print and end."""
        from importlib.metadata import version

        del unused
        print(f"polychirp {version('polychirp')}")
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """The parser of all verbs; each verb's module adds its own part."""
    parser = Parser(
        prog="polychirp",
        description="Simulate mutual interference between FMCW automotive radars.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=Version, nargs=0, help="print the version")
    subparsers = parser.add_subparsers(metavar="COMMAND", required=True, parser_class=Parser)
    for verb in VERBS:
        name = f"polychirp.cli.{verb.replace('-', '_')}"
        if find_spec(name) is not None:
            module = import_module(name)
            module.add_parser(subparsers)
            subparsers.choices[verb].set_defaults(command=module.run)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; give its exit code.

    Errors that polychirp raises on purpose become one sentence on stderr; all others keep their
    traceback, for they are faults of polychirp.
    """
    # matrices are small here; set before NumPy is imported, whose threads would wait for work on
    # the cores that the kernels use
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        with _warnings_as_notes():
            arguments = build_parser().parse_args(argv)
            command: Callable[[argparse.Namespace], int] = arguments.command
            return command(arguments)
    except PolychirpError as error:
        print(f"polychirp: {error}", file=sys.stderr)
        return error.exit_code
    except BrokenPipeError:
        # the reader of a pipe (`| head`) has seen enough; keep the interpreter from complaining
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        print("polychirp: stopped before the end; nothing unfinished was kept", file=sys.stderr)
        return _STOPPED


@contextmanager
def _warnings_as_notes() -> Iterator[None]:
    """Show each `ModelWarning` once, as a note on stderr."""
    seen: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *place: object) -> None:
        if not issubclass(category, ModelWarning):
            usual(message, category, *place)  # type: ignore[arg-type]
        elif str(message) not in seen:
            seen.add(str(message))
            print(f"note: {message}", file=sys.stderr)

    with warnings.catch_warnings():
        usual = warnings.showwarning
        warnings.simplefilter("always", ModelWarning)
        warnings.showwarning = show  # type: ignore[assignment]
        yield
