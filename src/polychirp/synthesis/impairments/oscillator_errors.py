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

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.model.paths import PropagationPaths
from polychirp.model.radar import Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Scene
from polychirp.rng import Streams
from polychirp.synthesis.base import SynthesisEngine
from polychirp.synthesis.impairments.far_noise import far_noise
from polychirp.synthesis.impairments.phase_error import PhaseError, phase_error
from polychirp.synthesis.impairments.wide_victim import Wide
from polychirp.synthesis.links.leakage import LEAKAGE_PART

HIGHEST_OFFSET_STOPBANDS: Final = 2.0
"""Highest offset of phase noise computed as waves, in units of the highest `stopband`; chosen."""

PHASE_TOLERANCE: Final = 1e-6
"""Greatest error of the phase, interpolated between nodes of delay, rad rms; chosen."""

MOST_DELAY_NODES: Final = 16
"""Most nodes in a group of delays; chosen: enough for half a cycle of the highest offset."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Oscillating:
    r"""An engine that adds the errors of the radars' oscillators to any other engine.

    If the oscillators of victim and transmitter are ideal, the samples are the inner engine's, at
    no cost. Otherwise the inner engine is also called once per node of delay, at a sample rate of
    8.5 times the filter's `stopband` or more; errors of the ramps raise it for other radars'
    signals, and fast ones for the radar's own. At the default level of noise the error is 1e-6 of
    the strongest sample, and 2e-5 where windows contain ends of ramps; the signals that are aliased
    into the band are of fourth order in the phase error.

    Limits. A path's error of phase is that of its delay at the snapshot's reference time and at the
    array's centre: changes of the delay must stay well within 1/ν at the highest offset ν, as they
    do for a snapshot a few ms old. Only offsets up to twice the highest `stopband` in the scene are
    waves that add in phase over paths and radars; the noise of another radar beyond them is
    Gaussian (`far_noise`).

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
        shortest = float(min(schedules[n].duration.min() for n in (victim, transmitter)))
        paths = [_between(shot, victim, transmitter) for shot in snapshots]
        highest = highest_offset(scene)
        if victim != transmitter:
            excursion = sum(ramp_error_bandwidth(radar, shortest) for radar in pair)
        else:
            excursion = max(0.0, _own_bandwidth(pair[0], paths, shortest) - highest)
        wide = Wide.of(scene, schedules[victim], victim, highest=highest, excursion=excursion)
        added = self._added(
            wide,
            schedules,
            paths,
            victim,
            transmitter,
            shortest=shortest,
            num_parts=len(samples),
        )
        for part, signal in enumerate(added):
            if signal.any():
                samples[part] += wide.narrowed(signal)
        return samples

    def _added(
        self,
        wide: Wide,
        schedules: Sequence[RampSchedule],
        paths: Sequence[PropagationPaths],
        victim: int,
        transmitter: int,
        *,
        shortest: float,
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
            for delay, shots in shared(paths, other, highest=highest, shortest=shortest):
                added[:LEAKAGE_PART] += deviation(wide.scene, shots, delay)
            if victim != transmitter:
                added += far_noise(
                    self.inner,
                    wide,
                    schedules,
                    paths,
                    victim=victim,
                    transmitter=transmitter,
                    streams=self.streams,
                )
        if num_parts > LEAKAGE_PART:
            nothing = [shot.select(np.zeros(0, dtype=np.int64)) for shot in paths]
            for alone, delay in wide.one_leakage_each(victim):
                added[LEAKAGE_PART] += deviation(alone, nothing, delay)[LEAKAGE_PART]
        return added


def highest_offset(scene: Scene) -> float:
    """Highest offset at which phase noise is computed as waves, Hz; the same for all radars."""
    return HIGHEST_OFFSET_STOPBANDS * max(radar.if_filter.stopband for radar in scene.radars)


def ramp_error_bandwidth(radar: Radar, shortest: float) -> float:
    """By how much the radar's ramp error widens a ramp of ``shortest`` s on each side, Hz."""
    error = radar.oscillator.ramp_error
    return 0.0 if error is None else error.bandwidth(shortest)


def _own_bandwidth(radar: Radar, paths: Sequence[PropagationPaths], shortest: float) -> float:
    r"""By how much the radar's ramp error widens its own echoes on each side, Hz (Carson's rule).

    An echo of delay τ has the difference of two errors, of at most
    :math:`2\hat\epsilon\,\min(\pi f\tau, 1)` with the error's frequency f.
    """
    error = radar.oscillator.ramp_error
    if error is None:
        return 0.0
    frequency = error.bandwidth(shortest) - abs(error.peak)
    latest = max((float(shot.delay.max(initial=0.0)) for shot in paths), default=0.0)
    return 2.0 * abs(error.peak) * min(math.pi * frequency * latest, 1.0) + frequency


def shared(
    snapshots: Sequence[PropagationPaths], sender: Radar, *, highest: float, shortest: float
) -> Iterator[tuple[float, tuple[PropagationPaths, ...]]]:
    r"""Delay of every node, s, and the paths, scaled by their shares in it.

    .. math:: \theta(t-\tau) \approx \sum_k \ell_k(\tau)\, \theta(t-\tau_k)

    for groups of delays that are half a cycle of the highest frequency of θ wide, with Lagrange's
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
    width = 0.5 / max(highest, ramp_error_bandwidth(sender, shortest))
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
    noise = sender.oscillator.phase_noise
    if noise is not None:
        f = np.geomspace(1e-3 * highest, highest, 200)
        error = scale * (np.pi * f) ** count
        total += float(np.trapezoid(2.0 * noise.density(f) * error**2, f))
    total += (scale * (np.pi * ramp_error_bandwidth(sender, shortest)) ** count) ** 2
    return math.sqrt(total)


def _between(shot: PropagationPaths, victim: int, transmitter: int) -> PropagationPaths:
    return shot.select((shot.receiver == victim) & (shot.transmitter == transmitter))


def _turned(error: PhaseError | None, time: FloatArray) -> ComplexArray:
    """The factor e^{j2πθ} at ``time``; 1 if there is no error."""
    if error is None:
        return np.ones((), dtype=np.complex128)
    return np.asarray(np.exp(2j * np.pi * error(time)))
