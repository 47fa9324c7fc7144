r"""The paths of a scene all through a frame, each traced only as often as it must be.

Between two traces, T apart, the paths of both are there, carried to the moment with their delays'
rates and accelerations; those of the one fade linearly as those of the other come:

.. math:: H(t) = (1 - s)\,H_0(t) + s\,H_1(t - T), \qquad s = t/T

What moves sideways, or into a shadow, so changes without a step. A path whose coherence time is
:math:`t_c` holds contributions whose phases spread: carried on for t, it is wrong by
:math:`\alpha t + \beta t^2`, of which the sizes add up to ½ at :math:`t_c`. Fading in between is
right about α and leaves :math:`\beta T^2/4` half way. With a quarter from either term,

.. math:: e = \min\{1, \tfrac1{16} (T/t_c)^2\}^2

is the power that is wrong; and of what no longer coheres at all no more is lost than its power. A
part, such as the facets of one body, is traced again for a pair of radars before the errors of that
pair's paths add up to `ERROR` of the power of its whole, or of what they are heard among to
`FAINT_ECHO` or `FAINT_OTHER`, whichever is more. A car that passes a radar at two metres is traced
for it at every step, for the others every few milliseconds.

Limits: amplitudes and shadows in between are guessed from both ends. Delays of bounces between
bodies have no acceleration, as their mirror points slide; and they change faster than their
coherence times say, for they hang on which facets their tubes meet.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple, Protocol, runtime_checkable

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.base import (
    Part,
    RayTracer,
    all_pairs,
    gather,
    strength,
    strongest_of_pair,
    without_weak,
)
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene
from polychirp.threads import side_by_side

if TYPE_CHECKING:
    from polychirp.channel.scene.world import World

ERROR: Final = 1e-2
"""Of the power of a part's whole, that may be wrong between two traces.

Meshes that are right to a decibel leave as much of it wrong, and tubes of 2 cm more: against tubes
of 2.5 mm what bounces between the paper's bodies has a correlation of 0.6 in the median."""

FAINT_ECHO: Final = 2.5e-5
"""Power of errors of one part, relative to all of a radar's own echoes.

Receivers look 40 dB below the strongest echo: at four times as much, what is left of strong echoes
is claimed now and then, and at forty times tried as points, thousands of them."""

FAINT_OTHER: Final = 1e-3
"""Power of errors of one part, relative to what a radar hears of others.

Other radars' ramps are heard as bursts or as ghosts, below which nobody looks for weaker ones."""

LONGEST: Final = 16e-3
"""s, after which a part is traced again in any case: shadows move too, of which no coherence time
knows."""


@runtime_checkable
class PartedTracer(RayTracer, Protocol):
    """A tracer whose parts can be traced one by one."""

    @property
    def dynamic_range(self) -> float:
        """Ratio by which a path may be weaker than its pair's strongest."""
        ...

    @property
    def max_length(self) -> float:
        """M, of the longest path that is followed."""
        ...

    def prepare(self, scene: Scene) -> World:
        """The scene made ready."""
        ...

    def parts(self, world: World) -> tuple[Part, ...]:
        """What is traced."""
        ...


def _silent(done: int, total: int) -> None:
    """Tell nobody."""
    del done, total


def follow(
    tracer: RayTracer,
    scene: Scene,
    times: FloatArray,
    *,
    receivers: Sequence[int] | None = None,
    progress: Callable[[int, int], None] = _silent,
) -> tuple[PropagationPaths, ...]:
    """Paths at every one of ``times`` (s, rising, evenly spaced).

    Parameters
    ----------
    scene : at any time
    receivers : numbers of the radars that listen; None: all. Other tracers than those with parts
        trace all pairs at every time
    progress : told how many traces are done, and of how many at most

    Examples
    --------
    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.frames import Pose
    >>> from polychirp.model.radar import Radar
    >>> from polychirp.model.scene import Actor
    >>> cars = (Actor(name="a", kind="vehicle"), Actor(name="b", kind="vehicle", pose=Pose(x=9.0)))
    >>> scene = Scene(time=0.0, actors=cars, carriers=(0, 1),
    ...     radars=(Radar(name="front"), Radar(name="rear", mount=Pose(yaw=3.14))))
    >>> [paths.num_paths for paths in follow(Composite(), scene, np.array([0.0, 1e-3]))]
    [2, 2]
    """
    if not isinstance(tracer, PartedTracer):
        return _every_time(tracer, scene, times, progress)
    return _Frame(tracer, scene, times, receivers).snapshots(progress)


