"""`Pmcw`: a carrier of constant frequency whose phase follows a binary code."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import FloatArray
from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Between, Hertz, Seconds
from polychirp.waveform.base import need_not_negative, need_positive
from polychirp.waveform.carriers import carriers
from polychirp.waveform.code_sequences import (
    PREFERRED,
    PRIMITIVE,
    almost_perfect_sequence,
    gold_sequence,
    largest_prime,
    m_sequence,
    num_gold,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pmcw(Spec):
    r"""Phase-modulated continuous wave, or direct-sequence spread spectrum: a carrier with a code.

    A sweep is a stretch of the carrier with ``periods`` codes. Its receiver correlates the samples
    with the code: echoes are resolved to :math:`cT_c/2` and repeat after :math:`cLT_c/2`, with L
    chips of the duration :math:`T_c`. The first period of a sweep belongs to the echoes that are on
    their way; the converter starts after it.

    The power is constant (a peak-to-average ratio of 0 dB).

    Parameters
    ----------
    carrier : Hz
    code : an m-sequence, which all such radars share; a Gold sequence, of which each radar draws
        its own if ``member`` is None; or an almost perfect autocorrelation sequence
    order : n; the first two codes have 2^n − 1 chips, the third the greatest length
        2(q + 1) up to 2^n, with a prime q
    member : number of the Gold sequence, from 0 to 2^n
    chip_duration : s
    periods : number of codes in a sweep, of which the receiver adds all but the first
    idle : s, silence between the end of a sweep and the start of the next

    Raises
    ------
    InputError
        There is no such code, a sweep has fewer than two periods, a frequency or duration is not
        positive, or the idle time is negative.

    Examples
    --------
    >>> ramps = Pmcw(order=5, periods=2).schedule(num_sweeps=2, streams=Streams(seed=1))
    >>> ramps.code.num_chips, (ramps.duration * 1e9).round(6), ramps.slope
    (31, array([124., 124.]), array([0., 0.]))
    """

    kind: Literal["pmcw"] = "pmcw"
    carrier: Hertz = 79e9
    code: Literal["m-sequence", "gold", "almost-perfect"] = "m-sequence"
    order: int = 9
    member: int | None = None
    chip_duration: Seconds = 2e-9
    periods: Annotated[int, Between(greatest=10_000)] = 3
    idle: Seconds = 17e-6

    def __post_init__(self) -> None:
        need_positive("a PMCW waveform", carrier=self.carrier, chip_duration=self.chip_duration)
        need_not_negative("a PMCW waveform", idle=self.idle)
        if self.periods < 2:
            raise InputError(
                f"a PMCW waveform of {self.periods} periods leaves none after the first, during "
                "which echoes arrive; use 2 or more"
            )
        known = PREFERRED if self.code == "gold" else PRIMITIVE
        if self.order not in known:
            raise InputError(
                f"a PMCW waveform has no {self.code} code of the order {self.order}; use one of "
                f"{', '.join(map(str, known))}"
            )
        if self.member is not None and self.code != "gold":
            raise InputError(f"a PMCW waveform's {self.code} code has no members; leave it out")
        if self.member is not None and not 0 <= self.member < num_gold(self.order):
            raise InputError(
                f"a PMCW waveform's Gold family has the members 0 to {2**self.order}, not "
                f"{self.member}"
            )

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """``num_sweeps`` stretches of the carrier; a Gold code comes from the radar's streams."""
        chips = self._chips(streams)
        return carriers(
            chips[None],
            carrier=self.carrier,
            chip_duration=self.chip_duration,
            duration=self.periods * chips.size * self.chip_duration,
            idle=self.idle,
            num_sweeps=num_sweeps,
        )

    def _chips(self, streams: Streams) -> FloatArray:
        if self.code == "m-sequence":
            return m_sequence(self.order)
        if self.code == "almost-perfect":
            return almost_perfect_sequence(largest_prime(2 ** (self.order - 1) - 1))
        member = self.member
        if member is None:
            member = int(streams["waveform", "code"].integers(num_gold(self.order)))
        return np.asarray(gold_sequence(self.order, member))
