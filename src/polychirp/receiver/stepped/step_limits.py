"""Frames of steps that cannot be read as they are, with the reason and what would work."""

import math
import warnings
from typing import Final

import numpy as np

from polychirp.axes import FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError, ModelWarning, PhysicsError
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.stepped.solution import unambiguous_speed
from polychirp.receiver.stepped.staircase import Staircase

MOST_CELLS_MOVED: Final = 2.0
"""Greatest motion within a sweep, in range cells, without a warning. Chosen: the phase bvt² of the
range's change is then 0.5 cycles at the ends of the sweep, where the taper is small, and an echo
loses 0.9 dB; at twice the motion it loses 2.8 dB."""


def warn_of_motion(stairs: Staircase, range_rate: FloatArray) -> None:
    """Warn, with a `ModelWarning`, of detections that move by several range cells in the sweep."""
    moved = float(np.max(np.abs(range_rate), initial=0.0)) * stairs.duration / stairs.range_cell
    if moved > MOST_CELLS_MOVED:
        warnings.warn(
            f"a detection of the receiver 'mfsk' moves by {moved:.2g} range cells in the sweep, so "
            "that its echo spreads over several beats and is weaker; use a shorter sweep or less "
            "bandwidth",
            ModelWarning,
            stacklevel=3,
        )


def refuse_high_pass(*, has_high_pass: bool) -> None:
    """Refuse a high-pass filter, which removes the beats of steps, with a `CapabilityError`."""
    if has_high_pass:
        raise CapabilityError(
            "the beats of steps are Doppler frequencies about 0 Hz, which the high-pass filter of "
            "the front end removes; leave front_end.high_pass out"
        )


def refuse_early_samples(
    schedule: RampSchedule, times: SampleTimes, *, greatest_range: float
) -> None:
    """Refuse a converter that starts before the echo of its step arrives, with a `PhysicsError`."""
    delay = 2.0 * greatest_range / SPEED_OF_LIGHT
    start = float(np.min(times.first - schedule.start_time))
    if start < delay * (1 - 1e-9):
        raise PhysicsError(
            f"the converter starts {start * 1e6:.4g} µs after a step's start, before echoes from "
            f"the receiver's greatest range of {greatest_range:g} m arrive; set converter.start to "
            f"'{math.ceil(delay * 1e9)} ns' or more, and half the length of the IF filter's "
            "response longer"
        )


def refuse_ambiguous(schedule: RampSchedule, *, least_range: float, greatest_range: float) -> None:
    """Refuse steps on which two ranges within limits, m, look alike at one range rate.

    Range rates within a cell count as one. `CapabilityError` is raised.
    """
    stairs = Staircase.of(schedule)
    speed = unambiguous_speed(
        stairs,
        least_range=least_range,
        greatest_range=greatest_range,
        greatest_speed=stairs.rate_cell,
    )
    if speed < 0.5 * stairs.rate_cell:
        raise CapabilityError(
            f"targets of one speed look alike at two ranges up to {greatest_range:g} m, the "
            "receiver's greatest range; use more steps, less bandwidth or a smaller shift, or "
            "lower receiver.greatest_range"
        )
