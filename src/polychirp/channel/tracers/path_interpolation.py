r"""Interpolation of paths in time, so that each part is traced only as often as necessary.

Between two traces, T apart, the paths of both are used, extrapolated with the rates and
accelerations of their delays. Those of the earlier trace fade out linearly while those of the later
one fade in:

.. math:: H(t) = (1 - s)\,H_0(t) + s\,H_1(t - T), \qquad s = t/T

So fields change without steps where a body moves sideways or into a shadow. `part_traces` says how
wrong they are then, and therefore when each part is traced.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.base import (
    Part,
    RayTracer,
    all_pairs,
    gather,
    strength,
    strongest_of_pair,
    within_range,
)
from polychirp.channel.tracers.part_traces import (
    Frame,
    Limits,
    PartTraces,
    faint_errors,
    power_of_pairs,
    trace_together,
)
from polychirp.channel.tracers.ray_check import checked
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene
from polychirp.threads import side_by_side

if TYPE_CHECKING:
    from polychirp.channel.scene.world import World


@runtime_checkable
class PartedTracer(RayTracer, Protocol):
    """A tracer whose parts can be traced one by one."""

    @property
    def dynamic_range(self) -> float:
        """Power ratio of a pair's strongest path to the weakest path that is kept."""

    @property
    def max_length(self) -> float:
        """Length of the longest path that is traced, m."""

    @property
    def motion_error(self) -> float:
        """Greatest power of a part's errors between two traces, over the power of its whole."""

    def prepare(self, scene: Scene) -> "World":
        """The scene with all that its tracing needs at one time."""

    def parts(self, world: "World") -> tuple[Part, ...]:
        """The parts into which the tracing of this scene is divided."""


