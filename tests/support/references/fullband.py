"""The reference engine: it samples the mixer's product at a radio rate and filters by quadrature.

It does not use that the product of two chirps is a chirp, nor compute overlaps: at every instant
the phases of both transmitters are looked up in their schedules, at the retarded time of every path
and element. It is slow, and so for short ramps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.errors import InputError
from polychirp.model.if_frame import sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.spec import Spec
from polychirp.synthesis.links.leakage import all_links, num_parts
from polychirp.synthesis.links.links import Links, nearest_snapshots
from polychirp.units import SamplesPerSecond

_NODES_PER_PANEL = 16
"""Gauss–Legendre nodes of a panel."""

_NODES_PER_BLOCK = 200_000
"""Nodes that are held at once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FullBand(Spec):
    r"""Direct evaluation of :math:`\int h(s)\, y(t - s)\, ds`.

    Nodes lie in Gauss–Legendre panels, so that a wave of frequency f is integrated to rounding
    from about 4|f| nodes per second; panels end wherever a ramp begins or ends at an element, so
    that the jumps there cost no accuracy.

    Parameters
    ----------
    sample_rate : nodes per second; None takes four times the largest beat that can occur between
        the two schedules, in the filter's band or not
    """

    sample_rate: SamplesPerSecond | None = None

    def __post_init__(self) -> None:
        if self.sample_rate is not None and not self.sample_rate > 0:
            raise InputError("the full-band engine needs a positive sample rate")

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
        radar = scene.radars[victim]
        own, sent = schedules[victim], schedules[transmitter]
        links = all_links(
            scene, snapshots, victim=victim, transmitter=transmitter, num_elements=sent.num_elements
        )
        chosen = nearest_snapshots(own, snapshots)
        times = sample_times(own, radar.converter)
        rate = self.sample_rate or 4.0 * (_largest_beat(own, sent) + radar.if_filter.stopband)
        parts = num_parts(radar, is_own=victim == transmitter)
        shape = (parts, radar.array.num_channels, own.num_ramps, times.most_samples)
        out = np.zeros(shape, dtype=np.complex128)
        half = 0.5 * radar.if_filter.support
        for ramp in range(own.num_ramps):
            # from the ramp's start on, times are small and phases keep their digits
            origin = float(own.start_time[ramp])
            mixer = _Mixer(_moved(own, origin), _moved(sent, origin), links, chosen, origin, parts)
            moments = times.time[ramp, : times.num_samples[ramp]] - origin
            for first, last in _blocks(moments, rate, half):
                t = moments[first:last]
                node, weight = _nodes(mixer.corners(t[0] - half, t[-1] + half), t, half, rate)
                weighted = mixer.product(node) * weight
                for n, moment in enumerate(t, start=first):
                    inside = slice(*np.searchsorted(node, [moment - half, moment + half]))
                    response = radar.if_filter.impulse_response(moment - node[inside])
                    out[:, :, ramp, n] = weighted[:, :, inside] @ response
        return out


@dataclass(frozen=True, slots=True)
class _Mixer:
    """The product of both signals, at times counted from ``origin``."""

    own: RampSchedule
    sent: RampSchedule
    links: Sequence[Links]
    chosen: IntArray
    origin: float
    num_parts: int

    def corners(self, begin: float, end: float) -> FloatArray:
        """Every time between ``begin`` and ``end`` at which a ramp begins or ends, in order."""
        own = np.concatenate([self.own.start_time, self.own.end_time])
        sent = np.concatenate([self.sent.start_time, self.sent.end_time, _chip_ends(self.sent)])
        found = [own]
        for link in self.links:
            # u = t − τ(t) solved for t
            late = sent[:, None, None] + link.delay_at(self.origin)
            found.append((late / (1.0 - link.delay_rate[:, None])).ravel())
        every = np.unique(np.concatenate([*found, [begin, end]]))
        return every[(every >= begin) & (every <= end)]

    def product(self, time: FloatArray) -> ComplexArray:
        """Signal before the filter, ``(part, channel, time)``."""
        ramp, is_on = _ramp_at(self.own, time)
        phase = _phase(self.own, ramp, time)
        channels = self.links[0].element_delay.shape[1]
        y = np.zeros((self.num_parts, channels, time.size), dtype=np.complex128)
        for number, link in enumerate(self.links):
            here = np.flatnonzero(is_on & (self.chosen[ramp] == number))
            t = time[here]
            since = t + self.origin - link.reference_time
            for p in range(link.delay.size):
                for m in range(y.shape[1]):
                    late = link.delay[p] + link.element_delay[p, m]
                    late += (link.delay_rate[p] + link.element_delay_rate[p, m]) * since
                    u = t - (late + 0.5 * link.delay_acceleration[p] * since**2)
                    other, sends = _ramp_at(self.sent, u)
                    turns = phase[here] - _phase(self.sent, other, u)
                    beat = np.exp(2j * np.pi * turns) * sends
                    weight = self.sent.transmit_weight[other, link.transmit_element[p]]
                    amplitude = link.amplitude[p] + link.amplitude_rate[p] * since
                    amplitude = amplitude * weight * _chip_at(self.sent, other, u)
                    y[link.part[p], m, here] += np.conj(amplitude) * beat
        return y


