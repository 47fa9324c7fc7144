r"""Suppression of interference by diverse waveforms, for two radars that face each other.

Each receives nothing but the signal of the other. The interference in the samples of the victim is
compared with the ghost from an interferer with the same ramps, synchronous with the victim:

- *matched*: all samples of all ramps added in phase for a point at (R, v), on a grid of cells;
- *per sweep*: powers of Hann-windowed spectra averaged over ramps, as in the figures of the paper;
- *duty*: share of samples in which the interferer is in the IF band.

If both frames cover the same band, the mean of the matched output over cells is bounded by the
product of bandwidth and frame duration,

.. math:: 10\log_{10} B\,T_{frame}

whatever their order, slopes and starts: for unit energies
:math:`\int |S_1|^2|S_2|^2\,df \ge 1/(B\,T_{frame})` by Cauchy and Schwarz, where
BT_frame is 2nBT for n triangles of two ramps T. Only spectra that overlap less give less.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.frames import Pose
from polychirp.model.antenna import AntennaArray
from polychirp.model.baseband import Progress, no_progress
from polychirp.model.if_frame import IfFrame, SampleTimes, sample_times
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.receiver.alternatives.paper_receiver import range_spectra
from polychirp.receiver.signal_model.point_signal import beat_phase, matched_amplitudes, replica
from polychirp.rng import Streams
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.waveform import AnyWaveform, DiverseTriangular, FixedTriangular, Triangular

RADAR_DISTANCE: Final = 13.2
"""Distance between the two radars, m, as in scenario C of the paper."""

NUM_SWEEPS: Final = 16

NUM_DRAWS: Final = 16
"""Number of pairs of radars that are drawn for every family; chosen."""

IN_BAND: Final = 0.5
"""Amplitude above which an interferer counts as in the band, relative to the middle of the band."""

LEAST_AMPLITUDE: Final = 1e-4
"""Relative amplitude below which samples are left out of the matched output; if all samples had it
and added in phase, they would give −80 dB."""

FEW_SAMPLES: Final = 0.02
"""Share of samples up to which adding them one by one is faster."""

CELL_RANGES: Final = np.linspace(1.0, 29.0, 40)
"""Ranges of the cells of the matched output, m."""

CELL_RATES: Final = np.linspace(-30.0, 30.0, 70)
"""Range rates of the cells of the matched output, m/s."""

RAMP_DURATIONS: Final = (1e-3, 2e-3)
"""Limits of ramp durations in table 2 of the paper, s."""

BANDWIDTHS: Final = (800e6, 1000e6)
"""Limits of bandwidths in table 2 of the paper, Hz."""

_MIDDLE_DURATION: Final = 1.5e-3
_MIDDLE_BANDWIDTH: Final = 900e6

Pair = Callable[[Streams, int], tuple[RampSchedule, RampSchedule]]
"""Function from random streams and a number of sweeps to the schedules of victim and interferer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Suppression:
    """Interference of one family of waveforms, relative to a synchronous ghost, mean over draws.

    Parameters
    ----------
    family : name of the family
    matched_mean, matched_peak : matched output, mean over cells and strongest cell
    per_sweep : strongest range of the averaged spectra
    duty : share of samples in the band
    law : 1/(B T_frame)
    num_draws : number of pairs of radars
    """

    family: str
    matched_mean: float
    matched_peak: float
    per_sweep: float
    duty: float
    law: float
    num_draws: int


