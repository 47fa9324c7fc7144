"""`IfFrame` and `IfParts`: dechirped samples of one frame, and the parts that sum to them."""

from dataclasses import dataclass, replace
from typing import Annotated, Final, Self

import numpy as np

from polychirp.axes import Axes, BoolArray, ComplexArray, FloatArray, PerRamp, PerRampIndex, seal
from polychirp.errors import InputError, did_you_mean
from polychirp.model.antenna import AntennaArray
from polychirp.model.front_end import HighPass
from polychirp.model.if_filter import IfFilter
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule

PARTS: Final = ("echo", "multipath", "direct", "indirect", "noise", "leakage", "distortion")
"""Names of the parts of the samples.

- ``echo``, ``multipath``: the radar's own echoes, the latter on the paths that a surface reflects
  on the way to or from a body (`PropagationPaths.is_mirrored`).
- ``direct``, ``indirect``: other radars' signals, the latter on reflected or scattered paths.
- ``noise``: thermal noise.
- ``leakage``: the radar's own signal that reaches its receiver without any scene.
- ``distortion``: the change of the sum of all other parts by saturation, quantisation and offsets.
"""


def parts_of(radar: Radar) -> tuple[str, ...]:
    """Names of the parts that a radar's samples have, in the order of `PARTS`.

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
    first : time of each ramp's first sample, s ``(ramp,)``
    num_samples : number of samples on each ramp, ``(ramp,)``
    rate : sample rate, 1/s
    """

    first: PerRamp
    num_samples: PerRampIndex
    rate: float

    def __post_init__(self) -> None:
        seal(self)

    @property
    def most_samples(self) -> int:
        """Length of the padded ``fast`` axis: the greatest number of samples on a ramp."""
        return int(self.num_samples.max())

    @property
    def is_sample(self) -> BoolArray:
        """Mask ``(ramp, fast)``, false in the padding after a short ramp's last sample."""
        return np.arange(self.most_samples) < self.num_samples[:, None]

    @property
    def time(self) -> FloatArray:
        """Time of every sample, s ``(ramp, fast)``, continued through the padding."""
        return self.first[:, None] + np.arange(self.most_samples) / self.rate


def sample_times(schedule: RampSchedule, converter: Converter) -> SampleTimes:
    """Times of the samples that a converter takes on every ramp.

    `InputError` is raised if a ramp leaves no room for two samples between the converter's start
    and its margin.
    """
    room = schedule.duration - converter.start - converter.margin
    # the small terms keep a last sample exactly at the window's end in spite of rounding
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

    A sample is :math:`y = s_{tx}\,\overline{s_{rx}}` of the transmitted and the received signal:
    the echo of a target at rest at range R on a ramp of slope b has the beat **+**\ 2bR/c.
    :math:`|y|^2` is the power in W at the converter's input (volts across one ohm). Of a converter
    with real samples, y is twice the sampled branch I (`Converter`). Short ramps are padded with
    zeros from sample ``times.num_samples`` on.

    A `VictimResult` has it, and `Recording.frame` makes one from recorded samples.

    Parameters
    ----------
    samples : V, ``(channel, ramp, fast)`` complex
    times : times of the samples
    schedule : ramps that the radar transmitted
    array : antenna array of the radar
    high_pass : high-pass filter of the radar, None if it has none; its causal phase is in the
        samples, and a receiver corrects it
    if_filter : IF filter of the radar, None if it is not known; the receiver of codes needs it,
        as the filter weakens a part of their band
    """

    samples: Annotated[ComplexArray, Axes("channel", "ramp", "fast", dtype=np.complex128)]
    times: SampleTimes
    schedule: RampSchedule
    array: AntennaArray
    high_pass: HighPass | None = None
    if_filter: IfFilter | None = None

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

    def with_samples(self, samples: ComplexArray) -> Self:
        """Copy of the frame with other samples of the same shape."""
        return replace(self, samples=samples)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class IfParts:
    """Parts of a frame's samples, which sum to the samples.

    Each part except ``distortion`` is linear: it is what its source alone would give.

    A `VictimResult` has it beside its `IfFrame`.

    Parameters
    ----------
    samples : V, ``(part, channel, ramp, fast)``
    names : names of the parts, in the order of `PARTS`; a part that is not named is zero
    neglected : V, upper bound of the rms, over the frame, of the sum of the signals of all radars
        that were left out as inaudible (`interferer_culling`)
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
        """The part of this name, V ``(channel, ramp, fast)``; zeros if the frame lacks it."""
        if part in self.names:
            return np.asarray(self.samples[self.names.index(part)])
        if part not in PARTS:
            raise InputError(f"there is no part '{part}'; {did_you_mean(part, PARTS)}")
        return np.broadcast_to(np.complex128(0.0), self.samples.shape[1:])

    @property
    def echo(self) -> ComplexArray:
        """The radar's own echoes, multipath included."""
        return self["echo"] + self["multipath"]

    @property
    def interference(self) -> ComplexArray:
        """The signals of other radars, on direct and indirect paths."""
        return self["direct"] + self["indirect"]

    @property
    def noise(self) -> ComplexArray:
        """Thermal noise."""
        return self["noise"]

    def total(self, *parts: str) -> ComplexArray:
        """Sum of the named parts; if none is named, of all parts."""
        chosen = [self[part] for part in parts] if parts else self.samples
        return np.asarray(np.sum(chosen, axis=0))
