"""`PermutedChirps`: chirps whose pieces are sent in another order, as in BlueFMCW."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Between, Hertz, Seconds
from polychirp.waveform.base import need_not_negative, need_positive, need_sweeps
from polychirp.waveform.chirps import chirps, starts


@dataclass(frozen=True, slots=True, kw_only=True)
class PermutedChirps(Spec):
    r"""Chirps that are cut into pieces, which are sent in an order that is drawn for every chirp.

    BlueFMCW sends the pieces of a chirp's band in random order, and its receiver puts them
    back. Here every piece is a ramp. The phase of an echo in a sample follows from the frequency
    transmitted and the time, on whatever ramp the sample lies, so that the coherent receiver adds
    the pieces in phase without an alignment of its own: the resolution is that of the whole
    band. An interferer with another order is in the IF band on few of the pieces, and its
    beats there are at different ranges.

    After every jump of the frequency the mixer's product is outside of the IF band for the delay of
    the farthest echo: the converter's ``start`` of the radar must be at least that long.

    Parameters
    ----------
    start_frequency : Hz, lowest frequency of the band
    bandwidth : Hz, of all pieces together
    ramp_duration : s, of all pieces of a chirp, without the jumps
    num_pieces : number of pieces of a chirp
    jump : s, silence between two pieces
    idle : s, silence after a chirp

    Raises
    ------
    InputError
        There are fewer than two pieces, a frequency, bandwidth or duration is not positive, or a
        silence is negative.

    Examples
    --------
    >>> waveform = PermutedChirps(num_pieces=4, bandwidth=400e6)
    >>> ramps = waveform.schedule(num_sweeps=2, streams=Streams(seed=1))
    >>> [round(float(f)) for f in (ramps.start_frequency - 76.5e9) / 1e6]
    [0, 300, 100, 200, 100, 0, 200, 300]
    """

    kind: Literal["permuted-chirps"] = "permuted-chirps"
    start_frequency: Hertz = 76.5e9
    bandwidth: Hertz = 600e6
    ramp_duration: Seconds = 40e-6
    num_pieces: Annotated[int, Between(greatest=1_000)] = 4
    jump: Seconds = 0.0
    idle: Seconds = 5e-6

    def __post_init__(self) -> None:
        owner = "a waveform of permuted chirps"
        need_positive(
            owner,
            start_frequency=self.start_frequency,
            bandwidth=self.bandwidth,
            ramp_duration=self.ramp_duration,
        )
        need_not_negative(owner, jump=self.jump, idle=self.idle)
        if self.num_pieces < 2:
            raise InputError(
                f"{owner} needs 2 pieces or more in a chirp, not {self.num_pieces}; the waveform "
                "'sawtooth' has whole chirps"
            )

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` chirps, ordered by this radar's streams."""
        need_sweeps(num_sweeps)
        pieces = self.num_pieces
        draw = streams["waveform", "order"]
        order = np.array([draw.permutation(pieces) for _ in range(num_sweeps)])
        piece = self.ramp_duration / pieces
        silence = np.full((num_sweeps, pieces), self.jump)
        silence[:, -1] = self.idle
        return chirps(
            start_time=starts(piece + silence.ravel()),
            duration=np.full(order.size, piece),
            lowest=self.start_frequency + order.ravel() * self.bandwidth / pieces,
            bandwidth=np.full(order.size, self.bandwidth / pieces),
            is_up=np.ones(order.size, dtype=np.bool_),
            sweep=np.repeat(np.arange(num_sweeps), pieces),
        )
