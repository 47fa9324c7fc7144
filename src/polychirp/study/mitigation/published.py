"""Signals of the literature on mitigation, made from their descriptions; places and phases drawn.

What a description leaves open is chosen here, and said so.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfFrame, IfParts
from polychirp.rng import Streams
from polychirp.study.mitigation.hand_frames import (
    Butterworth,
    ChirpSequence,
    HandInterferer,
    HandTarget,
    hand_frame,
)
from polychirp.units import from_db

TU_DELFT_SLOPES: Final = (3.0, -2.0, -1.5)
"""Slopes of the interferers over that of the victim."""

ARIM_GRID: Final = tuple(
    (snr, sir, ratio / 10)
    for snr in range(5, 41, 5)
    for sir in range(-5, snr + 6, 5)
    for ratio in range(16)
)
"""SNR and SIR in dB, and slope of the interferer over that of the victim: all 960 cells of ARIM. In
the 60 with equal slopes the interferer's amplitude is zero by their formula."""

ARIM_CELLS: Final = tuple(cell for cell in ARIM_GRID if cell[2] != 1.0)
"""Cells of `ARIM_GRID` without equal slopes, whose beat does not cross the band."""

TOTH_FILTER: Final = Butterworth(order=9, cutoff=9e6)
"""Filter of the second case of Toth et al. 2019: of order 9. Its cutoff is chosen, 0.45 of the
sample rate. Their imperfect detector is that of each method here; the perfect one of the first case
is `KnownBursts`."""


class PublishedFrame(NamedTuple):
    """A drawn frame, its parts, and its targets."""

    frame: IfFrame
    parts: IfParts
    targets: tuple[HandTarget, ...]


def tu_delft(streams: Streams, *, num_targets: int = 3) -> PublishedFrame:
    """One ramp with three crossing interferers (J. Wang, Ding and Yarovoy 2022).

    Stated: 4160 samples at 12 MS/s, slope 10¹¹ Hz/s, interferers of 3, −2 and −1.5 times that
    slope, SNR 15 dB and SINR −12.7 dB of the samples. Chosen: targets of up to 10 dB difference
    with beats of 2 to 80 % of half the sample rate, interferers of equal amplitude that cross
    the victim's frequency within the middle 80 % of the ramp.
    """
    random = streams["published"]
    rate, count, slope = 12e6, 4160, 1e11
    victim = ChirpSequence(
        start_frequency=77e9, slope=slope, num_ramps=1, interval=2.0 * count / rate
    )
    targets = tuple(
        HandTarget(range=_range_of(beat, slope), amplitude=10.0 ** (-level / 20.0))
        for beat, level in zip(
            random.uniform(0.02, 0.8, num_targets) * 0.5 * rate,
            random.uniform(0.0, 10.0, num_targets),
            strict=True,
        )
    )
    interferers = []
    for ratio in TU_DELFT_SLOPES:
        crossing = random.uniform(0.1, 0.9) * count / rate
        chirps = ChirpSequence(
            start_frequency=victim.start_frequency + slope * (1.0 - ratio) * crossing,
            slope=ratio * slope,
            num_ramps=1,
            interval=4.0 * count / rate,
        )
        interferers.append(HandInterferer(chirps=chirps, start=0.0, amplitude=1.0))
    echo = sum(target.amplitude**2 for target in targets)
    noise = echo / from_db(15.0)
    frame, parts = hand_frame(
        victim,
        num_samples=count,
        sample_rate=rate,
        targets=targets,
        interferers=interferers,
        noise=noise,
        streams=streams,
    )
    return PublishedFrame(*with_disturbance(frame, parts, sinr=from_db(-12.7)), targets)


