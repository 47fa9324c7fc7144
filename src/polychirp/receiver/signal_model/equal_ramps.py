"""Ramps that count as equal, so that samples of one number can be compared from ramp to ramp."""

from typing import Final

import numpy as np

from polychirp.model.ramp import RampSchedule

LARGEST_DIFFERENCE: Final = 1e-6
"""Greatest relative difference of ramps that count as equal. Chosen above the drift of a clock in a
frame, 5e-7 at 10 ppm/s in 50 ms: it turns the phase of an echo from 50 m by 0.013 cycles."""


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
