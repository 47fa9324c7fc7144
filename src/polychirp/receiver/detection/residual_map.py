"""The map of ln(power) over range and range rate, computed again after every subtraction."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.jit import compiled, reordered
from polychirp.model.if_frame import SampleTimes
from polychirp.model.ramp import RampSchedule
from polychirp.receiver.detection.floor_correlation import FloorCorrelation, floor_correlation
from polychirp.receiver.detection.range_rate_map import (
    beat_lines,
    floor_over_range,
    medians,
    noise_share,
)
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.spectral_fit import BINS_PER_CELL, Band

SUBSTEPS = 8
"""Parts of a range step to one of which the beat at a row's first range is rounded (chosen). A step
is half a resolution cell, so that the error is at most a thirty-second of a cell. Because of the
rounding, a row is a sum of contiguous pieces of `SUBSTEPS` resampled spectra per ramp."""

NUM_FLOOR_RATES = 16
"""Greatest number of range rates from which the floor is estimated (chosen: more would take longer
and add little, see `ResidualMap.floor`)."""


class ResidualMap:
    """Mean over ramps of ln(power) at the beats of each range and range rate.

    The spectra are those that remain when the points found so far are subtracted. The map equals
    `log_range_rate_map` but for the rounding by `SUBSTEPS`, single precision and the axes' order.

    Parameters
    ----------
    beams : complex weights of the channels in each beam, ``(beam, channel)``

    Attributes
    ----------
    logs : ln(power), ``(ramp, bin, beam)``
    statistic : mean over ramps, ``(range_rate, range, beam)``
    noise : mean noise power, ``(ramp,)``: median over bins / ln 2, averaged over the beams
    """

    def __init__(
        self,
        band: Band,
        schedule: RampSchedule,
        times: SampleTimes,
        grid: Grid,
        beams: ComplexArray,
    ) -> None:
        self.band, self.grid, self.beams = band, grid, beams
        first, step = beat_lines(schedule, times, grid, band.size)
        self._step = np.ascontiguousarray(step[0])
        fraction = np.rint((first - band.first) / step * SUBSTEPS).astype(np.int64)
        self._start = np.ascontiguousarray(fraction // SUBSTEPS)
        self._fraction = np.ascontiguousarray(fraction % SUBSTEPS)
        self.logs = np.zeros((band.length.size, band.num_bins, len(beams)), dtype=np.float32)
        shape = (grid.range_rate.size, grid.range.size, len(beams))
        self.statistic = np.zeros(shape, dtype=np.float32)
        self.noise = np.zeros(band.length.size)
        self._apart = len(self.statistic) // NUM_FLOOR_RATES + 1
        self._block = round(6.0 / grid.range_step)

    def update(self, spectra: FloatArray, beats: FloatArray) -> None:
        """Compute the map of spectra from which the points with ``beats`` were subtracted.

        ``spectra`` is ``(part, ramp, channel, bin)`` with real and imaginary parts, ``beats`` Hz,
        ``(point, ramp)``. The mean noise power that subtraction of a point removes (`noise_share`)
        is added again, so that the notches at the points' beats do not lower the floor.
        """
        power = _beam_powers(spectra, np.ascontiguousarray(self.beams))
        noise = medians(np.swapaxes(power[:, ::BINS_PER_CELL], 1, 2)) / np.log(2.0)
        self.noise = np.mean(noise, axis=1)
        self.logs = _logs(power, noise, self._depletion(beats))
        self.statistic = _sum_of_rows(
            self.logs, self._start, self._fraction, self._step, self.grid.range.size
        )

    def _depletion(self, beats: FloatArray) -> FloatArray:
        """Share of the noise that was subtracted, ``(ramp, bin)``: the largest of any point."""
        band = self.band
        out = np.zeros((band.length.size, band.num_bins))
        if len(beats) == 0:
            return out
        place = beats * band.size / band.rate - band.first
        reach = np.arange(-3 * BINS_PER_CELL + 1, 3 * BINS_PER_CELL)
        index = np.rint(place).astype(np.int64)[..., None] + reach
        share = noise_share(np.abs(index - place[..., None]) / BINS_PER_CELL)
        rows = np.broadcast_to(np.arange(band.length.size)[:, None], index.shape)
        np.maximum.at(out, (rows, np.clip(index, 0, band.num_bins - 1)), share)
        return out

    def floor(self) -> FloatArray:
        """Level without targets, ``(range, beam)``: `floor_over_range` of a few range rates.

        With at most `NUM_FLOOR_RATES` evenly spaced rates each median is over about a thousand
        cells, and its error is 0.03 (in ln(power)) with 32 ramps. The rates between them read
        almost the same bins and would add little.
        """
        some = np.moveaxis(self.statistic[:: self._apart], -1, 0).astype(np.float64)
        return floor_over_range(some, self._block)[:, 0].T

    def floor_correlation(self) -> FloorCorrelation:
        """Correlation of the floor with the map when the samples contain noise alone."""
        return floor_correlation(
            self._start + self._fraction / SUBSTEPS,
            self._step,
            sampled=self._apart,
            block=self._block,
        )

    def peak_level(self) -> float:
        """Ln of the beams' summed exp(statistic), at the cell with the highest single beam."""
        beams = self.statistic.reshape(-1, self.statistic.shape[-1])
        cell = int(np.argmax(self.statistic)) // beams.shape[1]
        return float(np.logaddexp.reduce(beams[cell].astype(np.float64)))

    def excess(
        self, floor: FloatArray, least: float
    ) -> tuple[NDArray[np.float32], NDArray[np.int8]]:
        """Greatest height of a beam above its floor, and that beam's number.

        Both are ``(range_rate, range)``. The height is −∞ where ln of the beams' summed
        exp(statistic) is below ``least``. The sum is compared because a target half-way between
        two orthogonal beams has only 40 % of its power in each.
        """
        return _excess(  # type: ignore[no-any-return]
            self.statistic, floor.astype(np.float32), np.float32(least)
        )


