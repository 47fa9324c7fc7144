r"""The coherent range-rate map of a frame whose ramps may differ: all samples add up in phase.

A sample that is taken at time t, while the radar transmits the frequency f, measures a point at
range R and range rate v at :math:`t_0` with the phase

.. math:: \varphi = 2\pi\,[f\,\tau - b\,\tau^2/2],\qquad \tau = 2\,[R + v\,(t-t_0)]/c,

on whatever ramp of slope b it lies. The map is :math:`|\sum w\,y\,e^{-j\varphi}|^2 / \sum w` summed
over channels, with the weights w of `noise`: in white noise its mean is the noise power of a sample
times the number of channels. The profiles of all ramps (`profiles`) are shifted, turned in phase
and added for each range rate.

Two more maps tell where the ramps agree that there is a point (`agreement`).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.errors import InputError
from polychirp.jit import reordered
from polychirp.receiver.coherent.agreement import Agreement
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.profiles import STEPS_PER_RANGE, Profiles
from polychirp.receiver.settings import SearchSettings
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.point_signal import replica

RATES_PER_CELL = 2
"""Range rates of the map per cell λ/2T; chosen: the nearest one loses 0.9 dB at most."""

GREATEST_STRIDE = 64
"""Greatest number of range rates that share the sums of ramps without phases; chosen."""

RATES_FOR_COVARIANCE = 20
"""Number of range rates from which the channels' covariance is taken; chosen: it is right to some
per cent."""

GREATEST_OF_NOISE = 3.0
"""Power over the median up to which a cell counts as noise for the covariance; chosen."""

ROWS_FOR_FLOOR = 1000
"""Number of range rates from which the floor of a range is taken; chosen: its error is 5 %."""

NEIGHBOURS = 3
"""Number of ranges on either side over which floors are averaged; chosen."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CoherentMap:
    """The map and what tells if its values come from points, W, each ``(range rate, range)``.

    Parameters
    ----------
    power : the map
    difference, spread : as for `Agreement`
    range_floor : noise power of a sample at every range (`range_floors`), W, ``(range,)``
    num_averaged, num_channels : of `Agreement`
    """

    power: NDArray[np.float32]
    difference: NDArray[np.float32]
    spread: NDArray[np.float32]
    range_floor: FloatArray
    num_averaged: int
    num_channels: int

    def agreement(self, cell: IntArray) -> Agreement:
        """Sums over the ramps at the beats of cells ``(place, 2)``."""
        here = tuple(cell.T)
        return Agreement(
            power=self.power[here].astype(np.float64),
            difference=self.difference[here].astype(np.float64),
            spread=self.spread[here].astype(np.float64),
            num_averaged=self.num_averaged,
            num_channels=self.num_channels,
        )


def map_axes(seen: Observation, limits: SearchSettings) -> Grid:
    """Axes in steps of half a cell of the whole frame, at the middle of the frame.

    Raises
    ------
    InputError
        The limits leave no range cell between them.
    """
    cell = seen.range_cell
    distance = np.arange(limits.least_range, limits.greatest_range + 0.5 * cell, 0.5 * cell)
    if distance.size < 3:
        raise InputError(
            f"the receiver's map reaches from {limits.least_range:g} m to "
            f"{limits.greatest_range:g} m, less than a range cell of {cell:.3g} m; lower its least "
            "range or raise its greatest range"
        )
    step = seen.range_rate_cell / RATES_PER_CELL
    count = int(np.ceil(limits.greatest_speed / step))
    return Grid(
        range=distance,
        range_rate=step * np.arange(-count, count + 1, dtype=np.float64),
        time=seen.model.time,
    )


