"""Spectra and maps of the parts of a frame's samples: echoes, other radars, noise."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.model.spectra import RangeRateMap
from polychirp.receiver.overview.range_rate import range_rate_map
from polychirp.receiver.selection import AnyReceiver, FrameReceiver, receiver_for

V = TypeVar("V")

ALL = "all"
MITIGATED = "all, mitigated"
"""Names of the views of the sum of all parts, before and after mitigation."""


def part_views(
    view: Callable[[FrameReceiver, IfFrame], V],
    receiver: AnyReceiver,
    frame: IfFrame,
    parts: IfParts,
) -> dict[str, V]:
    """Views of each part that is not zero, of `ALL`, and of all that is `MITIGATED`, by name.

    The parts are not mitigated. ``view`` takes a receiver, whose mitigation it applies, and a
    frame: a function of `receiver.overview`.
    """
    reader = receiver_for(receiver, frame.schedule)
    plain = replace(reader, mitigation=None)
    views = {
        name: view(plain, frame.with_samples(parts[name]))
        for name in parts.names
        if np.any(parts[name])
    }
    views[ALL] = view(plain, frame)
    if reader.mitigation is not None:
        views[MITIGATED] = view(reader, frame)
    return views


def part_maps(receiver: AnyReceiver, frame: IfFrame, parts: IfParts) -> dict[str, RangeRateMap]:
    """`part_views` over range and range rate; all maps have the same axes."""
    return part_views(range_rate_map, receiver, frame, parts)
