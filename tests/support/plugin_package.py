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


def install(folder: Path, *, module: str, text: str, entry_points: str) -> None:
    """Write a module and the metadata of a package ``module`` 1.0 into a folder of packages."""
    (folder / f"{module}.py").write_text(text, encoding="utf-8")
    metadata = folder / f"{module}-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n", encoding="utf-8"
    )
    (metadata / "entry_points.txt").write_text(entry_points, encoding="utf-8")
