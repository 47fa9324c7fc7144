r"""Interference over noise in the IF band of a radar in closed form, without samples.

On one ramp of a victim and one ramp that arrives, the beat of a path changes linearly with time, at
the rate μ. The filter passes the energy

.. math:: E = P \int |H(f(t))|^2\,dt = P\,\frac{G(f_2) - G(f_1)}{\mu}, \qquad
          G(f) = \int_0^f |H|^2\,df'

of a path of power P, with the beats f₁ and f₂ at both ends of the common time, within which the
converter takes samples. Energies of paths, and of elements that send together, are added, which is
exact in the mean over their phases.

A ramp of either radar that begins or ends at a beat beyond the stop band makes a click,
`_click_time`, which counts as far as it is in the samples. Where the next ramp follows so soon that
both clicks overlap, their product counts (`_products`): a triangle whose frequency and phase are
continuous makes none at its corners. Over 200 drawn frames whose beats are hardly ever in the band,
the energy was wrong by 0.01 dB in the median, and by 1.1 dB at most where it was above −20 dB of
the noise's; what a click well before or after the samples leaves in them is up to 5 dB too low.

A code spreads the beat evenly over its band (`RampCode.bandwidth`), with the chips' mean power. The
energy of codes whose band chirps cross was wrong by 0.45 dB at most; what a code has beyond its
band is left out, clicks included.

Limits: the gain follows the beat without delay, also where a ramp begins or ends within the stop
band (the energy of one path over 64 chirps was wrong by 0.06 dB at most in 32 draws), so that a
beat that crosses the band just before or after the samples adds nothing to them; products of
paths of one radar are left out (0.6 dB at most for two paths, 6 dB apart), and so are products of
its elements: a single ramp of N elements in phase has up to 10 lg N dB more than the mean over
their codes. Doppler shifts of beats, some kHz, paths below `LEAST_PATH`, and what a high-pass takes
from interference and noise are left out too.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import SampleTimes, sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.synthesis.links.links import antenna_field
from polychirp.synthesis.links.thermal_noise import noise_density

LEAST_PATH: Final = 1e-3
"""Power of a path over that of the victim's noise behind its IF filter below which it is left out.
Chosen: a hundred such paths that are in the band all the time raise the floor by 0.4 dB."""

_TABLE_SIZE: Final = 4001
"""Number of frequencies at which G is computed; chosen: linear interpolation between them is right
to 1e-5 of the noise bandwidth."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReceivedPaths:
    """Paths from other radars that matter to the radars that they reach.

    Parameters
    ----------
    transmitter, receiver : numbers of the radars, ``(path,)``
    delay : s, at ``time``, ``(path,)``
    power : W, at the receiver's mixer, ``(path,)``
    time : s, for which the paths were traced
    """

    transmitter: IntArray
    receiver: IntArray
    delay: FloatArray
    power: FloatArray
    time: float


def received_paths(scene: Scene, paths: PropagationPaths) -> ReceivedPaths:
    """Paths from other radars whose power is `LEAST_PATH` of the receiver's noise or more.

    The power is that of the transmitter's first element with weight 1, as of the amplitudes of
    `links_between`.
    """
    paths = paths.select(paths.transmitter != paths.receiver)
    power = path_powers(scene, paths)
    noise = np.array([noise_power(scene, number) for number in range(len(scene.radars))])
    kept = power >= LEAST_PATH * noise[paths.receiver]
    return ReceivedPaths(
        transmitter=paths.transmitter[kept],
        receiver=paths.receiver[kept],
        delay=paths.delay[kept],
        power=power[kept],
        time=paths.reference_time,
    )


