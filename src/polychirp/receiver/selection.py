"""The receivers that a study file may name by their ``kind``, and the choice of one for a frame."""

from dataclasses import dataclass, fields
from typing import Annotated, Literal

from polychirp.model.ramp import RampSchedule
from polychirp.receiver.chain import Receiver
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.transforms import unfit
from polychirp.receiver.settings import SearchSettings
from polychirp.spec import ByKind

FrameReceiver = Receiver | RangeDoppler
"""Receivers that read a frame themselves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AutoReceiver(SearchSettings):
    """Range-Doppler processing for equal chirps of one direction, the joint receiver for others.

    Equal chirps at equal intervals have one beat for each range: their speeds come from the phases
    between chirps. Ramps that rise and fall, or differ, tell speeds by their beats as well, which
    the joint receiver needs.
    """

    kind: Literal["auto"] = "auto"

    def chosen(self, schedule: RampSchedule) -> FrameReceiver:
        """The receiver that reads these ramps, with the settings that it knows."""
        kind = Receiver if unfit(schedule) else RangeDoppler
        known = {field.name for field in fields(kind)} - {"kind"}
        return kind(**{f.name: getattr(self, f.name) for f in fields(self) if f.name in known})


AnyReceiver = Annotated[AutoReceiver | Receiver | RangeDoppler, ByKind(default="auto")]
"""Receivers of a study; a study file that names no kind has the first."""


def reason_of_choice(schedule: RampSchedule) -> str:
    """Reason for the choice of `AutoReceiver`, as the end of a sentence."""
    return unfit(schedule) or "its chirps are equal and follow each other at equal intervals"


def receiver_for(receiver: AnyReceiver, schedule: RampSchedule) -> FrameReceiver:
    """The receiver itself, or the one that `AutoReceiver` chooses for these ramps."""
    return receiver.chosen(schedule) if isinstance(receiver, AutoReceiver) else receiver
