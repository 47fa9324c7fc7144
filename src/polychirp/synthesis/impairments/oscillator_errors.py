r"""Radars with real oscillators: phase noise and ramp errors, added to any engine.

With errors θ of the transmitted phases of victim v and transmitter i, in cycles, the mixer's output
for a path of delay τ is multiplied, before the IF filter, by

.. math:: e^{j2\pi\left[\theta_v(t) - \theta_i(t-\tau)\right]} .

In a radar's own echo both errors are the same function, and phase noise keeps the share
:math:`4\sin^2(\pi\nu\tau)` of its spectrum at offset ν (range correlation; Budge and Burt 1993).

Closed forms exist for linear chirps only. The inner engine therefore computes the same signal
:math:`y_w` at a higher rate, after a filter that is flat over all frequencies that the errors can
bring into the band. It is multiplied by the errors' factor, filtered by the radar's own filter h
and decimated. Only the difference is added to the exact samples :math:`y_0` of linear chirps:

.. math:: y = y_0 + h * \left[y_w \left(e^{j2\pi[\theta_v - \theta_i]} - 1\right)\right] .

Paths of different delays have different errors. As θ is band-limited, errors at a few delays, the
nodes, are enough: Lagrange's polynomials divide each path among them.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import SampleTimes, sample_times
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.rng import Streams
from polychirp.synthesis.base import SynthesisEngine
from polychirp.synthesis.impairments.phase_error import PhaseError, phase_error
from polychirp.synthesis.links.leakage import LEAKAGE_PART
from polychirp.synthesis.links.links import links_of_all
from polychirp.synthesis.links.thermal_noise import noise_density
from polychirp.units import from_db

HIGHEST_OFFSET_STOPBANDS: Final = 2.0
"""Highest offset of phase noise computed as waves, in units of the highest `stopband`; chosen."""

PHASE_TOLERANCE: Final = 1e-6
"""Greatest error of the phase, interpolated between nodes of delay, rad rms; chosen."""

MOST_DELAY_NODES: Final = 16
"""Most nodes in a group of delays; chosen: enough for half a cycle of the highest offset."""

TRANSITION_STOPBANDS: Final = 2.5
"""Width of the wide filter's transition band over the `stopband` of the victim's filter. Chosen:
the wide filter is then so short that its windows seldom contain ramps' ends."""

WIDE_FILTER_ATTENUATION: Final = from_db(120.0)
"""Attenuation of the wide filter, power ratio, which sets its ripple too; chosen."""

