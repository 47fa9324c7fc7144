"""`Noise`: band-limited noise on a carrier, which the receiver has stored."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import ComplexArray
from polychirp.errors import InputError
from polychirp.model.ramp import RampSchedule
from polychirp.rng import Streams
from polychirp.spec import Spec
from polychirp.units import Between, Hertz, Ratio, Seconds, from_db
from polychirp.waveform.base import need_few_chips, need_not_negative, need_positive, need_sweeps
from polychirp.waveform.carriers import carriers

RATIO_ERROR = 0.01
"""Relative error of the ratio of peak to average power; chosen."""

LEAST_PRODUCT = 2.0
"""Least product of a block's band and duration. A block's spectral lines are one over its duration
apart: a band below 2 holds the carrier's line alone, which has no range; one from 2 on, three."""

MOST_ROUNDS = 200
"""Greatest number of rounds of clipping. Chosen: 1 dB needs 12."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise(Spec):
    r"""Gaussian noise of a limited band on a carrier, drawn anew for every sweep.

    A converter holds each of the transmitter's samples for its duration, so that the signal is a
    code of complex chips. A block of them is drawn with a flat spectrum over ``bandwidth``, and
    repeated: the first repetition belongs to the echoes that are on their way, as of `Pmcw`. The
    receiver correlates with the stored block. The side lobes of a block of the duration T are
    random, :math:`-10\log_{10}BT` dB below the strongest echo on average.

    Chips are clipped at ``peak_to_average`` times their mean power, which then is the ratio of peak
    to average power: the mean power is below that of other waveforms by this ratio. Where no chip
    reaches it, the ratio is that of the greatest chip: some 10 dB of a few sweeps of 512 chips.

    Parameters
    ----------
    carrier : Hz
    bandwidth : Hz, of the noise, at most 1/``chip_duration``
    chip_duration : s, interval of the transmitter's samples
    num_chips : number of chips of a block
    periods : number of times that a sweep has its block, of which the receiver adds all but one
    idle : s, silence between the end of a sweep and the start of the next
    peak_to_average : ratio of the greatest to the mean power, above 1

    Raises
    ------
    InputError
        A sweep has fewer than two periods, a block fewer than 16 chips, the band is wider than the
        transmitter's samples allow or so narrow that a block is constant, a frequency or
        duration is not positive, the idle time is negative, or the ratio is not above 1.

    Examples
    --------
    >>> ramps = Noise(num_chips=64).schedule(num_sweeps=2, streams=Streams(seed=1))
    >>> ramps.code.value.shape, bool(np.abs(ramps.code.value).max() <= 1.0)
    ((2, 64), True)
    """

    kind: Literal["noise"] = "noise"
    carrier: Hertz = 79e9
    bandwidth: Hertz = 300e6
    chip_duration: Seconds = 2e-9
    num_chips: int = 512
    periods: Annotated[int, Between(greatest=10_000)] = 3
    idle: Seconds = 17e-6
    peak_to_average: Ratio = from_db(8.0)

    def __post_init__(self) -> None:
        need_positive(
            "a noise waveform",
            carrier=self.carrier,
            bandwidth=self.bandwidth,
            chip_duration=self.chip_duration,
        )
        need_not_negative("a noise waveform", idle=self.idle)
        if self.periods < 2:
            raise InputError(
                f"a noise waveform of {self.periods} periods leaves none after the first, during "
                "which echoes arrive; use 2 or more"
            )
        if self.num_chips < 16:
            raise InputError(
                f"a noise waveform of {self.num_chips} chips has no band; use 16 or more"
            )
        if self.bandwidth * self.chip_duration > 1 + 1e-9:
            raise InputError(
                f"a noise waveform of {self.bandwidth / 1e6:.4g} MHz needs chips of "
                f"{1e9 / self.bandwidth:.4g} ns or less, not {self.chip_duration * 1e9:.4g} ns"
            )
        block = self.num_chips * self.chip_duration
        if self.bandwidth * block < LEAST_PRODUCT * (1 - 1e-9):
            least = math.ceil(LEAST_PRODUCT / block / 1e4) / 100  # rounded up, which is accepted
            raise InputError(
                f"a noise waveform with a block of {block * 1e6:.4g} µs is constant with so "
                f"narrow a bandwidth, and cannot tell ranges apart; use '{least:g} MHz' or more, "
                "or more chips"
            )
        if not self.peak_to_average > 1.0:
            raise InputError("a noise waveform's ratio of peak to average must be above 0 dB")

    def schedule(self, *, num_sweeps: int, streams: Streams) -> RampSchedule:
        """``num_sweeps`` stretches of the carrier, each with noise from the radar's streams."""
        need_sweeps(num_sweeps)
        need_few_chips(self.num_chips, num_sweeps)
        return carriers(
            self._chips(num_sweeps, streams),
            carrier=self.carrier,
            chip_duration=self.chip_duration,
            duration=self.periods * self.num_chips * self.chip_duration,
            idle=self.idle,
            num_sweeps=num_sweeps,
        )

    def _chips(self, num_sweeps: int, streams: Streams) -> ComplexArray:
        """Chips of every sweep, ``(sweep, chip)``, of magnitude 1 at the peak."""
        draw = streams["waveform", "noise"].normal(size=(num_sweeps, self.num_chips, 2))
        white = draw[..., 0] + 1j * draw[..., 1]
        offset = np.fft.fftfreq(self.num_chips, self.chip_duration)
        spectrum = np.fft.fft(white, axis=1) * (np.abs(offset) <= 0.5 * self.bandwidth)
        noise = np.fft.ifft(spectrum, axis=1)
        limit = np.sqrt(self.peak_to_average)
        for _ in range(MOST_ROUNDS):
            noise /= np.sqrt(np.mean(np.abs(noise) ** 2, axis=1, keepdims=True))
            noise *= np.minimum(1.0, limit / np.maximum(np.abs(noise), 1e-300))
            # clipping lowers the mean power, so that the next round clips again
            if np.min(np.mean(np.abs(noise) ** 2, axis=1)) > 1.0 - RATIO_ERROR:
                break
        return np.asarray(noise / np.abs(noise).max())