def played(
    first: AnyWaveform,
    second: AnyWaveform | None = None,
    *,
    start_spread: float = 0.0,
    start_jitter: float = 0.0,
    offset: float = 0.0,
) -> Pair:
    """A pair of radars with the waveforms ``first`` and ``second`` (or both with the first).

    Parameters
    ----------
    start_spread : s, greatest delay of the interferer's start, drawn uniformly
    start_jitter : s, greatest delay of each sweep of both after the sweep before, drawn uniformly
    offset : Hz, difference of all frequencies of the interferer
    """

    def pair(streams: Streams, num_sweeps: int) -> tuple[RampSchedule, RampSchedule]:
        schedules = []
        for name, waveform in (("victim", first), ("interferer", second or first)):
            own = streams.of("radar", name)
            schedule = waveform.schedule(num_sweeps=num_sweeps, streams=own)
            if start_jitter:
                late = np.cumsum(own["jitter"].uniform(0.0, start_jitter, num_sweeps))
                schedule = schedule.with_late_sweeps(late)
            schedules.append(schedule)
        start = float(streams["start"].uniform(0.0, 1.0)) * start_spread
        interferer = schedules[1].as_clocked(start_time=start, clock_offset=0.0)
        return schedules[0], replace(
            interferer, start_frequency=interferer.start_frequency + offset
        )

    return pair


def spread_time(spread: float) -> Pair:
    """Ramp durations drawn for every triangle within ±``spread`` of their middle."""
    limits = (_MIDDLE_DURATION * (1 - spread), _MIDDLE_DURATION * (1 + spread))
    return played(
        DiverseTriangular(bandwidth=(_MIDDLE_BANDWIDTH, _MIDDLE_BANDWIDTH), ramp_duration=limits)
    )


def spread_band(spread: float) -> Pair:
    """Bandwidths drawn for every triangle within ±``spread`` of their middle."""
    limits = (_MIDDLE_BANDWIDTH * (1 - spread), _MIDDLE_BANDWIDTH * (1 + spread))
    return played(
        DiverseTriangular(bandwidth=limits, ramp_duration=(_MIDDLE_DURATION, _MIDDLE_DURATION))
    )


_EQUAL_RAMPS: Final = Triangular()
_MEAN_TRIANGLES: Final = DiverseTriangular(
    bandwidth=(_MIDDLE_BANDWIDTH, _MIDDLE_BANDWIDTH),
    ramp_duration=(_MIDDLE_DURATION, _MIDDLE_DURATION),
)
_PAPER_TRIANGLES: Final = DiverseTriangular(bandwidth=BANDWIDTHS, ramp_duration=RAMP_DURATIONS)

FAMILIES: Final[Mapping[str, Pair]] = {
    "equal ramps, starting together": played(_EQUAL_RAMPS),
    "one slope for each radar": played(
        FixedTriangular(bandwidth=BANDWIDTHS, ramp_duration=RAMP_DURATIONS)
    ),
    "T at every triangle": played(replace(_MEAN_TRIANGLES, ramp_duration=RAMP_DURATIONS)),
    "B at every triangle": played(replace(_MEAN_TRIANGLES, bandwidth=BANDWIDTHS)),
    "T and B at every triangle (the paper)": played(_PAPER_TRIANGLES),
    "start frequency, 0 to 100 MHz": played(replace(_MEAN_TRIANGLES, start_frequency_spread=100e6)),
    "start frequency hops over 3 GHz": played(
        replace(_MEAN_TRIANGLES, start_frequency=77e9, start_frequency_spread=3e9)
    ),
    "up or down first": played(replace(_MEAN_TRIANGLES, random_order=True)),
    "start jitter, 0 to 20 µs": played(_MEAN_TRIANGLES, start_jitter=20e-6),
    "T, B, start frequency and order": played(
        replace(_PAPER_TRIANGLES, start_frequency_spread=100e6, random_order=True)
    ),
    "equal ramps, random start": played(_EQUAL_RAMPS, start_spread=3e-3),
    "one slope for each radar, random start": played(
        FixedTriangular(bandwidth=BANDWIDTHS, ramp_duration=RAMP_DURATIONS), start_spread=3e-3
    ),
    "T and B, random start": played(_PAPER_TRIANGLES, start_spread=3e-3),
    "equal ramps starting together, 2 MHz apart": played(_EQUAL_RAMPS, offset=2e6),
}
"""Families by name; ramps have 0.9 GHz and 1.5 ms unless drawn from the limits of table 2."""

SPREADS: Final = (1e-4, 1e-3, 1e-2, 0.03, 0.1, 0.3)
"""Relative half widths of the draws of durations or bandwidths."""

SWEEPS: Final = (1, 2, 4, 8, 16, 32, 64)
"""Numbers of triangles in a frame."""