NEGLIGIBLE_FAR_NOISE: Final = 1e-6
"""Greatest neglected noise density beyond the highest offset over that of thermal noise; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Oscillating:
    r"""An engine that adds the errors of the radars' oscillators to any other engine.

    If the oscillators of victim and transmitter are ideal, the samples are the inner engine's, at
    no cost. Otherwise the inner engine is also called once per node of delay, at a sample rate of
    8.5 times the filter's `stopband` or more. At the default level of noise the error is 1e-6 of
    the strongest sample, and 2e-5 where windows contain ends of ramps; the signals that are aliased
    into the band are of fourth order in the phase error.

    Limits. A path's error of phase is that of its delay at the snapshot's reference time and at the
    array's centre: changes of the delay must stay well within 1/ν at the highest offset ν, as they
    do for a snapshot a few ms old. Only offsets up to twice the highest `stopband` in the scene are
    waves that add in phase over paths and radars. If the beat of another radar is further out, its
    received power P leaves Gaussian noise in the band, of density

    .. math:: P\,\left[L_v(f_{IF}) + L_i(f_{IF})\right] ,

    at the beat :math:`f_{IF}` of the strongest path; the noise arrives from the directions of the
    paths, and is independent between victims.

    Parameters
    ----------
    inner : engine for linear chirps; its signals must depend on the given paths alone
    streams : phase noise comes from ``streams["oscillator", name, …]``

    Examples
    --------
    >>> from polychirp.synthesis.stretch.engine import Stretch
    >>> engine = Oscillating(inner=Stretch(), streams=Streams(seed=1))
    >>> isinstance(engine, SynthesisEngine)
    True
    """

    inner: SynthesisEngine
    streams: Streams

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
        samples = self.inner.contribution(
            scene, schedules, snapshots, victim=victim, transmitter=transmitter
        )
        pair = (scene.radars[victim], scene.radars[transmitter])
        if all(radar.oscillator.is_ideal for radar in pair):
            return samples
        wide = Wide.of(scene, schedules[victim], victim, highest_offset(scene))
        paths = [_between(shot, victim, transmitter) for shot in snapshots]
        added = self._added(wide, schedules, paths, victim, transmitter, num_parts=len(samples))
        for part, signal in enumerate(added):
            if signal.any():
                samples[part] += wide.narrowed(signal)
        return samples

    def _added(
        self,
        wide: "Wide",
        schedules: Sequence[RampSchedule],
        paths: Sequence[PropagationPaths],
        victim: int,
        transmitter: int,
        *,
        num_parts: int,
    ) -> ComplexArray:
        """Signal that the errors add, V ``(part, channel, ramp, fast)``, at the wide rate."""
        radar, other = wide.scene.radars[victim], wide.scene.radars[transmitter]
        highest, time = wide.highest_offset, wide.times.time
        own_error, sent_error = (
            phase_error(r, schedules[n], highest_offset=highest, streams=self.streams)
            for r, n in ((radar, victim), (other, transmitter))
        )
        turned = _turned(own_error, time)

        def deviation(
            alone: Scene, shots: Sequence[PropagationPaths], delay: float
        ) -> ComplexArray:
            """Signal that the errors at one delay, s, add to the signal of the paths ``shots``."""
            signal = self.inner.contribution(
                alone, schedules, shots, victim=victim, transmitter=transmitter
            )
            signal *= turned * np.conj(_turned(sent_error, time - delay)) - 1.0
            return signal

        added = np.zeros((num_parts, radar.array.num_channels, *time.shape), dtype=np.complex128)
        if any(shot.num_paths for shot in paths):
            shortest = float(min(schedules[n].duration.min() for n in (victim, transmitter)))
            for delay, shots in shared(paths, other, highest=highest, shortest=shortest):
                added[:LEAKAGE_PART] += deviation(wide.scene, shots, delay)
            if victim != transmitter:
                added += self._far(wide, schedules, paths, victim, transmitter)
        if num_parts > LEAKAGE_PART:
            nothing = [shot.select(np.zeros(0, dtype=np.int64)) for shot in paths]
            for alone, delay in wide.one_leakage_each(victim):
                added[LEAKAGE_PART] += deviation(alone, nothing, delay)[LEAKAGE_PART]
        return added

    def _far(
        self,
        wide: "Wide",
        schedules: Sequence[RampSchedule],
        paths: Sequence[PropagationPaths],
        victim: int,
        transmitter: int,
    ) -> ComplexArray:
        """Noise at offsets beyond the highest one, V, at the wide rate; 0 if it is negligible.

        The other radar's noise at the victim's own frequency is mixed as if that radar sent the
        victim's ramp, without a code. The other radar's own code would spread its noise by the
        code's band, which is neglected.
        """
        radar, other = wide.scene.radars[victim], wide.scene.radars[transmitter]
        own, sent = schedules[victim], schedules[transmitter]
        links = links_of_all(wide.scene, paths, victim=victim, transmitter=transmitter)
        strength = np.concatenate([np.abs(link.amplitude) for link in links])
        delay = np.concatenate([link.delay for link in links])[np.argmax(strength)]
        most = max(float(np.abs(link.amplitude).sum()) for link in links)
        time = wide.times.time
        mine, mixes = _frequency(own, time)
        others, sends = _frequency(sent, time - float(delay))
        beat = np.abs(mine - others)
        level = _level(radar, beat) + _level(other, beat)
        density = np.where(mixes & sends & (beat > wide.highest_offset), level, 0.0)
        if density.max() * most**2 < NEGLIGIBLE_FAR_NOISE * noise_density(radar):
            return np.zeros((), dtype=np.complex128)
        # element by element, since weights may change within a ramp of the victim
        weight = sent.transmit_weight[_ramp_at(sent, time - float(delay))]
        carrier = np.zeros((), dtype=np.complex128)
        for element in np.flatnonzero(np.any(sent.transmit_weight, axis=0)):
            alone = np.zeros((own.num_ramps, sent.num_elements), dtype=np.complex128)
            alone[:, element] = 1.0
            noisy = replace(own, transmit_weight=alone, code=None)
            instead = [noisy if n == transmitter else ramps for n, ramps in enumerate(schedules)]
            carrier = carrier + weight[..., element] * self.inner.contribution(
                wide.scene, instead, paths, victim=victim, transmitter=transmitter
            )
        generator = self.streams["oscillator", radar.name, "far", other.name]
        white = generator.standard_normal((*time.shape, 2)).view(np.complex128)[..., 0]
        return np.asarray(carrier * (white * np.sqrt(0.5 * wide.times.rate * density)))


def highest_offset(scene: Scene) -> float:
    """Highest offset at which phase noise is computed as waves, Hz; the same for all radars."""
    return HIGHEST_OFFSET_STOPBANDS * max(radar.if_filter.stopband for radar in scene.radars)


class _Early(Converter):
    """A converter whose window may begin before the ramp and end after it."""

    __slots__ = ()

    def __post_init__(self) -> None:
        pass


@dataclass(frozen=True, slots=True, kw_only=True)
class Wide:
    """A victim with so high a sample rate and so wide a filter that errors of phase can be added.

    The wide samples cover every window of the victim's own filter: sample n of the victim is at
    the wide sample ``reach + n·factor``.

    Parameters
    ----------
    radar : the victim
    own_times : when its converter samples
    scene : scene with a wide filter and a fast converter in the victim, without leakage and bumper
    highest_offset : Hz, up to which phase noise is computed as waves
    times : when the victim's converter in ``scene`` samples
    factor : number of wide samples per sample of the victim
    reach : number of wide samples in half the support of the victim's filter
    """

    radar: Radar
    own_times: SampleTimes
    scene: Scene
    highest_offset: float
    times: SampleTimes
    factor: int
    reach: int

    @classmethod
    def of(cls, scene: Scene, schedule: RampSchedule, victim: int, highest: float) -> "Wide":
        """The wide victim for errors with offsets up to ``highest`` Hz."""
        radar = scene.radars[victim]
        edge, converter = radar.if_filter.stopband, radar.converter
        wide_filter = IfFilter(
            passband=highest + edge,
            stopband=highest + (1.0 + TRANSITION_STOPBANDS) * edge,
            attenuation=WIDE_FILTER_ATTENUATION,
        )
        # signals that the errors shift beyond half the rate must not fold back into the band
        most = wide_filter.stopband + highest + edge
        factor = math.ceil(most / converter.sample_rate)
        rate = factor * converter.sample_rate
        reach = math.ceil(0.5 * radar.if_filter.support * rate)
        early = _Early(
            sample_rate=rate,
            start=converter.start - reach / rate,
            margin=converter.margin - reach / rate,
        )
        wide = replace(radar, if_filter=wide_filter, converter=early, leakage=(), bumper=None)
        return cls(
            radar=radar,
            own_times=sample_times(schedule, converter),
            scene=_with_radar(scene, wide, victim),
            highest_offset=highest,
            times=sample_times(schedule, early),
            factor=factor,
            reach=reach,
        )

    def one_leakage_each(self, victim: int) -> Iterator[tuple[Scene, float]]:
        """Scenes with one of the victim's leakages, or its bumper, in each, and its delay, s.

        These delays are too short to share nodes: the noise that range correlation leaves is
        proportional to the delay.
        """
        wide, bumper = self.scene.radars[victim], self.radar.bumper
        for leak in self.radar.leakage:
            yield _with_radar(self.scene, replace(wide, leakage=(leak,)), victim), leak.delay
        if bumper is not None:
            delay = 2.0 * bumper.distance / SPEED_OF_LIGHT
            yield _with_radar(self.scene, replace(wide, bumper=bumper), victim), delay

    def narrowed(self, signal: ComplexArray) -> ComplexArray:
        """The ``signal`` after the victim's own filter, ``(…, ramp, fast)``, at its own times."""
        from scipy.signal import upfirdn

        rate = self.times.rate
        grid = np.arange(-self.reach, self.reach + 1) / rate
        taps = self.radar.if_filter.impulse_response(grid) / rate
        # zeros before the taps make the first whole window end on a sample that is kept
        late = -2 * self.reach % self.factor
        taps = np.concatenate([np.zeros(late), taps])
        skipped = (2 * self.reach + late) // self.factor
        kept = slice(skipped, skipped + self.own_times.most_samples)
        filtered = upfirdn(taps, signal, down=self.factor, axis=-1)[..., kept]
        return np.asarray(np.where(self.own_times.is_sample, filtered, 0.0))


