r"""Interference over noise in the IF band of a radar in closed form, without samples.

On one ramp of a victim and one ramp that arrives, the beat of a path changes linearly with time, at
the rate μ. The filter passes the energy

.. math:: E = P \int |H(f(t))|^2\,dt = P\,\frac{G(f_2) - G(f_1)}{\mu}, \qquad
          G(f) = \int_0^f |H|^2\,df'

of a path of power P, with the beats f₁ and f₂ at both ends of the common time, within which the
converter takes samples. Energies of paths, and of elements that send together, are added, which is
exact in the mean over their phases.

A code spreads the beat evenly over its band (`RampCode.bandwidth`), with the chips' mean power. The
energy of codes whose band chirps cross was wrong by 0.45 dB at most; what a code has beyond its
band is left out.

Limits: the gain follows the beat without delay, also where a ramp begins or ends (the energy of one
path over 64 chirps was wrong by 0.06 dB at most in 32 draws); products of paths of one radar are
left out (0.6 dB at most for two paths, 6 dB apart), and so are products of its elements: a single
ramp of N elements in phase has up to 10 lg N dB more than the mean over their codes. Doppler shifts
of beats, some kHz, and paths below `LEAST_PATH` are left out too.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import FloatArray, IntArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
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
    window = times.num_samples / times.rate
    energy = np.zeros(own.num_ramps)
    mine = paths.receiver == victim
    for sender in np.unique(paths.transmitter[mine]):
        here = mine & (paths.transmitter == sender)
        energy += _energy(
            own,
            times.first,
            times.first + window,
            schedules[sender],
            paths.delay[here],
            paths.power[here],
            radar.if_filter,
        )
    return np.asarray(energy / (window * noise_power(scene, victim)))


def _energy(
    own: RampSchedule,
    first: FloatArray,
    last: FloatArray,
    sent: RampSchedule,
    delay: FloatArray,
    power: FloatArray,
    if_filter: IfFilter,
) -> FloatArray:
    """Energy, J, that one transmitter's paths bring into each ramp of a victim, ``(ramp,)``.

    ``first`` and ``last`` are the limits of the time in which the converter takes samples.
    """
    begin = np.searchsorted(sent.end_time, first - delay[:, None], side="right")
    end = np.searchsorted(sent.start_time, last - delay[:, None], side="left")
    count = np.maximum(end - begin, 0)
    cell = np.repeat(np.arange(count.size), count.ravel())
    before = np.cumsum(count) - count.ravel()
    i = np.arange(cell.size) - before[cell] + begin.ravel()[cell]
    p, k = np.divmod(cell, own.num_ramps)
    low = np.maximum(first[k], sent.start_time[i] + delay[p])
    high = np.maximum(np.minimum(last[k], sent.end_time[i] + delay[p]), low)
    rate = own.slope[k] - sent.slope[i]
    beat = own.start_frequency[k] + own.slope[k] * (low - own.start_time[k])
    beat -= sent.start_frequency[i] + sent.slope[i] * (low - delay[p] - sent.start_time[i])
    spread = 0.0 if sent.code is None else sent.code.bandwidth
    passed = power[p] * _passed_time(if_filter, beat, rate, high - low, spread=spread)
    passed *= mean_power(sent)[i]
    energy = np.bincount(k, weights=passed, minlength=own.num_ramps)
    return np.asarray(energy, dtype=np.float64)


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
        inside = _time_in_band(
            on_air[int(sender)], begin - paths.delay[here], end - paths.delay[here], band
        )
        sent = float(np.mean(mean_power(on_air[int(sender)])))
        energy += sent * float(np.sum(paths.power[here] * inside))
    return 1.0 + energy / noise, (high - low) * (end - begin)


def _time_in_band(
    sent: RampSchedule, begin: FloatArray, end: FloatArray, band: tuple[float, float]
) -> FloatArray:
    """Time, s, for which ramps are within a band between times of sending, ``(path,)``."""
    lowest, highest = sent.occupied
    # a signal of constant frequency, which has no band, is within 1 Hz
    lowest, highest = lowest - 0.5, highest + 0.5
    common = np.minimum(highest, band[1]) - np.maximum(lowest, band[0])
    share = np.clip(common / (highest - lowest), 0.0, 1.0)
    low = np.maximum(sent.start_time, begin[:, None])
    high = np.minimum(sent.end_time, end[:, None])
    return np.asarray(np.maximum(high - low, 0.0) @ share)