def _every_time(
    tracer: RayTracer, scene: Scene, times: FloatArray, progress: Callable[[int, int], None]
) -> tuple[PropagationPaths, ...]:
    snapshots = []
    for number, time in enumerate(times):
        progress(number, len(times))
        snapshots.append(tracer.trace(scene.at(float(time))))
    progress(len(times), len(times))
    return tuple(snapshots)


class _Limits(NamedTuple):
    """What a part's errors are weighed against, each ``(transmitter, receiver)``.

    ``others``: power of the other parts of its whole; ``faint``: of errors that nobody notices.
    """

    others: FloatArray
    faint: FloatArray


class _Row:
    """One part at all the times at which it was traced, each for some of the pairs."""

    def __init__(self, num_times: int, num_radars: int) -> None:
        self.tables: dict[int, PropagationPaths] = {}
        self.is_traced = np.zeros((num_times, num_radars, num_radars), dtype=bool)

    def add(self, number: int, pairs: IntArray, paths: PropagationPaths) -> None:
        """Keep what was traced at time ``number`` for ``pairs``."""
        self.tables[number] = paths
        self.is_traced[number, pairs[:, 0], pairs[:, 1]] = True


class _Fading:
    """All parts at every time: each pair's tables before and after it, carried there.

    The paths of all tables are behind one another; of which ``row`` and of which time's ``table``
    each is, is in ``(path,)``.
    """

    def __init__(self, rows: Sequence[_Row], times: FloatArray) -> None:
        self.times = times
        self.is_traced = np.array([row.is_traced for row in rows])
        tables = [(r, k, table) for r, row in enumerate(rows) for k, table in row.tables.items()]
        counts = [table.num_paths for _, _, table in tables]
        self.row = np.repeat([r for r, _, _ in tables], counts)
        self.table = np.repeat([k for _, k, _ in tables], counts)
        # each path is of its own table's time, whatever the whole says
        self.paths = gather([table for _, _, table in tables])

    def at(self, number: int) -> PropagationPaths:
        """Paths at time ``number``."""
        where = self.row, self.paths.transmitter, self.paths.receiver
        before, after = self._last(number)[where], self._next(number)[where]
        used = np.flatnonzero((self.table == before) | (self.table == after))
        table, gap = self.table[used], (after - before)[used]
        share = np.where(gap == 0, 1.0, 1.0 - np.abs(number - table) / np.maximum(gap, 1))
        used, share = used[share > 0], share[share > 0]
        paths, time = self.paths.select(used), self.times[number]
        delay, delay_rate = paths.delays_after(time - self.times[self.table[used]])
        return replace(
            paths,
            reference_time=float(time),
            delay=delay,
            delay_rate=delay_rate,
            transfer=share[:, None, None] * paths.transfer,
        )

    def _last(self, number: int) -> IntArray:
        """When each pair was traced last, ``(row, transmitter, receiver)``; 0 for never."""
        past = self.is_traced[:, number::-1]
        return np.where(past.any(axis=1), number - np.argmax(past, axis=1), 0)

    def _next(self, number: int) -> IntArray:
        """When each pair is traced next, like `_last`; the end for never."""
        coming = self.is_traced[:, number:]
        end = len(self.times) - 1
        return np.where(coming.any(axis=1), number + np.argmax(coming, axis=1), end)