def _with_radar(scene: Scene, radar: Radar, number: int) -> Scene:
    radars = list(scene.radars)
    radars[number] = radar
    return replace(scene, radars=tuple(radars))


def shared(
    snapshots: Sequence[PropagationPaths], sender: Radar, *, highest: float, shortest: float
) -> Iterator[tuple[float, tuple[PropagationPaths, ...]]]:
    r"""Delay of every node, s, and the paths, scaled by their shares in it.

    .. math:: \theta(t-\tau) \approx \sum_k \ell_k(\tau)\, \theta(t-\tau_k)

    for groups of delays that are half a cycle of the highest offset wide, with Lagrange's
    polynomials ℓ on Chebyshev's nodes of each group.

    Parameters
    ----------
    snapshots : paths of one transmitter and receiver
    sender : transmitting radar, whose errors θ are delayed
    highest : Hz, highest offset of its phase noise
    shortest : s, duration of the shortest ramp
    """
    delays = [shot.delay for shot in snapshots]
    every = np.concatenate(delays)
    width = 0.5 / highest
    for group in np.unique(np.floor(every / width)):
        inside = [np.floor(delay / width) == group for delay in delays]
        among = every[np.floor(every / width) == group]
        centre = 0.5 * float(among.min() + among.max())
        half = 0.5 * float(np.ptp(among))
        count = _num_nodes(sender, half, highest, shortest)
        nodes = centre + half * np.cos(np.pi * (np.arange(count) + 0.5) / count)
        for k, node in enumerate(nodes):
            yield (
                float(node),
                tuple(
                    _scaled(shot, which, nodes, k)
                    for shot, which in zip(snapshots, inside, strict=True)
                ),
            )


