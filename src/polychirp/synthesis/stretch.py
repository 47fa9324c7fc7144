r"""The production engine: beats in closed form, behind the true IF filter.

A transmitted ramp, received with a delay that is linear in time, is again a linear chirp; its
product with the victim's ramp is a chirp of rate :math:`\mu = b_v - b_i(1-\dot\tau)^2` that lasts
while both do. A sample whose filter window lies within it is the chirp's value times
`chirp_response`; a sample whose window is cut is integrated, or expanded at the cut where the beat
there is far out of band.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.frames import Spec
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import SampleTimes, sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.synthesis.chirp_response import (
    NUM_TERMS,
    bessel_coefficients,
    far_beat,
    num_orders,
    response_table,
    step_of,
    tap_table,
)
from polychirp.synthesis.leakage import all_links, num_parts
from polychirp.synthesis.links import Links, nearest_snapshots
from polychirp.synthesis.noise import noise_density
from polychirp.synthesis.overlaps import Overlap, all_overlaps, strongest_sample

if TYPE_CHECKING:
    from polychirp.synthesis.kernels import Lines, Pairs, Ramps, Taps, Window

NEGLIGIBLE: Final = 1e-7
"""What may be left out of a contribution, relative to its own strongest sample."""

INAUDIBLE: Final = 1e-3
"""The same, relative to the rms of the victim's noise, where nothing comes into the band."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch(Spec):
    """Closed-form synthesis at the converter's rate.

    What it leaves out is 1e-7 of the strongest that one path brings into the band, or, where
    nothing comes into it, one thousandth of the victim's thermal noise; all else is right to 1e-8.
    """

    def contribution(
        self,
        scene: Scene,
        schedules: Sequence[RampSchedule],
        snapshots: Sequence[PropagationPaths],
        *,
        victim: int,
        transmitter: int,
    ) -> ComplexArray:
        """See `SynthesisEngine.contribution`."""
        from polychirp.synthesis import kernels

        radar = scene.radars[victim]
        own, sent = schedules[victim], schedules[transmitter]
        links = [
            all_links(
                scene,
                paths,
                victim=victim,
                transmitter=transmitter,
                num_elements=sent.num_elements,
            )
            for paths in snapshots
        ]
        times = sample_times(own, radar.converter)
        parts = num_parts(radar, is_own=victim == transmitter)
        shape = (parts, radar.array.num_channels, own.num_ramps, times.most_samples)
        real, imag = np.zeros(shape), np.zeros(shape)
        if any(link.delay.size for link in links):
            chosen = nearest_snapshots(own, snapshots)
            overlaps = all_overlaps(radar, own, sent, links, chosen)
            floor = NEGLIGIBLE * strongest_sample(radar.if_filter, overlaps)
            if floor == 0.0:
                noise = noise_density(radar) * radar.if_filter.noise_bandwidth
                floor = INAUDIBLE * math.sqrt(noise)
            kernels.add_contribution(
                real,
                imag,
                _ramps(own),
                _ramps(sent),
                _window(radar.if_filter, own, times),
                _lines(links, chosen, floor),
                _pairs(radar.if_filter, own.num_ramps, overlaps),
                _taps(radar.if_filter),
            )
        samples = np.empty(shape, dtype=np.complex128)
        samples.real, samples.imag = real, imag
        return samples


def _ramps(schedule: RampSchedule) -> Ramps:
    from polychirp.synthesis.kernels import Ramps

    return Ramps(
        start=schedule.start_time,
        duration=schedule.duration,
        frequency=schedule.start_frequency,
        slope=schedule.slope,
        phase=schedule.start_phase,
        weight=np.ascontiguousarray(np.conj(schedule.transmit_weight)),
    )


