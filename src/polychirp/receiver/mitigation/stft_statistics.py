"""L-statistics: of each row of the time-frequency plane, the strongest slices are left out."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.receiver.mitigation.burst_repair import BurstRepair
from polychirp.receiver.mitigation.patches import gaps_and_ends
from polychirp.units import Between

HOPS = 4
"""Length of the window over the hop from slice to slice; chosen: Hann windows then add up to 2."""

LEAST_SHARE_KEPT = 0.25
"""Least share of each row's slices that is kept, chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StftStatistics(BurstRepair):
    r"""Add up only the weaker slices of each frequency of a ramp.

    The sum of a ramp's short-time spectra over all slices is the ramp's spectrum. An echo is in all
    slices of a row alike, and a burst that crosses the band in few of them. The strongest share of
    each row's slices is left out, and the others are added in phase and scaled by the share q that
    is kept (Muja, Anghel, Cacoveanu and Ciochina 2022),

    .. math:: 1 - q = M L / N

    with the M bursts that the detector finds on the ramp, the window's length L and the ramp's N
    samples: each burst passes a row within about one window. A ramp without bursts is not changed.
    Long bursts stay in a row for longer, and more of them remains. Slices are ranked by the mean
    power over the channels. It takes 16 N log₂ N / L real multiplications per sample and channel.
    `StftExcision` decides cell by cell.

    Parameters
    ----------
    window : L, length of the Hann window, samples; slices are a quarter of it apart
    """

    kind: Literal["stft-statistics"] = "stft-statistics"
    window: Annotated[int, Between(greatest=65_536)] = 64

    def __post_init__(self) -> None:
        BurstRepair.__post_init__(self)
        if self.window < HOPS or self.window % HOPS:
            raise InputError(f"the window of L-statistics must be a multiple of {HOPS} samples")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples without the strongest slices of each frequency."""
        hit = self.hit(frame)
        present = frame.times.is_sample
        kept: list[tuple[int, BoolArray]] = []
        for k in np.flatnonzero(hit.any(axis=1)):
            length = int(frame.times.num_samples[k])
            bursts = len(list(gaps_and_ends(hit[k, :length], 1)))
            lost = min(1.0 - LEAST_SHARE_KEPT, bursts * self.window / length)
            kept.append((int(k), self._kept(frame.samples[:, k, :length], lost)))

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            for k, mask in kept:
                length = mask.shape[0]
                out[..., k, :length] = self._added(out[..., k, :length], mask)
            return np.asarray(out)

        weight = present.astype(np.float64)
        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)

    def _kept(self, line: ComplexArray, lost: float) -> BoolArray:
        """Mask of the slices ``(frequency, slice)`` of a ramp ``(channel, fast)`` that are kept."""
        from scipy import fft

        windows = self._windows(line.shape[-1])
        power = np.zeros((line.shape[-1], len(windows)))
        for number, window in enumerate(windows):
            power[:, number] = rms_squared(fft.fft(line * window, axis=-1))
        # a slice that reaches beyond the ramp holds less of an echo, and is ranked by its share
        power /= np.maximum(windows.sum(axis=1), 1e-3) ** 2
        rank = np.argsort(np.argsort(power, axis=1), axis=1)
        return np.asarray(rank < len(windows) - round(lost * len(windows)))

    def _added(self, line: ComplexArray, kept: BoolArray) -> ComplexArray:
        """A ramp ``(…, fast)`` of the slices that are kept."""
        from scipy import fft

        windows = self._windows(line.shape[-1])
        total = windows.sum(axis=0)
        share = kept @ windows.sum(axis=1) / total.sum()
        spectrum = np.zeros_like(line)
        for number, window in enumerate(windows):
            spectrum += kept[:, number] * fft.fft(line * (window / total), axis=-1)
        return np.asarray(fft.ifft(spectrum / np.maximum(share, 1e-3), axis=-1))

    def _windows(self, length: int) -> FloatArray:
        """The windows of all slices on a ramp, ``(slice, fast)``."""
        hop = self.window // HOPS
        middle = np.arange(0, length + hop, hop)[:, None]
        away = np.arange(length) - middle
        inside = np.abs(away) < self.window / 2
        return np.asarray(np.where(inside, np.cos(np.pi * away / self.window) ** 2, 0.0))


def rms_squared(spectrum: ComplexArray) -> FloatArray:
    """Mean power over the channels, which are the first axis."""
    return np.asarray(np.mean(spectrum.real**2 + spectrum.imag**2, axis=0))
