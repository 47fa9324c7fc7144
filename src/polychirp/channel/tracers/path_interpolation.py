r"""Interpolation of paths in time, so that each part is traced only as often as necessary.

Between two traces, T apart, the paths of both are used, extrapolated with the rates and
accelerations of their delays. Those of the earlier trace fade out linearly while those of the later
one fade in:

.. math:: H(t) = (1 - s)\,H_0(t) + s\,H_1(t - T), \qquad s = t/T

So fields change without steps where a body moves sideways or into a shadow.

A path with a finite coherence time :math:`t_c` is a sum of contributions whose phases drift apart.
After extrapolation by t, its relative amplitude error is :math:`\alpha t + \beta t^2`, and
:math:`t_c` is the time at which the magnitudes of both terms add up to ½. The linear fade cancels
the term of α and leaves an error of :math:`\beta T^2/4` half way between traces. We assume that
both terms have the magnitude ¼ at :math:`t_c`. The power of the error is then

.. math:: e = \min\{1, \tfrac1{16} (T/t_c)^2\}^2

times the path's power. The factor is at most 1, because a path without any coherence left is wrong
by its own power.

A part (`channel.base.Part`), such as the facets of one body, is traced again for a pair of radars
before the powers of the errors of that pair's paths add up to a limit. The limit is the greater of
two powers. One is the tracer's ``motion_error`` times the power of the part's whole: the facets of
a body that are seen directly and in mirrors are two parts of one whole, and every other part is its
own whole. The other is `FAINT_ECHO_ERROR` times the power of the radar's own echoes, or, for a
signal of another radar, `FAINT_INTERFERENCE` of ``motion_error`` times the mean power that arrives
from one other radar. A car that passes a radar at two metres is traced at every one of the frame's
trace times for that radar, and every few milliseconds for the others.

Limits: amplitudes and shadows between traces are interpolated, not traced. Paths over several
bodies are less accurate than stated. Their delays are extrapolated without acceleration, which is
not known because their reflection points move along the surfaces. They also change faster than
their coherence times say, because each ray tube meets other facets as the bodies move.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
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

FAINT_ECHO_ERROR: Final = 2.5e-5
"""Power of one part's errors that is tolerated, as a ratio to that of all own echoes of a radar.

Chosen by trial: receivers search down to 40 dB below the strongest echo. At four times this value,
residuals of strong echoes are sometimes detected; at −25 dB, the receiver tries points on thousands
of residuals (decision 7)."""

FAINT_INTERFERENCE: Final = 0.1
"""Power of one part's errors that is tolerated, as a ratio to the mean power that a radar receives
from one other radar, over ``motion_error``.

Chosen greater than `FAINT_ECHO_ERROR` with the default of ``motion_error``: other radars' signals
appear as bursts or ghosts, and no receiver searches for weaker signals of other radars below
these."""

MAX_TRACE_INTERVAL: Final = 16e-3
"""Greatest time between two traces of a part, s.

