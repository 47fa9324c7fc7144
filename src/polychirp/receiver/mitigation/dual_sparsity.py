"""Dual sparsity: echoes are few lines of a spectrum, bursts few cells of a time-frequency plane.

Both are taken from a ramp in turns, the stronger ones first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.receiver.mitigation.prediction import rms
from polychirp.receiver.mitigation.stft_excision import HOPS_PER_WINDOW, hann_transform
from polychirp.units import Between

LEAST_FACTOR = 4.0
"""Multiple of the median amplitude of lines, and of cells, of noise to which thresholds fall.
Chosen: noise exceeds it in 1.5 cells of 10⁵ with one channel, and in fewer with more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DualSparsity(BurstRepair):
    r"""Subtract from a ramp the cells of its time-frequency plane that no echoes explain.

    Morphological component analysis (Starck, Elad and Donoho 2005) with the Fourier transform F for
    the echoes r and a short-time Fourier transform S for the interference i:

    .. math:: r \leftarrow F^{-1} T_k\{F(y - i)\}, \qquad i \leftarrow S^{-1} T_k\{S(y - r)\},

    where :math:`T_k` keeps what is above a threshold that falls by equal factors from the greatest
    amplitude to `LEAST_FACTOR` times the median. Both are measured in multiples of the plane's
    median; of white noise, a line of N samples is :math:`\sqrt{N/\sum w^2}` times a cell of the
    window w. The median of the lines would not do: a burst fills few cells and all lines, so that
    its lines would seem weak beside their median, and with them the echoes' lines beside their
    cells. The result is y − i: noise, and echoes too weak for a line, are kept. Channels share
    lines and cells, chosen by their mean power. Published forms minimise the sum of magnitudes
    (dual sparsity); here both are kept or not, so that the operation is linear once it is chosen.
    Ramps without bursts are not changed. An interferer so close to parallel that its cells fill a
    row is taken for an echo. It takes 100 to 400 log₂ N real multiplications per sample, channel
    and iteration. `Imat` does without the plane.

    Parameters
    ----------
    window : length of the Hann window of S, samples; slices are an eighth of it apart
    iterations : number of thresholds
    """

    kind: Literal["dual-sparsity"] = "dual-sparsity"
    window: Annotated[int, Between(greatest=65_536)] = 64
    iterations: Annotated[int, Between(greatest=1000)] = 20

    def __post_init__(self) -> None:
        BurstRepair.__post_init__(self)
        if self.window < HOPS_PER_WINDOW or self.window % HOPS_PER_WINDOW:
            raise InputError(
                f"the window of dual sparsity must be a multiple of {HOPS_PER_WINDOW} samples"
            )
        if self.iterations < 2:
            raise InputError("dual sparsity needs 2 iterations or more, for its threshold to fall")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples without the cells of interference."""
        hit, present = self.hit(frame), frame.times.is_sample
        chosen = []
        for k in np.flatnonzero(hit.any(axis=1)):
            length = int(frame.times.num_samples[k])
            if length >= self.window:
                line = frame.samples[:, k, :length]
                chosen.append((int(k), length, list(self._choices(line))))

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            for k, length, choices in chosen:
                for part in np.ndindex(out.shape[:-3]):  # one by one: planes are large
                    line = out[part][:, k, :length]
                    out[part][:, k, :length] = line - self._interference(line, choices)
            return np.asarray(out)

        weight = present.astype(np.float64)
        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)

    def _choices(self, line: ComplexArray) -> list[_Choice]:
        """Lines and cells that each iteration keeps of a ramp ``(channel, fast)``."""
        choices: list[_Choice] = []
        interference = np.zeros_like(line)
        first = 0.0
        for k in range(self.iterations):
            cells = rms(self._plane(line - interference))
            noise = max(float(np.median(cells)), 1e-300)
            lines = rms(_spectrum(line - interference)) / (noise * self._line_over_cell(line))
            cells = cells / noise
            first = first or max(float(lines.max()), float(cells.max()), LEAST_FACTOR)
            factor = first * (LEAST_FACTOR / first) ** (k / (self.iterations - 1))
            echo = _lines(line - interference, lines > factor)
            plane = self._plane(line - echo)
            choices.append(_Choice(lines > factor, _in_medians(rms(plane)) > factor))
            interference = self._back(plane * choices[-1].cells, line.shape[-1])
        return choices

    def _interference(self, line: ComplexArray, choices: list[_Choice]) -> ComplexArray:
        """Interference in a ramp ``(channel, fast)`` by the lines and cells chosen before."""
        interference = np.zeros_like(line)
        for choice in choices:
            echo = _lines(line - interference, choice.lines)
            interference = self._back(self._plane(line - echo) * choice.cells, line.shape[-1])
        return interference

    def _line_over_cell(self, line: ComplexArray) -> float:
        """Amplitude of a line of white noise on a ramp over that of a cell of its plane."""
        window = hann_transform(self.window).win
        return float(np.sqrt(line.shape[-1] / np.sum(np.abs(window) ** 2)))

    def _plane(self, line: ComplexArray) -> ComplexArray:
        return np.asarray(hann_transform(self.window).stft(line))

    def _back(self, plane: ComplexArray, length: int) -> ComplexArray:
        return np.asarray(hann_transform(self.window).istft(plane, k1=length))


class _Choice(NamedTuple):
    """Masks of an iteration: lines ``(frequency,)`` and cells ``(frequency, slice)``."""

    lines: BoolArray
    cells: BoolArray


def _spectrum(line: ComplexArray) -> ComplexArray:
    from scipy import fft

    return np.asarray(fft.fft(line, axis=-1))


def _lines(line: ComplexArray, chosen: BoolArray) -> ComplexArray:
    from scipy import fft

    return np.asarray(fft.ifft(_spectrum(line) * chosen, axis=-1))


def _in_medians(amplitude: FloatArray) -> FloatArray:
    return np.asarray(amplitude / max(float(np.median(amplitude)), 1e-300))
