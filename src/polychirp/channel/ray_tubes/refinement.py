"""Levels of tubes: wide ones first, then halves of those that are worth it and of their neighbours.

`tubes` says which are worth it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter

from polychirp.axes import IntArray
from polychirp.channel.ray_tubes.launch_grid import Window, windows_over
from polychirp.channel.scene.world import World

LEAST: Final = 256
"""Tubes with which a body is looked at, at least: small ones are not missed between two."""


class Level(NamedTuple):
    """Tubes of one transmitter that are as often halved.

    For every window its first ``body``, how often its tubes may be halved yet ``left``, and which
    of its ``tubes`` are there, with the most reflections ``turns`` that are followed of each. They
    are numbered row by row. ``start``: where the numbers of every window begin if all are
    numbered behind one another ``(window + 1,)``.
    """

    windows: list[Window]
    body: IntArray
    left: IntArray
    tubes: list[IntArray]
    turns: list[IntArray]
    start: IntArray

    def window_of(self, tube: IntArray) -> IntArray:
        """The windows of tubes that are numbered behind one another."""
        return np.searchsorted(self.start, tube, side="right") - 1

    def with_neighbours(self, wanted: IntArray, turns: IntArray) -> IntArray:
        """Up to how many reflections every tube is to be halved, ``(tube,)``; 0: it is not.

        As far as ``wanted`` tubes (with repeats) ask for it, for them and their eight neighbours.
        """
        found = np.zeros(self.start[-1], dtype=np.int64)
        np.maximum.at(found, wanted, turns)
        for number, window in enumerate(self.windows):
            mine = found[self.start[number] : self.start[number + 1]]
            if not mine.any():
                continue
            wide = maximum_filter(mine.reshape(window.shape), 3, mode="constant").reshape(-1)
            there = self.tubes[number]
            mine[:] = 0
            mine[there] = np.minimum(wide[there], self.turns[number])
        return found

    def halved(self, turns: IntArray) -> Level:
        """The next level: four tubes in the place of each of some."""
        some, tubes, most = [], [], []
        for number, window in enumerate(self.windows):
            here = turns[self.start[number] + self.tubes[number]]
            is_halved = here > 0
            if np.any(is_halved):
                some.append(number)
                tubes.append(_quarters(self.tubes[number][is_halved], window.shape[1]))
                most.append(np.repeat(here[is_halved], 4))
        windows = [self.windows[number].finer for number in some]
        return level_of(windows, self.body[some], self.left[some] - 1, tubes, most)


def _quarters(tube: IntArray, columns: int) -> IntArray:
    """Numbers of four tubes each, side by side: what they meet is near in the memory, too."""
    row, column = np.divmod(tube, columns)
    corner = 4 * row * columns + 2 * column
    return np.asarray(corner[:, None] + [0, 1, 2 * columns, 2 * columns + 1]).reshape(-1)


def level_of(
    windows: list[Window],
    body: Sequence[int] | IntArray,
    left: Sequence[int] | IntArray,
    tubes: list[IntArray],
    turns: list[IntArray],
) -> Level:
    """A level of some tubes of some windows."""
    return Level(
        windows,
        np.array(body, dtype=np.int64),
        np.array(left, dtype=np.int64),
        tubes,
        turns,
        np.concatenate([[0], np.cumsum([window.num_tubes for window in windows])]).astype(np.int64),
    )


def first_level(
    world: World, radar: int, bodies: list[int], widths: tuple[float, float], max_bounces: int
) -> Level:
    """All tubes over some bodies, as wide as ``widths[1]`` allows (m) if halved to ``widths[0]``.

    Bodies that seem small get narrower tubes, at least `LEAST` of them if ``tube`` allows it.
    """
    windows, whose, left = [], [], []
    tube, coarsest = widths
    most = max(0, int(np.floor(np.log2(coarsest / tube) + 1e-6)))
    for body in bodies:
        times = most
        found = windows_over(world, radar, body, tube * 2**times)
        while times > 0 and found[0].num_tubes < LEAST:
            times -= 1
            found = windows_over(world, radar, body, tube * 2**times)
        windows += found
        whose += [body] * len(found)
        left += [times] * len(found)
    tubes = [np.arange(window.num_tubes) for window in windows]
    turns = [np.full(window.num_tubes, max_bounces) for window in windows]
    return level_of(windows, whose, left, tubes, turns)
