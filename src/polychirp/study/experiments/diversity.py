r"""Which diversity is enough: two radars that face each other, over the space of waveforms.

Both hear nothing but each other. What the interferer leaves in the victim's samples is compared
with the ghost that it would make if it played the victim's own ramps in step:

- *matched*: every ramp and sample added in phase for a point at (R, v), on a grid of cells;
- *per sweep*: the powers of Hann-windowed spectra averaged over ramps, as the paper's figures do;
- *duty*: the share of samples in which the interferer is in the IF band.

Two chirps that cover the same band share it with the whole frame, so that their mean over cells
is bounded by the product of bandwidth and frame,

.. math:: 10\log_{10} B\,T_{frame}

whatever their order, slopes and starts: for unit energies
:math:`\int |S_1|^2|S_2|^2\,df \ge 1/(B\,T_{frame})` by Cauchy and Schwarz, where
BT_frame is 2nBT for n triangles of two ramps T. Only less overlap of spectra beats it.
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

DISTANCE: Final = 13.2
"""m between the two radars, as in the paper's scenario C."""

NUM_SWEEPS: Final = 16

DRAWS: Final = 16
"""Pairs of radars drawn of every family."""

IN_BAND: Final = 0.5
"""Of the amplitude that it has in the middle of the band: an interferer is heard above this."""

FAINT: Final = 1e-4
"""Of that amplitude: what is fainter is left out of the matched output, where even if all samples
were so faint and agreed it would leave −80 dB."""

FEW: Final = 0.02
"""Share of samples up to which it is cheaper to add single ones."""

CELL_RANGES: Final = np.linspace(1.0, 29.0, 40)
"""m, of the cells of the matched output."""

CELL_RATES: Final = np.linspace(-30.0, 30.0, 70)
"""m/s, of the cells of the matched output."""

TIME: Final = (1e-3, 2e-3)
"""s, limits of ramp times in the paper's table 2."""

BAND: Final = (800e6, 1000e6)
"""Hz, limits of bandwidths there."""

_MIDDLE_TIME: Final = 1.5e-3
_MIDDLE_BAND: Final = 900e6

Pair = Callable[[Streams, int], tuple[RampSchedule, RampSchedule]]
"""From random streams and a number of sweeps to what victim and interferer play."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Suppression:
    """Of one family of waveforms, in the mean over draws; ratios to a ghost in step.

    Parameters
    ----------
    family : its name
    matched_mean, matched_peak : matched output, mean over cells and strongest cell
    per_sweep : strongest range of the averaged spectra
    duty : share of samples in the band
    law : 1/(B T_frame)
    num_draws : pairs of radars drawn
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
    """A pair of radars that play ``first`` and ``second`` (or both the first).

    Parameters
    ----------
    start_spread : s, the interferer starts within so much after the victim
    start_jitter : s, sweeps of both start so much late, uniformly
    offset : Hz, by which all that the interferer plays is higher
    """

    def pair(streams: Streams, num_sweeps: int) -> tuple[RampSchedule, RampSchedule]:
        plans = []
        for name, waveform in (("victim", first), ("interferer", second or first)):
            own = streams.of("radar", name)
            plan = waveform.schedule(num_sweeps=num_sweeps, streams=own)
            if start_jitter:
                late = np.cumsum(own["jitter"].uniform(0.0, start_jitter, num_sweeps))
                plan = plan.with_late_sweeps(late)
            plans.append(plan)
        start = float(streams["start"].uniform(0.0, 1.0)) * start_spread
        interferer = plans[1].as_clocked(start_time=start, clock_offset=0.0)
        return plans[0], replace(interferer, start_frequency=interferer.start_frequency + offset)

    return pair


def spread_time(spread: float) -> Pair:
    """Ramp times drawn at every triangle within ±``spread`` of their middle, bandwidths equal."""
    limits = (_MIDDLE_TIME * (1 - spread), _MIDDLE_TIME * (1 + spread))
    return played(DiverseTriangular(bandwidth=(_MIDDLE_BAND, _MIDDLE_BAND), ramp_duration=limits))


def spread_band(spread: float) -> Pair:
    """Bandwidths drawn at every triangle within ±``spread`` of their middle, ramp times equal."""
    limits = (_MIDDLE_BAND * (1 - spread), _MIDDLE_BAND * (1 + spread))
    return played(DiverseTriangular(bandwidth=limits, ramp_duration=(_MIDDLE_TIME, _MIDDLE_TIME)))


