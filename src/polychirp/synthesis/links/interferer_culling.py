r"""Inaudible radars: an upper bound on each one's interference finds those that can be left out.

A sample is :math:`\int h(s)\,e^{j\phi(s)} ds`, with the impulse response h of the IF filter, over
pieces on which both radars stay on one ramp. There the magnitude of the beat frequency
:math:`\dot\phi/2\pi` is at least f, and :math:`\ddot\phi = 2\pi\mu` is constant. Two integrations
by parts, with :math:`\omega = 2\pi f`, show that a sample of a path of amplitude 1 is at most

.. math:: \sum_{ends} \left(\frac{|h|}{\omega} + \frac{|\dot h|}{\omega^2}
          + \frac{|h||\ddot\phi|}{\omega^3}\right) + \int\left(\frac{|\ddot h|}{\omega^2}
          + \frac{3|\dot h||\ddot\phi|}{\omega^3} + \frac{3|h|\ddot\phi^2}{\omega^4}\right) ds .

The sum is over the ends of the filter's support, where h is nearly zero, and over ends of ramps
within the support: a transmitter far out of band contributes only a click when a ramp begins or
ends. The bound is cheap, as it needs only the extremes of the paths' delays and the sums of their
amplitudes, no phases. Interferers that are not *audible* by this bound are left out of the victim's
samples.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Final

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, IntArray, Sealed
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
"""Limit of the rms of all inaudible radars together, relative to the rms of the victim's noise.

Chosen: with 1e-2, what is left out would raise the noise floor by 0.0004 dB at most. A smaller
limit would keep radars far out of band because of clicks, which come from the abrupt begin and end
of the modelled ramps and not from real transmitters."""

_ROWS_PER_BLOCK: Final = 1 << 16
"""Greatest product of victim's ramps and transmitters that are computed together; chosen, as the
arrays then take some 20 MB."""

_SENT_COLUMNS: Final = ("start_time", "end_time", "start_frequency", "stop_frequency", "slope")


@dataclass(frozen=True, slots=True, kw_only=True)
class AudibleRadars:
    """The radars that a victim receives.

    Parameters
    ----------
    numbers : of the radars, in the order in which they were given
    neglected : V, bound on the rms of all others together, over all samples of any one channel: it
        is the root of the sum of their bounds' squares, as their phases are independent
    """

    numbers: tuple[int, ...]
    neglected: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class InterferenceBounds(Sealed):
    """Bounds on the interference of radars in a victim's samples.

    Parameters
    ----------
    rms : V, over all samples of a channel, ``(radar,)``
    closest : Hz, least magnitude of the beat frequency at times within the filter's support of any
        sample, ``(radar,)``; ∞ if no signal arrives
    """

    rms: Annotated[FloatArray, Axes("radar")]
    closest: Annotated[FloatArray, Axes("radar")]


def audible_radars(
    scene: Scene,
    schedules: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    interferers: Sequence[int],
    share: float = NEGLIGIBLE_SHARE,
) -> AudibleRadars:
    """All interferers but the weakest, whose rms together is ``share`` of the noise's rms at most.

    An interferer is always audible if its beat frequency comes within the IF filter's stop edge. It
    is audible too if its or the victim's oscillator is not ideal, as its noise may reach the
    passband, or if its ramps carry a code, whose spectrum has no end.
    """
    radar = scene.radars[victim]
    bounds = interference_bounds(
        scene, schedules, snapshots, victim=victim, interferers=interferers
    )
    noise = math.sqrt(noise_density(radar) * radar.if_filter.noise_bandwidth)
    is_clean = np.array(
        [
            radar.oscillator.is_ideal
            and scene.radars[number].oscillator.is_ideal
            and schedules[number].code is None
            for number in interferers
        ],
        dtype=bool,
    )
    outside = np.flatnonzero((bounds.closest > radar.if_filter.stopband) & is_clean)
    order = outside[np.argsort(bounds.rms[outside], kind="stable")]
    together = np.sqrt(np.cumsum(bounds.rms[order] ** 2))
    count = int(np.searchsorted(together, share * noise, side="right"))
    left_out = set(order[:count].tolist())
    return AudibleRadars(
        numbers=tuple(number for n, number in enumerate(interferers) if n not in left_out),
        neglected=float(together[count - 1]) if count else 0.0,
    )


def interference_bounds(
    scene: Scene,
    schedules: Sequence[RampSchedule],
    snapshots: Sequence[PropagationPaths],
    *,
    victim: int,
    interferers: Sequence[int],
) -> InterferenceBounds:
    """The bounds of all ``interferers``; an interferer without a path to the victim has 0 V."""
    radar, own = scene.radars[victim], schedules[victim]
    band = _VictimBand.of(radar, own)
    chosen = nearest_snapshots(own, snapshots)
    extremes = _path_extremes(scene, own, snapshots, chosen, victim)
    number = np.asarray(interferers, dtype=np.int64)
    strongest = extremes.amplitude[:, number].max(axis=0, initial=0.0)
    rms, closest = np.zeros(number.size), np.full(number.size, math.inf)
    step = max(1, _ROWS_PER_BLOCK // own.num_ramps)
    arriving = np.flatnonzero(strongest > 0.0)
    for begin in range(0, arriving.size, step):
        n = arriving[begin : begin + step]
        sent = [schedules[i] for i in number[n]]
        response, closest[n] = band.response(_Interferers.of(sent, extremes, number[n]))
        root_power = [
            _root_power(scene, victim, i, schedule.num_elements)
            for i, schedule in zip(number[n], sent, strict=True)
        ]
        volts = (
            extremes.amplitude[chosen][:, number[n]].T * np.array(root_power)[:, None] * response
        )
        rms[n] = np.sqrt(np.sum(volts**2, axis=1) / band.num_samples)
    return InterferenceBounds(rms=rms, closest=closest)


@dataclass(frozen=True, slots=True, eq=False)
class _PathExtremes:
    """Sums of amplitudes ``(snapshot, radar)``; extremes of delays, s, and rates ``(radar,)``."""

    amplitude: FloatArray
    earliest: FloatArray
    latest: FloatArray
    rate: FloatArray


def _path_extremes(
    scene: Scene,
    own: RampSchedule,
    snapshots: Sequence[PropagationPaths],
    chosen: IntArray,
    victim: int,
) -> _PathExtremes:
    count = len(scene.radars)
    extremes = _PathExtremes(
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
        extremes.amplitude[number] = np.bincount(
            sender, weights=_norm(paths.transfer[here]), minlength=count
        )
        np.minimum.at(extremes.earliest, sender, paths.delay[here] - slack)
        np.maximum.at(extremes.latest, sender, paths.delay[here] + slack)
        np.maximum.at(extremes.rate, sender, speed)
    return extremes


def _norm(transfer: ComplexArray) -> FloatArray:
    """Largest singular value of matrices ``(…, 2, 2)``: bound for any two polarisations."""
    square = np.sum(np.abs(transfer) ** 2, axis=(-2, -1))
    product = transfer[..., 0, 0] * transfer[..., 1, 1]
    determinant = product - transfer[..., 0, 1] * transfer[..., 1, 0]
    gap = np.sqrt(np.maximum(square**2 - 4.0 * np.abs(determinant) ** 2, 0.0))
    return np.asarray(np.sqrt(0.5 * (square + gap)))


def _root_power(scene: Scene, victim: int, transmitter: int, num_elements: int) -> float:
    """Received voltage, V, by a path of amplitude 1 at the peak gain of both antennas.

    All transmitting elements add in phase. The gain errors of the victim's channels are left out,
    as they scale its noise by the same factor.
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
class _Interferers:
    """Schedules of n transmitters, and extremes of their paths' delays and rates ``(n, 1)``."""

    schedules: Sequence[RampSchedule]
    earliest: FloatArray
    latest: FloatArray
    rate: FloatArray

    @classmethod
    def of(
        cls, schedules: Sequence[RampSchedule], paths: _PathExtremes, number: IntArray
    ) -> "_Interferers":
        at = number[:, None]
        return cls(schedules, paths.earliest[at], paths.latest[at], paths.rate[at])

    def ramps(self, name: str) -> FloatArray:
        return np.concatenate([getattr(schedule, name) for schedule in self.schedules])

    def arriving(self, begin: FloatArray, end: FloatArray) -> tuple[IntArray, IntArray]:
        """First ramp (index into `ramps`) and number of ramps from begin to end ``(n, k)``."""
        first = np.array(
            [
                np.searchsorted(schedule.end_time, early)
                for schedule, early in zip(self.schedules, begin - self.latest, strict=True)
            ]
        )
        after = np.array(
            [
                np.searchsorted(schedule.start_time, late, side="right")
                for schedule, late in zip(self.schedules, end - self.earliest, strict=True)
            ]
        )
        size = np.array([schedule.num_ramps for schedule in self.schedules])
        return first + (np.cumsum(size) - size)[:, None], np.maximum(after - first, 0)


