"""Excision: ridges of crossing interferers are removed from the time-frequency plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.errors import InputError
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.detection.cfar import ordered_statistic_factor
from polychirp.receiver.mitigation.base import Mitigated
from polychirp.spec import Spec
from polychirp.units import Between

if TYPE_CHECKING:
    from scipy.signal import ShortTimeFFT

HOPS_PER_WINDOW = 8
"""Length of the window over the hop from slice to slice; chosen."""

MOST_ROWS_HIT = 0.5
"""Share of a slice's rows that are hit above which the whole slice is removed; chosen: the burst
then fills the slice, also in the rows where echoes hide it."""

LEAST_SHARE_KEPT = 0.1
"""Share of a sample in slices that remain up to which the sample's weight is 0; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StftExcision(Spec):
    r"""Remove cells of the short-time Fourier transform that are far above their row's median.

    An echo is a steady row of a ramp's time-frequency plane; a crossing interferer is a ridge that
    passes each row once. A cell is hit if its mean power over the channels exceeds a multiple of
    the median of its row; its neighbours in frequency are then hit too. The multiple is that of an
    ordered-statistic CFAR over the row's independent slices (Rohling 1983), so that white noise
    exceeds it with ``false_alarm_probability``. A burst that is weaker than the echoes is found in
    the rows beside theirs. A slice with more than half of its rows hit is removed as a whole, and
    the weight of its samples falls. Zeroing and levelling are after J. Wang (2022).

    The inverse transform uses the canonical dual window: samples without hits are unchanged. A
    ridge that fills more than half of a row, such as that of a nearly parallel interferer, is kept
    like an echo. Where a ridge hits half of a slice or less, it remains in the rows of stronger
    echoes. Slices that reach beyond the ramp are treated like the nearest whole one.

    Parameters
    ----------
    window : length of the Hann window, samples; slices are an eighth of it apart
    false_alarm_probability : of a cell that contains noise alone
    cells : treatment of a cell that is hit: "zeroed", or "levelled", scaled to its row's median
    """

    kind: Literal["stft-excision"] = "stft-excision"
    window: Annotated[int, Between(greatest=65_536)] = 32
    false_alarm_probability: float = 1e-6
    cells: Literal["zeroed", "levelled"] = "zeroed"

    def __post_init__(self) -> None:
        if self.window < HOPS_PER_WINDOW or self.window % HOPS_PER_WINDOW:
            raise InputError(
                f"the window of an excision must be a multiple of {HOPS_PER_WINDOW} samples"
            )
        if not 0 < self.false_alarm_probability < 0.1:
            raise InputError("an excision's false-alarm probability must lie between 0 and 0.1")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples without ridges."""
        transform = self._transform()
        gain = self.gain(frame)
        present = frame.times.is_sample
        left = 1.0 - _share_lost(transform, ~np.any(gain > 0.0, axis=1), present.shape[1])
        weight = np.where(present & (left > LEAST_SHARE_KEPT), left, 0.0)
        ramps = np.flatnonzero((gain < 1.0).any(axis=(1, 2)))
        cut = gain[ramps]
        scale = (weight[ramps] > 0) / np.maximum(left[ramps], LEAST_SHARE_KEPT)

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            if ramps.size:
                for part in np.ndindex(out.shape[:-3]):  # one by one: planes are 8 times as large
                    cells = transform.stft(out[part][:, ramps])
                    back = transform.istft(cells * cut, k1=present.shape[1])
                    out[part][:, ramps] = back * scale
            return np.asarray(out)

        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)

    def gain(self, frame: IfFrame) -> FloatArray:
        """Amplitude factor, 0 … 1, of every cell ``(ramp, frequency, slice)``."""
        transform = self._transform()
        cells = transform.stft(frame.samples * frame.times.is_sample)
        power = np.mean(cells.real**2 + cells.imag**2, axis=0)
        gain = np.ones(power.shape)
        for k, length in enumerate(frame.times.num_samples):
            first, last = whole_slices(transform, int(length))
            if last > first:
                inside = power[k, :, first:last]
                gain[k, :, first:last] = self._cut(inside, self.above(inside, len(cells)))
                gain[k, :, :first] = gain[k, :, first : first + 1]
                gain[k, :, last:] = gain[k, :, last - 1 : last]
        return gain

    def above(self, power: FloatArray, channels: int) -> BoolArray:
        """Mask of a ramp's cells ``(frequency, slice)`` whose power exceeds the threshold.

        Slices that overlap a cell with a burst contain the burst too and are no reference for the
        cell: the median of all slices has a higher rank among the others.
        """
        transform = self._transform()
        number = independent_slices(transform, power.shape[1])
        others = number - independent_slices(transform, 2 * HOPS_PER_WINDOW - 1)
        rank = (number + 1) // 2
        factor = ordered_statistic_factor(
            max(others, rank),
            rank,
            false_alarm_probability=self.false_alarm_probability,
            num_looks=channels,
        )
        return np.asarray(power > factor * np.median(power, axis=1, keepdims=True))

    def _cut(self, power: FloatArray, above: BoolArray) -> FloatArray:
        """Amplitude factor of each cell of a ramp; ``above``: mask of cells above the threshold."""
        hit = above | np.roll(above, 1, axis=0) | np.roll(above, -1, axis=0)
        level = np.zeros_like(power)
        if self.cells == "levelled":
            median = np.median(power, axis=1, keepdims=True)
            level = np.sqrt(median / np.maximum(power, median))
        cut = np.where(hit, level, 1.0)
        cut[:, np.mean(hit, axis=0) > MOST_ROWS_HIT] = 0.0
        return cut

    def _transform(self) -> ShortTimeFFT:
        from scipy.signal import ShortTimeFFT
        from scipy.signal.windows import hann

        window = hann(self.window, sym=False)
        return ShortTimeFFT(window, self.window // HOPS_PER_WINDOW, fs=1.0, fft_mode="twosided")


def whole_slices(transform: ShortTimeFFT, length: int) -> tuple[int, int]:
    """Index of the first slice within a ramp of ``length`` samples, and index after the last."""
    first = -(-transform.m_num_mid // transform.hop)
    last = (length - (transform.m_num - transform.m_num_mid)) // transform.hop
    return first - transform.p_min, last + 1 - transform.p_min


def independent_slices(transform: ShortTimeFFT, number: int) -> int:
    r"""Number of independent slices that are equivalent to ``number`` overlapping ones.

    .. math:: n \Big/ \Big(1 + 2\sum_l \rho_l\Big), \qquad
              \rho_l = \frac{\left(\sum_n w_n w_{n+lh}\right)^2}{\left(\sum_n w_n^2\right)^2}

    with the window w and the hop h. The mean of so many independent powers has the same variance as
    the mean of powers that have the correlation ρ_l if they are l slices apart.
    """
    window = np.asarray(transform.win, dtype=np.float64)
    energy = float(np.sum(window**2))
    shared = [
        float(np.sum(window[lag:] * window[:-lag])) / energy
        for lag in range(transform.hop, window.size, transform.hop)
    ]
    return max(1, round(number / (1.0 + 2.0 * sum(share**2 for share in shared))))


def _share_lost(transform: ShortTimeFFT, is_lost: BoolArray, fast: int) -> FloatArray:
    """Share, 0 … 1, of each sample ``(ramp, fast)`` in removed slices ``(ramp, slice)``.

    The share in one slice is window times dual window; the shares in all slices add up to 1.
    """
    both = np.asarray(transform.win * transform.dual_win, dtype=np.float64)
    out = np.zeros((is_lost.shape[0], fast))
    for column, number in enumerate(range(transform.p_min, transform.p_max(fast))):
        start = number * transform.hop - transform.m_num_mid
        inside = slice(max(0, start), min(fast, start + both.size))
        out[:, inside] += is_lost[:, [column]] * both[inside.start - start : inside.stop - start]
    return out
