"""Memory that a study needs, estimated before any of it is allocated."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import InputError
from polychirp.model.if_frame import SampleTimes, parts_of, sample_times
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.alternatives.paper_receiver import PADDING, PaperReceiver
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.selection import AnyReceiver, receiver_for
from polychirp.receiver.settings import range_axis
from polychirp.receiver.signal_model.power_spectra import spectrum_size
from polychirp.study.spec import Study, StudyRadar, victim_indices

MOST_MEMORY: Final = 32 << 30
"""Greatest memory, bytes, of one victim's frame and receiver, and of all frames; chosen."""

SAMPLE_BYTES: Final = 16
"""Size of a complex sample, bytes."""

_SPECTRA: Final = 10
"""Size of the receiver's spectra relative to the frame's samples; chosen above 4, the size of two
copies (as recorded, and without the points found) with two bins for each sample."""

_CELL: Final = 40
"""Bytes for each cell of the coherent map: powers, floors, ratios, logarithms; an estimate."""


def refuse_too_large(study: Study, schedules: Sequence[RampSchedule]) -> None:
    """Refuse a study that needs more than `MOST_MEMORY`, or whose range-rate map is empty.

    Parameters
    ----------
    schedules : schedules of all radars of the study

    Raises
    ------
    InputError
        The message says which radar needs how much memory, and how to reduce it.
    """
    total = 0.0
    for number in victim_indices(study):
        radar, schedule = study.radars[number], schedules[number]
        parts = _parts(study.receiver, radar, schedule)
        total += parts["frame"]
        what, size = max(parts.items(), key=lambda item: item[1])
        if sum(parts.values()) > MOST_MEMORY:
            raise InputError(
                f"radars.{number}: the {_NAMES[what]} of '{radar.name}' takes "
                f"{_shown(size)} of memory, more than {_shown(MOST_MEMORY)}; {_WAYS_OUT[what]}"
            )
        receiver = receiver_for(study.receiver, schedule)
        try:
            if isinstance(receiver, CoherentReceiver | PaperReceiver):
                range_axis(receiver, schedule)
        except InputError as error:
            raise InputError(f"radars.{number}: {error}") from None
    if total > MOST_MEMORY:
        raise InputError(
            f"victims: their frames take {_shown(total)} of memory, more than "
            f"{_shown(MOST_MEMORY)}; name fewer victims, or use fewer sweeps or channels"
        )


_NAMES: Final = {
    "frame": "frame",
    "spectra": "spectra",
    "map": "range-rate map",
}

_WAYS_OUT: Final = {
    "frame": "use fewer sweeps or channels, shorter ramps or a slower converter",
    "spectra": "use fewer sweeps or channels, shorter ramps or a slower converter",
    "map": "lower receiver.greatest_speed or receiver.greatest_range, or use fewer sweeps",
}


def _parts(receiver: AnyReceiver, radar: StudyRadar, schedule: RampSchedule) -> dict[str, float]:
    """Bytes of everything whose size depends on the study, by its name in `_NAMES`."""
    times = sample_times(schedule, radar.converter)
    elements = schedule.num_elements
    frame = {"frame": frame_memory(times, radar)}
    receiver = receiver_for(receiver, schedule)
    if isinstance(receiver, CoherentReceiver):
        return {**frame, "map": map_memory(receiver, schedule, radar)}
    if isinstance(receiver, PaperReceiver):
        lines = float(radar.array.num_channels) * elements * schedule.num_ramps
        return {**frame, "spectra": 2.0 * lines * PADDING * spectrum_size(times) * SAMPLE_BYTES}
    return frame


def frame_memory(times: SampleTimes, radar: StudyRadar) -> float:
    """Bytes of a frame's samples, of their parts and of their spectra."""
    return float(frame_bytes(times, radar)) + float(_padded(times, radar)) * _SPECTRA * SAMPLE_BYTES


def frame_bytes(times: SampleTimes, radar: StudyRadar) -> int:
    """Bytes of a frame's samples and of its parts; all ramps are padded to the longest."""
    return _padded(times, radar) * (1 + len(parts_of(radar))) * SAMPLE_BYTES


def _padded(times: SampleTimes, radar: StudyRadar) -> int:
    return radar.array.num_channels * times.num_samples.size * times.most_samples


def map_memory(receiver: CoherentReceiver, schedule: RampSchedule, radar: StudyRadar) -> float:
    """Bytes of the coherent map, of its floor and ratio, and of the profiles of all ramps."""
    wavelength = SPEED_OF_LIGHT / float(np.max(schedule.centre_frequency))
    span = float(schedule.end_time[-1] - schedule.start_time[0])
    cell = SPEED_OF_LIGHT / (2.0 * float(np.max(schedule.bandwidth)))
    ranges = 2.0 * (receiver.greatest_range - receiver.least_range) / cell
    rates = 8.0 * receiver.greatest_speed * span / wavelength
    channels = radar.array.num_channels * schedule.num_elements
    return rates * (ranges * _CELL + 4.0 * SAMPLE_BYTES * schedule.num_ramps) + (
        4.0 * ranges * channels * schedule.num_ramps * SAMPLE_BYTES
    )


def _shown(size: float) -> str:
    return f"{size / 2**30:.3g} GiB" if math.isfinite(size) else "too much"
