"""Excision: ridges of crossing interferers are cut out of the time-frequency plane."""

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

HOPS = 8
"""Hops in a window."""

MOST_ROWS = 0.5
"""Share of a slice's rows above which a burst is taken to fill it, also where echoes hide it."""

LEAST_SHARE = 0.1
"""A sample of which less is left counts as lost."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StftExcision(Spec):
    r"""Cut what stands out of its row of the short-time Fourier transform.

    An echo is a steady row of a ramp's time-frequency plane, a crossing interferer a ridge that
    passes each row once. A cell whose power, summed over the channels, exceeds a multiple of the
    median of its row is hit, and so are its neighbours in frequency. The multiple is that of an
    ordered-statistic CFAR over the row's independent slices (Rohling 1983), so that white noise
    exceeds it with ``false_alarm_probability``. A burst that is weaker than the echoes is found in
    the rows beside theirs; a slice with more than half of its rows hit is cut as a whole, and its
    samples count as less present. Zeroing and levelling are after J. Wang (2022).

    The transform back is by the canonical dual window: where nothing is hit, every sample is
    what it was. A ridge that fills more than half of a row, such as a nearly parallel
    interferer's, is taken for an echo. One that fills no slice stays in the echoes' rows, where
    they are stronger. Slices that reach beyond the ramp share the verdict of the nearest whole one.

    Parameters
    ----------
    window : samples of Hann's window; slices follow each other by an eighth of it
    false_alarm_probability : per cell, on noise alone
    cells : what becomes of a cell that is hit: "zeroed", or "levelled", scaled to its row's median
    """

    kind: Literal["stft-excision"] = "stft-excision"
    window: Annotated[int, Between(greatest=65_536)] = 32
    false_alarm_probability: float = 1e-6
    cells: Literal["zeroed", "levelled"] = "zeroed"

    def __post_init__(self) -> None:
        if self.window < HOPS or self.window % HOPS:
            raise InputError(f"the window of an excision must be a multiple of {HOPS} samples")
        if not 0 < self.false_alarm_probability < 0.1:
            raise InputError("an excision's false-alarm probability must lie between 0 and 0.1")

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples without ridges."""
        transform = self._transform()
        gain = self.gain(frame)
        present = frame.times.is_sample
        left = 1.0 - _share_lost(transform, ~np.any(gain > 0.0, axis=1), present.shape[1])
        weight = np.where(present & (left > LEAST_SHARE), left, 0.0)
        ramps = np.flatnonzero((gain < 1.0).any(axis=(1, 2)))
        cut = gain[ramps]
        scale = (weight[ramps] > 0) / np.maximum(left[ramps], LEAST_SHARE)

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            if ramps.size:
                for part in np.ndindex(out.shape[:-3]):  # a plane is 8 times its samples
                    cells = transform.stft(out[part][:, ramps])
                    back = transform.istft(cells * cut, k1=present.shape[1])
                    out[part][:, ramps] = back * scale
            return np.asarray(out)

        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)

    def gain(self, frame: IfFrame) -> FloatArray:
        """What every cell is multiplied by, ``(ramp, frequency, slice)``."""
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
        """Cells ``(frequency, slice)`` of a ramp above the threshold.

        Slices that overlap a loud cell are loud too, so they are no reference: what is the median
        of all is a higher rank among the others.
        """
        transform = self._transform()
        number = independent_slices(transform, power.shape[1])
        others = number - independent_slices(transform, 2 * HOPS - 1)
        rank = (number + 1) // 2
        factor = ordered_statistic_factor(
            max(others, rank),
            rank,
            false_alarm_probability=self.false_alarm_probability,
            num_looks=channels,
        )
        return np.asarray(power > factor * np.median(power, axis=1, keepdims=True))

    def _cut(self, power: FloatArray, above: BoolArray) -> FloatArray:
        """Gain of each cell, of which some are above the threshold."""
        hit = above | np.roll(above, 1, axis=0) | np.roll(above, -1, axis=0)
        level = np.zeros_like(power)
        if self.cells == "levelled":
            median = np.median(power, axis=1, keepdims=True)
            level = np.sqrt(median / np.maximum(power, median))
        cut = np.where(hit, level, 1.0)
        cut[:, np.mean(hit, axis=0) > MOST_ROWS] = 0.0
        return cut

    def _transform(self) -> ShortTimeFFT:
        from scipy.signal import ShortTimeFFT
        from scipy.signal.windows import hann

        window = hann(self.window, sym=False)
        return ShortTimeFFT(window, self.window // HOPS, fs=1.0, fft_mode="twosided")


def whole_slices(transform: ShortTimeFFT, length: int) -> tuple[int, int]:
    """Numbers of the first slice, and after the last, that lie inside a ramp of so many samples."""
    first = -(-transform.m_num_mid // transform.hop)
    last = (length - (transform.m_num - transform.m_num_mid)) // transform.hop
    return first - transform.p_min, last + 1 - transform.p_min


def independent_slices(transform: ShortTimeFFT, number: int) -> int:
    r"""How many independent slices say as much about noise as so many that overlap.

    .. math:: n \Big/ \Big(1 + 2\sum_l \rho_l\Big), \qquad
              \rho_l = \frac{\left(\sum_n w_n w_{n+lh}\right)^2}{\left(\sum_n w_n^2\right)^2}

    with the hop h: the variance of the mean of powers that are correlated by ρ.
    """
    window = np.asarray(transform.win, dtype=np.float64)
    energy = float(np.sum(window**2))
    shared = [
        float(np.sum(window[lag:] * window[:-lag])) / energy
        for lag in range(transform.hop, window.size, transform.hop)
    ]
    return max(1, round(number / (1.0 + 2.0 * sum(share**2 for share in shared))))


def _share_lost(transform: ShortTimeFFT, is_lost: BoolArray, fast: int) -> FloatArray:
    """What lost slices, ``(ramp, slice)``, take of each sample, ``(ramp, fast)``, 0 … 1.

    Slices weigh samples by window times dual window, and all of them together by one.
    """
    both = np.asarray(transform.win * transform.dual_win, dtype=np.float64)
    out = np.zeros((is_lost.shape[0], fast))
    for column, number in enumerate(range(transform.p_min, transform.p_max(fast))):
        start = number * transform.hop - transform.m_num_mid
        inside = slice(max(0, start), min(fast, start + both.size))
        out[:, inside] += is_lost[:, [column]] * both[inside.start - start : inside.stop - start]
    return out
