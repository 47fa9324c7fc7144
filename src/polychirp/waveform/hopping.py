"""`Hopping`: equal chirps that hop among channels of a band, from chirp to chirp or by frame."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Hertz, Seconds
from polychirp.waveform.base import need_not_negative, need_positive, need_sweeps
from polychirp.waveform.chirps import chirps


@dataclass(frozen=True, slots=True, kw_only=True)
class Hopping(Spec):
    """Equal chirps that hop at random among the channels of a band.

    Hops from chirp to chirp give the frame the resolution of the whole band, with the coherent
    receiver. Hops from frame to frame leave equal chirps, which the range-Doppler receiver reads,
    with the resolution of one channel.

    Parameters
    ----------
    band : Hz, lower and upper edge; no chirp leaves it
    channels : Hz, lowest frequency of each channel; if there is none, channels are as wide as a
        chirp and fill the band from its lower edge on, as many as have room
    bandwidth : Hz, of a chirp
    ramp_duration : s
    idle : s, silence between the end of a chirp and the start of the next
    every : whether a channel is drawn for every chirp, or once for the frame
    direction : whether the frequency rises or falls on a ramp

    Raises
    ------
    InputError
        A chirp in some channel would leave the band, the band's edges are in the wrong order, or a
        frequency, bandwidth or duration is not positive.

    Examples
    --------
    >>> waveform = Hopping(band=(76e9, 77e9), bandwidth=250e6)
    >>> ramps = waveform.schedule(num_sweeps=64, streams=Streams(seed=1))
    >>> [float(f) for f in np.unique(ramps.start_frequency) / 1e9]
    [76.0, 76.25, 76.5, 76.75]
    """

    kind: Literal["hopping"] = "hopping"
    band: tuple[Hertz, Hertz] = (76e9, 77e9)
    channels: tuple[Hertz, ...] = ()
    bandwidth: Hertz = 250e6
    ramp_duration: Seconds = 20e-6
    idle: Seconds = 5e-6
    every: Literal["chirp", "frame"] = "chirp"
    direction: Literal["up", "down"] = "up"

    def __post_init__(self) -> None:
        low, high = self.band
        owner = "a hopping waveform"
        need_positive(owner, bandwidth=self.bandwidth, ramp_duration=self.ramp_duration)
        need_positive(owner, band=low)
        need_not_negative(owner, idle=self.idle)
        if not high - low >= self.bandwidth * (1 - 1e-9):
            raise InputError(
                f"{owner} has chirps of {self.bandwidth / 1e6:g} MHz, which do not fit into its "
                f"band of {low / 1e9:g} to {high / 1e9:g} GHz; widen the band or narrow the chirps"
            )
        for number, lowest in enumerate(self.channels):
            last = lowest + self.bandwidth
            if lowest < low * (1 - 1e-12) or last > high * (1 + 1e-12):
                raise InputError(
                    f"channel {number} of {owner} reaches from {lowest / 1e9:g} to "
                    f"{last / 1e9:g} GHz, outside of its band of {low / 1e9:g} to "
                    f"{high / 1e9:g} GHz; move the channel or widen the band"
                )

    @property
    def lowest_frequencies(self) -> tuple[float, ...]:
        """Lowest frequency of every channel, Hz."""
        if self.channels:
            return self.channels
        low, high = self.band
        count = int((high - low) / self.bandwidth * (1 + 1e-9))
        return tuple(low + n * self.bandwidth for n in range(count))

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` chirps, with channels drawn from this radar's streams."""
        need_sweeps(num_sweeps)
        lowest = np.array(self.lowest_frequencies)
        draws = num_sweeps if self.every == "chirp" else 1
        chosen = streams["waveform", "channel"].integers(lowest.size, size=draws)
        interval = self.ramp_duration + self.idle
        return chirps(
            start_time=np.arange(num_sweeps, dtype=np.float64) * interval,
            duration=np.full(num_sweeps, self.ramp_duration),
            lowest=np.broadcast_to(lowest[chosen], num_sweeps),
            bandwidth=np.full(num_sweeps, self.bandwidth),
            is_up=np.full(num_sweeps, self.direction == "up"),
            sweep=np.arange(num_sweeps),
        )
