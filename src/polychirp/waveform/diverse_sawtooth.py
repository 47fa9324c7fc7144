"""`DiverseSawtooth`: chirps whose start frequency, bandwidth and idle time are drawn."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Hertz, Seconds
from polychirp.waveform.base import need_limits, need_not_negative, need_positive, need_sweeps
from polychirp.waveform.chirps import chirps, starts


@dataclass(frozen=True, slots=True, kw_only=True)
class DiverseSawtooth(Spec):
    """Chirps whose start frequency, bandwidth (so the slope) and idle time are drawn.

    With a draw for every chirp it is the dither of Texas Instruments' application report SWRA662A;
    with one draw for the frame, a slope, a band and a pause that are fixed for each radar. Draws
    are uniformly distributed between their limits, and each quantity has a random stream of its
    own. Equal limits leave a quantity constant.

    The frequency of a radar's crystal is common to all of its chirps, so that the phases of the
    chirps follow from their frequencies: the coherent receiver adds chirps of any draws in phase.

    Parameters
    ----------
    start_frequency : Hz, lowest frequency that a chirp can have
    start_frequency_spread : Hz, greatest random increase of a chirp's lowest frequency
    bandwidth : Hz, lower and upper limit of the draws
    ramp_duration : s
    idle : s, lower and upper limit of the silence after a chirp
    every : whether values are drawn for every chirp, or once for the frame
    direction : whether the frequency rises or falls on a ramp

    Raises
    ------
    InputError
        Limits are inverted or negative, or a frequency, bandwidth or duration is not positive.

    Examples
    --------
    >>> waveform = DiverseSawtooth(bandwidth=(250e6, 300e6), idle=(4e-6, 6e-6))
    >>> ramps = waveform.schedule(num_sweeps=4, streams=Streams(seed=1))
    >>> len(set(ramps.slope)), len(set(np.diff(ramps.start_time)))
    (4, 3)
    """

    kind: Literal["diverse-sawtooth"] = "diverse-sawtooth"
    start_frequency: Hertz = 76.5e9
    start_frequency_spread: Hertz = 0.0
    bandwidth: tuple[Hertz, Hertz] = (270e6, 300e6)
    ramp_duration: Seconds = 20e-6
    idle: tuple[Seconds, Seconds] = (5e-6, 5e-6)
    every: Literal["chirp", "frame"] = "chirp"
    direction: Literal["up", "down"] = "up"

    def __post_init__(self) -> None:
        owner = "a diverse sawtooth"
        need_positive(owner, start_frequency=self.start_frequency, ramp_duration=self.ramp_duration)
        need_limits(owner, bandwidth=self.bandwidth)
        least, greatest = self.idle
        need_not_negative(owner, start_frequency_spread=self.start_frequency_spread, idle=least)
        if not least <= greatest:
            raise InputError(
                f"{owner} has limits of idle in the wrong order ({least:g} to {greatest:g}); "
                "write the smaller one first"
            )

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` chirps, drawn from this radar's streams."""
        need_sweeps(num_sweeps)
        draws = num_sweeps if self.every == "chirp" else 1

        def drawn(name: str, limits: tuple[float, float]) -> np.ndarray:
            values = streams["waveform", name].uniform(*limits, draws)
            return np.broadcast_to(values, num_sweeps)

        extra = drawn("start_frequency", (0.0, self.start_frequency_spread))
        return chirps(
            start_time=starts(self.ramp_duration + drawn("idle", self.idle)),
            duration=np.full(num_sweeps, self.ramp_duration),
            lowest=self.start_frequency + extra,
            bandwidth=drawn("bandwidth", self.bandwidth),
            is_up=np.full(num_sweeps, self.direction == "up"),
            sweep=np.arange(num_sweeps),
        )
