"""The progress bar of long commands: on stderr, and gone when they end."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from polychirp.study.trial import Progress


@contextmanager
def progress_bar(name: str) -> Iterator[Progress]:
    """A bar with the time it has taken; without a terminal, a line when the work changes."""
    if not sys.stderr.isatty():
        yield _lines(name)
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Bar(*columns, TimeRemainingColumn(), console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name)

        def show(what: str, done: int, total: int) -> None:
            bar.update(task, description=f"{name}: {what}", completed=done, total=total)

        yield show


def _lines(name: str) -> Progress:
    """One line at the start and the end of every kind of work."""

    def show(what: str, done: int, total: int) -> None:
        if done in (0, total):
            print(f"{name}: {what} {done}/{total}", file=sys.stderr)

    return show
