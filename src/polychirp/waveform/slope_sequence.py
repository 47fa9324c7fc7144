"""`SlopeSequence`: several slopes in every sweep, in an order that each radar is given."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Hertz, HertzPerSecond, Seconds
from polychirp.waveform.base import need_not_negative, need_positive, need_sweeps
from polychirp.waveform.chirps import chirps, starts


@dataclass(frozen=True, slots=True, kw_only=True)
class SlopeSequence(Spec):
    """Ramps of equal duration with given slopes, one after the other in every sweep.

    Son, Sung and Heo (2018) give each vehicle a sequence of its own, such as 1200, 900, 600 and
    300 MHz/ms for one and 900, 300, 1200 and 600 for another; their receiver looks for the crossing
    of the lines that the beats of all slopes draw in the plane of range and range rate. The
    coherent receiver needs no such step: at the crossing all samples add up in phase.

    Parameters
    ----------
    start_frequency : Hz, lowest frequency of all ramps
    slopes : Hz/s, of each ramp of a sweep, negative for a down-ramp
    ramp_duration : s, of each ramp
    idle : s, silence after every ramp

    Raises
    ------
    InputError
        There is no slope or one of zero, a frequency or duration is not positive, or the idle time
        is negative.

    Examples
    --------
    >>> waveform = SlopeSequence(slopes=(1.2e12, -3e11))
    >>> ramps = waveform.schedule(num_sweeps=2, streams=Streams(seed=1))
    >>> ramps.start_frequency / 1e9
    array([76.5, 76.8, 76.5, 76.8])
    """

    kind: Literal["slope-sequence"] = "slope-sequence"
    start_frequency: Hertz = 76.5e9
    slopes: tuple[HertzPerSecond, ...] = (1.2e12, 9e11, 6e11, 3e11)
    ramp_duration: Seconds = 1e-3
    idle: Seconds = 0.0

    def __post_init__(self) -> None:
        owner = "a slope sequence"
        need_positive(owner, start_frequency=self.start_frequency, ramp_duration=self.ramp_duration)
        need_not_negative(owner, idle=self.idle)
        if not self.slopes or 0.0 in self.slopes:
            raise InputError(f"{owner} needs one slope or more, none of them 0; it has a ramp each")

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` sweeps, without random numbers."""
        del streams
        need_sweeps(num_sweeps)
        slope = np.tile(self.slopes, num_sweeps)
        duration = np.full(slope.size, self.ramp_duration)
        return chirps(
            start_time=starts(duration + self.idle),
            duration=duration,
            lowest=np.full(slope.size, self.start_frequency),
            bandwidth=np.abs(slope) * duration,
            is_up=slope > 0,
            sweep=np.repeat(np.arange(num_sweeps), len(self.slopes)),
        )
