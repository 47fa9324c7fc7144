"""``polychirp completion`` — a script by which a shell completes the commands of polychirp."""

import argparse
from typing import Any, Final

SHELLS: Final = ("bash", "zsh", "fish")
"""Shells whose scripts can be printed."""

_EPILOG: Final = """\
bash: polychirp completion bash > ~/.local/share/bash-completion/completions/polychirp
zsh:  polychirp completion zsh > FOLDER/_polychirp, for a FOLDER of $fpath
fish: polychirp completion fish > ~/.config/fish/completions/polychirp.fish

Shells read these files when they start.
"""

_FILES: Final = frozenset({"A", "B", "CAPTURE", "FILE", "MESH", "PATH", "RUN", "STUDY"})
_FOLDERS: Final = frozenset({"DIR"})
"""Metavariables of arguments that are paths of files or folders, and of folders alone."""


def add_parser(subparsers: Any) -> None:
    """Add the parser of the verb ``completion``."""
    parser = subparsers.add_parser(
        "completion",
        help="print a script that completes commands in a shell",
        description="Print a script by which a shell completes verbs, options and file names.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("shell", choices=SHELLS, help="the shell")


def run(arguments: argparse.Namespace) -> int:
    """Print the script."""
    import shtab

    from polychirp.cli.app import build_parser

    parser = build_parser()
    parser.prog = "polychirp"
    _mark_paths(parser)
    print(shtab.complete(parser, shell=arguments.shell))
    return 0


def _mark_paths(parser: argparse.ArgumentParser) -> None:
    """Mark the arguments that are paths by an attribute that shtab reads."""
    import shtab

    for action in parser._actions:  # argparse has no public list of a parser's arguments
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                _mark_paths(inner)
        elif action.metavar in _FILES | _FOLDERS:
            place = shtab.DIRECTORY if action.metavar in _FOLDERS else shtab.FILE
            action.complete = place  # type: ignore[attr-defined]
