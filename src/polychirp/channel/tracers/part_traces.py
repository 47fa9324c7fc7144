r"""Traces of one part of the paths during a frame, each pair of radars as often as it needs.

A path with a finite coherence time :math:`t_c` is a sum of contributions whose phases drift apart.
After extrapolation by t, its relative amplitude error is :math:`\alpha t + \beta t^2`, and
:math:`t_c` is the time at which the magnitudes of both terms add up to ½. The linear fade between
two traces (`path_interpolation`) cancels the term of α and leaves an error of :math:`\beta T^2/4`
half way between traces that are T apart. We assume that both terms have the magnitude ¼ at
:math:`t_c`. The power of the error is then

.. math:: e = \min\{1, \tfrac1{16} (T/t_c)^2\}^2

times the path's power. The factor is at most 1, because a path without any coherence left is wrong
by its own power.

A part (`channel.base.Part`), such as the facets of one body, is traced again for a pair of radars
before the powers of the errors of that pair's paths add up to a limit. The limit is the greater of
two powers. One is the tracer's ``motion_error`` times the power of the part's whole: all that a
body reflects first is one whole. The other is `FAINT_ECHO_ERROR` times the power of the radar's own
echoes, or, for a signal of another radar, `FAINT_INTERFERENCE` of ``motion_error`` times the mean
power that arrives from one other radar. A car that passes a radar at two metres is traced at every
one of the frame's trace times for that radar, and every few milliseconds for the others.

The error must be within the limit by the coherence times of both traces: a glint that comes near
makes those of the later one shorter. All parts are traced at the ends of equal intervals of the
frame, which last `MAX_TRACE_INTERVAL` at most in the mean. If either end of an interval asks for a
shorter time, the part is traced half way too, and so on. Parts have most of their times in common
then, and with them the facets that radars see.

Limits: amplitudes and shadows between traces are interpolated, not traced. Paths over several
bodies change faster than their coherence times say, because ray tubes come and go at edges as the
bodies move. Nor do coherence times say how fast shadows change, or waves over edges, which
therefore state the longest time between two traces.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.base import Part, strength
from polychirp.model.paths import PropagationPaths
from polychirp.model.scene import Scene

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

MAX_TRACE_INTERVAL: Final = 18e-3
"""Greatest mean time between two traces of a part, s.