def path_powers(scene: Scene, paths: PropagationPaths) -> FloatArray:
    """Power of every path at its receiver's mixer, antennas and front ends included, W."""
    turn = scene.radar_rotation
    out = np.zeros((paths.num_paths, 2), dtype=np.complex128)
    back = np.zeros_like(out)
    factor = np.zeros(paths.num_paths)
    for number, radar in enumerate(scene.radars):
        sent, got = paths.transmitter == number, paths.receiver == number
        pattern = radar.array.pattern
        out[sent] = antenna_field(pattern, paths.departure[sent], turn[number])
        back[got] = antenna_field(pattern, paths.arrival[got], turn[number])
        response = float(np.abs(radar.array.transmitter_response[0]) ** 2)
        factor[sent] = radar.transmit_power * radar.transmit_gain * response
    gain = np.array([radar.receive_gain for radar in scene.radars])
    amplitude = np.einsum("pi,pij,pj->p", back, paths.transfer, out)
    return np.asarray(factor * gain[paths.receiver] * np.abs(amplitude) ** 2)


def noise_power(scene: Scene, number: int) -> float:
    """Power of a radar's noise behind its IF filter, W."""
    radar = scene.radars[number]
    return noise_density(radar) * _noise_bandwidth(radar.if_filter)


@lru_cache(maxsize=32)
def _noise_bandwidth(if_filter: IfFilter) -> float:
    return if_filter.noise_bandwidth


def interference_to_noise(
    scene: Scene, schedules: Sequence[RampSchedule], paths: ReceivedPaths, *, victim: int
) -> FloatArray:
    """Power ratio of interference to noise in the samples of every ramp of a victim, ``(ramp,)``.

    Schedules are in the time of the scene.
    """
    own, radar = schedules[victim], scene.radars[victim]
    times = sample_times(own, radar.converter)
    energy = np.zeros(own.num_ramps)
    mine = paths.receiver == victim
    for sender in np.unique(paths.transmitter[mine]):
        here = mine & (paths.transmitter == sender)
        meetings = _meetings(own, schedules[sender], paths.delay[here], paths.power[here])
        energy += _energy(meetings, _Window.of(times), radar.if_filter)
    return np.asarray(energy * times.rate / (times.num_samples * noise_power(scene, victim)))


@dataclass(frozen=True, slots=True, eq=False)
class _Window:
    """Times in which the converter takes samples: limits, s ``(ramp,)``, and spacing, s."""

    first: FloatArray
    last: FloatArray
    spacing: float

    @classmethod
    def of(cls, times: SampleTimes) -> "_Window":
        return cls(times.first, times.first + times.num_samples / times.rate, 1.0 / times.rate)

    def share(self, ramp: IntArray, time: FloatArray, if_filter: IfFilter) -> FloatArray:
        """Share of the energy of a click at ``time`` that is in the samples of a ramp."""
        place, share = _click_shape(if_filter)
        # a sample stands for the interval around it
        ahead = time + 0.5 * self.spacing
        inside = np.interp(self.last[ramp] - ahead, place, share)
        return np.asarray(inside - np.interp(self.first[ramp] - ahead, place, share))


