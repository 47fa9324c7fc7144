"""Excision: ridges of crossing interferers are removed from the time-frequency plane."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.errors import CapabilityError, InputError
from polychirp.model.if_frame import IfFrame, SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.mitigation.base import Mitigated, refuse_frame
from polychirp.receiver.mitigation.row_median import median_factors
from polychirp.receiver.mitigation.steady_lines import Lines, excision_matrix, steady_lines
from polychirp.spec import Spec
from polychirp.units import Between

if TYPE_CHECKING:
    from scipy.signal import ShortTimeFFT

HOPS_PER_WINDOW = 8
"""Length of the window over the hop from slice to slice; chosen."""

MOST_ROWS_HIT = 0.5
"""Share of a slice's rows that are hit above which the whole slice is removed; chosen: the burst
then fills the slice, also in the rows where echoes hide it."""

CONNECTED = 0.05
"""Probability that noise alone exceeds the lower threshold of cells that are connected with a hit
one. Chosen: it leaves of a ridge what is some 3 dB above the noise, with four channels, and noise
alone connects only a few cells."""

LEAST_SHARE_KEPT = 0.1
"""Share of a sample in slices that remain up to which the sample's weight is 0; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StftExcision(Spec):
    r"""Remove cells of the short-time Fourier transform that are far above their row's median.

    An echo is a steady row of a ramp's time-frequency plane; a crossing interferer is a ridge that
    passes each row once. A cell is hit if its mean power over the channels exceeds a multiple of
    the median of its row; its neighbours in frequency are then hit too. The multiple is that of an
    ordered-statistic CFAR over the row's overlapping slices (`median_factors`), so that white noise
    exceeds it with ``false_alarm_probability``, to a third on ramps of three windows or more. Ramps
    of two windows have 0.6 times this rate, and those of one and a half 0.1 times: the median then
    holds the cell's own power, and weak bursts are missed. A burst that is weaker than the echoes
    is found in the rows beside theirs. A slice with more than half of its rows hit is removed as a
    whole, and the weight of its samples falls. Zeroing and levelling are after J. Wang (2022).

    Where much of a ramp is removed, and not the same part of every ramp, echoes are interrupted by
    gaps that change from ramp to ramp, which spreads strong echoes over range and speed: zeroed or
    levelled, their side lobes may cross the threshold of detection. "filled" closes the gaps by the
    steady lines of each ramp (`steady_lines`). Without these lines a burst shows in the rows of
    echoes too, so that cells are chosen once more from the rest: those that exceed the threshold,
    and those connected with them that noise alone exceeds in `CONNECTED` of all cases. No slice
    needs to be removed as a whole then, and all samples keep their weight.

    The inverse transform uses the canonical dual window: samples without hits are unchanged. A
    ridge that fills more than half of a row, such as that of a nearly parallel interferer, is kept
    like an echo. Where a ridge hits half of a slice or less, it remains in the rows of stronger
    echoes. Slices that reach beyond the ramp are treated like the nearest whole one.

    `Blanking` removes whole samples instead.

    Parameters
    ----------
    window : length of the Hann window, samples; slices are an eighth of it apart
    false_alarm_probability : of a cell that contains noise alone
    cells : treatment of a cell that is hit: "zeroed"; "levelled", scaled to its row's median; or
        "filled" from the ramp's steady lines, which takes some 50 ms per ramp of 500 samples
    """

    kind: Literal["stft-excision"] = "stft-excision"
    window: Annotated[int, Between(greatest=65_536)] = 32
    false_alarm_probability: float = 1e-6
    cells: Literal["zeroed", "levelled", "filled"] = "zeroed"

    def __post_init__(self) -> None:
        if self.window < HOPS_PER_WINDOW or self.window % HOPS_PER_WINDOW:
            raise InputError(
                f"the window of an excision must be a multiple of {HOPS_PER_WINDOW} samples"
            )
        if not 0 < self.false_alarm_probability < 0.1:
            raise InputError("an excision's false-alarm probability must lie between 0 and 0.1")

    def refuse(
        self, schedule: RampSchedule, *, times: SampleTimes, is_real: bool, num_channels: int
    ) -> None:
        """Refuse ramps that it cannot repair.

        Raises
        ------
        CapabilityError
            No ramp is as long as the window.
        """
        del schedule, is_real, num_channels
        longest = times.most_samples
        if longest < HOPS_PER_WINDOW:
            raise CapabilityError(
                f"a ramp has {longest} samples, too few for a time-frequency plane; leave this "
                "mitigation out"
            )
        if longest < self.window:
            raise CapabilityError(
                f"a ramp has {longest} samples, and the window of the time-frequency plane "
                f"{self.window}; use a window of "
                f"{HOPS_PER_WINDOW * (longest // HOPS_PER_WINDOW)} or less"
            )

    def mitigate(self, frame: IfFrame) -> Mitigated:
        """The frame's samples without ridges."""
        gain = self.gain(frame)
        return self._filled(frame, gain) if self.cells == "filled" else self._cut_out(frame, gain)

    def _cut_out(self, frame: IfFrame, gain: FloatArray) -> Mitigated:
        """The frame with cells scaled by ``gain``; samples of removed slices have less weight."""
        transform = self._transform()
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

    def _filled(self, frame: IfFrame, gain: FloatArray) -> Mitigated:
        """The frame with all cells filled that are hit after its steady lines are subtracted."""
        transform, looks = self._transform(), self._looks(frame)
        present = frame.times.is_sample
        ramps = [int(k) for k in np.flatnonzero((gain < 1.0).any(axis=(1, 2)))]
        rest = frame.samples * present
        for k in ramps:
            lines, kept = self._lines(frame, k, gain[k])
            rest[:, k, : kept.shape[1]] -= kept @ lines.fit.T @ lines.tone.T
        cells = transform.stft(rest[:, ramps])
        power = np.mean(cells.real**2 + cells.imag**2, axis=0)
        fillers = []
        for number, k in enumerate(ramps):
            length = int(frame.times.num_samples[k])
            gain[k] = ~self._ridges(power[number], length, looks)
            lines, _ = self._lines(frame, k, gain[k])
            fillers.append(lines)

        def repair(samples: ComplexArray) -> ComplexArray:
            out = samples * present
            if ramps:
                for part in np.ndindex(out.shape[:-3]):
                    planes = transform.stft(out[part][:, ramps])
                    back = transform.istft(planes * gain[ramps], k1=present.shape[1])
                    for number, lines in enumerate(fillers):
                        length = lines.tone.shape[0]
                        of_ramp = back[:, number, :length]
                        of_ramp += of_ramp @ lines.fit.T @ lines.missing.T
                    out[part][:, ramps] = back * present[ramps]
            return np.asarray(out)

        weight = present.astype(np.float64)
        return Mitigated(samples=repair(frame.samples), weight=weight, repair=repair)

    def _lines(self, frame: IfFrame, ramp: int, gain: FloatArray) -> tuple[Lines, ComplexArray]:
        """Steady lines of a ramp, and its samples ``(channel, fast)`` that the gain keeps."""
        length = int(frame.times.num_samples[ramp])
        matrix = excision_matrix(self._transform(), gain, length)
        kept = frame.samples[:, ramp, :length] @ matrix.T
        lines = steady_lines(kept, matrix, gain.mean(axis=1))
        return (lines if np.any(frame.samples.imag) else lines.real()), kept

    def _ridges(self, power: FloatArray, length: int, looks: FloatArray) -> BoolArray:
        """Mask of the cells ``(frequency, slice)`` of a ramp without lines that contain a burst.

        Slices that reach beyond the ramp have less noise, by the energy of the window's part in it.
        """
        from scipy.ndimage import binary_propagation

        transform = self._transform()
        first, last = whole_slices(transform, length)
        if last <= first:
            return np.zeros(power.shape, dtype=np.bool_)
        inside = np.maximum(_energy_inside(transform, length, power.shape[1]), 1e-6)
        median = np.median(power[:, first:last], axis=1, keepdims=True)
        ratio = power / (inside * np.maximum(median, 1e-300))
        beyond = ((0, 0), (first, power.shape[1] - last))
        high, low = (
            np.pad(median_factors(last - first, looks, probability=share), beyond, mode="edge")
            for share in (self.false_alarm_probability, CONNECTED)
        )
        rows = len(ratio)
        # the first row follows the last one
        seeds, mask = (np.concatenate([ratio > factor] * 3) for factor in (high, low))
        hit = binary_propagation(seeds, structure=np.ones((3, 3), dtype=np.bool_), mask=mask)
        hit = hit[rows : 2 * rows]
        return np.asarray(hit | np.roll(hit, 1, axis=0) | np.roll(hit, -1, axis=0))

    def gain(self, frame: IfFrame) -> FloatArray:
        """Amplitude factor, 0 … 1, of every cell ``(ramp, frequency, slice)``."""
        power, looks = self._power(frame), self._looks(frame)
        gain = np.ones(power.shape)
        for k, (first, last) in enumerate(self._inner_slices(frame)):
            if last > first:
                inside = power[k, :, first:last]
                above = self.above(inside, looks)
                gain[k, :, first:last] = self._cut(inside, above)
                gain[k, :, :first] = gain[k, :, first : first + 1]
                gain[k, :, last:] = gain[k, :, last - 1 : last]
        return gain

    def hit(self, frame: IfFrame) -> BoolArray:
        """Mask of the samples nearest to a slice with a cell that is removed, ``(ramp, fast)``."""
        slices = np.asarray(self.hit_cells(frame).any(axis=1))
        present = frame.times.is_sample
        return np.asarray(slices[:, nearest_slices(self.window, present.shape[1])] & present)

    def hit_cells(self, frame: IfFrame) -> BoolArray:
        """Mask of the cells above their thresholds, ``(ramp, frequency, slice)``.

        Slices that reach beyond the ramp are treated like the nearest whole one.
        """
        power, looks = self._power(frame), self._looks(frame)
        hit = np.zeros(power.shape, dtype=np.bool_)
        for k, (first, last) in enumerate(self._inner_slices(frame)):
            if last > first:
                hit[k, :, first:last] = self.above(power[k, :, first:last], looks)
                hit[k, :, :first] = hit[k, :, first : first + 1]
                hit[k, :, last:] = hit[k, :, last - 1 : last]
        return hit

    def _power(self, frame: IfFrame) -> FloatArray:
        """Mean power over the channels of every cell, ``(ramp, frequency, slice)``."""
        refuse_frame(self, frame)
        cells = self._transform().stft(frame.samples * frame.times.is_sample)
        return np.asarray(np.mean(cells.real**2 + cells.imag**2, axis=0))

    def _inner_slices(self, frame: IfFrame) -> list[tuple[int, int]]:
        """`whole_slices` of every ramp."""
        transform = self._transform()
        return [whole_slices(transform, int(length)) for length in frame.times.num_samples]

    def _looks(self, frame: IfFrame) -> FloatArray:
        """Number of independent looks in a cell of every row, ``(frequency,)``: the channels.

        Of real samples the rows at zero and at half the sample rate are real: half a look each.
        """
        looks = np.full(self.window, float(len(frame.samples)))
        if not np.any(frame.samples.imag):
            looks[[0, self.window // 2]] *= 0.5
        return looks

    def above(self, power: FloatArray, looks: FloatArray) -> BoolArray:
        """Mask of a ramp's cells ``(frequency, slice)`` whose power exceeds the threshold.

        ``looks`` is the number of independent looks in a cell of each row, ``(frequency,)``.
        """
        factor = median_factors(power.shape[1], looks, probability=self.false_alarm_probability)
        return np.asarray(power > factor * np.median(power, axis=1, keepdims=True))

    def _cut(self, power: FloatArray, above: BoolArray) -> FloatArray:
        """Amplitude factor of each cell of a ramp; ``above``: mask of cells above the threshold."""
        hit = above | np.roll(above, 1, axis=0) | np.roll(above, -1, axis=0)
        level = np.zeros_like(power)
        if self.cells == "levelled":
            median = np.median(power, axis=1, keepdims=True)
            level = np.sqrt(median / np.maximum(np.maximum(power, median), 1e-300))
        cut = np.where(hit, level, 1.0)
        cut[:, np.mean(hit, axis=0) > MOST_ROWS_HIT] = 0.0
        return cut

    def _transform(self) -> ShortTimeFFT:
        return hann_transform(self.window)


@lru_cache(maxsize=8)
def hann_transform(window: int, hops: int = HOPS_PER_WINDOW) -> ShortTimeFFT:
    """Short-time transform with Hann windows of so many samples, 1/``hops`` of one apart."""
    from scipy.signal import ShortTimeFFT
    from scipy.signal.windows import hann

    return ShortTimeFFT(hann(window, sym=False), window // hops, fs=1.0, fft_mode="twosided")


def nearest_slices(window: int, length: int, hops: int = HOPS_PER_WINDOW) -> IntArray:
    """Index of the slice whose middle is nearest to each of ``length`` samples, ``(fast,)``.

    >>> nearest_slices(16, 8)
    array([3, 4, 4, 5, 5, 6, 6, 7])
    """
    transform = hann_transform(window, hops)
    number = (np.arange(length) + transform.hop // 2) // transform.hop - transform.p_min
    return np.minimum(number, transform.p_max(length) - transform.p_min - 1)


def whole_slices(transform: ShortTimeFFT, length: int) -> tuple[int, int]:
    """Index of the first slice within a ramp of ``length`` samples, and index after the last."""
    first = -(-transform.m_num_mid // transform.hop)
    last = (length - (transform.m_num - transform.m_num_mid)) // transform.hop
    return first - transform.p_min, last + 1 - transform.p_min


def _energy_inside(transform: ShortTimeFFT, length: int, slices: int) -> FloatArray:
    """Share of the window's energy inside a ramp of ``length`` samples, ``(slice,)``."""
    energy = np.cumsum(np.concatenate([[0.0], np.abs(transform.win) ** 2]))
    start = (np.arange(slices) + transform.p_min) * transform.hop - transform.m_num_mid
    begin = np.clip(-start, 0, transform.m_num)
    end = np.clip(length - start, begin, transform.m_num)
    return np.asarray((energy[end] - energy[begin]) / energy[-1])


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