def _scaled(
    shot: PropagationPaths, which: BoolArray, nodes: FloatArray, k: int
) -> PropagationPaths:
    """The paths ``which``, times the polynomial that is 1 at node k and 0 at all others."""
    chosen = shot.select(which)
    others = np.delete(nodes, k)
    share = np.prod((chosen.delay[:, None] - others) / (nodes[k] - others), axis=1)
    return replace(chosen, transfer=share[:, None, None] * chosen.transfer)


def _num_nodes(sender: Radar, half: float, highest: float, shortest: float) -> int:
    """Least number of nodes for delays within ±``half`` s whose error is within the tolerance."""
    for count in range(1, MOST_DELAY_NODES):
        if _error(sender, half, count, highest, shortest) <= PHASE_TOLERANCE:
            return count
    return MOST_DELAY_NODES


def _error(sender: Radar, half: float, count: int, highest: float, shortest: float) -> float:
    """Error of K = ``count`` nodes, rad rms: 2(πfa)^K/K! of a wave of frequency f, a = ``half``."""
    total = 0.0
    scale = 2.0 * half**count / math.factorial(count)  # first omitted term of Jacobi–Anger
    noise, ramp_error = sender.oscillator.phase_noise, sender.oscillator.ramp_error
    if noise is not None:
        f = np.geomspace(1e-3 * highest, highest, 200)
        error = scale * (np.pi * f) ** count
        total += float(np.trapezoid(2.0 * noise.density(f) * error**2, f))
    if ramp_error is not None:
        total += (scale * (np.pi * ramp_error.bandwidth(shortest)) ** count) ** 2
    return math.sqrt(total)


def _between(shot: PropagationPaths, victim: int, transmitter: int) -> PropagationPaths:
    return shot.select((shot.receiver == victim) & (shot.transmitter == transmitter))


def _turned(error: PhaseError | None, time: FloatArray) -> ComplexArray:
    """The factor e^{j2πθ} at ``time``; 1 if there is no error."""
    if error is None:
        return np.ones((), dtype=np.complex128)
    return np.asarray(np.exp(2j * np.pi * error(time)))


def _frequency(schedule: RampSchedule, time: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Frequency at ``time``, Hz, and a mask that is true while a ramp is sent."""
    ramp = _ramp_at(schedule, time)
    into = time - schedule.start_time[ramp]
    sends = (into >= 0.0) & (into < schedule.duration[ramp])
    return schedule.start_frequency[ramp] + schedule.slope[ramp] * into, sends


def _ramp_at(schedule: RampSchedule, time: FloatArray) -> IntArray:
    """Number of the ramp that is sent at ``time``, or was the last one, and 0 before the first."""
    return np.maximum(np.searchsorted(schedule.start_time, time, side="right") - 1, 0)


def _level(radar: Radar, offset: FloatArray) -> FloatArray:
    noise = radar.oscillator.phase_noise
    return np.zeros_like(offset) if noise is None else noise.density(offset)
