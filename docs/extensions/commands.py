"""The page of all commands and options, from the parsers of the command line."""

import argparse
from pathlib import Path

import rst
from sphinx.application import Sphinx

from polychirp.cli.app import build_parser


def page(parser: argparse.ArgumentParser) -> list[str]:
    """The page: the command itself, then every verb."""
    lines = [*rst.heading("Command line", "="), parser.description or "", "", *code(parser.epilog)]
    for verb, inner in verbs(parser).items():
        lines += [f".. _command-{verb}:", "", *rst.heading(f"polychirp {verb}", "-")]
        lines += [escaped(inner.description or ""), "", *code(usage(inner))]
        lines += rst.table(("argument", "meaning"), arguments(inner))
        lines += code(inner.epilog)
    return lines


def verbs(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Parser of every verb."""
    (group,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    return dict(group.choices)


def usage(parser: argparse.ArgumentParser) -> str:
    """The line that shows how a command is written, however wide the terminal is."""
    return " ".join(parser.format_usage().removeprefix("usage: ").split())


def arguments(parser: argparse.ArgumentParser) -> list[tuple[str, str]]:
    """Every argument as it is written, and what it means."""
    rows = []
    for action in parser._actions:
        if isinstance(action, argparse._HelpAction):
            continue
        value = "" if action.nargs == 0 else action.metavar or "|".join(action.choices or [])
        written = [f"{option} {value}".strip() for option in action.option_strings] or [str(value)]
        text = (action.help or "").replace("%%", "%")
        rows.append((", ".join(rst.literal(one) for one in written), escaped(text)))
    return rows


def escaped(text: str) -> str:
    """Text in which nothing is markup."""
    return "".join(f"\\{c}" if c in "*|`_\\" else c for c in text)


def code(text: str | None) -> list[str]:
    """Text as it stands."""
    lines = (text or "").rstrip().splitlines()
    return rst.directive("code-block:: text", content=lines) if lines else []


def write_page(app: Sphinx) -> None:
    """Write the page before the builder reads it."""
    rst.write(Path(app.srcdir) / "generated" / "commands.rst", page(build_parser()))


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the writer."""
    app.connect("builder-inited", write_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
