r"""Frames whose chirps are equal, in subframes of different repetition intervals.

Each subframe is read on its own: it gives range rates modulo its span
:math:`S_b = \lambda/2T_b`. Range rates that differ by :math:`\Delta v` look alike only if
:math:`\Delta v` is nearly a multiple of every span. The least such :math:`\Delta v > 0` is the span
of all subframes together.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import Final

import numpy as np

from polychirp.axes import FloatArray, IntArray, axes_of
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.range_doppler.transforms import (
    MOST_UNEVEN,
    repetition_interval,
    unfit,
)
from polychirp.receiver.signal_model.equal_ramps import unequal

LEAST_RAMPS: Final = 8
"""Least number of ramps of a subframe. Chosen: fewer tell no range rates apart behind the taper."""

DISTINCT: Final = 1.0
"""Distance, in Doppler cells of a subframe, from which two range rates differ in it. Chosen: at
20 dB of SNR, it is some five standard deviations of the difference of two subframes."""

FASTEST: Final = 150.0
"""Greatest range rate that is considered, m/s. Chosen: two vehicles of 270 km/h that approach."""


def subframes(schedule: RampSchedule) -> tuple[IntArray, ...]:
    """Numbers of the ramps of each run of three or more at equal intervals, in order of time.

    A ramp between two runs belongs to the later one. The parts do not hold all ramps if some follow
    each other at intervals of their own.

    >>> from polychirp.rng import Streams
    >>> from polychirp.waveform import Subframes
    >>> waveform = Subframes(intervals=(40e-6, 50e-6), ramps_per_subframe=4)
    >>> subframes(waveform.schedule(num_sweeps=8, streams=Streams(seed=1)))
    (array([0, 1, 2, 3]), array([4, 5, 6, 7]))
    """
    gap = np.diff(schedule.start_time)
    change = np.flatnonzero(np.abs(np.diff(gap)) > MOST_UNEVEN * gap[:-1]) + 1
    runs = [run for run in np.split(np.arange(gap.size), change) if run.size > 1]
    parts: list[IntArray] = []
    for run, later in zip_longest(runs, runs[1:]):
        is_shared = later is not None and later[0] == run[-1] + 1
        last = int(run[-1]) if is_shared else int(run[-1]) + 1
        parts.append(np.arange(int(run[0]), last + 1))
    return tuple(parts)


def has_subframes(schedule: RampSchedule) -> bool:
    """True if the ramps are read in subframes; False if they are at equal intervals."""
    return bool(unfit(schedule)) and len(subframes(schedule)) > 1


def unreadable(schedule: RampSchedule) -> str:
    """Reason why the receiver reads ramps neither at once nor in subframes; empty if it can."""
    reason = unfit(schedule)
    if not reason or unequal(schedule):
        return reason
    parts = subframes(schedule)
    if len(parts) < 2:
        return reason
    sizes = [part.size for part in parts]
    if sum(sizes) < schedule.num_ramps or min(sizes) < max(LEAST_RAMPS, max(sizes) // 2):
        return (
            f"its subframes of equal intervals have {', '.join(map(str, sizes))} of its "
            f"{schedule.num_ramps} ramps, and each needs {LEAST_RAMPS} or more and half as many as "
            "the longest (choose a num_sweeps that fills whole subframes)"
        )
    own = [ramps_of(schedule, part) for part in parts]
    for number, part in enumerate(own):
        if unfit(part):
            return f"subframe {number} cannot be read, as {unfit(part)}"
    if not extends(own):
        return "its subframes have too similar intervals to tell more speeds together than alone"
    return ""


def ramps_of(schedule: RampSchedule, ramps: IntArray) -> RampSchedule:
    """Schedule of the ramps with these numbers."""
    kept = {name: getattr(schedule, name)[ramps] for name in axes_of(RampSchedule)}
    return RampSchedule(**kept)


def frame_of(frame: IfFrame, ramps: IntArray) -> IfFrame:
    """Frame of the ramps with these numbers."""
    times = SampleTimes(
        first=frame.times.first[ramps],
        num_samples=frame.times.num_samples[ramps],
        rate=frame.times.rate,
    )
    return replace(
        frame,
        samples=frame.samples[:, ramps, : times.most_samples],
        times=times,
        schedule=ramps_of(frame.schedule, ramps),
    )


def span_of(schedule: RampSchedule) -> float:
    """Range rates λ/2T that ramps at equal intervals T tell apart, m/s; λ is that mid-ramp."""
    wavelength = SPEED_OF_LIGHT / float(schedule.centre_frequency[0])
    return wavelength / (2.0 * repetition_interval(schedule))


def unambiguous_span(schedule: RampSchedule, *, code_length: int = 1) -> float:
    """Span of the range rates that a frame tells apart, m/s, at most twice `FASTEST` in subframes.

    ``code_length`` divides the span of chirps: the sweeps of a code whose folds are not told apart.
    """
    if not has_subframes(schedule):
        return span_of(schedule) / code_length
    own = [ramps_of(schedule, part) for part in subframes(schedule)]
    spans = np.array([span_of(part) for part in own]) / code_length
    return joint_span(spans, spans / [part.num_ramps / code_length for part in own])


def extends(own: Sequence[RampSchedule]) -> bool:
    """True if the subframes tell more range rates together than each of them alone."""
    spans = np.array([span_of(part) for part in own])
    return joint_span(spans, spans / [part.num_ramps for part in own]) > 1.5 * float(spans.max())


def joint_span(spans: FloatArray, cells: FloatArray) -> float:
    """Least range rate, m/s, that all subframes take for none; at most twice `FASTEST`.

    Parameters
    ----------
    spans, cells : m/s, span of range rates and Doppler cell of each subframe

    Examples
    --------
    4 spans of 50 m/s are 5 of 40 m/s:

    >>> joint_span(np.array([50.0, 40.0]), np.array([0.8, 0.6]))
    200.0
    """
    multiples = spans[0] * np.arange(1, int(2.0 * FASTEST / spans[0]) + 1)
    apart = np.abs(wrapped(multiples[:, None], spans)) / cells
    alike = multiples[np.all(apart < DISTINCT, axis=1)]
    return float(alike[0]) if alike.size else 2.0 * FASTEST


def wrapped(rate: FloatArray, span: FloatArray | float) -> FloatArray:
    """Range rates modulo ``span``, within half of it on either side of 0."""
    return np.asarray(rate - span * np.rint(rate / span))
