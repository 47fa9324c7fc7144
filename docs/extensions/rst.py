"""Pieces of reStructuredText, of which generated pages consist."""

from collections.abc import Iterable, Sequence
from pathlib import Path


def heading(text: str, mark: str) -> list[str]:
    """A heading with its line of ``mark``."""
    return [text, mark * len(text), ""]


def indented(lines: Iterable[str], depth: int = 3) -> list[str]:
    """The lines, moved to the right; empty lines stay empty."""
    return [" " * depth + line if line else "" for line in lines]


def directive(name: str, *options: str, content: Sequence[str] = ()) -> list[str]:
    """A directive with its options and its content."""
    return [f".. {name}", *indented([*options, "", *content]), ""]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """A table whose cells are reStructuredText of one line."""
    cells = [head, *rows]
    lines = [
        f"{'*' if column == 0 else ' '} - {text}"
        for row in cells
        for column, text in enumerate(row)
    ]
    return directive("list-table::", ":header-rows: 1", ":class: wide", content=lines)


def literal(text: str) -> str:
    """Text as code."""
    return f"``{text}``" if text else ""


def write(path: Path, lines: Iterable[str]) -> None:
    """Write a page, if its text has changed: the builder reads changed pages again."""
    text = "\n".join(lines).rstrip() + "\n"
    if path.exists() and path.read_text(encoding="utf-8") == text:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
