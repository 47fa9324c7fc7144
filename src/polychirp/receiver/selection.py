"""The receivers that a study file may name by their ``kind``, and the choice of one for a frame."""

from dataclasses import dataclass, fields
from typing import Annotated, Any, Final, Literal

import numpy as np

from polychirp.errors import CapabilityError, InputError, no_such
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.alternatives.triangular_pairing import refuse_unpaired
from polychirp.receiver.angle.directions import unfit as unfit_array
from polychirp.receiver.angle.doa import AngleEstimator
from polychirp.receiver.angle.elements import Elements
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.decoding.code_limits import (
    refuse_filter,
    refuse_prediction,
    refuse_samples,
    refuse_undecodable,
)
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.subframes import has_subframes, unreadable
from polychirp.receiver.range_doppler.transforms import refuse
from polychirp.receiver.settings import (
    DetectorSettings,
    ReceiverSettings,
    SearchSettings,
    need_dynamic_range,
)
from polychirp.receiver.signal_model.equal_ramps import refuse_code, refuse_steps
from polychirp.receiver.signal_model.transmit_codes import (
    need_own_line,
    virtual_channels,
    virtual_line,
)
from polychirp.receiver.stepped.chain import MfskReceiver
from polychirp.receiver.stepped.staircase import refuse_unstepped
from polychirp.receiver.stepped.step_limits import (
    refuse_ambiguous,
    refuse_early_samples,
    refuse_high_pass,
)
from polychirp.spec import ByKind, chosen_by_kind, kinds_of
from polychirp.units import Ratio

FrameReceiver = CoherentReceiver | RangeDoppler | Decoding | MfskReceiver | PaperReceiver
"""Receivers that read a frame themselves."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AutoReceiver(SearchSettings):
    """The receiver that suits the ramps.

    Equal chirps at equal intervals, or in subframes of such, have one beat for each range, and
    their speeds come from the phases between chirps: they have range-Doppler processing, after
    decoding if chips within them are coded. Steps of constant frequency have the receiver of MFSK.
    The coherent receiver reads all other ramps.

    It chooses `RangeDoppler`, `Decoding`, `MfskReceiver` or `CoherentReceiver`.

    Parameters
    ----------
    dynamic_range : as of the coherent receiver; None for its own default
    """

    dynamic_range: Ratio | None = None
    kind: Literal["auto"] = "auto"

    def __post_init__(self) -> None:
        super(AutoReceiver, self).__post_init__()
        need_dynamic_range(self.dynamic_range)

    def chosen(self, schedule: RampSchedule) -> FrameReceiver:
        """The receiver that reads these ramps, with the settings that it knows."""
        if schedule.code is not None:
            return Decoding(**_shared(Decoding, self))
        if schedule.is_stepped:
            return MfskReceiver(**_shared(MfskReceiver, self))
        kind = CoherentReceiver if unreadable(schedule) else RangeDoppler
        return kind(**_shared(kind, self))


AnyReceiver = Annotated[
    AutoReceiver | CoherentReceiver | RangeDoppler | Decoding | MfskReceiver | PaperReceiver,
    ByKind(default="auto", group="polychirp.receivers", method="detect", base=SearchSettings),
]
"""Receivers of a study, and those of plug-ins; a study file that names no kind has the first."""

RECEIVERS: Final = {
    kind().kind: kind
    for kind in (
        AutoReceiver,
        CoherentReceiver,
        RangeDoppler,
        Decoding,
        MfskReceiver,
        PaperReceiver,
    )
}
"""Class of every receiver that a study may name, by its kind."""


def reason_of_choice(schedule: RampSchedule) -> str:
    """Reason for the choice of `AutoReceiver`, as the end of a sentence."""
    if schedule.code is not None:
        return "its ramps carry a code"
    if schedule.is_stepped:
        return "its ramps are steps of constant frequency"
    reason = unreadable(schedule)
    if reason:
        return reason
    intervals = "intervals in each subframe" if has_subframes(schedule) else "intervals"
    return f"its chirps are equal and follow each other at equal {intervals}"


def refuse_real_samples(receiver: AnyReceiver, schedule: RampSchedule, *, radar: str) -> None:
    """Refuse real samples for a receiver that takes their image for another beat.

    Raises
    ------
    CapabilityError
        The receiver of these ramps is not the range-Doppler receiver, which reads one side of each
        spectrum.
    """
    kind = receiver_for(receiver, schedule).kind
    if kind != "range-doppler":
        raise CapabilityError(
            f"the receiver '{kind}' needs complex samples, and the converter of '{radar}' takes "
            "real ones; set its converter.sampling to 'complex', or use equal chirps, which the "
            "receiver 'range-doppler' reads"
        )


def readable_elements(
    receiver: FrameReceiver, array: AntennaArray, schedule: RampSchedule
) -> Elements:
    """The virtual elements of an array, if the receiver and its estimator of angles can read them.

    Raises
    ------
    CapabilityError
        The coherent and the paper's receiver need a uniform line of virtual elements; the
        estimators have the needs of `angle.directions.unfit`.
    """
    place, _ = virtual_channels(array, schedule.num_elements)
    if not isinstance(receiver, MfskReceiver) and not decodes_elements(receiver):
        need_own_line(array)
        virtual_line(array, schedule.num_elements)
    elements = Elements.of(place, frequency=float(np.mean(schedule.centre_frequency)))
    reason = unfit_array(elements, angle_estimator(receiver))
    if reason:
        raise CapabilityError(reason)
    return elements


def decodes_elements(receiver: FrameReceiver) -> bool:
    """True if the receiver itself separates several transmitting elements by their code."""
    return isinstance(receiver, RangeDoppler | Decoding)


def angle_estimator(receiver: FrameReceiver) -> AngleEstimator:
    """The estimator of angles of a receiver; the paper's receiver has root-MUSIC alone."""
    return receiver.angle if isinstance(receiver, DetectorSettings) else "root-music"


