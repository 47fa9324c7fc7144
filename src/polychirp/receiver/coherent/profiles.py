"""Range transforms of all ramps on one axis of range, ready to be added up in phase."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.jit import reordered
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.ramps import ELAPSED, FREQUENCY, SLOPE
from polychirp.receiver.coherent.spectra import Spectra
from polychirp.receiver.signal_model.grid import Grid
from polychirp.receiver.signal_model.unit_signal import unit_signal_into

STEPS_PER_RANGE = 4
"""Steps of the profiles per range of the map; chosen: at four steps per range cell, the nearest
step loses 0.2 dB at most."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Profiles:
    """Weighted range transforms.

    A point at (R, v) stands at the range :math:`R + v (t_k - t_0 + f_k/b_k)` of ramp k, with
    :math:`t_k` the middle of its window and :math:`f_k` the frequency then. The phases refer to
    that middle; those of a point at rest are removed, except that of the mean frequency.

    Parameters
    ----------
    value : V, sums over the samples of a ramp times their weight, ``(channel, ramp, step)``
    weight : number of the ramp's samples times their weight, ``(ramp, step)``
    axes : of the map; steps are ``1 / STEPS_PER_RANGE`` of its ranges
    first : number of steps from the map's first range to the profiles' own
    """

    value: NDArray[np.complex64]
    weight: NDArray[np.float32]
    axes: Grid
    first: int

    @classmethod
    def of(cls, seen: Observation, spectra: Spectra, axes: Grid) -> Self:
        """Profiles wherever points of the map stand."""
        step = axes.range_step / STEPS_PER_RANGE
        ends = np.rint(shifts(seen, axes.range_rate[[0, -1]]) / step).astype(np.int64)
        first = int(ends.min())
        size = int(ends.max()) - first + STEPS_PER_RANGE * axes.range.size
        # delays and beats of the first step, and their changes from step to step
        delay = 2.0 / SPEED_OF_LIGHT * (axes.range[0] + step * first)
        change = 2.0 / SPEED_OF_LIGHT * step
        slope = seen.model.schedule.slope
        value = spectra.at(seen, slope * delay, slope * change, size)
        per_bin = seen.num_bins / seen.model.times.rate
        share = _weights(seen.weight, slope * delay * per_bin, slope * change * per_bin, size)
        offset = seen.frequency - seen.frequency.mean() - slope * delay
        cycles = -delay * (offset + 0.5 * slope * delay)
        _turn(value, share, np.stack([cycles, -change * offset, change**2 * slope], axis=1))
        if seen.model.high_pass is not None:
            beat = slope[:, None] * (delay + change * np.arange(size))
            value *= np.exp(-1j * np.angle(seen.model.high_pass.response(beat)))
        return cls(
            value=value,
            weight=share * seen.count[:, None].astype(np.float32),
            axes=axes,
            first=first,
        )

    def mixed(self, matrix: ComplexArray) -> Self:
        """The profiles of other channels, which are these times a matrix."""
        return replace(self, value=np.tensordot(matrix.astype(np.complex64), self.value, 1))

    def places(self, seen: Observation, range_rate: FloatArray) -> tuple[IntArray, ComplexArray]:
        """Step of the map's first range on each ramp, and the ramps' phasors, ``(rate, ramp)``."""
        step = self.axes.range_step / STEPS_PER_RANGE
        place = np.rint(shifts(seen, range_rate) / step).astype(np.int64)
        elapsed = seen.middle - seen.model.time
        way = seen.frequency * range_rate[:, None] * elapsed
        way -= (seen.frequency - seen.frequency.mean()) * step * place
        return place - self.first, np.exp(-2j * np.pi * ((2.0 / SPEED_OF_LIGHT * way) % 1.0))

    def at(self, seen: Observation, cell: IntArray) -> tuple[ComplexArray, FloatArray]:
        """Profiles in phase, ``(place, channel, ramp)``, and their weights, ``(place, ramp)``.

        Parameters
        ----------
        cell : indices of range rate and range, ``(place, 2)``
        """
        rate, column = self.axes.range_rate[cell[:, 0]], STEPS_PER_RANGE * cell[:, 1] - self.first
        step = self.axes.range_step / STEPS_PER_RANGE
        value = np.empty((len(cell), *self.value.shape[:2]), dtype=np.complex128)
        weight = np.empty((len(cell), self.value.shape[1]))
        _at(seen.ramps, self.value, self.weight, step, rate, column, value, weight)
        return value, weight

    def sums(self, seen: Observation, range_rate: FloatArray) -> NDArray[np.complex64]:
        """Sums of the ramps in phase at a few range rates, ``(channel, rate, range)``."""
        place, turn = self.places(seen, range_rate)
        return np.asarray(_sums(self.value, place, turn.astype(np.complex64), self.axes.range.size))


