"""`Sawtooth`: equal ramps, all up or all down."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Hertz, Seconds
from polychirp.waveform.base import need_not_negative, need_positive, need_sweeps
from polychirp.waveform.chirps import chirps


@dataclass(frozen=True, slots=True, kw_only=True)
class Sawtooth(Spec):
    """Conventional FMCW with one ramp per sweep; all ramps are equal.

    Parameters
    ----------
    start_frequency : Hz, lowest frequency of the band
    bandwidth : Hz
    ramp_duration : s
    idle : s, silence between the end of a ramp and the start of the next
    direction : whether the frequency rises or falls on a ramp

    Raises
    ------
    InputError
        A frequency, bandwidth or duration is not positive, or the idle time is negative.

    Examples
    --------
    >>> from polychirp.rng import Streams
    >>> ramps = Sawtooth(idle=1e-5).schedule(num_sweeps=3, streams=Streams(seed=1))
    >>> ramps.start_time * 1e3
    array([0. , 1.51, 3.02])
    """

    kind: Literal["sawtooth"] = "sawtooth"
    start_frequency: Hertz = 79e9
    bandwidth: Hertz = 900e6
    ramp_duration: Seconds = 1.5e-3
    idle: Seconds = 0.0
    direction: Literal["up", "down"] = "up"

    def __post_init__(self) -> None:
        need_positive(
            "a sawtooth",
            start_frequency=self.start_frequency,
            bandwidth=self.bandwidth,
            ramp_duration=self.ramp_duration,
        )
        need_not_negative("a sawtooth", idle=self.idle)

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` sweeps, without random numbers."""
        del streams
        need_sweeps(num_sweeps)
        return chirps(
            start_time=np.arange(num_sweeps, dtype=np.float64) * (self.ramp_duration + self.idle),
            duration=np.full(num_sweeps, self.ramp_duration),
            lowest=np.full(num_sweeps, self.start_frequency),
            bandwidth=np.full(num_sweeps, self.bandwidth),
            is_up=np.full(num_sweeps, self.direction == "up"),
            sweep=np.arange(num_sweeps),
        )