_EQUAL: Final = Triangular()
_SAME: Final = DiverseTriangular(
    bandwidth=(_MIDDLE_BAND, _MIDDLE_BAND), ramp_duration=(_MIDDLE_TIME, _MIDDLE_TIME)
)
_BOTH: Final = DiverseTriangular(bandwidth=BAND, ramp_duration=TIME)

FAMILIES: Final[Mapping[str, Pair]] = {
    "equal ramps, in step": played(_EQUAL),
    "one slope for each radar": played(FixedTriangular(bandwidth=BAND, ramp_duration=TIME)),
    "T at every triangle": played(replace(_SAME, ramp_duration=TIME)),
    "B at every triangle": played(replace(_SAME, bandwidth=BAND)),
    "T and B at every triangle (the paper)": played(_BOTH),
    "start frequency, 0 to 100 MHz": played(replace(_SAME, start_frequency_spread=100e6)),
    "start frequency hops over 3 GHz": played(
        replace(_SAME, start_frequency=77e9, start_frequency_spread=3e9)
    ),
    "up or down first": played(replace(_SAME, random_order=True)),
    "start jitter, 0 to 20 µs": played(_SAME, start_jitter=20e-6),
    "T, B, start frequency and order": played(
        replace(_BOTH, start_frequency_spread=100e6, random_order=True)
    ),
    "equal ramps, random start": played(_EQUAL, start_spread=3e-3),
    "one slope for each radar, random start": played(
        FixedTriangular(bandwidth=BAND, ramp_duration=TIME), start_spread=3e-3
    ),
    "T and B, random start": played(_BOTH, start_spread=3e-3),
    "equal ramps in step, 2 MHz apart": played(_EQUAL, offset=2e6),
}
"""By name; ramps of 0.9 GHz and 1.5 ms unless drawn from table 2's limits."""

SPREADS: Final = (1e-4, 1e-3, 1e-2, 0.03, 0.1, 0.3)
"""Relative half-widths of the draws."""

SWEEPS: Final = (1, 2, 4, 8, 16, 32, 64)
"""Triangles in a frame."""


def compare_families(
    families: Mapping[str, Pair] = FAMILIES,
    *,
    num_sweeps: int = NUM_SWEEPS,
    num_draws: int = DRAWS,
    seed: int = 1,
    progress: Progress = no_progress,
) -> tuple[Suppression, ...]:
    """Every family over ``num_draws`` pairs of radars; powers are averaged over pairs."""
    rows = []
    for number, (name, pair) in enumerate(families.items()):
        progress("diversity", number, len(families))
        rows.append(_family(name, pair, num_sweeps, num_draws, seed))
    progress("diversity", len(families), len(families))
    return tuple(rows)


def over_spread(*, num_draws: int = DRAWS, seed: int = 1) -> dict[str, tuple[Suppression, ...]]:
    """Families of one diversity each, over `SPREADS`."""
    kinds = {"T": spread_time, "B": spread_band}
    return {
        name: compare_families(
            {f"±{spread:g}": kind(spread) for spread in SPREADS}, num_draws=num_draws, seed=seed
        )
        for name, kind in kinds.items()
    }


def over_sweeps(*, num_draws: int = DRAWS, seed: int = 1) -> dict[str, tuple[Suppression, ...]]:
    """What a frame of more triangles gives, over `SWEEPS`."""
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
    found = [(*measured(*plans), law(plans[0])) for plans in pairs]
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
    """`ambiguity` of a family's victims, powers averaged over draws."""
    plans = (pair(Streams(seed).of("pair", number), num_sweeps)[0] for number in range(num_draws))
    slow, fast = np.mean([ambiguity(plan) for plan in plans], axis=0)
    return float(slow), float(fast)


def law(plan: RampSchedule) -> float:
    """1/(B T_frame): the least mean of the matched output over cells in one band."""
    return 1.0 / float(np.sum(plan.bandwidth * plan.duration))


