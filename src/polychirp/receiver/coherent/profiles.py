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

    Steps follow each other in an order in which ranges of the map are neighbours: step n of a ramp
    is at ``[n % STEPS_PER_RANGE, n // STEPS_PER_RANGE]``.

    Parameters
    ----------
    value : V, sums over the samples of a ramp times their weight, their real and imaginary parts,
        ``(2, channel, ramp, step within a range, range)``
    weight : number of the ramp's samples times their weight, ``(ramp, step within a range, range)``
    axes : of the map; steps are ``1 / STEPS_PER_RANGE`` of its ranges
    first : number of steps from the map's first range to the profiles' own
    """

    value: NDArray[np.float32]
    weight: NDArray[np.float32]
    axes: Grid
    first: int

    @classmethod
    def of(
        cls, seen: Observation, spectra: Spectra, axes: Grid, *, num_channels: int | None = None
    ) -> Self:
        """Profiles wherever points of the map stand, of the first channels; None for all."""
        step = axes.range_step / STEPS_PER_RANGE
        ends = np.rint(shifts(seen, axes.range_rate[[0, -1]]) / step).astype(np.int64)
        first = int(ends.min())
        size = int(ends.max()) - first + STEPS_PER_RANGE * axes.range.size
        size += -size % STEPS_PER_RANGE
        # delays and beats of the first step, and their changes from step to step
        delay = 2.0 / SPEED_OF_LIGHT * (axes.range[0] + step * first)
        change = 2.0 / SPEED_OF_LIGHT * step
        slope = seen.model.schedule.slope
        per_bin = seen.num_bins / seen.model.times.rate
        share = _weights(seen.weight, slope * delay * per_bin, slope * change * per_bin, size)
        offset = seen.frequency - seen.frequency.mean() - slope * delay
        cycles = -delay * (offset + 0.5 * slope * delay)
        phase = np.stack([cycles, -change * offset, change**2 * slope], axis=1)
        turn = np.ones((0, 0), dtype=np.complex64)
        if seen.model.high_pass is not None:
            beat = slope[:, None] * (delay + change * np.arange(size))
            response = seen.model.high_pass.response(beat)
            turn = np.exp(-1j * np.angle(response)).astype(np.complex64)
        value = spectra.at(seen, slope * delay, slope * change, size, num_channels)
        return cls(
            value=_turned(value, share, phase, turn),
            weight=_counted(share, seen.count),
            axes=axes,
            first=first,
        )

    def mixed(self, matrix: ComplexArray) -> Self:
        """The profiles of other channels, which are these times a matrix."""
        mixing = matrix.astype(np.complex64)
        return replace(self, value=_mixed(self.value, mixing.real.copy(), mixing.imag.copy()))

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
        value = np.empty((len(cell), *self.value.shape[1:3]), dtype=np.complex128)
        weight = np.empty((len(cell), self.value.shape[2]))
        _at(seen.ramps, self.value, self.weight, step, rate, column, value, weight)
        return value, weight

    def sums(self, seen: Observation, range_rate: FloatArray) -> NDArray[np.float32]:
        """Sums of the ramps in phase at a few range rates.

        They are their real and imaginary parts, ``(2, channel, rate, range)``.
        """
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
def _turned(value: Any, share: Any, phase: Any, turn: Any) -> Any:  # pragma: no cover - compiled
    """Profiles in the order of `Profiles`, times phasors of quadratic phases and times shares.

    Parameters
    ----------
    value : real and imaginary parts in turn, ``(2 channels, ramp, step)``
    share : ``(ramp, step)``
    phase : cycles, and those per step and its square, ``(ramp, 3)``
    turn : phasors besides, ``(ramp, step)``; none if it is empty
    """
    width, ramps, size = value.shape
    per_range = STEPS_PER_RANGE
    out = np.empty((2, width // 2, ramps, per_range, size // per_range), dtype=np.float32)
    real, imag = np.empty(size), np.empty(size)
    x, y = np.empty(size, dtype=np.float32), np.empty(size, dtype=np.float32)
    for k in range(ramps):
        unit_signal_into(real, imag, phase[k], 1.0)
        for i in range(size):
            x[i], y[i] = share[k, i] * real[i], share[k, i] * imag[i]
        if turn.size:
            for i in range(size):
                one = complex(x[i], y[i]) * turn[k, i]
                x[i], y[i] = one.real, one.imag
        for m in range(width // 2):
            for n in range(per_range):
                for i in range(size // per_range):
                    j = per_range * i + n
                    u, v = value[2 * m, k, j], value[2 * m + 1, k, j]
                    out[0, m, k, n, i] = u * x[j] - v * y[j]
                    out[1, m, k, n, i] = u * y[j] + v * x[j]
    return out


@reordered
def _counted(share: Any, count: Any) -> Any:  # pragma: no cover - compiled
    """Shares ``(ramp, step)`` times the number of a ramp's samples, in the order of `Profiles`."""
    ramps, size = share.shape
    per_range = STEPS_PER_RANGE
    out = np.empty((ramps, per_range, size // per_range), dtype=np.float32)
    for k in range(ramps):
        for n in range(per_range):
            for i in range(size // per_range):
                out[k, n, i] = share[k, per_range * i + n] * count[k]
    return out


@reordered
def _mixed(value: Any, real: Any, imag: Any) -> Any:  # pragma: no cover - compiled
    """Profiles of channels times a matrix of these real and imaginary parts."""
    _, channels, ramps, per_range, size = value.shape
    out = np.zeros_like(value)
    for k in range(ramps):
        for n in range(per_range):
            for p in range(channels):
                x, y = out[0, p, k, n], out[1, p, k, n]
                for m in range(channels):
                    c, s = real[p, m], imag[p, m]
                    u, v = value[0, m, k, n], value[1, m, k, n]
                    for i in range(size):
                        x[i] += c * u[i] - s * v[i]
                        y[i] += c * v[i] + s * u[i]
    return out


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
            i, j = (column[n] + place) % STEPS_PER_RANGE, (column[n] + place) // STEPS_PER_RANGE
            for m in range(profiles.shape[1]):
                out[n, m, k] = turn * complex(profiles[0, m, k, i, j], profiles[1, m, k, i, j])
            size[n, k] = weights[k, i, j]


@reordered
def _sums(value: Any, place: Any, turn: Any, num_ranges: int) -> Any:  # pragma: no cover - compiled
    channels, ramps = value.shape[1:3]
    out = np.zeros((2, channels, len(place), num_ranges), dtype=np.float32)
    for v in range(len(place)):
        for k in range(ramps):
            c, s = turn[v, k].real, turn[v, k].imag
            n, first = place[v, k] % STEPS_PER_RANGE, place[v, k] // STEPS_PER_RANGE
            for m in range(channels):
                x, y = value[0, m, k, n, first:], value[1, m, k, n, first:]
                p, q = out[0, m, v], out[1, m, v]
                for i in range(num_ranges):
                    p[i] += c * x[i] - s * y[i]
                    q[i] += s * x[i] + c * y[i]
    return out
