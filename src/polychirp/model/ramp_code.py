"""`RampCode`: the chips by which a radar multiplies its signal within each ramp."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, IntArray, PerRamp, PerRampIndex, seal
from polychirp.errors import InputError

LARGEST_CHIP = 1.0 + 1e-9
"""Greatest magnitude of a chip; the excess over full power allows for rounding errors."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RampCode:
    r"""Chips of constant phase and magnitude that follow each other without a gap within a ramp.

    On ramp k, at the time u from its start, the transmitted signal is multiplied by

    .. math:: a_k(u) = v_{r_k,\;\lfloor u/T_{c,k}\rfloor \bmod L}

    with the row :math:`r_k` of ``value``, its L chips, and the chips' duration
    :math:`T_{c,k}`. The code is repeated until the ramp ends. The oscillator's signal that drives
    the mixer has no code.

    Parameters
    ----------
    value : ``(code, chip)`` complex, at most 1 in magnitude; 1 is full power
    row : row of ``value`` that each ramp sends, ``(ramp,)``
    chip_duration : s, ``(ramp,)``

    Raises
    ------
    InputError
        There is no chip, a chip is above 1 in magnitude or not finite, a duration is not positive,
        or a ramp sends a row that does not exist.

    Examples
    --------
    >>> code = RampCode(value=[[1, 1, -1]], row=[0, 0], chip_duration=[2e-9, 2e-9])
    >>> code.num_chips, float(round(code.period[0] * 1e9, 6))
    (3, 6.0)
    """

    value: Annotated[ComplexArray, Axes("code", "chip", dtype=np.complex128)]
    row: PerRampIndex
    chip_duration: PerRamp

    def __post_init__(self) -> None:
        seal(self)
        if not self.value.size:
            raise InputError("a code of ramps has no chip; give it one or more")
        if not np.all(np.abs(self.value) <= LARGEST_CHIP):
            raise InputError("a chip is above 1 in magnitude; 1 is full power")
        if not np.all(self.chip_duration > 0):
            raise InputError("chips need a positive duration")
        if np.any(self.row < 0) or np.any(self.row >= len(self.value)):
            raise InputError(f"a ramp sends a code that is not one of the {len(self.value)}")

    @property
    def num_chips(self) -> int:
        """Number of chips after which the code repeats."""
        return int(self.value.shape[1])

    @property
    def period(self) -> FloatArray:
        """Duration of the code on each ramp, s ``(ramp,)``."""
        return self.num_chips * self.chip_duration

    @property
    def repetition(self) -> FloatArray:
        """Delay by which echoes look alike on each ramp, s ``(ramp,)``; at most the period.

        It is the least delay at which the periodic autocorrelation of the first code exceeds half
        of its peak, as that of an almost perfect sequence does after half a period.
        """
        spectrum = np.abs(np.fft.fft(self.value[0])) ** 2
        level = np.abs(np.fft.ifft(spectrum))
        # neighbouring chips of a narrow band are alike, too
        beyond = np.flatnonzero(level[1:] < 0.5 * level[0])
        first = int(beyond[0]) + 1 if beyond.size else level.size
        alike = np.flatnonzero(level[first:] > 0.5 * level[0])
        size = first + int(alike[0]) if alike.size else level.size
        if size > level.size // 2 + 1:
            size = level.size
        return np.asarray(size * self.chip_duration)

    @property
    def mean_power(self) -> float:
        """Mean of the chips' squared magnitudes, over all rows."""
        return float(np.mean(np.abs(self.value) ** 2))

    @property
    def bandwidth(self) -> float:
        r"""Width of the band that the chips' values occupy, Hz, at most one over their duration.

        .. math:: B = \frac{1}{T_c}\,\frac{\left(\sum_n P_n\right)^2}{N\sum_n P_n^2}

        with the mean power :math:`P_n` of all codes in N equal parts of the band :math:`1/T_c`.
        """
        power = np.mean(np.abs(np.fft.fft(self.value, axis=1)) ** 2, axis=0)
        # parts of the band even out the lines of a single code
        parts = np.array([part.mean() for part in np.array_split(power, min(16, power.size))])
        share = float(parts.sum() ** 2 / (parts.size * np.sum(parts**2)))
        return share / float(np.max(self.chip_duration))

    def sent(self, ramp: int, time: FloatArray) -> ComplexArray:
        """Chips that a ramp sends at times from its start, s, of any shape.

        >>> code = RampCode(value=[[1, -1]], row=[0], chip_duration=[2e-9])
        >>> code.sent(0, np.array([1e-9, 3e-9, 5e-9])).real
        array([ 1., -1.,  1.])
        """
        number = np.floor(time / self.chip_duration[ramp]).astype(np.int64)
        return np.asarray(self.value[self.row[ramp], number % self.num_chips])

    def of_ramps(self, ramps: IntArray) -> "RampCode":
        """The code of the ramps with these numbers."""
        return RampCode(
            value=self.value, row=self.row[ramps], chip_duration=self.chip_duration[ramps]
        )