class _Frame:
    """The parts of one frame, and when they were traced."""

    def __init__(
        self,
        tracer: PartedTracer,
        scene: Scene,
        times: FloatArray,
        receivers: Sequence[int] | None,
    ) -> None:
        self.tracer, self.times = tracer, times
        self.scenes = [scene.at(float(time)) for time in times]
        self.worlds = [tracer.prepare(moment) for moment in self.scenes]
        self.pairs = all_pairs(self.scenes[0], receivers, max_length=tracer.max_length)
        self.parts = tracer.parts(self.worlds[0])

    def snapshots(self, progress: Callable[[int, int], None]) -> tuple[PropagationPaths, ...]:
        total = len(self.parts) * len(self.times)
        first = self._first()
        whole = gather(first)
        power = strength(whole, self.scenes[0])
        strongest = strongest_of_pair(whole, power, len(self.scenes[0].radars))
        faint = _faint(_of_pairs(whole, power, len(strongest)))
        limits = [_Limits(others, faint) for others in self._of_wholes(first)]
        steps = [
            self._steps(begin, self.scenes[0], limit)
            for begin, limit in zip(first, limits, strict=True)
        ]
        # what asks for most first, so that no core waits for another in the end
        order = np.argsort([-np.sum(1 / some) for some in steps], kind="stable")
        following = [
            partial(self._row, self.parts[k], first[k], steps[k], limits[k], strongest)
            for k in order
        ]
        rows: list[_Row] = []
        for row in side_by_side(following):
            rows.append(row)
            progress(len(rows) * len(self.times), total)
        fading = _Fading([rows[k] for k in np.argsort(order)], self.times)
        return tuple(
            without_weak(fading.at(k), moment, self.tracer.dynamic_range)
            for k, moment in enumerate(self.scenes)
        )

    def _first(self) -> list[PropagationPaths]:
        """All parts at the first time, each with what is known from those before it."""
        num_radars = len(self.scenes[0].radars)
        strongest, tables = np.zeros((num_radars, num_radars)), []
        for part in self.parts:
            found = part.trace(self.worlds[0], self.pairs, strongest)
            power = strength(found, self.scenes[0])
            strongest = np.maximum(strongest, strongest_of_pair(found, power, num_radars))
            tables.append(found)
        return tables

    def _of_wholes(self, first: list[PropagationPaths]) -> FloatArray:
        """Power of all other parts of each part's whole, ``(part, transmitter, receiver)``."""
        scene = self.scenes[0]
        power = [_of_pairs(paths, strength(paths, scene), len(scene.radars)) for paths in first]
        whole = np.array([part.whole or part.name for part in self.parts])
        is_other = (whole[:, None] == whole) & ~np.eye(len(whole), dtype=np.bool_)
        return np.tensordot(is_other, np.array(power), axes=1)

    def _row(
        self,
        part: Part,
        begin: PropagationPaths,
        steps: IntArray,
        limits: _Limits,
        strongest: FloatArray,
    ) -> _Row:
        """One part, traced for each pair as often as that pair asks for, and at the end.

        ``steps`` are those of its paths at the first time, ``begin``.
        """
        last = len(self.times) - 1
        row = _Row(len(self.times), len(strongest))
        row.add(0, self.pairs, begin)
        due = np.minimum(steps, last)
        for number in range(1, last + 1):
            pairs = self.pairs[due[self.pairs[:, 0], self.pairs[:, 1]] == number]
            if not len(pairs):
                continue
            found = part.trace(self.worlds[number], pairs, strongest)
            row.add(number, pairs, found)
            steps = self._steps(found, self.scenes[number], limits)
            # on a grid, so that pairs with different steps are traced together
            next_due = np.minimum((number // steps + 1) * steps, last)
            due = np.where(due == number, next_due, due)
        return row

    def _steps(self, paths: PropagationPaths, scene: Scene, limits: _Limits) -> IntArray:
        """After how many times each pair is to be traced again, ``(transmitter, receiver)``.

        The same both ways round, which are traced together.
        """
        grid = float(self.times[1] - self.times[0]) if len(self.times) > 1 else LONGEST
        step = max(1, int(LONGEST / grid * (1 + 1e-9)))
        power = strength(paths, scene)
        whole = limits.others + _of_pairs(paths, power, len(limits.others))
        allowed = np.maximum(ERROR * whole, limits.faint)
        steps = np.full(allowed.shape, step)
        while step > 1:
            wrong = stated_error(step * grid / paths.coherence_time)
            is_wrong = _of_pairs(paths, power * wrong, len(allowed)) > allowed
            is_wrong |= is_wrong.T
            if not np.any(is_wrong):
                break
            shorter = (step + 1) // 2
            steps[is_wrong] = shorter
            step = shorter
        return steps


def stated_error(gap: FloatArray) -> FloatArray:
    """Share of a path's power that is wrong half way between traces; ``gap`` T/t_c.

    >>> float(stated_error(np.array(0.4)))
    0.0001
    """
    return np.asarray(np.minimum(1.0, gap**2 / 16) ** 2)


def _of_pairs(paths: PropagationPaths, power: FloatArray, num_radars: int) -> FloatArray:
    """Sums of ``power`` ``(path,)`` for every pair, ``(transmitter, receiver)``."""
    total = np.zeros((num_radars, num_radars))
    np.add.at(total, (paths.transmitter, paths.receiver), power)
    return total


def _faint(power: FloatArray) -> FloatArray:
    """Power of errors that each pair may make among what its receiver hears, like ``power``.

    Own echoes are heard among own echoes; other transmitters share a part of what they all make.
    """
    own = np.diagonal(power)
    others = (power.sum(axis=0) - own) / max(len(power) - 1, 1)
    is_own = np.eye(len(power), dtype=bool)
    return np.asarray(np.where(is_own, FAINT_ECHO * own, FAINT_OTHER * others))
