"""`PhaseCodedRamp`: equal chirps whose phase follows a code within each of them."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.model.ramp_code import RampCode
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Hertz, Seconds
from polychirp.waveform.base import need_few_chips, need_positive
from polychirp.waveform.sawtooth import Sawtooth


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseCodedRamp(Spec):
    r"""PC-FMCW: chirps with chips of ±1, drawn anew for every chirp.

    The transmitted signal alone is coded. The receiver mixes with the chirp without its code,
    aligns the codes of all echoes by a filter whose group delay depends on the beat, multiplies by
    the code, and has the samples of an uncoded chirp (Uysal 2020). A ghost of a radar without this
    code keeps it, and is spread over L chips times its band: by :math:`10\log_{10}L` dB.

    The power is constant (a peak-to-average ratio of 0 dB).

    Parameters
    ----------
    start_frequency : Hz, lowest frequency of the band
    bandwidth : Hz
    ramp_duration : s
    idle : s, silence between the end of a ramp and the start of the next
    num_chips : L, number of chips on a ramp
    chip_duration : s; None: the ramp's duration over the number of chips
    direction : whether the frequency rises or falls on a ramp

    Raises
    ------
    InputError
        There are fewer than two chips, the code is longer than a ramp, a frequency, bandwidth or
        duration is not positive, or the idle time is negative.

    Examples
    --------
    >>> ramps = PhaseCodedRamp(num_chips=4).schedule(num_sweeps=2, streams=Streams(seed=1))
    >>> ramps.code.value.real
    array([[ 1., -1., -1., -1.],
           [ 1., -1., -1.,  1.]])
    """

    kind: Literal["phase-coded-ramp"] = "phase-coded-ramp"
    start_frequency: Hertz = 76.5e9
    bandwidth: Hertz = 600e6
    ramp_duration: Seconds = 30e-6
    idle: Seconds = 5e-6
    num_chips: int = 64
    chip_duration: Seconds | None = None
    direction: Literal["up", "down"] = "up"

    def __post_init__(self) -> None:
        self._plain()
        if self.num_chips < 2:
            raise InputError(
                f"a phase-coded ramp needs 2 chips or more, not {self.num_chips}; the waveform "
                "'sawtooth' has no code"
            )
        if self.chip_duration is None:
            return
        need_positive("a phase-coded ramp", chip_duration=self.chip_duration)
        length = self.num_chips * self.chip_duration
        if length > self.ramp_duration * (1 + 1e-9):
            raise InputError(
                f"a code of {self.num_chips} chips of {self.chip_duration * 1e9:.4g} ns lasts "
                f"{length * 1e6:.4g} µs, longer than its ramp of {self.ramp_duration * 1e6:.4g} "
                "µs; use fewer or shorter chips, or a longer ramp_duration"
            )

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """Ramps of ``num_sweeps`` chirps, with codes drawn from this radar's streams."""
        need_few_chips(self.num_chips, num_sweeps)
        ramps = self._plain().schedule(num_sweeps=num_sweeps, streams=streams)
        signs = streams["waveform", "code"].integers(2, size=(num_sweeps, self.num_chips))
        chip = self.chip_duration or self.ramp_duration / self.num_chips
        code = RampCode(
            value=(1.0 - 2.0 * signs).astype(np.complex128),
            row=np.arange(num_sweeps),
            chip_duration=np.full(num_sweeps, chip),
        )
        return replace(ramps, code=code)

    def _plain(self) -> Sawtooth:
        """The same chirps without a code."""
        return Sawtooth(
            start_frequency=self.start_frequency,
            bandwidth=self.bandwidth,
            ramp_duration=self.ramp_duration,
            idle=self.idle,
            direction=self.direction,
        )