def measured(victim: RampSchedule, interferer: RampSchedule) -> tuple[float, float, float, float]:
    """Matched mean and peak, per sweep, and duty of what the victim hears of the interferer."""
    heard, ghost = _heard(victim, interferer), _heard(victim, victim)
    num_samples = int(np.sum(heard.times.num_samples))
    # a ghost in step is one tone on every ramp, which matching adds up whole
    reference = float(np.sum(np.abs(ghost.samples) ** 2)) / num_samples
    matched = _matched_over_cells(heard, FAINT * np.sqrt(reference)) / reference
    ranges = np.arange(0.5, 30.0, 0.05)
    spectra = [np.mean(np.abs(range_spectra(f, ranges)[0]) ** 2, axis=0) for f in (heard, ghost)]
    duty = np.sum(np.abs(heard.samples) > IN_BAND * np.sqrt(reference)) / num_samples
    return (
        float(np.mean(matched[:-1])),
        float(np.max(matched)),
        float(np.max(spectra[0]) / np.max(spectra[1])),
        float(duty),
    )


def _matched_over_cells(frame: IfFrame, least: float) -> FloatArray:
    """`_matched` for all cells and, last, for the ghost's own.

    Where samples above ``least``, V, are few, only they are added.
    """
    cells = np.stack(np.meshgrid(CELL_RANGES, CELL_RATES, indexing="ij"), axis=-1).reshape(-1, 2)
    motions = np.array([*((*cell, 0.0) for cell in cells), (DISTANCE / 2, 0.0, 0.0)])
    is_loud = np.abs(frame.samples[0]) > least
    if np.mean(is_loud) > FEW:
        return _matched(frame.samples, frame.schedule, frame.times, motions)
    start = float(frame.schedule.start_time[0])
    phases = beat_phase(frame.schedule, frame.times, motion=motions, time=start)
    total = np.zeros(len(motions), dtype=np.complex128)
    for k, loud in enumerate(is_loud):
        t = np.flatnonzero(loud) / frame.times.rate
        cycles = phases[:, k] @ np.array([np.ones_like(t), t, 0.5 * t**2])
        total += np.exp(-2j * np.pi * cycles) @ frame.samples[0, k, loud]
    return np.asarray(np.abs(total / np.sum(frame.times.num_samples)) ** 2)


def ambiguity(plan: RampSchedule) -> tuple[float, float]:
    """Strongest side lobes in speed, below and above 3 m/s.

    At each speed the range is sought where up- or down-ramps, or all, fit best: a speed v shifts
    them by v f/b to either side.
    """
    # no beat here is faster than some kilohertz
    times = sample_times(plan, Converter(sample_rate=62.5e3))
    speeds = np.concatenate([np.arange(0.1, 3.0, 0.01), np.arange(3.0, 30.0, 0.03)])
    shift = float(np.mean(plan.centre_frequency) / np.mean(np.abs(plan.slope)))
    sides = np.multiply.outer(speeds * shift, np.array([-1.0, 0.0, 1.0]))
    offsets = (sides[..., None] + np.arange(-0.1, 0.11, 0.05)).reshape(len(speeds), -1)
    motions = np.stack(np.broadcast_arrays(15.0 + offsets, speeds[:, None], 0.0), axis=-1)
    start = float(plan.start_time[0])
    samples = replica(plan, times, motion=np.array([15.0, 0.0, 0.0]), time=start)
    power = _matched(samples[None], plan, times, motions.reshape(-1, 3))
    strongest = power.reshape(len(speeds), -1).max(axis=1)
    return float(strongest[speeds < 3.0].max()), float(strongest[speeds >= 3.0].max())


def _matched(
    samples: ComplexArray, plan: RampSchedule, times: SampleTimes, motions: FloatArray
) -> FloatArray:
    """Power of all samples added in phase for each of ``motions``, ``(cell,)``."""
    weight = times.is_sample.astype(np.float64)
    phases = beat_phase(plan, times, motion=motions, time=float(plan.start_time[0]))
    amplitude = matched_amplitudes(samples, weight, phases, times.rate)[:, 0]
    share = weight.sum(axis=1) / weight.sum()
    return np.asarray(np.abs(amplitude @ share) ** 2)


def _heard(victim: RampSchedule, interferer: RampSchedule) -> IfFrame:
    """What the victim hears of the other radar, and nothing else."""
    array = AntennaArray(num_channels=1)
    scene = Scene(
        time=0.0,
        actors=(
            Actor(name="a", kind="vehicle"),
            Actor(name="b", kind="vehicle", pose=Pose(x=DISTANCE, yaw=np.pi)),
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
