"""Frames that a radar cannot sample, or that its receiver cannot read."""

from polychirp.errors import CapabilityError, PhysicsError
from polychirp.model.if_frame import sample_times
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation.base import refuse_unfit
from polychirp.receiver.selection import (
    readable_elements,
    receiver_for,
    refuse_unreadable,
    refuse_unsampled,
)
from polychirp.receiver.signal_model.transmit_codes import code_blocks
from polychirp.study.limits.derived_radar import DerivedRadar
from polychirp.study.spec import Study, StudyRadar


def refuse_undersampled(
    study: Study, radar: StudyRadar, derived: DerivedRadar, *, number: int
) -> None:
    """Refuse a radar that cannot sample the beats of echoes from the receiver's greatest range."""
    limit = min(radar.if_filter.stopband, 0.5 * radar.converter.sample_rate)
    if derived.beat_band[1] > limit:
        raise PhysicsError(
            f"radars.{number}: echoes from {study.receiver.greatest_range:g} m, the receiver's "
            f"greatest range, beat at {_hertz(derived.beat_band[1])} on the steepest ramp, "
            f"and '{radar.name}' samples no more than {_hertz(limit)}; use slower ramps, less "
            "bandwidth, a smaller range or a faster converter"
        )


def _hertz(frequency: float) -> str:
    """A frequency as text, in MHz from 1 MHz on and in kHz below."""
    if frequency >= 1e6:
        return f"{frequency / 1e6:.4g} MHz"
    return f"{frequency / 1e3:.4g} kHz"


def refuse_unread(study: Study, schedule: RampSchedule, *, number: int) -> None:
    """Refuse a victim whose ramps, or whose array and its coding, its receiver cannot read."""
    try:
        refuse_unreadable(study.receiver, schedule)
    except CapabilityError as error:
        raise CapabilityError(f"radars.{number}.waveform: {error}") from None
    if schedule.num_elements > 1:
        try:
            code_blocks(schedule)
        except CapabilityError as error:
            raise CapabilityError(f"radars.{number}.coding: {error}") from None
    try:
        refuse_unsampled(study.receiver, schedule, study.radars[number])
    except (CapabilityError, PhysicsError) as error:
        raise type(error)(f"radars.{number}: {error}") from None
    try:
        readable_elements(
            receiver_for(study.receiver, schedule), study.radars[number].array, schedule
        )
    except CapabilityError as error:
        raise CapabilityError(f"radars.{number}.array: {error}") from None


def refuse_unrepaired(study: Study, schedule: RampSchedule, *, number: int) -> None:
    """Refuse a victim whose ramps, samples or array the receiver's mitigation cannot repair."""
    radar = study.radars[number]
    try:
        refuse_unfit(
            study.receiver.mitigation,
            schedule,
            times=sample_times(schedule, radar.converter),
            is_real=radar.converter.is_real,
            num_channels=radar.array.num_channels,
        )
    except CapabilityError as error:
        raise CapabilityError(f"receiver.mitigation, of radars.{number}: {error}") from None
