"""Range-rate maps of the parts of a frame's samples: echoes, other radars, noise."""

from dataclasses import replace

import numpy as np

from polychirp.errors import CapabilityError
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.model.spectra import RangeRateMap
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.range_doppler.subframes import has_subframes
from polychirp.receiver.selection import AnyReceiver, receiver_for
from polychirp.study.random_draw import sample_street
from polychirp.study.spec import Study, schedules_of, victim_indices


def refuse_maps(study: Study) -> None:
    """Refuse, with a `CapabilityError`, a study with a victim that has no range-rate map."""
    study = sample_street(study)
    schedules = schedules_of(study)
    for number in victim_indices(study):
        schedule = schedules[number]
        receiver = receiver_for(study.receiver, schedule)
        if not isinstance(receiver, RangeDoppler) or has_subframes(schedule):
            raise CapabilityError(
                f"'{study.radars[number].name}' has no range-rate map of its parts, which needs "
                "equal chirps at equal intervals and the receiver 'range-doppler'; leave --maps "
                "out, or choose such chirps"
            )


def part_maps(receiver: AnyReceiver, frame: IfFrame, parts: IfParts) -> dict[str, RangeRateMap]:
    """Maps by name: each part that is not zero, ``all`` of them, and ``all, mitigated``.

    The parts are not mitigated. All maps have the same axes. The frame must be one that
    `refuse_maps` does not refuse.
    """
    reader = receiver_for(receiver, frame.schedule)
    assert isinstance(reader, RangeDoppler)
    plain = replace(reader, mitigation=None)
    maps = {
        name: plain.spectra(frame.with_samples(parts[name])).mean_power
        for name in parts.names
        if np.any(parts[name])
    }
    maps["all"] = plain.spectra(frame).mean_power
    if reader.mitigation is not None:
        maps["all, mitigated"] = reader.spectra(frame).mean_power
    return maps
