"""Rates of `ChirpSubtraction` on traced streets that are not in the benchmark's set.

``python -m tools.experiments.chirp_subtraction_rates KIND FRAMES`` draws frames of a kind of
`STREETS` from streams of their own, and prints the share of ramps that the method changes on the
frames and on their clean forms, the EVM that it makes of the clean ones, and the floor before and
after, frame by frame.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.receiver.mitigation import ChirpSubtraction
from polychirp.receiver.mitigation.base import mitigated
from polychirp.rng import Streams
from polychirp.study.mitigation.measures import measured_frame, measures
from polychirp.study.mitigation.street_frames import STREETS, street_frame

SEED = 20_263
"""Seed of the streams, on none of which a limit was chosen; the set has 0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rates:
    """Shares of ramps that change, and measures of a frame, dB; EVM as a ratio."""

    changed: float
    changed_clean: float
    clean_evm: float
    floor_before: float
    floor_after: float
    sinr_before: float
    sinr_after: float


def rates_of(kind: str, number: int) -> Rates:
    """Rates on a frame of a kind of street."""
    drawn = street_frame(Streams(SEED).of("fresh", kind, number), STREETS[kind])
    on = measured_frame(*drawn)
    method = ChirpSubtraction()
    after, unspoilt = method.mitigate(on.frame), method.mitigate(on.clean)
    before, cleaned = measures(on, mitigated(None, on.frame)), measures(on, after)
    return Rates(
        changed=_share(after.samples - on.frame.samples),
        changed_clean=_share(unspoilt.samples - on.clean.samples),
        clean_evm=measures(on, unspoilt)["evm"],
        floor_before=before["floor_rise"],
        floor_after=cleaned["floor_rise"],
        sinr_before=before["sinr_range"],
        sinr_after=cleaned["sinr_range"],
    )


def _share(change: ComplexArray) -> float:
    """Share of the ramps of a difference ``(channel, ramp, fast)`` that are not zero."""
    return float(np.mean(np.any(np.abs(change) > 1e-9, axis=(0, 2))))


if __name__ == "__main__":
    for frame_number in range(int(sys.argv[2])):
        one = rates_of(sys.argv[1], frame_number)
        print(
            f"{frame_number}: ramps changed {one.changed:.1%}, of the clean frame "
            f"{one.changed_clean:.1%} with an EVM of {one.clean_evm:.2%}; floor "
            f"{one.floor_before:.1f} to {one.floor_after:.1f} dB, SINR {one.sinr_before:.1f} to "
            f"{one.sinr_after:.1f} dB",
            flush=True,
        )
