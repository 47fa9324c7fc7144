"""The command ``polychirp``: its verbs, its error messages of one sentence, its exit codes."""

import argparse
import io
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Final, NoReturn

from polychirp.cli.terminal import command_name, say
from polychirp.errors import InputError, ModelWarning, PolychirpError, RunError

VERBS: Final = (
    "init",
    "check",
    "run",
    "live",
    "study",
    "compare",
    "roc",
    "benchmark",
    "dataset",
    "plot",
    "report",
    "export",
    "process",
    "rcs",
    "correlate",
    "paper",
    "warm-up",
    "completion",
)
"""Verbs in the order in which the help lists them; each has a module in this folder."""

_NOTHING_KEPT: Final = "no results were stored"
"""Part of the message after an interrupt of a verb whose module has no ``KEPT_FILES``."""

_STOPPED: Final = 130
"""Exit code after Ctrl-C: 128 + 2, as shells report a program that SIGINT, signal 2, ended."""

_TERMINATED: Final = 143
"""Exit code after SIGTERM, signal 15: 128 + 15."""

_EPILOG: Final = """\
start with:
  {name} init study.toml     write a study with comments
  {name} check study.toml    see what its radars resolve
  {name} run study.toml      run it once
  {name} study study.toml    run many trials of it

exit codes: 0 done, 2 unusable input, 3 impossible or not supported, 4 failed while running
"""


class Parser(argparse.ArgumentParser):
    """Parser that reports wrong arguments in one sentence, like all other errors."""

    def error(self, message: str) -> NoReturn:
        """Raise `InputError`, which `main` prints."""
        prefix, _, arguments = message.partition("unrecognized arguments: ")
        if not prefix and arguments and not arguments.startswith("-"):
            message += "; names that a command takes stand before its options"
        raise InputError(f"{message}; see '{self.prog} --help'")


class Version(argparse.Action):
    """Option that prints the version, which is looked up for this option only, and ends."""

    def __call__(self, parser: argparse.ArgumentParser, *unused: object) -> NoReturn:
        """Print the version and end the program."""
        from importlib.metadata import version

        del unused
        print(f"polychirp {version('polychirp')}")
        parser.exit()


class Terminated(KeyboardInterrupt):
    """SIGTERM as an exception, on which a command cleans up as it does after Ctrl-C."""


def build_parser() -> argparse.ArgumentParser:
    """The parser of all verbs; each verb's module adds its own part."""
    name = command_name()
    parser = Parser(
        prog=name,
        description="Simulate mutual interference between FMCW automotive radars.",
        epilog=_EPILOG.format(name=name),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=Version, nargs=0, help="print the version")
    subparsers = parser.add_subparsers(metavar="COMMAND", required=True, parser_class=Parser)
    for verb in VERBS:
        module = import_module(f"polychirp.cli.{verb.replace('-', '_')}")
        module.add_parser(subparsers)
        kept = getattr(module, "KEPT_FILES", _NOTHING_KEPT)
        subparsers.choices[verb].set_defaults(command=module.run, kept=kept, verb=verb)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    One sentence on stderr reports errors that polychirp raises on purpose, errors of the system (a
    full disk, too little memory), input that is nested too deeply and numbers that overflow. All
    other errors are faults of polychirp and keep their traceback.
    """
    # matrices are small, and waiting BLAS threads would occupy cores that the kernels use; NumPy
    # reads the variable when it is imported
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a file name need not be valid text
    arguments = argparse.Namespace()
    try:
        with _warnings_as_notes(), _sigterm_as_interrupt():
            arguments = _parsed(argv)
            command: Callable[[argparse.Namespace], int] = arguments.command
            code = command(arguments)
            sys.stdout.flush()
            return code
    except BrokenPipeError:
        # the reader of the pipe, such as `head`, has closed it
        _give_up_stdout()
        return 0
    except KeyboardInterrupt as stop:
        kept = getattr(arguments, "kept", _NOTHING_KEPT)
        say(f"polychirp: stopped before the end; {kept}")
        return _TERMINATED if isinstance(stop, Terminated) else _STOPPED
    except (PolychirpError, OSError, MemoryError, RecursionError, OverflowError) as error:
        explained = _explained(error)
        say(f"polychirp: {_as_called(str(explained))}")
        return explained.exit_code


def _parsed(argv: Sequence[str] | None) -> argparse.Namespace:
    """The arguments of the command line; those that no command takes are refused."""
    parser = build_parser()
    arguments, others = parser.parse_known_args(argv)
    if others:
        message = f"unrecognized arguments: {' '.join(others)}"
        takes_one = isinstance(getattr(arguments, "study", None), str)
        if not takes_one or others[0].startswith("-"):
            parser.error(message)
        verb = arguments.verb
        raise InputError(
            f"{message}; '{verb}' takes one study; see '{command_name()} {verb} --help'"
        )
    return arguments


def _as_called(message: str) -> str:
    """The message, in which quoted commands begin with the name that the user called."""
    return message.replace("'polychirp ", f"'{command_name()} ")


def _explained(error: BaseException) -> PolychirpError:
    """The error as a `PolychirpError`, whose message is one sentence."""
    match error:
        case PolychirpError():
            return error
        case OSError():
            _give_up_stdout_if_full()
            place = f"'{error.filename}': " if error.filename else ""
            return RunError(
                f"{place}{error.strerror or error}; check that the path exists, that you may use "
                "it, and that its disk is not full"
            )
        case MemoryError():
            size = f" ({error})" if str(error) else ""
            return RunError(
                f"there is not enough memory{size}; use fewer radars, sweeps, channels or workers"
            )
        case RecursionError():
            return InputError("the input is nested too deeply; write it with fewer levels")
    return InputError(f"a number is too large to compute with ({error}); use a smaller one")


def _give_up_stdout_if_full() -> None:
    try:
        sys.stdout.flush()
    except OSError:
        _give_up_stdout()


def _give_up_stdout() -> None:
    """Send stdout to the null device, so that the interpreter's last flush of it cannot fail."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except (OSError, ValueError):
        return


@contextmanager
def _sigterm_as_interrupt() -> Iterator[None]:
    """Raise `Terminated` on SIGTERM, so that a command cleans up as it does after Ctrl-C."""

    def stop(*unused: object) -> NoReturn:
        del unused
        raise Terminated

    try:
        before = signal.signal(signal.SIGTERM, stop)
    except ValueError:  # only the main thread may set handlers
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def _warnings_as_notes() -> Iterator[None]:
    """Show each `ModelWarning` once, as a note on stderr."""
    seen: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *place: object) -> None:
        if not issubclass(category, ModelWarning):
            usual(message, category, *place)  # type: ignore[arg-type]
        elif str(message) not in seen:
            seen.add(str(message))
            say(f"note: {message}")

    with warnings.catch_warnings():
        usual = warnings.showwarning
        warnings.simplefilter("always", ModelWarning)
        warnings.showwarning = show  # type: ignore[assignment]
        yield
