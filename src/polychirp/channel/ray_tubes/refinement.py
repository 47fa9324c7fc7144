"""Levels of tubes: wide tubes first, then quarters of some tubes and of their neighbours.

`paths` chooses those tubes, by the power that their hits may bring to a receiver.
"""

from typing import Final, NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter

from polychirp.axes import IntArray
from polychirp.channel.ray_tubes.flat_parts import lone_parts
from polychirp.channel.ray_tubes.launch_grid import (
    FULL_WIDTH_DISTANCE,
    Window,
    distance_to,
    windows_over,
)
from polychirp.channel.scene.world import World

MIN_TUBES: Final = 2000
"""Least number of tubes in a body's first window, unless the narrowest tubes are wider than that
allows. Chosen: with half as many, the wave from one sphere of 0.4 m to another was missed in two of
six draws (`tests/physics/test_curved_bodies.py`)."""


TUBES_ACROSS: Final = 120
"""Least number of tubes along the diagonal of a body's box. The border of what the tubes light is
stepped by their width, and the echo of a body is wrong by the area of these steps: with 120, that
of a corner reflector by 0.2 dB at most over drawn sizes, ranges and aspects. Half as many tubes
double the error; twice as many take four times as long. Near cars have more tubes anyway."""

LONE_SHARE: Final = 1.0 / 3.0
"""Tubes across a body that is one flat part and touches no other, over ``Widths.across``. Such a
body is no part of a corner, and `flat_pairs` has what it reflects to other flat parts. Chosen: the
steps in what it lights on curved bodies are then a fortieth of it."""


LEAST_DISTANCE: Final = 0.3
"""Distance of a body, m, below which its tubes are not made narrower (chosen)."""


class Widths(NamedTuple):
    """Widths of the ``narrowest`` and the ``widest`` tubes, m, and `TUBES_ACROSS` or another."""

    narrowest: float
    widest: float
    across: int


class Level(NamedTuple):
    """Tubes of one transmitter that have been cut in quarters equally often.

    The other fields have one entry for every window: ``body``, the number of the body that it
    covers; ``left``, how often its tubes may still be cut in quarters; ``tubes``, the numbers of
    its tubes that are followed, counted row by row; ``max_turns``, the largest number of
    reflections to follow along each of these tubes.
    """

    windows: list[Window]
    body: IntArray
    left: IntArray
    tubes: list[IntArray]
    max_turns: list[IntArray]

    @property
    def start(self) -> IntArray:
        """Number of every window's first tube, counted through all windows, ``(window + 1,)``."""
        sizes = [window.num_tubes for window in self.windows]
        return np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)])

    def window_of(self, tube: IntArray) -> IntArray:
        """Numbers of the windows of tubes, whose numbers count through all windows."""
        return np.searchsorted(self.start, tube, side="right") - 1

    def with_neighbours(self, wanted: IntArray, turns: IntArray) -> IntArray:
        """Number of reflections to follow along every tube's quarters, ``(tube,)``; 0: no quarters.

        The tubes ``wanted``, where a number may occur more than once, are cut in quarters with
        their eight neighbours; ``turns`` is the number of reflections to follow for each entry.
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

    def halved(self, turns: IntArray) -> "Level":
        """The next level: quarters of tubes whose ``turns``, from `with_neighbours`, exceed 0."""
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
    """Numbers of each tube's quarters, one after another: their rays read the same memory."""
    row, column = np.divmod(tube, columns)
    corner = 4 * row * columns + 2 * column
    return np.asarray(corner[:, None] + [0, 1, 2 * columns, 2 * columns + 1]).reshape(-1)


def _times_nearer(distance: float) -> int:
    """Number of times that the widest tubes are halved over a body at this distance, m."""
    nearer = FULL_WIDTH_DISTANCE / max(distance, LEAST_DISTANCE)
    return max(0, round(0.5 * float(np.log2(nearer))))


def first_level(
    world: World, radar: int, bodies: list[int], widths: Widths, max_bounces: int
) -> Level:
    """All tubes over some bodies.

    The width is that of the narrowest tubes times the greatest power of 2 that does not exceed the
    widest. Over a body that is nearer than half of `FULL_WIDTH_DISTANCE` it is halved, and again
    wherever the distance falls to a quarter: the sagitta of the wave front across a tube stays
    about the same. It is halved further for a body that seems small from the radar until there are
    `MIN_TUBES`. It is never below that of the narrowest tubes. These are narrower than asked for on
    a body that would have fewer than ``widths.across`` of them along the diagonal of its box, or
    `LONE_SHARE` of that number if it is one of `lone_parts`.
    """
    windows, whose, left = [], [], []
    narrowest, widest, across = widths
    most = max(0, int(np.floor(np.log2(widest / narrowest) + 1e-6)))
    for body in bodies:
        times = max(0, most - _times_nearer(distance_to(world, radar, body)))
        found = windows_over(world, radar, body, narrowest * 2**times)
        while times > 0 and found[0].num_tubes < MIN_TUBES:
            times -= 1
            found = windows_over(world, radar, body, narrowest * 2**times)
        if times == 0:
            share = LONE_SHARE if body in lone_parts(world) else 1.0
            fewest = max(1, round(share * across))
            found = windows_over(world, radar, body, narrowest, across=fewest)
        windows += found
        whose += [body] * len(found)
        left += [times] * len(found)
    tubes = [np.arange(window.num_tubes) for window in windows]
    max_turns = [np.full(window.num_tubes, max_bounces) for window in windows]
    columns = np.array(whose, dtype=np.int64), np.array(left, dtype=np.int64)
    return Level(windows, *columns, tubes, max_turns)