def receiver_for(receiver: AnyReceiver, schedule: RampSchedule) -> FrameReceiver:
    """The receiver itself, or the one that `AutoReceiver` chooses for these ramps."""
    return receiver.chosen(schedule) if isinstance(receiver, AutoReceiver) else receiver


def receiver_of_kind(kind: str, settings: AnyReceiver) -> AnyReceiver:
    """The receiver of this kind, with those of the ``settings`` that it knows.

    A receiver that has this kind already is returned as it is. `InputError` is raised if there is
    no such kind.

    >>> receiver_of_kind("coherent", RangeDoppler(greatest_range=50.0)).greatest_range
    50.0
    """
    if kind == settings.kind:
        return settings
    known = {kinds_of(member)[0]: member for member in chosen_by_kind(AnyReceiver)}
    if kind not in known:
        raise InputError(no_such("receiver", kind, list(known)))
    chosen: Any = known[kind]
    made: AnyReceiver = chosen(**_shared(chosen, settings))
    return made


def _shared(kind: type[ReceiverSettings], settings: ReceiverSettings) -> dict[str, Any]:
    """Values of the settings that a receiver of this kind has as well."""
    known = {field.name for field in fields(kind)} - {"kind"}
    given = {f.name: getattr(settings, f.name) for f in fields(settings) if f.name in known}
    if given.get("dynamic_range", 0.0) is None:
        del given["dynamic_range"]  # the default of the receiver
    return given


def refuse_unreadable(receiver: AnyReceiver, schedule: RampSchedule) -> None:
    """Refuse ramps that the receiver cannot read, with a `CapabilityError` that says why.

    A receiver of a plug-in refuses them by its own method ``refuse``, if it has one.
    """
    own = getattr(receiver, "refuse", None)
    if own is not None:
        own(schedule)
        return
    receiver = receiver_for(receiver, schedule)
    if not isinstance(receiver, MfskReceiver | Decoding):
        refuse_steps(schedule, receiver.kind)
    if not isinstance(receiver, Decoding):
        refuse_code(schedule, f"the receiver '{receiver.kind}' does not remove")
    match receiver:
        case Decoding():
            refuse_undecodable(schedule)
            refuse_prediction(receiver.mitigation)
        case RangeDoppler():
            refuse(unreadable(schedule))
        case MfskReceiver():
            refuse_unstepped(schedule)
            refuse_ambiguous(
                schedule,
                least_range=receiver.least_range,
                greatest_range=receiver.greatest_range,
            )
        case PaperReceiver():
            refuse_unpaired(schedule)
        case _ if np.any(schedule.slope == 0.0):
            flat = int(np.argmax(schedule.slope == 0.0))
            raise CapabilityError(
                f"ramp {flat} has a constant frequency, from whose beat no receiver here reads a "
                "range; give it a slope"
            )


def refuse_unsampled(receiver: AnyReceiver, schedule: RampSchedule, radar: Radar) -> None:
    """Refuse a radar whose samples the receiver of these ramps cannot read.

    Raises
    ------
    CapabilityError, PhysicsError
        The samples of a coded carrier are too few, too slow or too early, or the IF filter takes
        the code from them (`decoding.code_limits`),
        or those of steps are too early or behind a high-pass filter (`stepped.step_limits`).
    """
    chosen = receiver_for(receiver, schedule)
    if isinstance(chosen, Decoding):
        times = sample_times(schedule, radar.converter)
        refuse_samples(schedule, times, greatest_range=chosen.greatest_range)
        passband = radar.if_filter.passband
        refuse_filter(schedule, passband, greatest_range=chosen.greatest_range)
    if isinstance(chosen, MfskReceiver):
        times = sample_times(schedule, radar.converter)
        refuse_early_samples(schedule, times, greatest_range=chosen.greatest_range)
        refuse_high_pass(has_high_pass=radar.front_end.high_pass is not None)
