r"""The coherent range-rate map of a frame whose ramps may differ: all samples add up in phase.

A sample that is taken at time t, while the radar transmits the frequency f, measures a point at
range R and range rate v at :math:`t_0` with the phase

.. math:: \varphi = 2\pi\,[f\,\tau - b\,\tau^2/2],\qquad \tau = 2\,[R + v\,(t-t_0)]/c,

on whatever ramp of slope b it lies. The map is :math:`|\sum w\,y\,e^{-j\varphi}|^2 / \sum w` summed
over channels, with the weights w of `noise`: in white noise its mean is the noise power of a sample
times the number of channels. The profiles of all ramps (`profiles`) are shifted, turned in phase
and added for each range rate (`rate_blocks`).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.errors import InputError
from polychirp.receiver.coherent.agreement import Agreement
from polychirp.receiver.coherent.noise import medians, medians_of_copy
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.profiles import Profiles
from polychirp.receiver.coherent.rate_blocks import powers
from polychirp.receiver.settings import SearchSettings
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.point_signal import replica

RATES_PER_CELL = 2
"""Range rates of the map per cell λ/2T; chosen: the nearest one loses 0.9 dB at most."""

RATES_FOR_COVARIANCE = 20
"""Number of range rates from which the channels' covariance is taken; chosen: it is right to some
per cent."""

GREATEST_OF_NOISE = 3.0
"""Power over the median up to which a cell counts as noise for the covariance; chosen."""

ROWS_FOR_FLOOR = 500
"""Number of range rates from which the floor of a range is taken; chosen: its error is 3 %, before
its mean over neighbours."""

RANGES_FOR_FLOOR = 100
"""Number of ranges from which the floor of a range rate is taken; chosen: its error is 6 %."""

LEAST_RIDGE = 1.5
"""Least floor of a range rate, over the median of the floors, from which it counts; chosen: noise
hardly reaches it."""

NEIGHBOURS = 3
"""Number of ranges on either side over which floors are averaged; chosen."""


UNKNOWN, POINT, OTHER = range(3)
"""Values of `CoherentMap.known`."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CoherentMap:
    """The map, and what tells if its values come from points.

    Parameters
    ----------
    power : the map, W, ``(range rate, range)``
    range_floor : noise power of a sample at every range (`range_floors`), W, ``(range,)``
    rate_floor : the same at every range rate (`rate_floors`), W, ``(range rate,)``
    seen, profiles : what the map is made of
    known : what `shows_points` has said of the cells so far, ``(range rate, range)``
    """

    power: NDArray[np.float32]
    range_floor: FloatArray
    rate_floor: FloatArray
    seen: Observation
    profiles: Profiles
    known: NDArray[np.int8]

    @property
    def num_channels(self) -> int:
        """Number of channels whose powers are added."""
        return int(self.profiles.value.shape[1])

    def agreement(self, cell: IntArray) -> Agreement:
        """Sums over the ramps at the beats of cells ``(place, 2)``."""
        value, weight = self.profiles.at(self.seen, cell)
        return Agreement.of(self.seen, value, weight)

    def shows_points(self, cell: IntArray, floor: FloatArray, threshold: float) -> BoolArray:
        """Mask of the cells ``(place, 2)`` at which the ramps show points (`agreement`).

        The answers are kept: the same floors and threshold are asked for again and again.
        """
        known = self.known[tuple(cell.T)]
        new = np.flatnonzero(known == UNKNOWN)
        if new.size:
            is_point = self.agreement(cell[new]).shows_points(floor[new], threshold)
            known[new] = np.where(is_point, POINT, OTHER)
            self.known[tuple(cell[new].T)] = known[new]
        return np.asarray(known == POINT)


@dataclass(frozen=True, slots=True, kw_only=True)
class MapLimits:
    """Least and greatest range (m) and range rate (m/s) of a map."""

    range: tuple[float, float]
    range_rate: tuple[float, float]

    @classmethod
    def of(cls, settings: SearchSettings) -> Self:
        """The limits that a receiver's settings name."""
        return cls(
            range=(settings.least_range, settings.greatest_range),
            range_rate=(-settings.greatest_speed, settings.greatest_speed),
        )


def map_axes(seen: Observation, limits: MapLimits) -> Grid:
    """Axes in steps of half a cell of the whole frame, at the middle of the frame.

    Raises
    ------
    InputError
        The limits leave no range cell between them.
    """
    cell = seen.range_cell
    least, greatest = limits.range
    distance = np.arange(least, greatest + 0.5 * cell, 0.5 * cell)
    if distance.size < 3:
        raise InputError(
            f"the receiver's map reaches from {least:g} m to {greatest:g} m, less than "
            f"a range cell of {cell:.3g} m; lower its least range or raise its greatest range"
        )
    step = seen.range_rate_cell / RATES_PER_CELL
    first, last = np.floor(limits.range_rate[0] / step), np.ceil(limits.range_rate[1] / step)
    return Grid(
        range=distance,
        range_rate=step * np.arange(first, last + 1.0),
        time=seen.model.time,
    )


def channel_covariance(seen: Observation, profiles: Profiles) -> ComplexArray:
    """Covariance of the channels in cells without strong points, V², ``(channel, channel)``."""
    rates = profiles.axes.range_rate
    sums = profiles.sums(seen, rates[:: max(1, rates.size // RATES_FOR_COVARIANCE)])
    real, imag = sums.reshape(2, sums.shape[1], -1)
    power = np.sum(real**2 + imag**2, axis=0)
    is_noise = power <= GREATEST_OF_NOISE * float(medians(power))
    cells = real[:, is_noise] + 1j * imag[:, is_noise].astype(np.float64)
    return np.asarray(cells @ cells.conj().T / cells.shape[1])


def coherent_map(
    seen: Observation, profiles: Profiles, memory: NDArray[np.float32] | None = None
) -> CoherentMap:
    """The map of profiles whose channels are white.

    It overwrites ``memory``, that of an earlier map which is not needed any more; None for new one.
    """
    power = powers(seen, profiles, memory)
    return CoherentMap(
        power=power,
        range_floor=range_floors(power, profiles.value.shape[1]),
        rate_floor=rate_floors(power, profiles.value.shape[1]),
        seen=seen,
        profiles=profiles,
        known=np.zeros(power.shape, dtype=np.int8),
    )


def range_floors(power: NDArray[np.float32], num_channels: int) -> FloatArray:
    """Noise power of a sample at every range, W, from the median over range rates, ``(range,)``."""
    from scipy.special import gammaincinv

    step = max(1, power.shape[0] // ROWS_FOR_FLOOR)
    some = np.array(power[::step].T, order="C")
    median = medians_of_copy(some) / gammaincinv(num_channels, 0.5)
    padded = np.pad(median, NEIGHBOURS, mode="edge")
    width = 2 * NEIGHBOURS + 1
    return np.asarray(np.convolve(padded, np.full(width, 1.0 / width), mode="valid"))


def rate_floors(power: NDArray[np.float32], num_channels: int) -> FloatArray:
    """Noise power of a sample at range rates with a ridge over all ranges, W; 0 at others.

    Bursts of another radar at the same place of all equal ramps make such a ridge: they add up in
    phase at the range rates by which they turn from ramp to ramp.
    """
    from scipy.special import gammaincinv

    step = max(1, power.shape[1] // RANGES_FOR_FLOOR)
    some = np.array(power[:, ::step], order="C")
    floor = medians_of_copy(some) / gammaincinv(num_channels, 0.5)
    return np.where(floor > LEAST_RIDGE * np.median(floor), floor, 0.0)


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
