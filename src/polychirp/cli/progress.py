"""Progress of long commands on stderr: a temporary bar on a terminal, else lines."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from polychirp.cli.terminal import printable, say

if TYPE_CHECKING:
    from polychirp.model.baseband import Progress

_LINE_INTERVAL: Final = 60.0
"""Time between lines of progress where stderr is no terminal, s. Chosen."""

_LEAST_TIME: Final = 5.0
"""Time that one kind of work must have taken before its end is estimated, s. Chosen."""

_LEAST_SHARE: Final = 0.1
"""Share of the steps that must be done before the end is estimated. Chosen."""

_STEADY_RATIO: Final = 2.0
"""Greatest ratio of the times per step in both halves of the steps done, for an estimate of the
end. Chosen: the first steps may wait for kernels to be compiled, and the others are faster."""


class TimeLeft:
    """Estimator of the end of one kind of work, from steps that were done at a steady rate."""

    def __init__(self, began: float) -> None:
        self._steps: list[tuple[int, float]] = [(0, began)]

    def update(self, done: int, total: int, now: float) -> float | None:
        """Time left with ``done`` of ``total`` steps done, s; None if it cannot be estimated."""
        first, began = self._steps[0]
        if done > self._steps[-1][0]:
            self._steps.append((done, now))
        if now - began < _LEAST_TIME or done < max(2, _LEAST_SHARE * total) or done >= total:
            return None
        middle, when = min(self._steps, key=lambda step: abs(2 * step[0] - done))
        last, end = self._steps[-1]
        if not first < middle < last:
            return None
        early, late = (when - began) / (middle - first), (end - when) / (last - middle)
        if max(early, late) > _STEADY_RATIO * min(early, late):
            return None
        return max(0.0, late * (total - done) - (now - end))


def _in_words(seconds: float | None) -> str:
    if seconds is None:
        return ""
    if seconds < 90.0:
        return f"about {max(5, 5 * round(seconds / 5)):.0f} s left"
    return f"about {seconds / 60:.0f} min left"


@contextmanager
def progress_bar(name: str) -> Iterator["Progress"]:
    """Callback that shows the kind of work, the steps done and, if it is known, the time left."""
    name = printable(name)
    if not sys.stderr.isatty():
        yield _lines(name)
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]}", markup=False),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, left="")
        kind, left = "", TimeLeft(time.monotonic())

        def show(what: str, done: int, total: int) -> None:
            nonlocal kind, left
            now = time.monotonic()
            if what != kind:
                kind, left = what, TimeLeft(now)
            bar.update(
                task,
                description=f"{name}: {printable(what)}",
                completed=done,
                total=total,
                left=_in_words(left.update(done, total, now)),
            )

        yield show


def _lines(name: str) -> "Progress":
    """Callback that prints a line at the start and end of each kind of work, and every minute."""
    kind, left, shown, earlier = "", TimeLeft(0.0), 0.0, -1

    def show(what: str, done: int, total: int) -> None:
        nonlocal kind, left, shown, earlier
        now = time.monotonic()
        if what != kind:
            kind, left, shown, earlier = what, TimeLeft(now), now, -1
        estimate = _in_words(left.update(done, total, now))
        if done in (0, total) and done != earlier:
            say(f"{name}: {what} {done}/{total}")
        elif now >= shown + _LINE_INTERVAL:
            shown = now
            say(f"{name}: {what} {done}/{total}{', ' if estimate else ''}{estimate}")
        earlier = done

    return show