A limit is needed because shadows move, which coherence times do not include. Chosen: decision 7
compares 8, 16 and 32 ms."""


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
        snapshots.append(tracer.trace(scene.at(float(time))))
    progress(len(times), len(times))
    return tuple(snapshots)


class _Limits(NamedTuple):
    """Powers that a part's errors are compared with, each ``(transmitter, receiver)``.

    ``others``: power of all other parts of the part's whole. ``faint``: power of the part's errors
    that is tolerated however weak the whole is.
    """

    others: FloatArray
    faint: FloatArray


class _PartTraces:
    """Paths of one part at the times at which it was traced.

    ``tables`` holds the paths by the number of the time, for the pairs that were traced then;
    ``is_traced`` ``(time, transmitter, receiver)`` says which these were.
    """

    def __init__(self, num_times: int, num_radars: int) -> None:
        self.tables: dict[int, PropagationPaths] = {}
        self.is_traced = np.zeros((num_times, num_radars, num_radars), dtype=bool)

    def add(self, number: int, pairs: IntArray, paths: PropagationPaths) -> None:
        """Add the paths traced at time ``number`` for ``pairs``."""
        self.tables[number] = paths
        self.is_traced[number, pairs[:, 0], pairs[:, 1]] = True


class _CrossFade:
    """Paths of all parts at every time, faded between the traces before and after it.

    ``paths`` holds the paths of all traces, one behind the other; ``part`` and ``trace``
    ``(path,)`` are the number of their part and of the time at which they were traced.
    """

    def __init__(self, parts: Sequence[_PartTraces], times: FloatArray) -> None:
        self.times = times
        self.is_traced = np.array([part.is_traced for part in parts])
        tables = [(p, k, table) for p, part in enumerate(parts) for k, table in part.tables.items()]
        counts = [table.num_paths for _, _, table in tables]
        self.part = np.repeat([p for p, _, _ in tables], counts)
        self.trace = np.repeat([k for _, k, _ in tables], counts)
        # `gather` gives all paths one reference time; `at` uses the time of each path's trace
        self.paths = gather([table for _, _, table in tables])

    def at(self, number: int) -> PropagationPaths:
        """Paths at time ``number``."""
        where = self.part, self.paths.transmitter, self.paths.receiver
        before, after = self._last(number)[where], self._next(number)[where]
        used = np.flatnonzero((self.trace == before) | (self.trace == after))
        trace, gap = self.trace[used], (after - before)[used]
        share = np.where(gap == 0, 1.0, 1.0 - np.abs(number - trace) / np.maximum(gap, 1))
        some = share > 0
        used, share, gap = used[some], share[some], gap[some]
        paths, time = self.paths.select(used), self.times[number]
        elapsed = time - self.times[self.trace[used]]
        delay, delay_rate = paths.delays_after(elapsed)
        grid = max(self.times[-1] - self.times[0], 1e-12) / max(len(self.times) - 1, 1)
        fading = -np.sign(elapsed) / (np.maximum(gap, 1) * grid)
        turned = elapsed[:, None]
        return replace(
            paths,
            reference_time=float(time),
            delay=delay,
            delay_rate=delay_rate,
            transfer=share[:, None, None] * paths.transfer,
            # between its traces the amplitude of a path changes by the fade alone
            transfer_drift=np.where(gap == 0, paths.transfer_drift, fading / share),
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
        first = self._first_traces()
        whole = gather(first)
        power = strength(whole, self.scenes[0])
        strongest = strongest_of_pair(whole, power, len(self.scenes[0].radars))
        powers = _power_of_pairs(whole, power, len(strongest))
        faint = _faint_errors(powers, FAINT_INTERFERENCE * self.tracer.motion_error)
        limits = [_Limits(others, faint) for others in self._power_of_others(first)]
        steps = [
            self._steps(begin, self.scenes[0], limit)
            for begin, limit in zip(first, limits, strict=True)
        ]
        groups = self._groups()
        # the group with the most traces starts first: started last, it would run on one core alone
        groups.sort(key=lambda group: -sum(float(np.sum(1 / steps[k])) for k in group))
        work = [partial(self._traces, group, first, steps, limits, strongest) for group in groups]
        done: dict[int, _PartTraces] = {}
        for traces in side_by_side(work):
            done |= traces
            progress(len(done) * len(self.times), total)
        fading = _CrossFade([done[k] for k in range(len(self.parts))], self.times)
        return tuple(
            without_weak(fading.at(k), moment, self.tracer.dynamic_range)
            for k, moment in enumerate(self.scenes)
        )

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
            _power_of_pairs(paths, strength(paths, scene), len(scene.radars)) for paths in first
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

    def _traces(
        self,
        group: Sequence[int],
        first: Sequence[PropagationPaths],
        steps: Sequence[IntArray],
        limits: Sequence[_Limits],
        strongest: FloatArray,
    ) -> dict[int, _PartTraces]:
        """Traces of a group's parts: each pair as often as its errors need, and at the last time.

        ``first`` are every part's paths at the first time. ``steps`` ``(transmitter, receiver)`` of
        every part is the number of time steps from there to the next trace (`_steps`).
        """
        last = len(self.times) - 1
        found = {k: _PartTraces(len(self.times), len(strongest)) for k in group}
        due = {k: np.minimum(steps[k], last) for k in group}
        for k in group:
            found[k].add(0, self.pairs, first[k])
        for number, k in product(range(1, last + 1), group):
            pairs = self.pairs[due[k][self.pairs[:, 0], self.pairs[:, 1]] == number]
            if not len(pairs):
                continue
            paths = self.parts[k].trace(self.worlds[number], pairs, strongest)
            found[k].add(number, pairs, paths)
            until_next = self._steps(paths, self.scenes[number], limits[k])
            # traces are due at multiples of the step, so that pairs with different steps coincide
            next_due = np.minimum((number // until_next + 1) * until_next, last)
            due[k] = np.where(due[k] == number, next_due, due[k])
        return found

    def _steps(self, paths: PropagationPaths, scene: Scene, limits: _Limits) -> IntArray:
        """Number of time steps until each pair is traced again, ``(transmitter, receiver)``.

        Steps are halved until the error is below its limit. Both directions between two radars get
        the smaller step of the two, and are traced together.
        """
        grid = float(self.times[1] - self.times[0]) if len(self.times) > 1 else MAX_TRACE_INTERVAL
        step = max(1, int(MAX_TRACE_INTERVAL / grid * (1 + 1e-9)))
        power = strength(paths, scene)
        whole = limits.others + _power_of_pairs(paths, power, len(limits.others))
        allowed = np.maximum(self.tracer.motion_error * whole, limits.faint)
        steps = np.full(allowed.shape, step)
        while step > 1:
            wrong = interpolation_error(step * grid / paths.coherence_time)
            is_wrong = _power_of_pairs(paths, power * wrong, len(allowed)) > allowed
            is_wrong |= is_wrong.T
            if not np.any(is_wrong):
                break
            shorter = (step + 1) // 2
            steps[is_wrong] = shorter
            step = shorter
        return steps


def interpolation_error(gap: FloatArray) -> FloatArray:
    """Power of a path's error half way between traces, as a ratio to the path's power.

    ``gap`` is T/t_c, the time between the traces over the coherence time.

    >>> float(interpolation_error(np.array(0.4)))
    0.0001
    """
    return np.asarray(np.minimum(1.0, gap**2 / 16) ** 2)


def _power_of_pairs(paths: PropagationPaths, power: FloatArray, num_radars: int) -> FloatArray:
    """Sums of ``power`` ``(path,)`` for every pair, ``(transmitter, receiver)``."""
    total = np.zeros((num_radars, num_radars))
    np.add.at(total, (paths.transmitter, paths.receiver), power)
    return total


def _faint_errors(power: FloatArray, of_interference: float) -> FloatArray:
    """Power of errors that may be tolerated for each pair, shaped like ``power``.

    Errors of own echoes are compared with the power of all own echoes. Errors of signals of other
    radars are compared with the mean power that the receiver gets from one other radar, of which
    they may have the share ``of_interference``.
    """
    own = np.diagonal(power)
    others = (power.sum(axis=0) - own) / max(len(power) - 1, 1)
    is_own = np.eye(len(power), dtype=bool)
    return np.asarray(np.where(is_own, FAINT_ECHO_ERROR * own, of_interference * others))