def _window(if_filter: IfFilter, own: RampSchedule, times: SampleTimes) -> Window:
    from polychirp.synthesis.kernels import Window

    half = 0.5 * if_filter.support
    last = times.first + (times.num_samples - 1) / times.rate
    return Window(
        first=times.first - own.start_time,
        num_samples=times.num_samples,
        step=1.0 / times.rate,
        low=np.searchsorted(own.end_time, times.first - half).astype(np.int64),
        high=np.searchsorted(own.start_time, last + half).astype(np.int64),
    )


def _lines(links: Sequence[Links], chosen: IntArray, floor: float) -> Lines:
    from polychirp.synthesis.kernels import Lines

    return Lines(
        start=np.cumsum([0, *(link.delay.size for link in links)]).astype(np.int64),
        reference_time=np.array([link.reference_time for link in links]),
        chosen=chosen,
        delay=np.concatenate([link.delay for link in links]),
        delay_rate=np.concatenate([link.delay_rate for link in links]),
        element_delay=np.concatenate([link.element_delay for link in links]),
        amplitude=np.conj(np.concatenate([link.amplitude for link in links])),
        limit=np.concatenate([_limits(link, floor) for link in links]),
        part=np.concatenate([link.part for link in links]),
        element=np.concatenate([link.transmit_element for link in links]),
    )


def _limits(link: Links, floor: float) -> FloatArray:
    """Gains below which a path may be left out, ``(path,)``.

    Strong paths share half the floor in proportion to their amplitudes, so that it holds for
    their sum in phase. The many weak ones have unrelated phases and share the rest by powers.
    A path may leave out two ends in a sample.
    """
    strength = np.maximum(np.abs(link.amplitude), 1e-300)
    share = np.maximum(1.0 / strength.sum(), 1.0 / (math.sqrt(strength.size) * strength))
    return np.asarray(0.25 * floor * share)


def _pairs(if_filter: IfFilter, num_ramps: int, overlaps: Sequence[Overlap]) -> Pairs:
    from polychirp.synthesis.kernels import Pairs

    victims = np.array([overlap.victim_ramp for overlap in overlaps], dtype=np.int64)
    start = np.searchsorted(victims, np.arange(num_ramps + 1)).astype(np.int64)
    sent = np.zeros(num_ramps, dtype=np.int64)
    sent[victims[::-1]] = [overlap.sent_ramp for overlap in reversed(overlaps)]
    orders = num_orders(if_filter, max((overlap.spread for overlap in overlaps), default=0.0))
    begin, far = [0], []
    moment, envelope = [np.empty((0, orders), dtype=np.complex128)], [np.empty(0)]
    for overlap in overlaps:
        steepest = abs(overlap.centre) + overlap.spread
        far.append(far_beat(if_filter, steepest))
        # a window that meets beats below `far` is at most this far from the band
        near = far[-1] + 0.5 * if_filter.support * steepest
        if overlap.lowest.min() <= near:
            table = response_table(
                if_filter,
                rate=overlap.centre,
                highest=min(near, float(overlap.highest.max())),
                num_orders=orders,
            )
            moment.append(table.moment)
            envelope.append(table.envelope)
        begin.append(sum(part.size for part in envelope))
    return Pairs(
        start=start,
        sent=sent,
        begin=np.array(begin, dtype=np.int64),
        rate=np.array([overlap.centre for overlap in overlaps]),
        far=np.array(far),
        step=step_of(if_filter),
        moment=np.concatenate(moment),
        envelope=np.concatenate(envelope),
    )


def _taps(if_filter: IfFilter) -> Taps:
    from polychirp.synthesis.kernels import Taps

    table = tap_table(if_filter)
    node, weight = np.polynomial.legendre.leggauss(16)
    return Taps(
        half=0.5 * if_filter.support,
        stopband=if_filter.stopband,
        step=table.step,
        taylor=table.taylor,
        peak=float(np.abs(table.taylor[:, 0]).max()),
        edge=float(abs(table.taylor[0, 0])),
        bessel=bessel_coefficients(NUM_TERMS),
        node=0.5 * (node + 1.0),
        weight=0.5 * weight,
    )