def _moved(schedule: RampSchedule, origin: float) -> RampSchedule:
    return replace(schedule, start_time=schedule.start_time - origin)


def _ramp_at(schedule: RampSchedule, time: FloatArray) -> tuple[IntArray, BoolArray]:
    """The last ramp that has begun, and true where it has not ended."""
    ramp = np.searchsorted(schedule.start_time, time, side="right") - 1
    begun = ramp >= 0
    ramp = np.maximum(ramp, 0)
    return ramp.astype(np.int64), begun & (time < schedule.end_time[ramp])


def _phase(schedule: RampSchedule, ramp: IntArray, time: FloatArray) -> FloatArray:
    """Transmitted phase, cycles."""
    into = time - schedule.start_time[ramp]
    return np.asarray(
        schedule.start_phase[ramp]
        + schedule.start_frequency[ramp] * into
        + 0.5 * schedule.slope[ramp] * into**2
    )


def _chip_at(schedule: RampSchedule, ramp: IntArray, time: FloatArray) -> ComplexArray:
    """The chip that is sent at each time; 1 without a code."""
    code = schedule.code
    if code is None:
        return np.ones(time.size, dtype=np.complex128)
    into = (time - schedule.start_time[ramp]) / code.chip_duration[ramp]
    number = np.floor(np.maximum(into, 0.0)).astype(np.int64) % code.num_chips
    return code.value[code.row[ramp], number]


def _chip_ends(schedule: RampSchedule) -> FloatArray:
    """Every time at which a chip ends, s."""
    code = schedule.code
    if code is None:
        return np.zeros(0)
    ends = [
        start + chip * np.arange(1.0, duration / chip)
        for start, duration, chip in zip(
            schedule.start_time, schedule.duration, code.chip_duration, strict=True
        )
    ]
    return np.concatenate(ends)


def _largest_beat(own: RampSchedule, sent: RampSchedule) -> float:
    """Hz, the largest difference between any two frequencies of the two."""
    mine = np.concatenate([own.start_frequency, own.stop_frequency])
    other = np.concatenate([sent.start_frequency, sent.stop_frequency])
    return float(max(mine.max() - other.min(), other.max() - mine.min()))


def _blocks(moments: FloatArray, rate: float, half: float) -> list[tuple[int, int]]:
    """Runs of samples whose nodes fit into a block, as (first, last + 1)."""
    spacing = float(moments[1] - moments[0])
    count = max(1, int((_NODES_PER_BLOCK / rate - 2 * half) / spacing))
    return [(n, min(n + count, moments.size)) for n in range(0, moments.size, count)]


def _nodes(
    corners: FloatArray, moments: FloatArray, half: float, rate: float
) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights of panels between corners and the ends of every sample's window."""
    window = np.concatenate([moments - half, moments + half])
    inside = window[(window >= corners[0]) & (window <= corners[-1])]
    edge = np.unique(np.concatenate([corners, inside]))
    count = np.ceil(np.diff(edge) * rate / _NODES_PER_PANEL).astype(np.int64)
    width = np.repeat(np.diff(edge) / count, count)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    begin = np.repeat(edge[:-1], count) + within * width
    x, w = np.polynomial.legendre.leggauss(_NODES_PER_PANEL)
    node = begin[:, None] + 0.5 * width[:, None] * (x + 1.0)
    return node.ravel(), (0.5 * width[:, None] * w).ravel()