def channel_covariance(seen: Observation, profiles: Profiles) -> ComplexArray:
    """Covariance of the channels in cells without strong points, V², ``(channel, channel)``."""
    rates = profiles.axes.range_rate
    sums = profiles.sums(seen, rates[:: max(1, rates.size // RATES_FOR_COVARIANCE)])
    cells = sums.reshape(len(sums), -1)
    power = np.sum(np.abs(cells) ** 2, axis=0)
    cells = cells[:, power <= GREATEST_OF_NOISE * np.median(power)].astype(np.complex128)
    return np.asarray(cells @ cells.conj().T / cells.shape[1])


def coherent_map(seen: Observation, profiles: Profiles) -> CoherentMap:
    """The map of profiles whose channels are white."""
    channels, axes = len(profiles.value), profiles.axes
    place, turn = profiles.places(seen, axes.range_rate)
    rises = seen.model.schedule.slope > 0
    stride = _stride(seen, axes)
    least = np.finfo(np.float32).tiny  # a ramp without samples has no weight and no value
    energy = np.sum(np.abs(profiles.value) ** 2, axis=0) / np.maximum(profiles.weight, least)
    tables = np.stack([profiles.weight * rises[:, None], profiles.weight, energy])
    rising, every, total = _sums_of_tables(tables, place[::stride], axes.range.size)
    order = np.argsort(rises, kind="stable")
    value = profiles.value[:, order]
    split = np.stack([value[..., 0::2], value[..., 1::2]], axis=2)
    power, difference = _sums_of_powers(
        np.ascontiguousarray(split.real),
        np.ascontiguousarray(split.imag),
        place[:, order],
        turn.real[:, order].astype(np.float32),
        turn.imag[:, order].astype(np.float32),
        rises[order],
        rising,
        every,
        stride,
    )
    averaged = channels * (seen.num_used - 1)
    row = np.arange(axes.range_rate.size) // stride
    spread = np.maximum(total[row] - power, 0.0) / max(averaged, 1)
    return CoherentMap(
        power=power,
        difference=difference,
        spread=np.asarray(spread, dtype=np.float32),
        range_floor=range_floors(power, channels),
        num_averaged=averaged,
        num_channels=channels,
    )


def _stride(seen: Observation, axes: Grid) -> int:
    """Number of range rates over which no ramp's profile moves by more than a range of the map."""
    slope = seen.model.schedule.slope
    reach = float(np.max(np.abs(seen.middle - seen.model.time + seen.frequency / slope)))
    return int(np.clip(axes.range_step / (reach * axes.range_rate_step), 1, GREATEST_STRIDE))


def range_floors(power: NDArray[np.float32], num_channels: int) -> FloatArray:
    """Noise power of a sample at every range, W, from the median over range rates, ``(range,)``."""
    from scipy.special import gammaincinv

    step = max(1, power.shape[0] // ROWS_FOR_FLOOR)
    median = np.median(power[::step], axis=0) / gammaincinv(num_channels, 0.5)
    padded = np.pad(median, NEIGHBOURS, mode="edge")
    width = 2 * NEIGHBOURS + 1
    return np.asarray(np.convolve(padded, np.full(width, 1.0 / width), mode="valid"))


@reordered
def _sums_of_tables(tables: Any, place: Any, num_ranges: int) -> Any:  # pragma: no cover - compiled
    """Sums over ramps of shifted ``(table, ramp, step)``: ``(table, rate, range)``."""
    count, ramps = tables.shape[:2]
    out = np.zeros((count, place.shape[0], num_ranges), dtype=np.float32)
    for v in range(place.shape[0]):
        for n in range(count):
            for k in range(ramps):
                low = place[v, k]
                for i in range(num_ranges):
                    out[n, v, i] += tables[n, k, low + STEPS_PER_RANGE * i]
    return out


@reordered
def _sums_of_powers(  # pragma: no cover - compiled
    real: Any,
    imag: Any,
    place: Any,
    cosine: Any,
    sine: Any,
    rises: Any,
    rising: Any,
    every: Any,
    stride: int,
) -> Any:
    """Sums over channels of the power of the profiles' sum, and of that of their difference."""
    channels, ramps = real.shape[:2]
    rates, num_ranges = place.shape[0], every.shape[1]
    power = np.zeros((rates, num_ranges), dtype=np.float32)
    difference = np.zeros((rates, num_ranges), dtype=np.float32)
    a = np.empty((2, num_ranges), dtype=np.float32)
    b = np.empty((2, num_ranges), dtype=np.float32)
    for v in range(rates):
        up, total = rising[v // stride], every[v // stride]
        for m in range(channels):
            for d in range(2):
                for i in range(num_ranges):
                    a[d, i] = np.float32(0.0)
                    b[d, i] = np.float32(0.0)
            k = 0
            while k < ramps:
                p, q = a[int(rises[k])], b[int(rises[k])]
                s0, c0, t0 = place[v, k], cosine[v, k], sine[v, k]
                x0, y0 = real[m, k, s0 & 1, s0 >> 1 :], imag[m, k, s0 & 1, s0 >> 1 :]
                if k + 1 < ramps and rises[k + 1] == rises[k]:  # two ramps share loads of sums
                    s1, c1, t1 = place[v, k + 1], cosine[v, k + 1], sine[v, k + 1]
                    x1 = real[m, k + 1, s1 & 1, s1 >> 1 :]
                    y1 = imag[m, k + 1, s1 & 1, s1 >> 1 :]
                    for i in range(num_ranges):
                        p[i] += x0[i] * c0 - y0[i] * t0 + x1[i] * c1 - y1[i] * t1
                        q[i] += x0[i] * t0 + y0[i] * c0 + x1[i] * t1 + y1[i] * c1
                    k += 2
                else:
                    for i in range(num_ranges):
                        p[i] += x0[i] * c0 - y0[i] * t0
                        q[i] += x0[i] * t0 + y0[i] * c0
                    k += 1
            for i in range(num_ranges):
                re, im = a[0, i] + a[1, i], b[0, i] + b[1, i]
                power[v, i] += (re * re + im * im) / total[i]
                down = total[i] - up[i]
                if up[i] > 0.0 and down > 0.0:
                    # what the sum says of the rising ramps, less what these say themselves
                    re = a[1, i] - re * up[i] / total[i]
                    im = b[1, i] - im * up[i] / total[i]
                    difference[v, i] += (re * re + im * im) * total[i] / (up[i] * down)
    return power, difference


def coherent_power(seen: Observation, residual: ComplexArray, motion: FloatArray) -> FloatArray:
    """The map's value at exact motions (R, v, a) ``(point, 3)``: the slow twin, ``(point,)``."""
    out = np.empty(len(motion))
    for n, one in enumerate(motion):
        signal = replica(seen.model.schedule, seen.model.times, motion=one, time=seen.model.time)
        phase = np.exp(1j * np.angle(seen.model.response(one[None])[0, 0]))
        weight = seen.weights(one[None])[0]
        kept = residual * seen.present * weight[:, None]
        mean = seen.mixing @ np.sum(kept * (signal * phase[:, None]).conj(), axis=(1, 2))
        out[n] = np.sum(np.abs(mean) ** 2) / (weight @ seen.count)
    return out
