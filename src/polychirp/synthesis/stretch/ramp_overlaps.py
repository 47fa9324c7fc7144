"""Ramps of a victim and a transmitter that overlap: when, and at which beats."""

import math
from collections.abc import Collection, Sequence

import numpy as np

from polychirp.model.if_filter import IfFilter
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.synthesis.stretch.kernel_records import (
    BandLimits,
    LinkTable,
    Overlap,
    Ramps,
    ramp_pair,
)


def all_overlaps(
    radar: Radar,
    own: RampSchedule,
    sent: RampSchedule,
    ramps: tuple[Ramps, Ramps],
    links: LinkTable,
    pairs: Collection[tuple[int, int]] | None = None,
) -> list[Overlap]:
    """Every overlap, in order of the victim's and then of the transmitted ramps.

    ``ramps`` has the columns of ``own`` and ``sent``; ``pairs`` are the pairs of a victim's and a
    transmitted ramp to be considered, None for all. In `Overlap.power`, a path whose beat is in
    the band counts with its power or, if the beat crosses the band fast, with the peak power of the
    pulse h(0)/√|μ| that the crossing leaves behind the filter.
    """
    from polychirp.synthesis.stretch.batch_kernels import overlap_of

    half, peak = 0.5 * radar.if_filter.support, _peak(radar.if_filter)
    found = []
    for k in range(own.num_ramps):
        snapshot = links.snapshot[k]
        low, high = int(links.start[snapshot]), int(links.start[snapshot + 1])
        until = float(own.duration[k]) - radar.converter.margin
        band = BandLimits(
            half, float(radar.converter.start), until, float(radar.if_filter.passband), peak
        )
        for i in sent_during(own, sent, links, k):
            if pairs is not None and (k, i) not in pairs:
                continue
            pair = ramp_pair(ramps[0], k, ramps[1], i, links)
            found.append(overlap_of(pair, links, low, high, band))
    return found


def _peak(if_filter: IfFilter) -> float:
    """Impulse response of the filter at its middle, 1/s."""
    return float(if_filter.impulse_response(np.zeros(1))[0])


def strongest_sample(overlaps: Sequence[Overlap]) -> float:
    """About the rms, V, of the samples in which the paths bring most power into the band."""
    return math.sqrt(max((overlap.power for overlap in overlaps), default=0.0))


def sent_during(own: RampSchedule, sent: RampSchedule, links: LinkTable, k: int) -> range:
    """Transmitted ramps that arrive, on some path, while ramp k of the victim lasts."""
    snapshot = links.snapshot[k]
    part = slice(int(links.start[snapshot]), int(links.start[snapshot + 1]))
    if part.start == part.stop:
        return range(0)
    begin, end = float(own.start_time[k]), float(own.end_time[k])
    then = links.reference_time[snapshot]
    delay, drift, beside = links.delay[part], links.delay_rate[part], links.element_delay[part]
    latest = float(np.max(delay + drift * (begin - then))) + float(beside.max())
    earliest = float(np.min(delay + drift * (end - then))) + float(beside.min())
    return range(
        int(np.searchsorted(sent.end_time, begin - latest)),
        int(np.searchsorted(sent.start_time, end - earliest, side="right")),
    )
