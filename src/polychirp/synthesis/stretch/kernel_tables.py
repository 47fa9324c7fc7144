"""Tables that the kernels read: ramps, samples, links, pairs of ramps, the filter's responses."""

import math
from collections.abc import Sequence, Set
from itertools import pairwise
from typing import Any, Final

import numpy as np

from polychirp.axes import IntArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.synthesis.links.links import Links
from polychirp.synthesis.stretch.chirp_response import (
    ResponseTable,
    bessel_coefficients,
    far_beat,
    num_orders,
    response_table,
    step_of,
    tap_table,
)
from polychirp.synthesis.stretch.kernel_records import (
    NUM_END_TERMS,
    LinkTable,
    Overlap,
    PairTable,
    Ramps,
    Taps,
    Window,
)

SLOW_RATE_TURN: Final = 1e-4
"""Greatest π·rate·S²/4, rad, at which a response is tabulated about the rate zero.

Chosen: a radar's own echoes and pairs of nearly equal slopes then share one table.
"""

NUM_GAUSS_NODES: Final = 32
"""Number of nodes in a panel of `chirp_kernels.quadrature`; chosen together with `PANEL_CYCLES`."""


def ramps_of(schedule: RampSchedule) -> Ramps:
    """Columns of a schedule, copied: numba would compile again for arrays that are read-only."""
    return Ramps(
        start=np.array(schedule.start_time),
        duration=np.array(schedule.duration),
        frequency=np.array(schedule.start_frequency),
        slope=np.array(schedule.slope),
        phase=np.array(schedule.start_phase),
        # the mixer conjugates the received signal
        weight=np.ascontiguousarray(np.conj(schedule.transmit_weight)),
    )


def window_of(own: RampSchedule, times: SampleTimes) -> Window:
    """The victim's samples on every ramp."""
    return Window(
        first=times.first - own.start_time, num_samples=times.num_samples, step=1.0 / times.rate
    )


def link_table(links: Sequence[Links], snapshot: IntArray) -> LinkTable:
    """All links: those of a snapshot by part, the strong ones first, and then by delay.

    Strong links have more than ten times the mean power (chosen); weak ones are left out earlier.
    """
    is_weak = []
    for link in links:
        power = np.abs(link.amplitude) ** 2
        is_weak.append(power <= 10.0 * (power.mean() if power.size else 0.0))
    order = [
        np.lexsort((link.delay, weak, link.part)) for link, weak in zip(links, is_weak, strict=True)
    ]

    def column(name: str) -> Any:
        parts = [getattr(link, name)[some] for link, some in zip(links, order, strict=True)]
        return np.concatenate(parts)

    return LinkTable(
        start=np.cumsum([0, *(link.delay.size for link in links)]).astype(np.int64),
        reference_time=np.array([link.reference_time for link in links], dtype=np.float64),
        snapshot=snapshot,
        delay=column("delay"),
        delay_rate=column("delay_rate"),
        delay_acceleration=column("delay_acceleration"),
        element_delay=column("element_delay"),
        element_delay_rate=column("element_delay_rate"),
        amplitude=np.conj(column("amplitude")),
        amplitude_rate=np.conj(column("amplitude_rate")),
        limit=np.zeros(sum(link.delay.size for link in links)),
        part=column("part"),
        element=column("transmit_element"),
        is_weak=np.concatenate([weak[some] for weak, some in zip(is_weak, order, strict=True)]),
    )


def with_limits(links: LinkTable, floor: float) -> LinkTable:
    """The links, each with the gain below which it may be left out.

    Strong links share half of ``floor``, V, in proportion to their amplitudes, so that it holds for
    their sum in phase. The many weak ones have unrelated phases and share the rest by powers. The
    limit is half of a link's share, since a link may leave out two ends in a sample.
    """
    limit = np.zeros(links.delay.size)
    for low, high in pairwise(links.start):
        strength = np.maximum(np.abs(links.amplitude[low:high]), 1e-300)
        if strength.size:
            share = np.maximum(1.0 / strength.sum(), 1.0 / (math.sqrt(strength.size) * strength))
            limit[low:high] = 0.25 * floor * share
    return links._replace(limit=limit)


def pair_table(if_filter: IfFilter, overlaps: Sequence[Overlap], used: Set[int]) -> PairTable:
    """All pairs; those ``used`` that come near the band have tables of the filter's response.

    Pairs with nearly steady beats, such as those of own echoes, share the table of rate zero.
    """
    rate, spread = np.array([_rate_range(if_filter, overlap) for overlap in overlaps]).T
    steepest = np.array([overlap.steepest for overlap in overlaps])
    far = np.array([far_beat(if_filter, slope) for slope in steepest])
    # highest beat at the middle of a window that meets beats below `far`
    near = far + 0.5 * if_filter.support * steepest
    highest = np.minimum(near, [overlap.highest for overlap in overlaps])
    wanted = [k for k in used if overlaps[k].lowest <= near[k]]
    orders = num_orders(if_filter, max((float(spread[k]) for k in wanted), default=0.0))
    place: dict[float, tuple[int, int]] = {}
    tables: list[ResponseTable] = []
    span = np.zeros((len(overlaps), 2), dtype=np.int64)
    size = 0
    # the highest beats first, so that a table serves all pairs of its rate
    for k in sorted(wanted, key=lambda k: (-highest[k], k)):
        if rate[k] not in place:
            table = response_table(
                if_filter, rate=float(rate[k]), highest=float(highest[k]), num_orders=orders
            )
            place[rate[k]] = (size, size + table.envelope.size)
            size += table.envelope.size
            tables.append(table)
        span[k] = place[rate[k]]
    return PairTable(
        sent=np.array([overlap.sent_ramp for overlap in overlaps], dtype=np.int64),
        begin=span[:, 0].copy(),
        end=span[:, 1].copy(),
        rate=rate.copy(),
        spread=spread.copy(),
        far=far,
        step=step_of(if_filter),
        moment=np.concatenate([np.empty((0, orders), np.complex128), *(t.moment for t in tables)]),
        envelope=np.concatenate([np.empty(0), *(t.envelope for t in tables)]),
    )


def _rate_range(if_filter: IfFilter, overlap: Overlap) -> tuple[float, float]:
    """Rate of the pair's table, 0 if its beats are slow, and the links' distance from it, Hz/s."""
    if math.pi * overlap.steepest * (0.5 * if_filter.support) ** 2 < SLOW_RATE_TURN:
        return 0.0, overlap.steepest
    return overlap.centre, overlap.spread


def taps_of(if_filter: IfFilter) -> Taps:
    """The filter's impulse response, tabulated for the kernels."""
    table = tap_table(if_filter)
    node, weight = np.polynomial.legendre.leggauss(NUM_GAUSS_NODES)
    return Taps(
        half=0.5 * if_filter.support,
        stopband=if_filter.stopband,
        step=table.step,
        taylor=table.taylor,
        peak=float(np.abs(table.taylor[:, 0]).max()),
        edge=float(abs(table.taylor[0, 0])),
        bessel=bessel_coefficients(NUM_END_TERMS),
        node=0.5 * (node + 1.0),
        weight=0.5 * weight,
    )
