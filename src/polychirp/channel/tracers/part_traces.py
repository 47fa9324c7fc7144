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
makes those of the later one shorter. If the later one asks for a shorter time, the part is traced
half way too, and so on.

Limits: amplitudes and shadows between traces are interpolated, not traced. Paths over several
bodies change faster than their coherence times say, because ray tubes come and go at edges as the
bodies move. Nor do coherence times say how fast shadows change, or waves over edges, which
therefore state the longest time between two traces.
"""

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.channel.base import Part, gather, strength
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

MAX_TRACE_INTERVAL: Final = 16e-3
"""Greatest time between two traces of a part, s.

A limit is needed because shadows move, which coherence times do not include. Chosen: decision 7
compares 8, 16 and 32 ms."""


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
        self._latest = np.zeros(shape[1:], dtype=np.int64)
        self._due = np.minimum(self.steps[0], frame.last)

    @property
    def num_expected(self) -> float:
        """About the number of pairs to be traced, by their first traces."""
        return float(np.sum(1.0 / self.steps[0][self.is_traced[0]]))

    def trace_due(self, number: int) -> None:
        """Trace the pairs that are due at time ``number``, and before it if that was too late."""
        pairs = self.frame.pairs
        pairs = pairs[self._due[pairs[:, 0], pairs[:, 1]] == number]
        if not len(pairs):
            return
        self._trace(number, pairs)
        some = pairs[:, 0], pairs[:, 1]
        begin = self._latest[some]
        for start in np.unique(begin):
            self._trace_between(int(start), number, pairs[begin == start])
        self._latest[some] = number
        # traces are due at multiples of the step, so that pairs with different steps coincide
        step = self.steps[number][some]
        self._due[some] = np.minimum((number // step + 1) * step, self.frame.last)

    def _trace_between(self, begin: int, end: int, pairs: IntArray) -> None:
        """Trace pairs between two traces of them until all are as near as both ends ask for."""
        least = np.minimum(self.steps[begin], self.steps[end])
        pairs = pairs[least[pairs[:, 0], pairs[:, 1]] < end - begin]
        if len(pairs):
            middle = (begin + end) // 2
            self._trace(middle, pairs)
            self._trace_between(begin, middle, pairs)
            self._trace_between(middle, end, pairs)

    def _trace(self, number: int, pairs: IntArray) -> None:
        frame = self.frame
        paths = self.part.trace(frame.worlds[number], pairs, frame.strongest)
        self._add(number, pairs, paths)

    def _add(self, number: int, pairs: IntArray, paths: PropagationPaths) -> None:
        """Add the paths traced at time ``number`` for ``pairs``."""
        earlier = self.tables.get(number)
        self.tables[number] = paths if earlier is None else gather([earlier, paths])
        some = pairs[:, 0], pairs[:, 1]
        self.is_traced[number][some] = True
        self.steps[number][some] = self._steps_after(number, paths)[some]

    def _steps_after(self, number: int, paths: PropagationPaths) -> IntArray:
        """Number of time steps to another trace of each pair, ``(transmitter, receiver)``.

        Steps are halved until the error is below its limit. Both directions between two radars get
        the smaller step of the two, so that they are traced together.
        """
        frame, limits = self.frame, self.limits
        step = max(1, int(MAX_TRACE_INTERVAL / frame.grid * (1 + 1e-9)))
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
