"""Levels of tubes: wide tubes first, then quarters of those that matter and of their neighbours.

`paths` decides which tubes matter.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter

from polychirp.axes import IntArray
from polychirp.channel.ray_tubes.launch_grid import Window, windows_over
from polychirp.channel.scene.world import World

MIN_TUBES: Final = 256
"""Least number of tubes over a body (chosen): fewer could miss a small body's surfaces."""


class Level(NamedTuple):
    """Tubes of one transmitter that have been halved equally often.

    Every window has its first ``body``, the number of times ``left`` that its tubes may still be
    halved, the numbers of those of its ``tubes`` that are there, row by row, and the most
    reflections ``max_turns`` to follow of each.
    """

    windows: list[Window]
    body: IntArray
    left: IntArray
    tubes: list[IntArray]
    max_turns: list[IntArray]

    @property
    def start(self) -> IntArray:
        """First numbers of all windows if tubes are numbered through them, ``(window + 1,)``."""
        sizes = [window.num_tubes for window in self.windows]
        return np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)])

    def window_of(self, tube: IntArray) -> IntArray:
        """The windows of tubes that are numbered through all windows."""
        return np.searchsorted(self.start, tube, side="right") - 1

    def with_neighbours(self, wanted: IntArray, turns: IntArray) -> IntArray:
        """Most reflections to follow of the quarters of every tube, ``(tube,)``; 0: no quarters.

        Tubes that are ``wanted`` (with repeats) for ``turns`` reflections are cut in quarters with
        their eight neighbours.
        """
        start = self.start
        found = np.zeros(start[-1], dtype=np.int64)
        np.maximum.at(found, wanted, turns)
        for number, window in enumerate(self.windows):
            mine = found[start[number] : start[number + 1]]
            if not mine.any():
                continue
            wide = maximum_filter(mine.reshape(window.shape), 3, mode="constant").reshape(-1)
            there = self.tubes[number]
            mine[:] = 0
            mine[there] = np.minimum(wide[there], self.max_turns[number])
        return found

    def halved(self, turns: IntArray) -> Level:
        """The next level: quarters of the tubes with ``turns``, as `with_neighbours` gives them."""
        some, tubes, most, start = [], [], [], self.start
        for number, window in enumerate(self.windows):
            here = turns[start[number] + self.tubes[number]]
            is_halved = here > 0
            if np.any(is_halved):
                some.append(number)
                tubes.append(_quarters(self.tubes[number][is_halved], window.shape[1]))
                most.append(np.repeat(here[is_halved], 4))
        windows = [self.windows[number].finer for number in some]
        return Level(windows, self.body[some], self.left[some] - 1, tubes, most)


def _quarters(tube: IntArray, columns: int) -> IntArray:
    """Numbers of four tubes for each, side by side, so that they meet what is near in memory."""
    row, column = np.divmod(tube, columns)
    corner = 4 * row * columns + 2 * column
    return np.asarray(corner[:, None] + [0, 1, 2 * columns, 2 * columns + 1]).reshape(-1)


def first_level(
    world: World, radar: int, bodies: list[int], widths: tuple[float, float], max_bounces: int
) -> Level:
    """All tubes over some bodies, of ``widths`` (m) from narrowest to widest.

    They have the width of the narrowest times the greatest power of 2 that the widest allows.
    Tubes over bodies that seem small are narrower: `MIN_TUBES` or more, if the narrowest allow it.
    """
    windows, whose, left = [], [], []
    narrowest, widest = widths
    most = max(0, int(np.floor(np.log2(widest / narrowest) + 1e-6)))
    for body in bodies:
        times = most
        found = windows_over(world, radar, body, narrowest * 2**times)
        while times > 0 and found[0].num_tubes < MIN_TUBES:
            times -= 1
            found = windows_over(world, radar, body, narrowest * 2**times)
        windows += found
        whose += [body] * len(found)
        left += [times] * len(found)
    tubes = [np.arange(window.num_tubes) for window in windows]
    max_turns = [np.full(window.num_tubes, max_bounces) for window in windows]
    columns = np.array(whose, dtype=np.int64), np.array(left, dtype=np.int64)
    return Level(windows, *columns, tubes, max_turns)
