"""`Subframes`: equal chirps whose repetition interval changes from subframe to subframe."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Between, Hertz, Seconds
from polychirp.waveform.base import need_positive, need_sweeps
from polychirp.waveform.chirps import chirps, starts


@dataclass(frozen=True, slots=True, kw_only=True)
class Subframes(Spec):
    r"""Equal chirps in subframes, each with its own repetition interval.

    Chirps T apart give range rates modulo :math:`\lambda/2T`. Range rates that agree modulo the
    spans of all intervals are much further apart, so that together the subframes tell fast targets.

    Parameters
    ----------
    start_frequency : Hz, lowest frequency of the band
    bandwidth : Hz
    ramp_duration : s
    intervals : s, from chirp to chirp, of each subframe in turn; after the last comes the first
    ramps_per_subframe : number of chirps of a subframe; a frame should have a multiple of
        this number times that of the intervals
    direction : whether the frequency rises or falls on a ramp

    Raises
    ------
    InputError
        A frequency, bandwidth or duration is not positive, there are fewer than two intervals, an
        interval is shorter than a ramp, or a subframe has fewer than two ramps.

    Examples
    --------
    >>> from polychirp.rng import Streams
    >>> waveform = Subframes(intervals=(40e-6, 50e-6), ramp_duration=30e-6, ramps_per_subframe=3)
    >>> ramps = waveform.schedule(num_sweeps=6, streams=Streams(seed=1))
    >>> (ramps.start_time * 1e6).round(6)
    array([  0.,  40.,  80., 120., 170., 220.])
    """

    kind: Literal["subframes"] = "subframes"
    start_frequency: Hertz = 76.5e9
    bandwidth: Hertz = 500e6
    ramp_duration: Seconds = 25e-6
    intervals: tuple[Seconds, ...] = (30e-6, 34e-6, 39e-6)
    ramps_per_subframe: Annotated[int, Between(greatest=1_000_000)] = 64
    direction: Literal["up", "down"] = "up"

    def __post_init__(self) -> None:
        need_positive(
            "a waveform of subframes",
            start_frequency=self.start_frequency,
            bandwidth=self.bandwidth,
            ramp_duration=self.ramp_duration,
        )
        if len(self.intervals) < 2:
            raise InputError(
                "a waveform of subframes needs two intervals or more; a sawtooth has one"
            )
        if min(self.intervals) < self.ramp_duration:
            raise InputError(
                f"an interval of {1e6 * min(self.intervals):g} µs is shorter than the ramps of "
                f"{1e6 * self.ramp_duration:g} µs; use longer intervals"
            )
        if self.ramps_per_subframe < 2:
            raise InputError(
                f"a subframe of {self.ramps_per_subframe} ramps has no interval; use 2 or more"
            )

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` sweeps, without random numbers."""
        del streams
        need_sweeps(num_sweeps)
        number = np.arange(num_sweeps)
        interval = np.array(self.intervals)[number // self.ramps_per_subframe % len(self.intervals)]
        return chirps(
            start_time=starts(interval),
            duration=np.full(num_sweeps, self.ramp_duration),
            lowest=np.full(num_sweeps, self.start_frequency),
            bandwidth=np.full(num_sweeps, self.bandwidth),
            is_up=np.full(num_sweeps, self.direction == "up"),
            sweep=number,
        )
