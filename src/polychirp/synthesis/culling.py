r"""Radars out of hearing: a strict and cheap bound on what each puts into a victim's samples.

A sample is :math:`\int h(s)\,e^{j\phi(s)} ds` over pieces on which both radars stay on one ramp.
There the beat :math:`\dot\phi/2\pi` never comes nearer to zero than some f, and
:math:`\ddot\phi = 2\pi\mu` is constant. Integrating by parts twice, with
:math:`\omega = 2\pi f`, a path of amplitude 1 leaves no more than

.. math:: \sum_{ends} \left(\frac{|h|}{\omega} + \frac{|\dot h|}{\omega^2}
          + \frac{|h||\ddot\phi|}{\omega^3}\right) + \int\left(\frac{|\ddot h|}{\omega^2}
          + \frac{3|\dot h||\ddot\phi|}{\omega^3} + \frac{3|h|\ddot\phi^2}{\omega^4}\right) ds .

Ends are those of the filter's support, where h is all but zero, and of ramps within it: the click
of a transmitter that is switched on or off far out of band is what can be heard of it. No phases,
kernels or links are computed: delays and amplitudes enter by their extremes and sums.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Final

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, IntArray, seal
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_filter import IfFilter, gauss_panels
from polychirp.model.if_frame import SampleTimes, sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.synthesis.links import nearest_snapshots
from polychirp.synthesis.noise import noise_density

NEGLIGIBLE_SHARE: Final = 1e-2
"""Of the rms of the victim's noise: what all radars out of hearing together stay below.

It raises the floor by 0.0004 dB. Less would keep far out-of-band neighbours for the clicks with
which a model's ramps begin and end, which no real transmitter makes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Audience:
    """Whom a victim hears.

    Parameters
    ----------
    heard : numbers of the radars, in the order they were given in
    neglected : V, on the rms over all samples of any channel of all others together: the root of
        the sum of their bounds' squares, as their oscillators' phases have nothing in common
    """

    heard: tuple[int, ...]
    neglected: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Loudness:
    """Bounds on what radars put into a victim's samples.

    Parameters
    ----------
    rms : V, over all samples of a channel, ``(radar,)``
    closest : Hz, least magnitude of the beat while it can reach a sample, ``(radar,)``; ∞ where
        nothing ever arrives
    """

    rms: Annotated[FloatArray, Axes("radar")]
    closest: Annotated[FloatArray, Axes("radar")]

    def __post_init__(self) -> None:
        seal(self)


def audience(
    scene: Scene,
    schedules: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    interferers: Sequence[int],
    share: float = NEGLIGIBLE_SHARE,
) -> Audience:
    """All interferers but those that together stay below ``share`` of the victim's noise (rms).

    Quietest first; one whose beat comes into the IF filter's stop edge is always heard, and so is
    one whose noise may, an oscillator that errs.
    """
    radar = scene.radars[victim]
    loud = loudness(scene, schedules, snapshots, victim=victim, interferers=interferers)
    noise = math.sqrt(noise_density(radar) * radar.if_filter.noise_bandwidth)
    is_clean = np.array(
        [
            radar.oscillator.is_ideal and scene.radars[number].oscillator.is_ideal
            for number in interferers
        ],
        dtype=bool,
    )
    outside = np.flatnonzero((loud.closest > radar.if_filter.stopband) & is_clean)
    order = outside[np.argsort(loud.rms[outside], kind="stable")]
    together = np.sqrt(np.cumsum(loud.rms[order] ** 2))
    count = int(np.searchsorted(together, share * noise, side="right"))
    left_out = set(order[:count].tolist())
    return Audience(
        heard=tuple(number for n, number in enumerate(interferers) if n not in left_out),
        neglected=float(together[count - 1]) if count else 0.0,
    )


def loudness(
    scene: Scene,
    schedules: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    interferers: Sequence[int],
) -> Loudness:
    """The bounds for every one of ``interferers``; a radar without paths has 0 V."""
    radar, own = scene.radars[victim], schedules[victim]
    ears = _Ears.of(radar, own)
    chosen = nearest_snapshots(own, snapshots)
    reach = _reach(scene, own, snapshots, chosen, victim)
    rms, closest = np.zeros(len(interferers)), np.full(len(interferers), math.inf)
    for n, number in enumerate(interferers):
        amplitude = reach.amplitude[chosen, number] * _root_power(
            scene, victim, number, schedules[number].num_elements
        )
        if amplitude.any():
            response, closest[n] = ears.response(
                schedules[number], reach.earliest[number], reach.latest[number], reach.rate[number]
            )
            rms[n] = math.sqrt(float(np.sum((amplitude * response) ** 2)) / ears.num_samples)
    return Loudness(rms=rms, closest=closest)


