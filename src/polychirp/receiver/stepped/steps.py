r"""`Steps`: one value of each step, and the spectra of both sequences.

The samples of a step are averaged with the weights that mitigation leaves. A Doppler frequency
:math:`f_d` turns the samples within a window of the length W, which lowers their mean by
:math:`\mathrm{sinc}(f_d W)`: 0.3 dB at 30 m/s and 10 µs.
"""

from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, Sealed
from polychirp.model.if_frame import SampleTimes
from polychirp.receiver.range_doppler.transforms import taper

NEWTON_STEPS = 6
"""Number of Newton's steps to a peak; chosen: a start within 1 % of a cell takes three."""

SEQUENCES = 2
"""Number of sequences: A and B."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Steps(Sealed):
    """Tapered values of the steps: a steady echo's sum is its amplitude.

    Parameters
    ----------
    value : V, ``(channel, sequence, step)``
    time : s, of each step from the middle of its sequence, ``(step,)``
    interval : s, from step to step of a sequence
    """

    value: Annotated[ComplexArray, Axes("channel", "sequence", "step", dtype=np.complex128)]
    time: Annotated[FloatArray, Axes("step")]
    interval: float

    @classmethod
    def of(cls, samples: ComplexArray, weight: FloatArray, *, interval: float) -> Self:
        """The steps of samples ``(channel, ramp, fast)`` with weights ``(ramp, fast)``."""
        channels, ramps, _ = samples.shape
        count = ramps // SEQUENCES
        by_sequence = weight.sum(axis=1).reshape(count, SEQUENCES) * taper(count)[:, None]
        total = np.maximum(by_sequence.sum(axis=0), 1e-300)
        summed = np.einsum("ckn,kn->ck", samples, weight).reshape(channels, count, SEQUENCES)
        value = summed * taper(count)[:, None] / total
        return cls(
            value=np.moveaxis(value, 2, 1),
            time=(np.arange(count) - 0.5 * (count - 1)) * interval,
            interval=interval,
        )

    @property
    def beat(self) -> FloatArray:
        """Beats of the cells of `power`, Hz ``(cell,)``: from 0 to 1/T, where they repeat."""
        return np.arange(self.time.size) / (self.time.size * self.interval)

    @property
    def cells(self) -> ComplexArray:
        """Amplitudes in the cells of both sequences' spectra, V ``(channel, 2 × cell)``."""
        return np.fft.fft(self.value, axis=2).reshape(len(self.value), -1)

    @property
    def power(self) -> FloatArray:
        """Mean power of channels and sequences in every cell, W ``(cell,)``."""
        return np.asarray(np.mean(np.abs(np.fft.fft(self.value, axis=2)) ** 2, axis=(0, 1)))

    def amplitude(self, beat: FloatArray) -> ComplexArray:
        """Amplitudes in the middle of each sequence, V ``(channel, sequence, beat)``."""
        return np.asarray(self.value @ self._turns(beat))

    def spectrum(self, *, padding: int) -> ComplexArray:
        """Amplitudes as of `amplitude` at beats from 0 to 1/T: ``(channel, sequence, cell)``.

        The cells are ``padding`` times narrower than those of `power`.
        """
        size = padding * self.time.size
        beat = np.arange(size) / (size * self.interval)
        to_middle = np.exp(-2j * np.pi * self.time[0] * beat)
        return np.asarray(np.fft.fft(self.value, size, axis=2) * to_middle)

    def peaks(self, beat: FloatArray) -> FloatArray:
        """Beats, Hz, at which the power is greatest, near ``beat``; at most half a cell away.

        Newton's method finds where the derivative of the power vanishes.
        """
        half = 0.5 / (self.time.size * self.interval)
        now = beat
        turning = -2j * np.pi * self.time[:, None]
        for _ in range(NEWTON_STEPS):
            turn = self._turns(now)
            zero, one, two = (self.value @ (turning**n * turn) for n in range(3))
            slope = 2.0 * np.sum((np.conj(zero) * one).real, axis=(0, 1))
            bend = 2.0 * np.sum(np.abs(one) ** 2 + (np.conj(zero) * two).real, axis=(0, 1))
            move = np.where(bend < 0.0, -slope / np.where(bend < 0.0, bend, -1.0), 0.0)
            now = np.clip(now + move, beat - half, beat + half)
        return np.asarray(now)

    def _turns(self, beat: FloatArray) -> ComplexArray:
        return np.asarray(np.exp(-2j * np.pi * self.time[:, None] * beat))


def middle_time(times: SampleTimes) -> float:
    """Mean time of all samples, s, to which range and range rate of the steps refer."""
    middle = times.first + 0.5 * (times.num_samples - 1) / times.rate
    return float(np.mean(middle))
