"""`IfFrame` and `IfParts`: dechirped samples, and their separate parts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np

from polychirp.axes import Axes, BoolArray, ComplexArray, FloatArray, PerRamp, PerRampIndex, seal
from polychirp.errors import InputError, did_you_mean
from polychirp.model.antenna import AntennaArray
from polychirp.model.front_end import HighPass
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule

PARTS: Final = ("echo", "multipath", "direct", "indirect", "noise", "leakage", "distortion")
"""Own echo without and with a reflecting plane; another radar's signal without and with a bounce;
thermal noise; the radar's own signal without any scene; the change of the sum of all that by
saturation, quantisation and offsets."""


def parts_of(radar: Radar) -> tuple[str, ...]:
    """The parts that a radar's samples have, in the order of `PARTS`.

    >>> parts_of(Radar(name="front"))
    ('echo', 'multipath', 'direct', 'indirect', 'noise')
    """
    absent = {"leakage": not radar.receives_itself, "distortion": not radar.front_end.distorts}
    return tuple(part for part in PARTS if not absent.get(part, False))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SampleTimes:
    """Times of the converter's samples: sample n of ramp k is taken at ``first[k] + n/rate``.

    Parameters
    ----------
    first : s, ``(ramp,)``
    num_samples : ``(ramp,)``
    rate : 1/s
    """

    first: PerRamp
    num_samples: PerRampIndex
    rate: float

    def __post_init__(self) -> None:
        seal(self)

    @property
    def most_samples(self) -> int:
        """Length of the padded ``fast`` axis."""
        return int(self.num_samples.max())

    @property
    def is_sample(self) -> BoolArray:
        """Mask ``(ramp, fast)``, false in the padding after a short ramp's last sample."""
        return np.arange(self.most_samples) < self.num_samples[:, None]

    @property
    def time(self) -> FloatArray:
        """Times, s, ``(ramp, fast)``, also of the padding."""
        return self.first[:, None] + np.arange(self.most_samples) / self.rate


def sample_times(schedule: RampSchedule, converter: Converter) -> SampleTimes:
    """The sampling window of every ramp.

    Raises
    ------
    InputError
        A ramp is too short for two samples between the converter's start and margin.
    """
    room = schedule.duration - converter.start - converter.margin
    # a window that ends on a sample keeps it in spite of rounding
    count = np.floor(room * converter.sample_rate * (1 + 1e-12) + 1e-9).astype(np.int64) + 1
    shortest = int(np.argmin(count))
    if room[shortest] <= 0 or count[shortest] < 2:
        raise InputError(
            f"ramp {shortest} lasts {schedule.duration[shortest] * 1e6:.4g} µs, shorter than its "
            f"converter's start ({converter.start * 1e6:.4g} µs) and margin "
            f"({converter.margin * 1e6:.4g} µs) and two samples; lengthen the ramp or shorten them"
        )
    return SampleTimes(
        first=schedule.start_time + converter.start, num_samples=count, rate=converter.sample_rate
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class IfFrame:
    r"""Dechirped samples of one radar over one frame.

    A sample is :math:`y = s_{tx}\,\overline{s_{rx}}`, so that an echo at range R on an up-ramp
    beats at **+**\ 2bR/c. :math:`|y|^2` is power in W at the converter's input (volts across one
    ohm). Short ramps are padded with zeros from sample ``times.num_samples`` on.

    Parameters
    ----------
    samples : V, ``(channel, ramp, fast)`` complex
    times : of the samples
    schedule : ramps that the radar transmitted
    array : its antenna
    high_pass : whose causal phase is in the samples, known to a receiver
    """

    samples: Annotated[ComplexArray, Axes("channel", "ramp", "fast", dtype=np.complex128)]
    times: SampleTimes
    schedule: RampSchedule
    array: AntennaArray
    high_pass: HighPass | None = None

    def __post_init__(self) -> None:
        seal(self)
        expected = (
            self.array.num_channels,
            self.schedule.num_ramps,
            self.times.most_samples,
        )
        if self.samples.shape != expected or self.times.first.size != self.schedule.num_ramps:
            raise InputError(
                f"IfFrame.samples has shape {self.samples.shape}; its array, schedule and sample "
                f"times ask for {expected} (channel, ramp, fast)"
            )

    def with_samples(self, samples: ComplexArray) -> IfFrame:
        """The same frame with other samples."""
        return replace(self, samples=samples)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class IfParts:
    """Parts of a frame's samples, which sum to them.

    All parts but the distortion are linear: each is the samples that its source alone would give.

    Parameters
    ----------
    samples : V, ``(part, channel, ramp, fast)``
    names : of the parts, in the order of `PARTS`; a part that is missing is zero
    neglected : V, bound on the rms over the frame of the signals of neglected radars
    """

    samples: Annotated[ComplexArray, Axes("part", "channel", "ramp", "fast", dtype=np.complex128)]
    names: tuple[str, ...] = PARTS
    neglected: float = 0.0

    def __post_init__(self) -> None:
        seal(self)
        if self.names != tuple(part for part in PARTS if part in self.names):
            raise InputError(f"IfParts.names are of {', '.join(PARTS)}, in this order")
        if self.samples.shape[0] != len(self.names):
            raise InputError(f"IfParts.samples needs the parts {', '.join(self.names)}")

    def __getitem__(self, part: str) -> ComplexArray:
        """One part, ``(channel, ramp, fast)``."""
        if part in self.names:
            return np.asarray(self.samples[self.names.index(part)])
        if part not in PARTS:
            raise InputError(f"there is no part '{part}'; {did_you_mean(part, PARTS)}")
        return np.broadcast_to(np.complex128(0.0), self.samples.shape[1:])

    @property
    def echo(self) -> ComplexArray:
        """The radar's own echo, with multipath."""
        return self["echo"] + self["multipath"]

    @property
    def interference(self) -> ComplexArray:
        """The signals of other radars."""
        return self["direct"] + self["indirect"]

    @property
    def noise(self) -> ComplexArray:
        """Thermal noise."""
        return self["noise"]

    def total(self, *parts: str) -> ComplexArray:
        """Sum of the named parts; by default of all."""
        chosen = [self[part] for part in parts] if parts else self.samples
        return np.asarray(np.sum(chosen, axis=0))