def arim(streams: Streams, *, snr: float, sir: float, ratio: float) -> PublishedFrame:
    """One ramp of ARIM's grid (Ristea, Anghel and Ionescu 2020).

    Stated: 40 MS/s, 1.6 GHz in 25.6 µs, 1024 samples, 1 to 4 targets at 2 to 95 m, one interferer
    that crosses in the middle 15 MHz of beats. SIR is that of the spectrum: the amplitude of the
    interferer over that of the strongest target is the square root of the relative slope, times
    the duration, over that of the SIR. Chosen: the other targets are up to 20 dB weaker.

    Echoes have beats from zero to the sample rate: beyond 48 m those above half of it, which the
    upper half of the discrete spectrum holds. The interferer is in the samples while its beat is
    within half the sample rate of zero.

    Parameters
    ----------
    snr : of the strongest target in a sample, ratio
    sir : ratio, see above
    ratio : slope of the interferer over that of the victim; at 1 there is no interference
    """
    random = streams["published"]
    rate, count = 40e6, 1024
    slope = 1.6e9 / 25.6e-6
    victim = ChirpSequence(
        start_frequency=77e9, slope=slope, num_ramps=1, interval=2.0 * count / rate
    )
    number = int(random.integers(1, 5))
    levels = np.append(0.0, random.uniform(0.0, 20.0, number - 1))
    targets = tuple(
        HandTarget(range=float(distance), amplitude=10.0 ** (-level / 20.0))
        for distance, level in zip(random.uniform(2.0, 95.0, number), levels, strict=True)
    )
    crossing = random.uniform(0.2, 0.8) * count / rate
    amplitude = np.sqrt(slope * abs(1.0 - ratio)) * count / rate / np.sqrt(sir)
    chirps = ChirpSequence(
        start_frequency=victim.start_frequency
        + slope * (1.0 - ratio) * crossing
        + random.uniform(-7.5e6, 7.5e6),
        slope=ratio * slope,
        num_ramps=1,
        interval=4.0 * count / rate,
    )
    drawn = hand_frame(
        victim,
        num_samples=count,
        sample_rate=rate,
        targets=targets,
        interferers=[HandInterferer(chirps=chirps, start=0.0, amplitude=float(amplitude))],
        noise=1.0 / snr,
        streams=streams,
    )
    return PublishedFrame(*drawn, targets)


def toth(
    streams: Streams,
    *,
    num_ramps: int = 128,
    interferers: Sequence[int] = (1, 2, 3),
    filtering: Butterworth | None = None,
) -> PublishedFrame:
    """A chirp sequence with 1 to 3 crossing interferers (Toth, Meissner, Melzer and Witrisal 2019).

    Stated: 76 GHz, 1 GHz in 48 µs, 20 MS/s, 128 ramps; interferers of 0.6 to 1.4 GHz in 40 to
    46 µs from 75.8 to 76.2 GHz on; SIR −60 to −20 dB and SNR −10 to 10 dB of a sample. Chosen:
    ramps follow each other after 60 µs, 3 targets at 5 to 60 m and up to 25 m/s, 20 dB apart.

    Parameters
    ----------
    interferers : numbers of interferers, one of which is drawn
    filtering : `TOTH_FILTER` for their second case; None for their ideal one
    """
    random = streams["published"]
    rate, duration = 20e6, 48e-6
    victim = ChirpSequence(
        start_frequency=76e9, slope=1e9 / duration, num_ramps=num_ramps, interval=60e-6
    )
    levels = np.append(0.0, random.uniform(0.0, 20.0, 2))
    targets = tuple(
        HandTarget(range=float(distance), range_rate=float(speed), amplitude=10.0 ** (-level / 20))
        for distance, speed, level in zip(
            random.uniform(5.0, 60.0, 3), random.uniform(-25.0, 25.0, 3), levels, strict=True
        )
    )
    others = []
    sir = from_db(random.uniform(-60.0, -20.0))
    for _ in range(int(random.choice(interferers))):
        length = random.uniform(40e-6, 46e-6)
        chirps = ChirpSequence(
            start_frequency=float(random.uniform(75.8e9, 76.2e9)),
            slope=float(random.uniform(0.6e9, 1.4e9)) / length,
            num_ramps=num_ramps,
            interval=float(length + random.uniform(2e-6, 20e-6)),
        )
        start = -float(random.uniform(0.0, chirps.interval))
        others.append(HandInterferer(chirps=chirps, start=start, amplitude=float(sir**-0.5)))
    drawn = hand_frame(
        victim,
        num_samples=round(rate * duration),
        sample_rate=rate,
        targets=targets,
        interferers=others,
        noise=1.0 / from_db(random.uniform(-10.0, 10.0)),
        streams=streams,
        filtering=filtering,
    )
    return PublishedFrame(*drawn, targets)


def with_disturbance(frame: IfFrame, parts: IfParts, *, sinr: float) -> tuple[IfFrame, IfParts]:
    """Frame whose interference is scaled so that its samples have this SINR, a ratio of powers."""
    echo, noise, other = (
        float(np.mean(np.abs(part) ** 2)) for part in (parts.echo, parts.noise, parts.interference)
    )
    gain = np.sqrt(max(echo / sinr - noise, 0.0) / max(other, 1e-300))
    scale = np.array([gain if name in ("direct", "indirect") else 1.0 for name in parts.names])
    samples = parts.samples * scale[:, None, None, None]
    return frame.with_samples(samples.sum(axis=0)), replace(parts, samples=samples)


def _range_of(beat: float, slope: float) -> float:
    return 0.5 * SPEED_OF_LIGHT * float(beat) / slope
