"""Which ramps of a victim and a transmitter meet, and at which beats."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import Axes, FloatArray, IntArray, PerPath, seal
from polychirp.model.if_filter import IfFilter
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.synthesis.links import Links


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Overlap:
    """A ramp of the victim and one that arrives, on some path, while it lasts.

    Parameters
    ----------
    victim_ramp, sent_ramp : numbers of the ramps
    rate : Hz/s, of the beat, ``(path,)``
    closest : Hz, least magnitude of the beat while the ramp is sampled, ``(path,)``; ∞ where
        the overlap is over before or begins after
    lowest, highest : Hz, magnitudes between which the beat stays during the overlap and half a
        filter's support around it, ``(path,)``; ∞ and 0 without an overlap
    strength : V, ``(path,)``
    """

    victim_ramp: int
    sent_ramp: int
    rate: PerPath
    closest: PerPath
    lowest: PerPath
    highest: PerPath
    strength: Annotated[FloatArray, Axes("path")]

    def __post_init__(self) -> None:
        seal(self)

    @property
    def centre(self) -> float:
        """Hz/s, half-way between the extreme rates."""
        return 0.5 * float(self.rate.min() + self.rate.max())

    @property
    def spread(self) -> float:
        """Hz/s, of the extreme rates from the centre."""
        return 0.5 * float(np.ptp(self.rate))


def all_overlaps(
    radar: Radar,
    own: RampSchedule,
    sent: RampSchedule,
    links: Sequence[Links],
    chosen: IntArray,
) -> list[Overlap]:
    """Every overlap, in order of the victim's and then of the transmitted ramps.

    ``chosen`` is the number of the links for every ramp of the victim, ``(ramp,)``.
    """
    return [
        _overlap(radar, own, sent, links[chosen[k]], k, i)
        for k in range(own.num_ramps)
        for i in _sent_during(own, sent, links[chosen[k]], k)
    ]


def strongest_sample(if_filter: IfFilter, overlaps: Sequence[Overlap]) -> float:
    """V, an estimate of the strongest sample that one path makes on its way through the band.

    A steady beat passes unchanged, a fast crossing leaves the pulse h(0)/√|μ| of the filter.
    """
    pulse = float(if_filter.impulse_response(np.zeros(1))[0])
    strongest = 0.0
    for overlap in overlaps:
        height = np.minimum(1.0, pulse / np.sqrt(np.maximum(np.abs(overlap.rate), 1e-300)))
        enters = overlap.closest <= if_filter.passband
        strongest = max(strongest, float(np.max(overlap.strength * height * enters)))
    return strongest


def _sent_during(own: RampSchedule, sent: RampSchedule, link: Links, k: int) -> range:
    """Transmitted ramps that arrive, on some path, while ramp k of the victim lasts."""
    if not link.delay.size:
        return range(0)
    begin, end = float(own.start_time[k]), float(own.end_time[k])
    earliest = float(np.min(begin - link.delay_at(begin)))
    latest = float(np.max(end - link.delay_at(end)))
    return range(
        int(np.searchsorted(sent.end_time, earliest)),
        int(np.searchsorted(sent.start_time, latest, side="right")),
    )


def _overlap(
    radar: Radar, own: RampSchedule, sent: RampSchedule, link: Links, k: int, i: int
) -> Overlap:
    """One overlap, by the equations of `kernels.add_contribution`."""
    stretched = 1.0 - link.delay_rate[:, None]
    ahead = own.start_time[k] - sent.start_time[i]
    into = ahead - link.delay_at(float(own.start_time[k]))
    f, g = sent.start_frequency[i], sent.slope[i]
    beat = (own.start_frequency[k] - f) + link.delay_rate[:, None] * f - stretched * g * into
    rate = own.slope[k] - stretched**2 * g
    begin = np.maximum(0.0, -into / stretched)
    end = np.minimum(own.duration[k], (sent.duration[i] - into) / stretched)
    meets = end > begin
    half = 0.5 * radar.if_filter.support
    lowest, highest = _magnitudes(beat, rate, begin - half, end + half)
    begin = np.maximum(begin, radar.converter.start)
    end = np.minimum(end, own.duration[k] - radar.converter.margin)
    closest, _ = _magnitudes(beat, rate, begin, end)
    return Overlap(
        victim_ramp=k,
        sent_ramp=i,
        rate=rate[:, 0],
        closest=np.where(end > begin, closest, math.inf).min(axis=1),
        lowest=np.where(meets, lowest, math.inf).min(axis=1),
        highest=np.where(meets, highest, 0.0).max(axis=1),
        strength=np.abs(link.amplitude * sent.transmit_weight[i, link.transmit_element]),
    )


def _magnitudes(
    beat: FloatArray, rate: FloatArray, begin: FloatArray, end: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest |beat + rate·t| from begin to end."""
    first, last = beat + rate * begin, beat + rate * end
    smaller = np.minimum(np.abs(first), np.abs(last))
    return np.where(first * last <= 0, 0.0, smaller), np.maximum(np.abs(first), np.abs(last))