@dataclass(frozen=True, slots=True, eq=False)
class _VictimBand:
    """Times and frequencies at which signals reach the victim's samples, ramp by ramp."""

    own: RampSchedule
    times: SampleTimes
    norms: "_Norms"
    begin: FloatArray
    end: FloatArray
    own_ends: IntArray

    @classmethod
    def of(cls, radar: Radar, own: RampSchedule) -> "_VictimBand":
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

    def response(self, others: _Interferers) -> tuple[FloatArray, FloatArray]:
        """Bound on the root of Σ|sample|² of each ramp for a path of 1 V; closest beat, Hz."""
        shape = (len(others.schedules), self.begin.size)
        first, count = others.arriving(self.begin, self.end)
        # one row for each overlap of a transmitter's ramp i with a ramp k of the victim
        cell = np.repeat(np.arange(count.size), count.ravel())
        i = np.arange(cell.size) + np.repeat(
            first.ravel() - (np.cumsum(count) - count.ravel()), count.ravel()
        )
        n, k = np.divmod(cell, self.begin.size)
        sent = {name: others.ramps(name)[i] for name in _SENT_COLUMNS}
        earliest, latest, rate = (
            value[n, 0] for value in (others.earliest, others.latest, others.rate)
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
        # the rectangle may include times up to the spread of delays before or after the ramp
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
        samples_at_end = np.sqrt(np.minimum(num_samples, self.window))
        clicks = ends * (self.click / omega + samples_at_end * at_ends)
        everywhere = np.sqrt(num_samples)
        return np.asarray(
            np.minimum(clicks + everywhere * (at_edges + inside), everywhere * self.integral[0])
        )


@lru_cache(maxsize=32)
def _norms(if_filter: IfFilter, rate: float) -> _Norms:
    support = if_filter.support
    # eight panels to a cycle of the stop edge: the corners of |h| at its zeros change the
    # integrals by less than 1e-4
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
        # the greatest value at a node is less than 0.1 % below the true maximum
        peak=(1.001 * float(value[0].max()), 1.001 * float(value[1].max())),
        edge=(float(at_end[0]), float(at_end[1])),
        click=math.sqrt(click),
        window=support * rate + 1.0,
    )