def interpolate_paths(
    tracer: RayTracer,
    scene: Scene,
    times: FloatArray,
    *,
    receivers: Sequence[int] | None = None,
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> tuple[PropagationPaths, ...]:
    """Paths at every one of ``times`` (s, rising, evenly spaced).

    Parameters
    ----------
    scene : the scene at any time; it is moved to each of ``times``
    receivers : numbers of the radars that receive; None: all. Tracers without parts trace all
        pairs at every time
    progress : called with the number of traces that are done or not needed, and with the greatest
        possible number of traces

    Examples
    --------
    >>> from polychirp.channel.tracers.composite import Composite
    >>> from polychirp.frames import Pose
    >>> from polychirp.model.radar import Radar
    >>> from polychirp.model.scene import Actor
    >>> cars = (Actor(name="a", kind="vehicle"), Actor(name="b", kind="vehicle", pose=Pose(x=9.0)))
    >>> scene = Scene(time=0.0, actors=cars, carriers=(0, 1),
    ...     radars=(Radar(name="front"), Radar(name="rear", mount=Pose(yaw=3.14))))
    >>> [paths.num_paths for paths in interpolate_paths(Composite(), scene, np.array([0.0, 1e-3]))]
    [2, 2]
    """
    if not isinstance(tracer, PartedTracer):
        return _every_time(tracer, scene, times, progress)
    return _FrameTraces(tracer, scene, times, receivers).snapshots(progress)


def _every_time(
    tracer: RayTracer, scene: Scene, times: FloatArray, progress: Callable[[int, int], None]
) -> tuple[PropagationPaths, ...]:
    snapshots = []
    for number, time in enumerate(times):
        progress(number, len(times))
        now = scene.at(float(time))
        snapshots.append(checked(tracer.trace(now), now))
    progress(len(times), len(times))
    return tuple(snapshots)


class _CrossFade:
    """Paths of all parts at every time, faded between the traces before and after it.

    ``paths`` holds the paths of all traces, one behind the other; ``part`` and ``trace``
    ``(path,)`` are the number of their part and of the time at which they were traced.
    """

    def __init__(self, parts: Sequence[PartTraces], times: FloatArray) -> None:
        self.times = times
        self.is_traced = np.array([part.is_traced for part in parts])
        tables = [
            (p, k, part.tables[k]) for p, part in enumerate(parts) for k in sorted(part.tables)
        ]
        counts = [table.num_paths for _, _, table in tables]
        self.part = np.repeat([p for p, _, _ in tables], counts)
        self.trace = np.repeat([k for _, k, _ in tables], counts)
        # `gather` gives all paths one reference time; `at` uses the time of each path's trace
        self.paths = gather([table for _, _, table in tables])

    def at(self, number: int, scene: Scene, dynamic_range: float) -> PropagationPaths:
        """Paths at time ``number``, when ``scene`` is as it is then.

        Those within ``dynamic_range`` before they fade are kept, so that both traces of a path
        are in use as long as it stays within it.
        """
        used, share, gap = self._used(number)
        paths = self._extrapolated(used, number)
        kept = within_range(paths, scene, dynamic_range)
        paths, used, share, gap = paths.select(kept), used[kept], share[kept], gap[kept]
        grid = max(self.times[-1] - self.times[0], 1e-12) / max(len(self.times) - 1, 1)
        fading = np.sign(self.trace[used] - number) / (np.maximum(gap, 1) * grid)
        return replace(
            paths,
            transfer=share[:, None, None] * paths.transfer,
            # between its traces the amplitude of a path changes by the fade alone
            transfer_drift=np.where(gap == 0, paths.transfer_drift, fading / share),
        )

    def _used(self, number: int) -> tuple[IntArray, FloatArray, IntArray]:
        """Numbers of the paths in use at time ``number``, their shares and the traces' distances.

        The share of a path is the factor of its amplitude; the distance is the number of time steps
        between the traces before and after ``number``, 0 at the time of a trace.
        """
        where = self.part, self.paths.transmitter, self.paths.receiver
        before, after = self._last(number)[where], self._next(number)[where]
        used = np.flatnonzero((self.trace == before) | (self.trace == after))
        gap, away = (after - before)[used], np.abs(number - self.trace[used])
        share = np.where(gap == 0, 1.0, 1.0 - away / np.maximum(gap, 1))
        some = share > 0
        return used[some], share[some], gap[some]

    def _extrapolated(self, used: IntArray, number: int) -> PropagationPaths:
        """Paths ``used`` as they have moved between their trace and time ``number``."""
        paths, time = self.paths.select(used), self.times[number]
        elapsed = time - self.times[self.trace[used]]
        delay, delay_rate = paths.delays_after(elapsed)
        turned = elapsed[:, None]
        return replace(
            paths,
            reference_time=float(time),
            delay=delay,
            delay_rate=delay_rate,
            departure=paths.departure + turned * paths.departure_rate,
            arrival=paths.arrival + turned * paths.arrival_rate,
        )

    def _last(self, number: int) -> IntArray:
        """Time number of each pair's latest trace at or before ``number``; 0 if there is none.

        Shaped ``(part, transmitter, receiver)``.
        """
        past = self.is_traced[:, number::-1]
        return np.where(past.any(axis=1), number - np.argmax(past, axis=1), 0)

    def _next(self, number: int) -> IntArray:
        """Time number of each pair's first trace at or after ``number``, shaped like `_last`.

        It is the number of the frame's last time if there is none.
        """
        coming = self.is_traced[:, number:]
        end = len(self.times) - 1
        return np.where(coming.any(axis=1), number + np.argmax(coming, axis=1), end)


class _FrameTraces:
    """Traces of all parts during one frame."""

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
        parts = self._part_traces()
        groups = self._groups()
        # the group with the most traces starts first: started last, it would run on one core alone
        groups.sort(key=lambda group: -sum(parts[k].num_expected for k in group))
        done = 0
        work = [partial(trace_together, [parts[k] for k in group]) for group in groups]
        for number in side_by_side(work):
            done += number
            progress(done * len(self.times), total)
        fading = _CrossFade(parts, self.times)
        return tuple(
            fading.at(k, moment, self.tracer.dynamic_range) for k, moment in enumerate(self.scenes)
        )

    def _part_traces(self) -> list[PartTraces]:
        """All parts, traced at the first time."""
        first, scene = self._first_traces(), self.scenes[0]
        whole = gather(first)
        power = strength(whole, scene)
        strongest = strongest_of_pair(whole, power, len(scene.radars))
        error = self.tracer.motion_error
        faint = faint_errors(power_of_pairs(whole, power, len(strongest)), error)
        frame = Frame(self.times, self.scenes, self.worlds, self.pairs, error, strongest)
        return [
            PartTraces(part, frame, Limits(others, faint), paths)
            for part, others, paths in zip(
                self.parts, self._power_of_others(first), first, strict=True
            )
        ]

    def _first_traces(self) -> list[PropagationPaths]:
        """Paths of all parts at the first time.

        Each part is given the power of the strongest path that the parts before it found, so that
        it can leave out paths that are much weaker.
        """
        num_radars = len(self.scenes[0].radars)
        strongest, tables = np.zeros((num_radars, num_radars)), []
        for part in self.parts:
            found = part.trace(self.worlds[0], self.pairs, strongest)
            power = strength(found, self.scenes[0])
            strongest = np.maximum(strongest, strongest_of_pair(found, power, num_radars))
            tables.append(found)
        return tables

    def _power_of_others(self, first: list[PropagationPaths]) -> FloatArray:
        """Power of all other parts of each part's whole, ``(part, transmitter, receiver)``."""
        scene = self.scenes[0]
        power = [
            power_of_pairs(paths, strength(paths, scene), len(scene.radars)) for paths in first
        ]
        whole = np.array([part.whole or part.name for part in self.parts])
        is_other = (whole[:, None] == whole) & ~np.eye(len(whole), dtype=np.bool_)
        return np.tensordot(is_other, np.array(power), axes=1)

    def _groups(self) -> list[list[int]]:
        """Numbers of the parts of each whole, which are traced one after the other at each time.

        What the parts of one body have in common, such as the facets that radars see, is then at
        hand for all of them.
        """
        groups: dict[str, list[int]] = {}
        for number, part in enumerate(self.parts):
            groups.setdefault(part.whole or part.name, []).append(number)
        return list(groups.values())