A limit is needed because shadows move, which coherence times do not include. Chosen: decision 7
compares 8, 16 and 32 ms, and equal intervals of 17 ms with those of 16 ms and a short one."""


class Frame(NamedTuple):
    """Times and places that all parts of a frame share, and their common limits.

    ``times`` s, rising and evenly spaced, with the ``scenes`` and ``worlds`` of each; ``pairs``
    (transmitter, receiver) ``(pair, 2)``, all that are traced; ``motion_error`` of the tracer;
    ``strongest`` power of the strongest path of every pair at the first time, ``(transmitter,
    receiver)``.
    """

    times: FloatArray
    scenes: list[Scene]
    worlds: list["World"]
    pairs: IntArray
    motion_error: float
    strongest: FloatArray

    @property
    def last(self) -> int:
        """Number of the last time."""
        return len(self.times) - 1

    @property
    def grid(self) -> float:
        """Time between two of ``times``, s."""
        return float(self.times[1] - self.times[0]) if self.last else MAX_TRACE_INTERVAL

    @property
    def marks(self) -> IntArray:
        """Numbers of the times at which all parts are traced.

        They divide the frame into equal intervals, to a step of ``times``, which are not longer
        than `MAX_TRACE_INTERVAL` in the mean.
        """
        wanted = math.ceil(self.last * self.grid / MAX_TRACE_INTERVAL * (1 - 1e-9))
        count = min(wanted, self.last)
        return np.arange(count + 1) * self.last // max(count, 1)


class Limits(NamedTuple):
    """Powers that a part's errors are compared with, each ``(transmitter, receiver)``.

    ``others``: power of all other parts of the part's whole. ``faint``: power of the part's errors
    that is tolerated however weak the whole is.
    """

    others: FloatArray
    faint: FloatArray


class PartTraces:
    """Traces of one part: its paths at the times at which it was traced.

    ``tables`` holds the paths by the number of the time, for the pairs that were traced then;
    ``is_traced`` ``(time, transmitter, receiver)`` says which these were. ``steps``, shaped
    likewise, is the greatest number of time steps to another trace that these paths allow.
    """

    def __init__(self, part: Part, frame: Frame, limits: Limits, first: PropagationPaths) -> None:
        self.part, self.frame, self.limits = part, frame, limits
        shape = len(frame.times), *frame.strongest.shape
        self.tables: dict[int, PropagationPaths] = {}
        self.is_traced = np.zeros(shape, dtype=np.bool_)
        self.steps = np.zeros(shape, dtype=np.int64)
        self._add(0, frame.pairs, first)

    @property
    def num_expected(self) -> float:
        """About the number of pairs to be traced, by their first traces."""
        return float(np.sum(1.0 / self.steps[0][self.is_traced[0]]))

    def trace_all(self, number: int) -> None:
        """Trace all pairs at time ``number``."""
        self._trace(number, self.frame.pairs)

    def trace_between(self, begin: int, end: int) -> bool:
        """Trace half way between two times the pairs that both of their traces there ask for.

        False if there are none.
        """
        nearest = np.minimum(self.steps[begin], self.steps[end])
        is_wanted = self.is_traced[begin] & self.is_traced[end] & (nearest < end - begin)
        pairs = self.frame.pairs
        pairs = pairs[is_wanted[pairs[:, 0], pairs[:, 1]]]
        if len(pairs):
            self._trace((begin + end) // 2, pairs)
        return bool(len(pairs))

    def _trace(self, number: int, pairs: IntArray) -> None:
        frame = self.frame
        paths = self.part.trace(frame.worlds[number], pairs, frame.strongest)
        self._add(number, pairs, paths)

    def _add(self, number: int, pairs: IntArray, paths: PropagationPaths) -> None:
        """Add the paths traced at time ``number`` for ``pairs``."""
        self.tables[number] = paths
        some = pairs[:, 0], pairs[:, 1]
        self.is_traced[number][some] = True
        self.steps[number][some] = self._steps_after(number, paths)[some]

    def _steps_after(self, number: int, paths: PropagationPaths) -> IntArray:
        """Number of time steps to another trace of each pair, ``(transmitter, receiver)``.

        Steps are halved until the error is below its limit. Both directions between two radars get
        the smaller step of the two, so that they are traced together.
        """
        frame, limits = self.frame, self.limits
        step = int(np.max(np.diff(frame.marks), initial=1))
        power = strength(paths, frame.scenes[number])
        whole = limits.others + power_of_pairs(paths, power, len(limits.others))
        allowed = np.maximum(frame.motion_error * whole, limits.faint)
        steps = np.full(allowed.shape, step)
        while step > 1:
            gap = step * frame.grid
            wrong = interpolation_error(gap / paths.coherence_time)
            if gap > self.part.longest * (1 + 1e-9):
                wrong = np.ones_like(wrong)
            is_wrong = power_of_pairs(paths, power * wrong, len(allowed)) > allowed
            is_wrong |= is_wrong.T
            if not np.any(is_wrong):
                break
            shorter = (step + 1) // 2
            steps[is_wrong] = shorter
            step = shorter
        return steps


def trace_together(parts: Sequence[PartTraces]) -> int:
    """Trace parts of one whole during their frame, those due at one time after each other.

    Returns their number.
    """
    for begin, end in pairwise(parts[0].frame.marks.tolist()):
        for part in parts:
            part.trace_all(end)
        _trace_between(parts, begin, end)
    return len(parts)


def _trace_between(parts: Sequence[PartTraces], begin: int, end: int) -> None:
    """Trace parts half way between two times, and so on, until none asks for more."""
    asked = [part.trace_between(begin, end) for part in parts]
    if any(asked):
        middle = (begin + end) // 2
        _trace_between(parts, begin, middle)
        _trace_between(parts, middle, end)


def interpolation_error(gap: FloatArray) -> FloatArray:
    """Power of a path's error half way between traces, as a ratio to the path's power.

    ``gap`` is T/t_c, the time between the traces over the coherence time.

    >>> float(interpolation_error(np.array(0.4)))
    0.0001
    """
    return np.asarray(np.minimum(1.0, gap**2 / 16) ** 2)


def power_of_pairs(paths: PropagationPaths, power: FloatArray, num_radars: int) -> FloatArray:
    """Sums of ``power`` ``(path,)`` for every pair, ``(transmitter, receiver)``."""
    total = np.zeros((num_radars, num_radars))
    np.add.at(total, (paths.transmitter, paths.receiver), power)
    return total


def faint_errors(power: FloatArray, motion_error: float) -> FloatArray:
    """Power of errors that may be tolerated for each pair, shaped like ``power``.

    Errors of own echoes are compared with the power of all own echoes. Errors of signals of other
    radars are compared with the mean power that the receiver gets from one other radar, of which
    they may have the share `FAINT_INTERFERENCE` of ``motion_error``.
    """
    own = np.diagonal(power)
    others = (power.sum(axis=0) - own) / max(len(power) - 1, 1)
    is_own = np.eye(len(power), dtype=bool)
    allowed = FAINT_INTERFERENCE * motion_error * others
    return np.asarray(np.where(is_own, FAINT_ECHO_ERROR * own, allowed))
