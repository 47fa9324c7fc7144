"""The progress bar of long commands: on stderr, and gone when they end."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from polychirp.model.baseband import Progress

_LINE_INTERVAL: Final = 60.0
"""s between lines where there is no terminal."""


@contextmanager
def progress_bar(name: str) -> Iterator[Progress]:
    """A bar with the time it has taken; without a terminal, lines now and then."""
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
    """A line at the start and the end of every kind of work, and one in a minute."""
    kind, began, shown = "", 0.0, 0.0

    def show(what: str, done: int, total: int) -> None:
        nonlocal kind, began, shown
        now = time.monotonic()
        if what != kind:
            kind, began, shown = what, now, now
        if done in (0, total):
            print(f"{name}: {what} {done}/{total}", file=sys.stderr)
        elif now >= shown + _LINE_INTERVAL:
            shown = now
            left = (now - began) * (total - done) / done / 60
            print(f"{name}: {what} {done}/{total}, {left:.0f} min left", file=sys.stderr)

    return show