@dataclass(frozen=True, slots=True, eq=False)
class _Meetings:
    """Pairs of a victim's ramp and a ramp of one transmitter that arrives on a path, ``(pair,)``.

    Pairs of one path follow each other in order of time.

    Parameters
    ----------
    own, sent : schedules of the victim and of the transmitter
    path, own_ramp, sent_ramp : their numbers
    delay : s, of the path
    power : W, mean power of the ramp on the path
    """

    own: RampSchedule
    sent: RampSchedule
    path: IntArray
    own_ramp: IntArray
    sent_ramp: IntArray
    delay: FloatArray
    power: FloatArray

    @property
    def rate(self) -> FloatArray:
        """Rate μ of the beat, Hz/s."""
        return np.asarray(self.own.slope[self.own_ramp] - self.sent.slope[self.sent_ramp])

    def common(self, begin: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Begin and end, s, of the part of the time from begin to end in which the ramp arrives."""
        low = np.maximum(begin, self.sent.start_time[self.sent_ramp] + self.delay)
        arrived = self.sent.end_time[self.sent_ramp] + self.delay
        return low, np.maximum(np.minimum(end, arrived), low)

    def beat(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Frequency, Hz, and phase, cycles, of the beat at a time of each pair."""
        frequency, phase = _frequency_and_phase(self.own, self.own_ramp, time)
        sent, behind = _frequency_and_phase(self.sent, self.sent_ramp, time - self.delay)
        return frequency - sent, phase - behind


def _frequency_and_phase(
    schedule: RampSchedule, ramp: IntArray, time: FloatArray
) -> tuple[FloatArray, FloatArray]:
    since = time - schedule.start_time[ramp]
    start, swept = schedule.start_frequency[ramp], schedule.slope[ramp] * since
    return start + swept, schedule.start_phase[ramp] + (start + 0.5 * swept) * since


def _meetings(
    own: RampSchedule, sent: RampSchedule, delay: FloatArray, power: FloatArray
) -> _Meetings:
    """All pairs of ramps that have a common time."""
    # less than 1e-12 s is rounding, as of `RampSchedule`
    late, early = own.start_time + 1e-12, own.end_time - 1e-12
    begin = np.searchsorted(sent.end_time, late - delay[:, None], side="right")
    end = np.searchsorted(sent.start_time, early - delay[:, None], side="left")
    count = np.maximum(end - begin, 0)
    cell = np.repeat(np.arange(count.size), count.ravel())
    before = np.cumsum(count) - count.ravel()
    i = np.arange(cell.size) - before[cell] + begin.ravel()[cell]
    p, k = np.divmod(cell, own.num_ramps)
    return _Meetings(own, sent, p, k, i, delay[p], power[p] * mean_power(sent)[i])


def _energy(meetings: _Meetings, window: _Window, if_filter: IfFilter) -> FloatArray:
    """Energy, J, that one transmitter brings into the samples of each ramp, ``(ramp,)``."""
    k, code = meetings.own_ramp, meetings.sent.code
    low, high = meetings.common(window.first[k], window.last[k])
    spread = 0.0 if code is None else code.bandwidth
    frequency, _ = meetings.beat(low)
    passed = _passed_time(if_filter, frequency, meetings.rate, high - low, spread=spread)
    energy = np.zeros(meetings.own.num_ramps)
    np.add.at(energy, k, meetings.power * passed)
    if code is None:
        energy += _click_energy(meetings, window, if_filter)
    return energy


def _click_energy(meetings: _Meetings, window: _Window, if_filter: IfFilter) -> FloatArray:
    """Energy, J, of clicks at both ends of the common times of ramps, ``(ramp,)``."""
    k, num_ramps = meetings.own_ramp, meetings.own.num_ramps
    low, high = meetings.common(meetings.own.start_time[k], meetings.own.end_time[k])
    begin, end = (_Clicks.at(meetings, time, if_filter) for time in (low, high))
    alone = sum(one.energy * window.share(k, one.time, if_filter) for one in (begin, end))
    energy = np.bincount(k, weights=alone, minlength=num_ramps)
    # filters see clicks of the neighbouring ramp of the victim, too
    is_next = meetings.path[:-1] == meetings.path[1:]
    is_other = is_next & (k[:-1] != k[1:])
    before, after = end.some(slice(-1)), begin.some(slice(1, None))
    product = _products(meetings, before, after, if_filter)
    for ramp, neighbour, is_counted in ((k[:-1], after, is_next), (k[1:], before, is_other)):
        shares = [window.share(ramp, one.time, if_filter) for one in (before, after)]
        both = is_counted * product * np.sqrt(shares[0] * shares[1])
        both += is_other * neighbour.energy * window.share(ramp, neighbour.time, if_filter)
        energy += np.bincount(ramp, weights=both, minlength=num_ramps)
    return np.asarray(energy)


@dataclass(frozen=True, slots=True, eq=False)
class _Clicks:
    """Clicks at one end of ramps: time, s, beat's sign and phase, cycles, energy, J ``(pair,)``."""

    time: FloatArray
    sign: FloatArray
    phase: FloatArray
    energy: FloatArray

    @classmethod
    def at(cls, meetings: _Meetings, time: FloatArray, if_filter: IfFilter) -> "_Clicks":
        frequency, phase = meetings.beat(time)
        energy = meetings.power * _click_time(if_filter, frequency, meetings.rate)
        return cls(time, np.sign(frequency), phase, energy)

    def some(self, which: slice) -> "_Clicks":
        """These of them."""
        return _Clicks(self.time[which], self.sign[which], self.phase[which], self.energy[which])


def _click_time(if_filter: IfFilter, beat: FloatArray, rate: FloatArray) -> FloatArray:
    r"""Energy over power, s, of the click of a beat that begins or ends beyond the stop band.

    At the frequency ν, an exponential that begins at the beat f and changes at the rate μ has the
    energy density :math:`1/4\pi^2(f-\nu)^2` for :math:`(f-\nu)^2 \gg |\mu|`, as of the first term
    of `interferer_culling`, and :math:`1/4|\mu|` at ν = f, half of the amplitude of a whole chirp.
    :math:`1/(4\pi^2(f-\nu)^2 + 4|\mu|)` is at most 1 dB above the Fresnel integral between
    them (Abramowitz and Stegun, section 7.3), and 0.1 dB below it. A filter that passes all ν up to
    ±c, half of its noise bandwidth, leaves

    .. math:: \int_{-c}^{c} \frac{d\nu}{4\pi^2(f-\nu)^2 + 4|\mu|} = \frac{1}{4\pi\sqrt{|\mu|}}
              \arctan\frac{2\pi c\sqrt{|\mu|}}{\pi^2(f^2-c^2) + |\mu|} .

    A beat between c and the stop edge has the click of a beat at the edge, as the integral has no
    limit there. A beat below c makes no click: `_passed_time` has its energy.
    """
    half = 0.5 * _noise_bandwidth(if_filter)
    size = np.maximum(np.abs(beat), if_filter.stopband)
    apart = np.pi**2 * (size**2 - half**2) + np.abs(rate)
    x = 2.0 * np.pi * half * np.sqrt(np.abs(rate)) / apart
    # arctan(x)/x is 1 to the last digit below 1e-8
    bend = np.where(x > 1e-8, np.arctan(x) / np.maximum(x, 1e-8), 1.0)
    return np.where(np.abs(beat) > half, 0.5 * half / apart * bend, 0.0)


@lru_cache(maxsize=32)
def _click_shape(if_filter: IfFilter) -> tuple[FloatArray, FloatArray]:
    """Share of the energy ∫h² of the filter's impulse response before times, s, and these times."""
    # 32 points (chosen) to a cycle of the stop edge, 16 to one of h²
    count = 32 * math.ceil(if_filter.support * if_filter.stopband) + 1
    time = 0.5 * if_filter.support * np.linspace(-1.0, 1.0, count)
    share = _summed(if_filter.impulse_response(time) ** 2, time)
    return time, share / share[-1]


def _products(
    meetings: _Meetings, before: _Clicks, after: _Clicks, if_filter: IfFilter
) -> FloatArray:
    r"""Product, J, of clicks at the end of a pair and at the begin of the next, ``(pair - 1,)``.

    With the clicks' energies :math:`E_1, E_2` at the beats :math:`f_1, f_2` a time g apart, and the
    noise bandwidth B, it is

    .. math:: -2\,\mathrm{sgn}(f_1 f_2)\sqrt{E_1 E_2}\,\mathrm{sinc}(Bg)\,
              \mathrm{Re}\left(e^{j2\pi(\varphi_1 - \varphi_2)}\,
              \frac{\sum_l w_{1l}^* w_{2l}}{|w_1||w_2|}\right)

    with the beat's phases, cycles, and the elements' weights: an end has the opposite sign of a
    begin, and sinc(Bg) is the autocorrelation of a filter with a flat band.
    """
    weight = meetings.sent.transmit_weight
    first, second = weight[meetings.sent_ramp[:-1]], weight[meetings.sent_ramp[1:]]
    norm = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    alike = np.sum(first.conj() * second, axis=1) / np.maximum(norm, 1e-300)
    turned = np.real(alike * np.exp(2j * np.pi * (before.phase - after.phase)))
    size = before.sign * after.sign * np.sqrt(before.energy * after.energy)
    near = np.sinc(_noise_bandwidth(if_filter) * (after.time - before.time))
    return np.asarray(-2.0 * size * near * turned)


def _passed_time(
    if_filter: IfFilter, beat: FloatArray, rate: FloatArray, duration: FloatArray, *, spread: float
) -> FloatArray:
    r"""∫|H(f)|² dt, s, over ``duration`` for beats that begin at ``beat`` and change at ``rate``.

    The code of a ramp spreads the beat evenly over a band B, ``spread``, Hz. G then has its mean
    over this band, and so has |H|²:

    .. math:: \bar G(f) = \frac1B \int_{f-B/2}^{f+B/2} G\,df', \qquad
              \overline{|H|^2}(f) = \frac{G(f + B/2) - G(f - B/2)}{B}
    """
    tables = _tables(if_filter)
    half = float(tables.frequency[-1])
    span = rate * duration
    # below a thousandth of the band the mean of a quotient would lose digits
    is_steady = np.abs(span) < 1e-3 * half
    middle, edges = beat + 0.5 * span, (beat + span, beat)
    if spread > 0.0:
        steady = (tables.odd(middle + 0.5 * spread) - tables.odd(middle - 0.5 * spread)) / spread
        ends = [tables.even(f + 0.5 * spread) - tables.even(f - 0.5 * spread) for f in edges]
        passed = (ends[0] - ends[1]) / spread
        # rounding errors far from the band may have the wrong sign
        passed = np.where(passed * rate < 0.0, 0.0, passed)
    else:
        steady = np.interp(np.abs(middle), tables.frequency, tables.gain, right=0.0)
        passed = tables.odd(edges[0]) - tables.odd(edges[1])
    crossing = passed / np.where(is_steady, 1.0, rate)
    return np.where(is_steady, steady * duration, crossing)


class _Tables(NamedTuple):
    """|H|², G, Hz, and the integral of G, Hz², at frequencies from 0 to the stop edge, Hz."""

    frequency: FloatArray
    gain: FloatArray
    integral: FloatArray
    second: FloatArray

    def odd(self, beat: FloatArray) -> FloatArray:
        """G at beats of both signs: it is odd, and constant beyond the filter's stop edge."""
        size = np.interp(np.abs(beat), self.frequency, self.integral)
        return np.asarray(np.sign(beat) * size)

    def even(self, beat: FloatArray) -> FloatArray:
        """Integral of G from 0 to beats of both signs: it is even, and a line beyond the edge."""
        beyond = np.maximum(np.abs(beat) - self.frequency[-1], 0.0) * self.integral[-1]
        return np.asarray(np.interp(np.abs(beat), self.frequency, self.second) + beyond)


@lru_cache(maxsize=32)
def _tables(if_filter: IfFilter) -> _Tables:
    frequency = np.linspace(0.0, if_filter.stopband, _TABLE_SIZE)
    gain = if_filter.response(frequency) ** 2
    integral = _summed(gain, frequency)
    return _Tables(frequency, gain, integral, _summed(integral, frequency))


def _summed(values: FloatArray, place: FloatArray) -> FloatArray:
    """Integral of values from the first place on, by the trapezoidal rule."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(place))])


def mean_power(sent: RampSchedule) -> FloatArray:
    """Mean power of each ramp's signal over that of one element with weight 1, ``(ramp,)``.

    Powers of elements that send together are added, which is exact in the mean over their phases.
    """
    elements = np.sum(np.abs(sent.transmit_weight) ** 2, axis=1)
    return np.asarray(elements * (1.0 if sent.code is None else sent.code.mean_power))


def band_of(schedule: RampSchedule) -> tuple[float, float]:
    """Lowest and highest frequency of a schedule, Hz, with the band of its code."""
    low, high = schedule.occupied
    return float(low.min()), float(high.max())


def energy_over_noise(
    scene: Scene,
    paths: ReceivedPaths,
    on_air: dict[int, RampSchedule],
    *,
    listener: int,
    band: tuple[float, float],
    time: tuple[float, float],
) -> tuple[float, float]:
    r"""Mean energy at a listening radar's antenna over that of noise, and number of noise samples.

    .. math:: 1 + \frac{\sum_p P_p T_p}{k T_0 F\,B\,T}

    with the time :math:`T_p` for which the signal of path p is within the band B during the time T
    of listening. In BT independent samples there is noise alone. A coded ramp has its mean power,
    evenly over its band.

    Parameters
    ----------
    on_air : schedules of the radars that send, by their numbers
    listener : number of the radar that listens, which has no signal of its own
    band : Hz, lower and upper edge
    time : s, begin and end of listening
    """
    low, high = band
    begin, end = time
    noise = noise_density(scene.radars[listener]) * (high - low) * (end - begin)
    energy = 0.0
    mine = paths.receiver == listener
    for sender in np.unique(paths.transmitter[mine]):
        if int(sender) not in on_air:
            continue
        here = mine & (paths.transmitter == sender)
        schedule = on_air[int(sender)]
        inside = _time_in_band(schedule, begin - paths.delay[here], end - paths.delay[here], band)
        energy += float(paths.power[here] @ inside @ mean_power(schedule))
    return 1.0 + energy / noise, (high - low) * (end - begin)


def _time_in_band(
    sent: RampSchedule, begin: FloatArray, end: FloatArray, band: tuple[float, float]
) -> FloatArray:
    """Time, s, for which each ramp is within a band between times of sending, ``(path, ramp)``."""
    low = np.maximum(sent.start_time, begin[:, None])
    duration = np.maximum(np.minimum(sent.end_time, end[:, None]) - low, 0.0)
    middle = sent.start_frequency + sent.slope * (low + 0.5 * duration - sent.start_time)
    # a signal of constant frequency, which has no band, is within 1 Hz
    spread = 1.0 if sent.code is None else max(sent.code.bandwidth, 1.0)
    below = [_time_below(edge - middle, sent.slope * duration, spread) for edge in band]
    return np.asarray(duration * (below[1] - below[0]))


def _time_below(above: FloatArray, swept: FloatArray, spread: float) -> FloatArray:
    r"""Share of the energy of a signal that is below an edge, in the mean over a piece of a ramp.

    The signal is spread evenly over a band B about a frequency that sweeps a range s, and whose
    mean is ``above`` below the edge:

    .. math:: \frac1s \int_{a-s/2}^{a+s/2} \mathrm{clip}\left(\frac xB + \tfrac12, 0, 1\right) dx
    """
    ends = [(above + side * swept) / spread + 0.5 for side in (-0.5, 0.5)]
    clipped = [np.clip(end, 0.0, 1.0) for end in ends]
    # ∫clip(v, 0, 1) dv is clip²/2 up to 1, and v − ½ beyond
    areas = [
        0.5 * one**2 + np.maximum(end - 1.0, 0.0) for one, end in zip(clipped, ends, strict=True)
    ]
    across = ends[1] - ends[0]
    # below a hundredth of the band the quotient would lose digits
    is_steady = np.abs(across) < 1e-2
    share = (areas[1] - areas[0]) / np.where(is_steady, 1.0, across)
    return np.where(is_steady, np.clip(above / spread + 0.5, 0.0, 1.0), share)