@reordered
def _beam_powers(spectra: Any, beams: Any) -> Any:  # pragma: no cover - compiled
    """Power of every beam, ``(ramp, bin, beam)``."""
    _, ramps, channels, bins = spectra.shape
    out = np.empty((ramps, bins, len(beams)))
    real, imag = np.empty(bins), np.empty(bins)
    for k in range(ramps):
        for b in range(len(beams)):
            real[:] = 0.0
            imag[:] = 0.0
            for m in range(channels):
                x, y = beams[b, m].real, beams[b, m].imag
                re, im = spectra[0, k, m], spectra[1, k, m]
                for i in range(bins):
                    real[i] += x * re[i] - y * im[i]
                    imag[i] += x * im[i] + y * re[i]
            for i in range(bins):
                out[k, i, b] = real[i] ** 2 + imag[i] ** 2
    return out


@compiled
def _logs(power: Any, noise: Any, depletion: Any) -> Any:  # pragma: no cover - compiled
    ramps, bins, beams = power.shape
    out = np.empty((ramps, bins, beams), dtype=np.float32)
    for k in range(ramps):
        for i in range(bins):
            for b in range(beams):
                value = power[k, i, b] + noise[k, b] * depletion[k, i]
                out[k, i, b] = np.log(max(value, 1e-300))
    return out


@reordered
def _sum_of_rows(  # pragma: no cover - compiled
    logs: Any, start: Any, fraction: Any, step: Any, num_ranges: int
) -> Any:
    """The map's statistic: each row is a mean over ramps of pieces of resampled spectra."""
    ramps, bins, beams = logs.shape
    rates = start.shape[0]
    out = np.zeros((rates, num_ranges * beams), dtype=np.float32)
    for k in range(ramps):
        low = start[:, k].min()
        length = start[:, k].max() - low + num_ranges
        resampled = np.empty((SUBSTEPS, length * beams), dtype=np.float32)
        for f in range(SUBSTEPS):
            for j in range(length):
                place = step[k] * (low + j + f / SUBSTEPS)
                i = min(bins - 1, max(0, int(np.floor(place + 0.5))))
                for b in range(beams):
                    resampled[f, j * beams + b] = logs[k, i, b]
        for i in range(rates):
            first = (start[i, k] - low) * beams
            row = resampled[fraction[i, k], first : first + num_ranges * beams]
            total = out[i]
            for n in range(num_ranges * beams):
                total[n] += row[n]
    out *= np.float32(1.0 / ramps)
    return out.reshape((rates, num_ranges, beams))


@compiled
def _excess(statistic: Any, floor: Any, least: Any) -> Any:  # pragma: no cover - compiled
    rates, ranges, beams = statistic.shape
    out = np.full((rates, ranges), -np.inf, dtype=np.float32)
    beam = np.zeros((rates, ranges), dtype=np.int8)
    nearly = np.float32(least - np.log(beams))  # the sum of beams below it is below least
    for i in range(rates):
        for j in range(ranges):
            highest, best, number = np.float32(-np.inf), np.float32(-np.inf), 0
            for b in range(beams):
                value = statistic[i, j, b]
                highest = max(highest, value)
                if value - floor[j, b] > best:
                    best = value - floor[j, b]
                    number = b
            if highest < nearly:
                continue
            if highest < least:
                together = np.float32(0.0)
                for b in range(beams):
                    together += np.exp(statistic[i, j, b] - highest)
                if highest + np.log(together) < least:
                    continue
            out[i, j] = best
            beam[i, j] = number
    return out, beam


def strongest_peaks(
    excess: NDArray[np.float32], threshold: float, apart: int, most: int
) -> IntArray:
    """Peaks of at least 85 % of the greatest excess, ``(peak, 2)``: row and column, highest first.

    Parameters
    ----------
    excess : height above the floor, in ln(power), ``(row, column)``
    threshold : least excess of a peak
    apart : cells; of two peaks no farther apart along both axes only the higher one is kept
    most : greatest number of peaks
    """
    enough = max(np.float64(threshold), 0.85 * np.float64(excess.max()))
    rows, columns = np.nonzero(excess >= enough)
    # NumPy sorts here, since a sort in Numba would take seconds to compile
    order = np.argsort(-excess[rows, columns], kind="stable")
    return _apart(rows[order], columns[order], apart, most)  # type: ignore[no-any-return]


@compiled
def _apart(rows: Any, columns: Any, apart: int, most: int) -> Any:  # pragma: no cover - compiled
    """The first ``most`` cells not within ``apart`` of a cell kept before, ``(cell, 2)``."""
    peaks = np.empty((most, 2), dtype=np.int64)
    count = 0
    for n in range(rows.size):
        if count == most:
            break
        is_new = True
        for m in range(count):
            if abs(peaks[m, 0] - rows[n]) <= apart and abs(peaks[m, 1] - columns[n]) <= apart:
                is_new = False
        if is_new:
            peaks[count, 0], peaks[count, 1] = rows[n], columns[n]
            count += 1
    return peaks[:count]
