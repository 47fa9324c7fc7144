"""Ramps that count as equal, from one to the next, and the refusal of codes and of steps."""

from typing import Final

import numpy as np

from polychirp.errors import CapabilityError
from polychirp.model.ramp import RampSchedule

LARGEST_DIFFERENCE: Final = 1e-6
"""Greatest relative difference of ramps that count as equal. Chosen above the drift of a clock in a
frame, 5e-7 at 10 ppm/s in 50 ms: it turns the phase of an echo from 50 m by 0.013 cycles."""

LEAST_CODED_TURN: Final = 0.05
"""Least change of the turn between ramps that a code makes, cycles; chosen below codes of eight
phases, and above the drift of a clock."""


def unequal(schedule: RampSchedule) -> str:
    """Reason why ramps do not count as equal, as the end of a sentence; empty if they do."""
    if schedule.num_ramps < 2:
        return "it has a single ramp"
    for name, values in (
        ("slope", schedule.slope),
        ("start frequency", schedule.start_frequency),
        ("duration", schedule.duration),
    ):
        if not np.allclose(values, values[0], rtol=LARGEST_DIFFERENCE, atol=0.0):
            return f"its ramps differ in {name}"
    return ""


def phases_are_coded(schedule: RampSchedule) -> bool:
    """True if start phases do not just turn evenly from ramp to ramp.

    >>> from polychirp.rng import Streams
    >>> from polychirp.waveform import PhaseCodedSawtooth, Sawtooth
    >>> equal, coded = (
    ...     waveform.schedule(num_sweeps=16, streams=Streams(1))
    ...     for waveform in (Sawtooth(), PhaseCodedSawtooth())
    ... )
    >>> phases_are_coded(equal), phases_are_coded(coded)
    (False, True)
    """
    bend = np.diff(schedule.start_phase, 2)
    return bool(np.any(np.abs(bend - np.rint(bend)) > LEAST_CODED_TURN))


def refuse_code(
    schedule: RampSchedule,
    reason: str,
    *,
    instead: str = "the receivers 'auto' and 'decoding' read it",
) -> None:
    """Refuse ramps that carry a code, with a `CapabilityError`.

    Parameters
    ----------
    reason : end of a sentence about the code, as "the receiver 'paper' does not remove"
    instead : sentence that says what works
    """
    if schedule.code is not None:
        raise CapabilityError(f"its ramps carry a code, which {reason}; {instead}")


def refuse_steps(schedule: RampSchedule, kind: str) -> None:
    """Refuse steps of constant frequency for a receiver that reads ranges from ramps.

    Parameters
    ----------
    kind : of the receiver

    Raises
    ------
    CapabilityError
        All ramps hold their frequencies (`RampSchedule.is_stepped`).
    """
    if schedule.is_stepped:
        raise CapabilityError(
            "its ramps are steps of constant frequency, from whose beats the receiver "
            f"'{kind}' reads no range; the receivers 'auto' and 'mfsk' read two sequences of steps"
        )
