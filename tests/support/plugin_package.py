"""A package with plug-ins, written as an installed one: a module and its metadata."""

from __future__ import annotations

from pathlib import Path

JITTERED = '''
"""A waveform in a package of its own."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

import polychirp as pc
from polychirp.spec import Spec
from polychirp.units import Hertz, Seconds


@dataclass(frozen=True, kw_only=True)
class Jittered(Spec):
    """Equal chirps with random intervals.

    Parameters
    ----------
    jitter : s, greatest addition to the silence before a chirp
    """

    kind: Literal["jittered"] = "jittered"
    start_frequency: Hertz = 76.5e9
    bandwidth: Hertz = 300e6
    ramp_duration: Seconds = 20e-6
    idle: Seconds = 5e-6
    jitter: Seconds = 2e-6

    def __post_init__(self) -> None:
        if not self.jitter >= 0:
            raise pc.InputError("a jittered waveform cannot have a negative jitter; use 0 or more")

    def schedule(self, *, num_sweeps: int, streams: pc.Streams) -> pc.RampSchedule:
        """Ramps of ``num_sweeps`` chirps."""
        if num_sweeps < 1:
            raise pc.InputError(f"num_sweeps is {num_sweeps}; a schedule needs 1 or more")
        extra = streams["waveform", "jitter"].uniform(0.0, self.jitter, num_sweeps)
        interval = self.ramp_duration + self.idle + extra
        duration = np.full(num_sweeps, self.ramp_duration)
        start = np.full(num_sweeps, self.start_frequency)
        slope = np.full(num_sweeps, self.bandwidth / self.ramp_duration)
        return pc.RampSchedule(
            start_time=np.concatenate([[0.0], np.cumsum(interval)[:-1]]),
            duration=duration,
            start_frequency=start,
            slope=slope,
            start_phase=pc.continuous_phase(duration=duration, start_frequency=start, slope=slope),
            sweep=np.arange(num_sweeps),
        )
'''


HALVES = '''
"""A mitigation in a package of its own."""

from dataclasses import dataclass
from typing import Literal

from polychirp.receiver.mitigation.base import Mitigated, with_weights
from polychirp.spec import Spec


@dataclass(frozen=True, kw_only=True)
class FirstHalf(Spec):
    """Keep the first part of every ramp.

    Parameters
    ----------
    share : of a ramp that is kept
    """

    kind: Literal["first-half"] = "first-half"
    share: float = 0.5

    def mitigate(self, frame) -> Mitigated:
        """The frame without the samples behind the first part."""
        kept = frame.times.is_sample.cumsum(axis=1) <= self.share * frame.times.num_samples[:, None]
        return with_weights(frame, kept & frame.times.is_sample)
'''


PLAIN_FFT = '''
"""A receiver in a package of its own."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.special import gammainccinv, gammaincinv

import polychirp as pc
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.settings import SearchSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainFft(SearchSettings):
    """Two Fourier transforms of equal chirps, without windows; it measures no azimuth."""

    kind: Literal["plain-fft"] = "plain-fft"

    def refuse(self, schedule: pc.RampSchedule) -> None:
        """Refuse chirps that differ."""
        if np.ptp(schedule.slope) > 0 or np.ptp(schedule.start_frequency) > 0:
            raise pc.CapabilityError("chirps differ; the receiver 'coherent' reads them")

    def detect(self, frame: pc.IfFrame) -> pc.Detections:
        """Local maxima of the mean power of all channels over its floor."""
        self.refuse(frame.schedule)
        samples = mitigated(self.mitigation, frame).samples
        channels, ramps, fast = samples.shape
        spectra = np.fft.fft2(samples, s=(2 * ramps, 2 * fast), axes=(1, 2)) / (ramps * fast)
        power = np.mean(np.abs(spectra) ** 2, axis=0)
        distance, rate = self._axes(frame, *power.shape)
        power = power[:, distance < self.greatest_range]
        floor = np.median(power) / gammaincinv(channels, 0.5) * channels
        least = floor * gammainccinv(channels, self.false_alarm_probability) / channels
        is_peak = power > least
        for step in (-1, 1):
            is_peak &= power > np.roll(power, step, axis=0)
            is_peak[:, 1:-1] &= power[:, 1:-1] > np.roll(power, step, axis=1)[:, 1:-1]
        row, column = np.nonzero(is_peak)
        slope, carrier = frame.schedule.slope[0], frame.schedule.centre_frequency[0]
        apart = distance[column] - carrier / slope * rate[row]  # a Doppler shift is in the beat
        is_inside = (apart >= self.least_range) & (apart <= self.greatest_range)
        is_inside &= np.abs(rate[row]) <= self.greatest_speed
        strongest = np.argsort(-power[row, column], kind="stable")
        kept = strongest[is_inside[strongest]][: self.most_detections]
        middle = 0.5 * (frame.schedule.start_time[0] + frame.schedule.end_time[-1])
        return pc.Detections(
            time=float(middle),
            range=apart[kept] + rate[row][kept] * (middle - frame.schedule.start_time[0]),
            range_rate=rate[row][kept],
            azimuth=np.full(kept.size, np.nan),
            power=power[row, column][kept],
            snr=power[row, column][kept] / max(floor, 1e-300),
        )

    def _axes(self, frame, rows, columns):
        """Ranges, m, of beats, and range rates, m/s, of the Fourier transforms."""
        interval = np.mean(np.diff(frame.schedule.start_time))
        beat = np.fft.fftfreq(columns, 1 / frame.times.rate)
        doppler = np.fft.fftfreq(rows, interval)
        slope, carrier = frame.schedule.slope[0], frame.schedule.centre_frequency[0]
        distance = beat * SPEED_OF_LIGHT / (2 * slope)
        return np.where(distance < 0, np.inf, distance), doppler * SPEED_OF_LIGHT / (2 * carrier)
'''


def install(folder: Path, *, module: str, text: str, entry_points: str) -> None:
    """Write a module and the metadata of a package ``module`` 1.0 into a folder of packages."""
    (folder / f"{module}.py").write_text(text, encoding="utf-8")
    metadata = folder / f"{module}-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n", encoding="utf-8"
    )
    (metadata / "entry_points.txt").write_text(entry_points, encoding="utf-8")
