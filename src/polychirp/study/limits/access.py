"""Rules of access whose settings do not keep radars apart, or do not fit their frames."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.study.spec import Study
from polychirp.waveform.access import Compass, Slots
from polychirp.waveform.frame_rules import FrameRule

SAME_SLOPE: Final = 1e-3
"""Difference of slopes, relative, up to which slots keep radars apart; chosen: ramps of 1 GHz are
then apart by 1 MHz more or less at their end."""

_ROUNDING: Final = 1e-9
"""Relative excess of a frame over its interval that is an error of rounding; chosen."""


def access_in_vain(study: Study, schedules: Sequence[RampSchedule]) -> Iterator[str]:
    """A sentence for settings of the rule that leave radars in each other's bands.

    Chirps of slope b that begin a slot apart are apart by b times the slot in frequency, which must
    exceed the stop edge of the IF filter; the way between radars, which adds to that or takes from
    it, is not counted. Bands must be apart by more than a radar's frame covers.
    """
    rule = study.access
    if len(study.radars) < 2:
        return
    if isinstance(rule, Slots) and rule.num_slots > 1:
        steepness = np.concatenate([np.abs(schedule.slope) for schedule in schedules])
        if float(np.ptp(steepness)) > SAME_SLOPE * float(steepness.max()):
            yield (
                f"access.kind = 'slots' keeps radars of equal slopes apart, and theirs reach from "
                f"{1e-12 * float(steepness.min()):.3g} to {1e-12 * float(steepness.max()):.3g} "
                "MHz/us, so that their ramps cross; give all radars the same ramps, such as "
                "waveform.kind = 'sawtooth' or 'triangular'"
            )
            return
        radar, needed = max(
            (
                (radar.name, radar.if_filter.stopband / float(abs(schedule.slope).min()))
                for radar, schedule in zip(study.radars, schedules, strict=True)
                if schedule.slope.all()
            ),
            key=lambda one: one[1],
            default=("", 0.0),
        )
        if rule.slot < needed:
            yield (
                f"access.slot is {1e6 * rule.slot:.3g} us, and the IF filter of '{radar}' passes "
                f"chirps that begin up to {1e6 * needed:.3g} us apart: radars of neighbouring "
                "slots disturb each other; lengthen the slot"
            )
    if isinstance(rule, Compass):
        occupied = [schedule.occupied for schedule in schedules]
        widest = max(float(high.max() - low.min()) for low, high in occupied)
        if rule.spacing < widest:
            yield (
                f"access.spacing is {1e-6 * rule.spacing:.4g} MHz, and a frame covers "
                f"{1e-6 * widest:.4g} MHz: radars of neighbouring bands disturb each other; widen "
                "the spacing"
            )


def refuse_long_frames(study: Study, schedules: Sequence[RampSchedule]) -> None:
    """Raise `InputError` if a frame is longer than the interval from frame to frame."""
    if not isinstance(study.access, FrameRule):
        return
    interval = study.access.frame_interval
    for radar, schedule in zip(study.radars, schedules, strict=True):
        length = float(schedule.end_time[-1] - schedule.start_time[0])
        if length > interval * (1.0 + _ROUNDING):
            raise InputError(
                f"access.frame_interval: a frame of radar '{radar.name}' lasts "
                f"{1e3 * length:.4g} ms, and the next one begins after {1e3 * interval:.4g} ms; "
                "lengthen frame_interval, or shorten frames"
            )