def compare_families(
    families: Mapping[str, Pair] = FAMILIES,
    *,
    num_sweeps: int = NUM_SWEEPS,
    num_draws: int = NUM_DRAWS,
    seed: int = 1,
    progress: Progress = no_progress,
) -> tuple[Suppression, ...]:
    """Suppression by every family; powers are averaged over ``num_draws`` pairs of radars."""
    rows = []
    for number, (name, pair) in enumerate(families.items()):
        progress("diversity", number, len(families))
        rows.append(_family(name, pair, num_sweeps, num_draws, seed))
    progress("diversity", len(families), len(families))
    return tuple(rows)


def over_spread(*, num_draws: int = NUM_DRAWS, seed: int = 1) -> dict[str, tuple[Suppression, ...]]:
    """Suppression over `SPREADS`, for draws of ramp duration (T) and of bandwidth (B)."""
    kinds = {"T": spread_time, "B": spread_band}
    return {
        name: compare_families(
            {f"±{spread:g}": kind(spread) for spread in SPREADS}, num_draws=num_draws, seed=seed
        )
        for name, kind in kinds.items()
    }


def over_sweeps(*, num_draws: int = NUM_DRAWS, seed: int = 1) -> dict[str, tuple[Suppression, ...]]:
    """Suppression over `SWEEPS` for two families."""
    names = ("T and B at every triangle (the paper)", "one slope for each radar")
    return {
        name: tuple(
            compare_families(
                {name: FAMILIES[name]}, num_sweeps=count, num_draws=num_draws, seed=seed
            )[0]
            for count in SWEEPS
        )
        for name in names
    }


def _family(name: str, pair: Pair, num_sweeps: int, num_draws: int, seed: int) -> Suppression:
    pairs = (pair(Streams(seed).of("pair", number), num_sweeps) for number in range(num_draws))
    found = [(*measured(*schedules), law(schedules[0])) for schedules in pairs]
    mean = [float(value) for value in np.mean(found, axis=0)]
    return Suppression(
        family=name,
        matched_mean=mean[0],
        matched_peak=mean[1],
        per_sweep=mean[2],
        duty=mean[3],
        law=mean[4],
        num_draws=num_draws,
    )


def side_lobes(
    pair: Pair, *, num_sweeps: int = NUM_SWEEPS, num_draws: int = 4, seed: int = 1
) -> tuple[float, float]:
    """`ambiguity` of the victims of a family, powers averaged over draws."""
    schedules = (
        pair(Streams(seed).of("pair", number), num_sweeps)[0] for number in range(num_draws)
    )
    slow, fast = np.mean([ambiguity(schedule) for schedule in schedules], axis=0)
    return float(slow), float(fast)


def law(schedule: RampSchedule) -> float:
    """Least mean of the matched output over cells, if both radars cover one band: 1/(B T_frame)."""
    return 1.0 / float(np.sum(schedule.bandwidth * schedule.duration))


def measured(victim: RampSchedule, interferer: RampSchedule) -> tuple[float, float, float, float]:
    """Matched mean and peak, per sweep, and duty of the interference at the victim."""
    received, ghost = _received(victim, interferer), _received(victim, victim)
    num_samples = int(np.sum(received.times.num_samples))
    # a synchronous ghost is one tone on every ramp, all of whose samples add in phase
    reference = float(np.sum(np.abs(ghost.samples) ** 2)) / num_samples
    matched = _matched_over_cells(received, LEAST_AMPLITUDE * np.sqrt(reference)) / reference
    ranges = np.arange(0.5, 30.0, 0.05)
    spectra = [np.mean(np.abs(range_spectra(f, ranges)[0]) ** 2, axis=0) for f in (received, ghost)]
    duty = np.sum(np.abs(received.samples) > IN_BAND * np.sqrt(reference)) / num_samples
    return (
        float(np.mean(matched[:-1])),
        float(np.max(matched)),
        float(np.max(spectra[0]) / np.max(spectra[1])),
        float(duty),
    )