@dataclass(frozen=True, slots=True, eq=False)
class _Reach:
    """Of every transmitter: path amplitudes summed ``(snapshot, radar)``; delays and rates."""

    amplitude: FloatArray
    earliest: FloatArray
    latest: FloatArray
    rate: FloatArray


def _reach(
    scene: Scene,
    own: RampSchedule,
    snapshots: Sequence[PropagationPaths],
    chosen: IntArray,
    victim: int,
) -> _Reach:
    count = len(scene.radars)
    reach = _Reach(
        np.zeros((len(snapshots), count)),
        np.full(count, math.inf),
        np.full(count, -math.inf),
        np.zeros(count),
    )
    aperture = max(
        np.linalg.norm(scene.radars[victim].array.position, axis=1).max(),
        *(np.linalg.norm(radar.array.transmit_position, axis=1).max() for radar in scene.radars),
    )
    for number in np.unique(chosen):
        paths = snapshots[number]
        here = np.flatnonzero((paths.receiver == victim) & (paths.transmitter != victim))
        sender = paths.transmitter[here]
        served = chosen == number
        first, last = own.start_time[served].min(), own.end_time[served].max()
        away = max(abs(first - paths.reference_time), abs(last - paths.reference_time))
        speed = np.abs(paths.delay_rate[here])
        slack = speed * away + 2.0 * aperture / SPEED_OF_LIGHT
        reach.amplitude[number] = np.bincount(
            sender, weights=_norm(paths.transfer[here]), minlength=count
        )
        np.minimum.at(reach.earliest, sender, paths.delay[here] - slack)
        np.maximum.at(reach.latest, sender, paths.delay[here] + slack)
        np.maximum.at(reach.rate, sender, speed)
    return reach


def _norm(transfer: ComplexArray) -> FloatArray:
    """Largest singular value of matrices ``(…, 2, 2)``: the most that any polarisations couple."""
    square = np.sum(np.abs(transfer) ** 2, axis=(-2, -1))
    product = transfer[..., 0, 0] * transfer[..., 1, 1]
    determinant = product - transfer[..., 0, 1] * transfer[..., 1, 0]
    gap = np.sqrt(np.maximum(square**2 - 4.0 * np.abs(determinant) ** 2, 0.0))
    return np.asarray(np.sqrt(0.5 * (square + gap)))


