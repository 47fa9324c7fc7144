"""`Staircase`: the two sequences of steps in a schedule, and what a schedule without them lacks."""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError
from polychirp.model.ramp import RampSchedule

MOST_UNEVEN: Final = 1e-3
"""Greatest deviation of a step from its sequence, as a share of the increment of frequency or of
the interval of time. Chosen: at the greatest range that a beat tells, where the phase turns by a
cycle from step to step, such a step is wrong by 0.006 rad."""

FEWEST_STEPS: Final = 8
"""Fewest steps of a sequence. Chosen: a spectrum of fewer has no training cells for a threshold."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Staircase:
    """Two sequences A and B of equal steps in turn, of one sweep.

    Parameters
    ----------
    num_steps : N, of each sequence
    interval : T, s, from step to step of one sequence
    late : s, of a step of B after that of A
    increment : Hz, from step to step of one sequence
    shift : Hz, of B from A
    frequency : Hz, mean of all steps
    """

    num_steps: int
    interval: float
    late: float
    increment: float
    shift: float
    frequency: float

    @classmethod
    def of(cls, schedule: RampSchedule) -> Self:
        """The sequences of a schedule; `CapabilityError` is raised if it has none (`unreadable`).

        >>> from polychirp.rng import Streams
        >>> from polychirp.waveform import Mfsk
        >>> Staircase.of(Mfsk().schedule(num_sweeps=1, streams=Streams(1))).num_steps
        512
        """
        refuse_unstepped(schedule)
        start, frequency = schedule.start_time, schedule.start_frequency
        return cls(
            num_steps=start[::2].size,
            interval=_mean_step(start[::2]),
            late=float(np.mean(start[1::2] - start[::2])),
            increment=_mean_step(frequency[::2]),
            shift=float(np.mean(frequency[1::2] - frequency[::2])),
            frequency=float(np.mean(frequency)),
        )

    @property
    def duration(self) -> float:
        """Duration N T of both sequences, s."""
        return self.num_steps * self.interval

    @property
    def range_cell(self) -> float:
        """Range c/2B that one cell of the spectrum of a sequence amounts to, m."""
        return SPEED_OF_LIGHT / (2.0 * self.num_steps * abs(self.increment))

    @property
    def rate_cell(self) -> float:
        """Range rate λ/2NT that one cell of the spectrum of a sequence amounts to, m/s."""
        return SPEED_OF_LIGHT / (2.0 * self.frequency * self.duration)


def unreadable(schedule: RampSchedule) -> str:
    """Reason why a schedule is no staircase, as the end of a sentence; empty if it is one.

    >>> from polychirp.rng import Streams
    >>> from polychirp.waveform import Sawtooth
    >>> unreadable(Sawtooth().schedule(num_sweeps=4, streams=Streams(seed=1)))
    'its ramps are no steps of constant frequency'
    """
    if not schedule.is_stepped:
        return "its ramps are no steps of constant frequency"
    return _miscounted(schedule) or _uneven(schedule)


def _miscounted(schedule: RampSchedule) -> str:
    """Reason for which elements, sweeps or steps are too many or too few; empty if they fit."""
    if schedule.num_elements > 1:
        return f"{schedule.num_elements} transmitting elements share its sweep"
    if (sweeps := int(schedule.sweep[-1]) + 1) > 1:
        return f"it has {sweeps} sweeps"
    if schedule.num_ramps % 2 or schedule.num_ramps < 2 * FEWEST_STEPS:
        return f"it has {schedule.num_ramps} steps"
    return ""


def _uneven(schedule: RampSchedule) -> str:
    """Reason for which steps are no two different sequences of equal steps; empty if they are."""
    start, frequency = schedule.start_time, schedule.start_frequency
    increment, interval = _mean_step(frequency[::2]), _mean_step(start[::2])
    shift, late = float(frequency[1] - frequency[0]), float(start[1] - start[0])
    number, second = np.divmod(np.arange(schedule.num_ramps), 2)
    off_frequency = frequency - frequency[0] - number * increment - second * shift
    off_time = start - start[0] - number * interval - second * late
    if np.ptp(schedule.duration) > MOST_UNEVEN * schedule.duration[0]:
        return "its steps differ in duration"
    if np.max(np.abs(off_frequency)) > MOST_UNEVEN * abs(increment) or increment == 0.0:
        return "its steps rise by different frequencies"
    if np.max(np.abs(off_time)) > MOST_UNEVEN * interval:
        return "its steps start at different intervals"
    if abs(shift - increment * late / interval) < MOST_UNEVEN * abs(increment):
        return "both sequences are on one line, whose phase says no more than its beat"
    return ""


def refuse_unstepped(schedule: RampSchedule) -> None:
    """Refuse a schedule that is no staircase, with a `CapabilityError` that says why."""
    reason = unreadable(schedule)
    if not reason:
        return
    if not schedule.is_stepped:
        raise CapabilityError(
            f"the receiver 'mfsk' needs steps of two sequences, and of this schedule {reason}; the "
            "receiver 'auto' chooses one that reads it"
        )
    raise CapabilityError(
        "the receiver 'mfsk' needs one sweep of two sequences with equal steps in turn, "
        f"{FEWEST_STEPS} or more in each, from one transmitting element, and of this schedule "
        f"{reason}; use the waveform 'mfsk' with num_sweeps = 1"
    )


def _mean_step(values: FloatArray) -> float:
    return float(values[-1] - values[0]) / (values.size - 1)
