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
from polychirp.synthesis.links.links import nearest_snapshots
from polychirp.synthesis.links.thermal_noise import noise_density

NEGLIGIBLE_SHARE: Final = 1e-2
"""Of the rms of the victim's noise: what all radars out of hearing together stay below.

It raises the floor by 0.0004 dB. Less would keep far out-of-band neighbours for the clicks with
which a model's ramps begin and end, which no real transmitter makes."""


_ROWS: Final = 1 << 16
"""Ramps of ours times transmitters, at once: some 20 MB."""

_SENT: Final = ("start_time", "end_time", "start_frequency", "stop_frequency", "slope")


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
    number = np.asarray(interferers, dtype=np.int64)
    loudest = reach.amplitude[:, number].max(axis=0, initial=0.0)
    rms, closest = np.zeros(number.size), np.full(number.size, math.inf)
    step = max(1, _ROWS // own.num_ramps)
    audible = np.flatnonzero(loudest > 0.0)
    for begin in range(0, audible.size, step):
        n = audible[begin : begin + step]
        sent = [schedules[i] for i in number[n]]
        response, closest[n] = ears.response(_Crowd.of(sent, reach, number[n]))
        root_power = [
            _root_power(scene, victim, i, plan.num_elements)
            for i, plan in zip(number[n], sent, strict=True)
        ]
        volts = reach.amplitude[chosen][:, number[n]].T * np.array(root_power)[:, None] * response
        rms[n] = np.sqrt(np.sum(volts**2, axis=1) / ears.num_samples)
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
class _Crowd:
    """Transmitters side by side, their ramps end to end; what their paths do at most ``(n, 1)``."""

    schedules: Sequence[RampSchedule]
    earliest: FloatArray
    latest: FloatArray
    rate: FloatArray

    @classmethod
    def of(cls, schedules: Sequence[RampSchedule], reach: _Reach, number: IntArray) -> _Crowd:
        at = number[:, None]
        return cls(schedules, reach.earliest[at], reach.latest[at], reach.rate[at])

    def ramps(self, name: str) -> FloatArray:
        return np.concatenate([getattr(plan, name) for plan in self.schedules])

    def met(self, begin: FloatArray, end: FloatArray) -> tuple[IntArray, IntArray]:
        """First ramp, and number of them, that reach a receiver from begin to end ``(n, k)``."""
        first = np.array(
            [
                np.searchsorted(plan.end_time, early)
                for plan, early in zip(self.schedules, begin - self.latest, strict=True)
            ]
        )
        after = np.array(
            [
                np.searchsorted(plan.start_time, late, side="right")
                for plan, late in zip(self.schedules, end - self.earliest, strict=True)
            ]
        )
        size = np.array([plan.num_ramps for plan in self.schedules])
        return first + (np.cumsum(size) - size)[:, None], np.maximum(after - first, 0)


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

    def response(self, crowd: _Crowd) -> tuple[FloatArray, FloatArray]:
        """Root of the energy of each ramp's samples for a path of 1 V, and the closest beat."""
        shape = (len(crowd.schedules), self.begin.size)
        first, count = crowd.met(self.begin, self.end)
        # one row for each meeting of a transmitter's ramp i with a ramp k of ours
        cell = np.repeat(np.arange(count.size), count.ravel())
        i = np.arange(cell.size) + np.repeat(
            first.ravel() - (np.cumsum(count) - count.ravel()), count.ravel()
        )
        n, k = np.divmod(cell, self.begin.size)
        sent = {name: crowd.ramps(name)[i] for name in _SENT}
        earliest, latest, rate = (
            value[n, 0] for value in (crowd.earliest, crowd.latest, crowd.rate)
        )
        closest, bend = np.full(count.size, math.inf), np.zeros(count.size)
        np.minimum.at(closest, cell, self._beat(k, sent, earliest, latest, rate))
        slope = np.abs(self.own.slope[k]) + np.abs(sent["slope"]) * (1.0 + rate) ** 2
        np.maximum.at(bend, cell, slope)
        ends = (sent["start_time"] >= self.begin[k] - latest).astype(np.int64)
        ends += sent["end_time"] <= self.end[k] - earliest
        all_ends = self.own_ends + np.bincount(cell, ends, count.size).reshape(shape)
        energy = self.norms.root_energy(
            closest.reshape(shape), bend.reshape(shape), all_ends, self.times.num_samples
        )
        return np.where(count > 0, energy, 0.0), closest.reshape(shape).min(axis=1)

    def _beat(
        self,
        k: IntArray,
        sent: dict[str, FloatArray],
        earliest: FloatArray,
        latest: FloatArray,
        rate: FloatArray,
    ) -> FloatArray:
        """Least magnitude of f_v(t) − f_i(t − τ), linear in t and τ, over a rectangle of both."""
        own, spread = self.own, latest - earliest
        begin = np.maximum(self.begin[k], sent["start_time"] + earliest)
        end = np.minimum(self.end[k], sent["end_time"] + latest)
        apart = own.start_frequency[k] - sent["start_frequency"]
        apart += sent["slope"] * (sent["start_time"] + earliest) - own.slope[k] * own.start_time[k]
        drift = own.slope[k] - sent["slope"]
        at_begin, at_end = apart + drift * begin, apart + drift * end
        later = sent["slope"] * spread
        low = np.minimum(at_begin, at_end) + np.minimum(later, 0.0)
        high = np.maximum(at_begin, at_end) + np.maximum(later, 0.0)
        away = np.maximum(np.maximum(low, -high), 0.0)
        highest = np.maximum(sent["start_frequency"], sent["stop_frequency"])
        # the rectangle may reach past a ramp by the spread of delays
        highest = highest + np.abs(later)
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