def shifts(seen: Observation, range_rate: FloatArray) -> FloatArray:
    """Range of a point on each ramp's profile less its range in mid-frame, ``(rate, ramp)``."""
    slope = seen.model.schedule.slope
    return range_rate[:, None] * (seen.middle - seen.model.time + seen.frequency / slope)


@reordered
def _weights(weight: Any, first: Any, step: Any, size: int) -> Any:  # pragma: no cover - compiled
    """Weights of the nearest bins at evenly spaced places, in bins: ``(ramp, step)``."""
    ramps, bins = weight.shape
    out = np.empty((ramps, size), dtype=np.float32)
    for k in range(ramps):
        for i in range(size):
            out[k, i] = weight[k, int(np.rint(first[k] + i * step[k])) % bins]
    return out


@reordered
def _turn(value: Any, share: Any, phase: Any) -> None:  # pragma: no cover - compiled
    """Multiply profiles by phasors of quadratic phases ``(ramp, 3)`` and by shares, in place."""
    channels, ramps, size = value.shape
    real, imag = np.empty(size), np.empty(size)
    for k in range(ramps):
        unit_signal_into(real, imag, phase[k], 1.0)
        for m in range(channels):
            for i in range(size):
                value[m, k, i] *= share[k, i] * np.complex64(complex(real[i], imag[i]))


@reordered
def _at(
    ramps: Any,
    profiles: Any,
    weights: Any,
    step: float,
    rate: Any,
    column: Any,
    out: Any,
    size: Any,
) -> None:  # pragma: no cover - compiled
    """Profiles turned to the phases of `Profiles.places`, and their weights, in place.

    ``column`` is the step of a place without the shift by its range rate.
    """
    for n in range(rate.size):
        for k in range(ramps.table.shape[1]):
            elapsed, frequency = ramps.table[ELAPSED, k], ramps.table[FREQUENCY, k]
            shift = rate[n] * (elapsed + frequency / ramps.table[SLOPE, k])
            place = int(np.rint(shift / step))
            way = frequency * rate[n] * elapsed - (frequency - ramps.mean_frequency) * step * place
            cycles = 2.0 / SPEED_OF_LIGHT * way
            angle = 2.0 * np.pi * (cycles - np.floor(cycles))
            turn = complex(np.cos(angle), -np.sin(angle))
            for m in range(len(profiles)):
                out[n, m, k] = turn * profiles[m, k, column[n] + place]
            size[n, k] = weights[k, column[n] + place]


@reordered
def _sums(value: Any, place: Any, turn: Any, num_ranges: int) -> Any:  # pragma: no cover - compiled
    channels, ramps = value.shape[:2]
    out = np.zeros((channels, len(place), num_ranges), dtype=np.complex64)
    for m in range(channels):
        for v in range(len(place)):
            for k in range(ramps):
                shifted = value[m, k, place[v, k] :]
                for i in range(num_ranges):
                    out[m, v, i] += turn[v, k] * shifted[STEPS_PER_RANGE * i]
    return out
