"""A recording of a real radar with simulated interference, before and after mitigation.

The recording is that of OpenRadar (Apache-2.0), ``doppler_example_1.npy``: 128 chirps of 60 MHz/µs
from 77.42 GHz on, 8 virtual channels (2 elements in turns × 4), 128 samples at 2.5 MS/s. Its int16
samples were stored as unsigned ones. Chirps of one element alone are used.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation import (
    AnyMitigation,
    Autoregression,
    Blanking,
    Burg,
    Imat,
    MatrixPencil,
    Nulling,
    StftExcision,
)
from polychirp.rng import Streams

FILE: Final = "data/openradar/doppler_example_1.npy"
"""Place of the recording in the folder of shared data."""

METHODS: Final[Mapping[str, AnyMitigation | None]] = {
    "nothing": None,
    "blanking": Blanking(),
    "Burg": Burg(order=8),
    "autoregression": Autoregression(order=8, longest_gap=8.0),
    "matrix pencil": MatrixPencil(window=16),
    "IMAT": Imat(),
    "nulling": Nulling(),
    "STFT excision": StftExcision(window=16),
}
"""Methods by name, with orders and windows for 128 samples."""

RATE, SLOPE, START = 2.5e6, 60e12, 77.4201e9
INTERVAL: Final = 2 * 92e-6
"""Time from one chirp of an element to its next one, s: two of 30 µs idle and 62 µs ramp."""


def recorded_frame(path: Path) -> IfFrame:
    """The recording as a frame of four channels."""
    raw = np.load(path)
    real, imag = (
        part.astype(np.int64).astype(np.uint16).view(np.int16).astype(np.float64)
        for part in (raw.real, raw.imag)
    )
    samples = np.moveaxis((real + 1j * imag)[:, :4], 0, 1)
    ramps, length = samples.shape[1:]
    start, equal = INTERVAL * np.arange(ramps), np.ones(ramps)
    return IfFrame(
        samples=samples,
        times=SampleTimes(first=start, num_samples=np.full(ramps, length), rate=RATE),
        schedule=RampSchedule(
            start_time=start,
            duration=equal * length / RATE,
            start_frequency=START * equal,
            slope=SLOPE * equal,
            start_phase=0.0 * equal,
            sweep=np.arange(ramps),
        ),
        array=AntennaArray(num_channels=len(samples)),
    )


def injected(frame: IfFrame, *, streams: Streams, level: float = 10.0) -> ComplexArray:
    """Chirps of a slope that differs by 0.4 %, on every second ramp, from a drawn direction.

    A slope of 60 MHz/µs makes any other crossing shorter than a sample: of half the slope, 0.08 µs.
    Here the band of ±1.25 MHz is crossed in 10 µs, 26 samples.

    Parameters
    ----------
    level : amplitude over the rms of the recording
    """
    random = streams["injected"]
    out = np.zeros_like(frame.samples)
    time = np.arange(frame.samples.shape[2]) / RATE
    amplitude = level * float(np.sqrt(np.mean(np.abs(frame.samples) ** 2)))
    steering = np.exp(1j * np.pi * np.arange(len(out)) * random.uniform(-0.7, 0.7))
    for ramp in range(0, out.shape[1], 2):
        away = time - random.uniform(0.2, 0.8) * time[-1]
        beat = 0.004 * SLOPE * away
        line = np.exp(2j * np.pi * (0.5 * beat * away + random.random()))
        out[:, ramp] = amplitude * steering[:, None] * line * (np.abs(beat) < 0.5 * RATE)
    return out


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordedResult:
    """Samples after a method, and the power of their error over that of the interference."""

    method: str
    samples: ComplexArray
    left: float


def compare_recorded(frame: IfFrame, interference: ComplexArray) -> tuple[RecordedResult, ...]:
    """Every method on the recording with interference; the recording itself is the truth."""
    spoiled = frame.with_samples(frame.samples + interference)
    results = []
    for name, method in METHODS.items():
        after = spoiled.samples if method is None else method.mitigate(spoiled).samples
        error = np.sum(np.abs(after - frame.samples) ** 2) / np.sum(np.abs(interference) ** 2)
        results.append(RecordedResult(method=name, samples=after, left=float(error)))
    return tuple(results)