def _matched_over_cells(frame: IfFrame, least: float) -> FloatArray:
    """`_matched` for all cells and, last, for that of the ghost.

    If few samples are above ``least``, V, only those are added.
    """
    cells = np.stack(np.meshgrid(CELL_RANGES, CELL_RATES, indexing="ij"), axis=-1).reshape(-1, 2)
    motions = np.array([*((*cell, 0.0) for cell in cells), (RADAR_DISTANCE / 2, 0.0, 0.0)])
    is_loud = np.abs(frame.samples[0]) > least
    if np.mean(is_loud) > FEW_SAMPLES:
        return _matched(frame.samples, frame.schedule, frame.times, motions)
    start = float(frame.schedule.start_time[0])
    phases = beat_phase(frame.schedule, frame.times, motion=motions, time=start)
    total = np.zeros(len(motions), dtype=np.complex128)
    for k, loud in enumerate(is_loud):
        t = np.flatnonzero(loud) / frame.times.rate
        cycles = phases[:, k] @ np.array([np.ones_like(t), t, 0.5 * t**2])
        total += np.exp(-2j * np.pi * cycles) @ frame.samples[0, k, loud]
    return np.asarray(np.abs(total / np.sum(frame.times.num_samples)) ** 2)


def ambiguity(schedule: RampSchedule) -> tuple[float, float]:
    """Strongest side lobes in speed, below and above 3 m/s.

    At each speed v, the greatest value is sought near the range itself and near the ranges that fit
    up- or down-ramps alone, which a speed shifts by v f/b to either side.
    """
    # a low rate is enough, as beats are at most some kilohertz
    times = sample_times(schedule, Converter(sample_rate=62.5e3))
    speeds = np.concatenate([np.arange(0.1, 3.0, 0.01), np.arange(3.0, 30.0, 0.03)])
    shift = float(np.mean(schedule.centre_frequency) / np.mean(np.abs(schedule.slope)))
    sides = np.multiply.outer(speeds * shift, np.array([-1.0, 0.0, 1.0]))
    offsets = (sides[..., None] + np.arange(-0.1, 0.11, 0.05)).reshape(len(speeds), -1)
    motions = np.stack(np.broadcast_arrays(15.0 + offsets, speeds[:, None], 0.0), axis=-1)
    start = float(schedule.start_time[0])
    samples = replica(schedule, times, motion=np.array([15.0, 0.0, 0.0]), time=start)
    power = _matched(samples[None], schedule, times, motions.reshape(-1, 3))
    strongest = power.reshape(len(speeds), -1).max(axis=1)
    return float(strongest[speeds < 3.0].max()), float(strongest[speeds >= 3.0].max())


def _matched(
    samples: ComplexArray, schedule: RampSchedule, times: SampleTimes, motions: FloatArray
) -> FloatArray:
    """Power of the sum of all samples, in phase for each of ``motions``, ``(cell,)``."""
    weight = times.is_sample.astype(np.float64)
    start = float(schedule.start_time[0])
    phases = beat_phase(schedule, times, motion=motions, time=start)
    amplitude = matched_amplitudes(samples, weight, phases, times.rate)[:, 0]
    share = weight.sum(axis=1) / weight.sum()
    return np.asarray(np.abs(amplitude @ share) ** 2)


def _received(victim: RampSchedule, interferer: RampSchedule) -> IfFrame:
    """Frame of the victim that contains the signal of the other radar alone."""
    array = AntennaArray(num_channels=1)
    scene = Scene(
        time=0.0,
        actors=(
            Actor(name="a", kind="vehicle"),
            Actor(name="b", kind="vehicle", pose=Pose(x=RADAR_DISTANCE, yaw=np.pi)),
        ),
        radars=(Radar(name="a", array=array), Radar(name="b", array=array)),
        carriers=(0, 1),
    )
    samples = Stretch().contribution(
        scene, (victim, interferer), (FreeSpace().trace(scene),), victim=0, transmitter=1
    )
    return IfFrame(
        samples=samples[0],
        times=sample_times(victim, scene.radars[0].converter),
        schedule=victim,
        array=array,
    )