def _root_power(scene: Scene, victim: int, transmitter: int, num_elements: int) -> float:
    """V, of a path of amplitude 1 along the axes of both antennas, all elements in phase.

    The victim's own errors of gain are not in it, as they scale its noise alike.
    """
    sender, receiver = scene.radars[transmitter], scene.radars[victim]
    elements = np.abs(sender.array.transmitter_response[:num_elements]).sum()
    return float(elements) * math.sqrt(
        sender.transmit_power
        * sender.transmit_gain
        * sender.array.pattern.peak_gain
        * receiver.array.pattern.peak_gain
        * receiver.receive_gain
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Ears:
    """What of other transmitters can reach the victim's samples, ramp by ramp."""

    own: RampSchedule
    times: SampleTimes
    norms: _Norms
    begin: FloatArray
    end: FloatArray
    own_ends: IntArray

    @classmethod
    def of(cls, radar: Radar, own: RampSchedule) -> _Ears:
        times = sample_times(own, radar.converter)
        half = 0.5 * radar.if_filter.support
        first = times.first - half
        last = times.first + (times.num_samples - 1) / times.rate + half
        ends = (first <= own.start_time).astype(np.int64) + (last >= own.end_time)
        return cls(
            own,
            times,
            _norms(radar.if_filter, times.rate),
            np.maximum(first, own.start_time),
            np.minimum(last, own.end_time),
            ends,
        )

    @property
    def num_samples(self) -> int:
        return int(self.times.num_samples.sum())

    def response(
        self, sent: RampSchedule, earliest: float, latest: float, rate: float
    ) -> tuple[FloatArray, float]:
        """Root of the energy of each ramp's samples for a path of 1 V, and the closest beat."""
        first = np.searchsorted(sent.end_time, self.begin - latest)
        count = np.searchsorted(sent.start_time, self.end - earliest, side="right") - first
        count = np.maximum(count, 0)
        k = np.repeat(np.arange(count.size), count)
        i = first[k] + np.arange(k.size) - np.repeat(np.cumsum(count) - count, count)
        closest = np.full(count.size, math.inf)
        np.minimum.at(closest, k, self._beat(sent, k, i, earliest, latest, rate))
        bend = np.zeros(count.size)
        slope = np.abs(self.own.slope[k]) + np.abs(sent.slope[i]) * (1.0 + rate) ** 2
        np.maximum.at(bend, k, slope)
        ends = self.own_ends.copy()
        np.add.at(ends, k, sent.start_time[i] >= self.begin[k] - latest)
        np.add.at(ends, k, sent.end_time[i] <= self.end[k] - earliest)
        energy = self.norms.root_energy(closest, bend, ends, self.times.num_samples)
        return np.where(count > 0, energy, 0.0), float(closest.min())

    def _beat(
        self,
        sent: RampSchedule,
        k: IntArray,
        i: IntArray,
        earliest: float,
        latest: float,
        rate: float,
    ) -> FloatArray:
        """Least magnitude of f_v(t) − f_i(t − τ), linear in t and τ, over a rectangle of both."""
        own = self.own
        begin = np.maximum(self.begin[k], sent.start_time[i] + earliest)
        end = np.minimum(self.end[k], sent.end_time[i] + latest)
        corners = np.stack(
            [
                own.start_frequency[k]
                + own.slope[k] * (t - own.start_time[k])
                - sent.start_frequency[i]
                - sent.slope[i] * (t - delay - sent.start_time[i])
                for t in (begin, end)
                for delay in (earliest, latest)
            ]
        )
        low, high = corners.min(axis=0), corners.max(axis=0)
        away = np.where(low * high <= 0.0, 0.0, np.minimum(np.abs(low), np.abs(high)))
        highest = np.maximum(sent.start_frequency[i], sent.stop_frequency[i])
        # the rectangle may reach past a ramp by the spread of delays
        highest = highest + np.abs(sent.slope[i]) * (latest - earliest)
        return np.asarray(np.maximum(away - rate * highest, 0.0))


@dataclass(frozen=True, slots=True)
class _Norms:
    """Integrals and maxima of a filter's impulse response and its derivatives."""

    integral: tuple[float, float, float]
    peak: tuple[float, float]
    edge: tuple[float, float]
    click: float
    window: float

    def root_energy(
        self, closest: FloatArray, bend: FloatArray, ends: IntArray, num_samples: IntArray
    ) -> FloatArray:
        omega = 2.0 * np.pi * np.minimum(np.maximum(closest, 1.0), 1e15)
        turn = 2.0 * np.pi * bend
        at_edges = 2.0 * (
            self.edge[0] / omega + self.edge[1] / omega**2 + self.edge[0] * turn / omega**3
        )
        inside = (
            self.integral[2] / omega**2
            + 3.0 * turn * self.integral[1] / omega**3
            + 3.0 * turn**2 * self.integral[0] / omega**4
        )
        at_ends = self.peak[1] / omega**2 + self.peak[0] * turn / omega**3
        heard_at_end = np.sqrt(np.minimum(num_samples, self.window))
        clicks = ends * (self.click / omega + heard_at_end * at_ends)
        everywhere = np.sqrt(num_samples)
        return np.asarray(
            np.minimum(clicks + everywhere * (at_edges + inside), everywhere * self.integral[0])
        )


@lru_cache(maxsize=32)
def _norms(if_filter: IfFilter, rate: float) -> _Norms:
    support = if_filter.support
    # two panels to a cycle: |h| has corners at its zeros, which cost the integrals under 1e-4
    node, weight = gauss_panels(8 * math.ceil(support * if_filter.stopband))
    value = np.abs(if_filter.derivatives(0.5 * support * node, 2))
    at_end = np.abs(if_filter.derivatives(np.array([0.5 * support]), 1))[:, 0]
    integral = 1.001 * 0.5 * support * (value @ weight)
    # a click's energy Σ h² depends on where it falls between two samples
    finer = 64 * math.ceil(if_filter.stopband / rate)
    number = np.arange(-math.ceil(support * rate), math.ceil(support * rate) + 1)
    moment = (number + np.arange(finer)[:, None] / finer) / rate
    click = 1.01 * float(np.max(np.sum(if_filter.impulse_response(moment) ** 2, axis=1)))
    return _Norms(
        integral=(float(integral[0]), float(integral[1]), float(integral[2])),
        # maxima between the nodes are missed by less than this
        peak=(1.001 * float(value[0].max()), 1.001 * float(value[1].max())),
        edge=(float(at_end[0]), float(at_end[1])),
        click=math.sqrt(click),
        window=support * rate + 1.0,
    )
