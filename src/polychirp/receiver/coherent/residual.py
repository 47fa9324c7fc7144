"""`Residual`: the samples without the signals of points, and sums over what other points leave."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.jit import reordered, reordered_inner
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points, without
from polychirp.receiver.coherent.ramps import HALF, HALF_LENGTH
from polychirp.receiver.coherent.replicas import BEAT, DRIFT, WEIGHT, Replicas, sums_of
from polychirp.receiver.coherent.spectra import Spectra, interpolated_into, lagrange

GREATEST_BEND = 0.7
"""Greatest phase, rad, by which a point's signal differs from a tone at the ends of a ramp where
sums follow from spectra; chosen: they are wrong by some per cent then."""

BINS_FOR_ENERGY = 2
"""Every second bin counts for the energy; these are still more bins than a ramp has samples."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Residual:
    """Samples without the signals of points.

    The samples are exact. What other points would leave follows from the spectra, right to some
    per cent of the difference between their signals and those of the points that are subtracted.

    Parameters
    ----------
    samples : V, ``(channel, ramp, fast)``
    spectra : their Fourier transforms
    points : those whose signals are subtracted
    subtracted : their replicas
    energy : power of all samples of white channels, V², with the weights of ramps and frequencies
    """

    samples: ComplexArray
    spectra: Spectra
    points: Points
    subtracted: Replicas
    energy: float

    @classmethod
    def of(cls, seen: Observation, points: Points) -> Self:
        """The samples of the observation without points."""
        return cls._of(seen, without(seen, seen.samples, points), points)

    def after(self, seen: Observation, points: Points) -> Self:
        """The residual of other points, of which few differ from those that are subtracted."""
        gone, come = unlike(self.subtracted, Replicas.of(seen, points))
        change = self.points[gone].negated + points[come]
        return self._of(seen, without(seen, self.samples, change), points)

    @classmethod
    def _of(cls, seen: Observation, samples: ComplexArray, points: Points) -> Self:
        spectra = Spectra.of(seen, samples)
        return cls(
            samples=samples,
            spectra=spectra,
            points=points,
            subtracted=Replicas.of(seen, points),
            energy=_energy(seen, spectra),
        )

    def weighted(self, seen: Observation) -> Self:
        """The same samples with the energy that follows from other weights."""
        subtracted = Replicas.of(seen, self.points)
        return replace(self, subtracted=subtracted, energy=_energy(seen, self.spectra))

    def sums(self, seen: Observation, at: Replicas, points: Replicas | None = None) -> ComplexArray:
        """Sums over the samples without the beats of ``at``, times powers 0, 1 and 2 of the time.

        They hold the roots of the weights at those beats.

        Parameters
        ----------
        points : those that are taken as subtracted; None for those that are

        Returns
        -------
        V, V s and V s², ``(3, point, channel, ramp)``
        """
        value = np.empty((len(at), 3, 2, len(seen.samples), seen.ramps.num_ramps))
        _sums(seen.ramps, self.kernel_view(seen), at.track, value)
        sums = np.moveaxis(value[:, :, 0] + 1j * value[:, :, 1], 1, 0)
        if points is None:
            return sums
        gone, come = unlike(self.subtracted, points)
        if np.any(gone):
            sums = sums + sums_of(seen, self.subtracted[gone], at)
        if np.any(come):
            sums = sums - sums_of(seen, points[come], at)
        return sums

    def kernel_view(self, seen: Observation) -> "Left":
        """The arrays that kernels read."""
        return Left(
            samples=self.samples,
            present=seen.present,
            counts=np.asarray(seen.model.times.num_samples),
            spectra=self.spectra.value,
            table=lagrange(8),
        )


class Left(NamedTuple):
    """Arrays of a `Residual` and its observation for kernels.

    Parameters
    ----------
    samples, spectra : those of the residual
    present : mask of the samples that are used, ``(ramp, fast)``
    counts : number of samples of every ramp, ``(ramp,)``
    table : coefficients that interpolate spectra (`spectra.lagrange`)
    """

    samples: ComplexArray
    present: BoolArray
    counts: IntArray
    spectra: NDArray[np.complex64]
    table: FloatArray


@reordered_inner
def left_into(ramps: Any, left: Any, track: Any, sums: Any) -> None:  # pragma: no cover - compiled
    """Sums over the samples of a residual at one place, ``(3, 2, channel, ramp)``.

    They are exact where the phase on any ramp bends by more than `GREATEST_BEND`.
    """
    bend = 0.0
    for k in range(track.shape[1]):
        bend = max(bend, np.pi * abs(track[DRIFT, k]) * ramps.table[HALF_LENGTH, k] ** 2)
    if bend <= GREATEST_BEND:
        interpolated_into(ramps, left.spectra, left.table, track, sums)
        return
    for k in range(track.shape[1]):
        root = np.sqrt(track[WEIGHT, k])
        for m in range(sums.shape[2]):
            for n in range(3):
                sums[n, 0, m, k], sums[n, 1, m, k] = 0.0, 0.0
        for i in range(left.counts[k]):
            if not left.present[k, i]:
                continue
            time = i / ramps.rate - ramps.table[HALF, k]
            turn = 2.0 * np.pi * (track[BEAT, k] + 0.5 * track[DRIFT, k] * time) * time
            tone = complex(root * np.cos(turn), -root * np.sin(turn))
            for m in range(sums.shape[2]):
                one = left.samples[m, k, i] * tone
                for n in range(3):
                    sums[n, 0, m, k] += one.real
                    sums[n, 1, m, k] += one.imag
                    one *= time


@reordered
def _sums(ramps: Any, left: Any, track: Any, sums: Any) -> None:  # pragma: no cover - compiled
    for p in range(len(track)):
        left_into(ramps, left, track[p], sums[p])


def _energy(seen: Observation, spectra: Spectra) -> float:
    """Power of all samples of white channels, V², with the weights of ramps and frequencies."""
    bins = -(-spectra.value.shape[1] // BINS_FOR_ENERGY)
    place = np.rint(np.arange(bins) * (seen.num_bins / bins)).astype(np.int64) % seen.num_bins
    mixing = seen.mixing.astype(np.complex64)
    total = _weighted_power(spectra.value, seen.weight, place, mixing.real, mixing.imag)
    return float(total / bins)


@reordered
def _weighted_power(
    value: Any, weight: Any, place: Any, real: Any, imag: Any
) -> Any:  # pragma: no cover - compiled
    """Power of every second bin ``(ramp, bin, channel)`` after mixing, times its weight."""
    ramps, _, channels = value.shape
    bins = place.size
    x, y = np.empty((channels, bins), dtype=np.float32), np.empty((channels, bins), np.float32)
    u, v = np.empty(bins, dtype=np.float32), np.empty(bins, dtype=np.float32)
    total = 0.0
    for k in range(ramps):
        for i in range(bins):
            for m in range(channels):
                one = value[k, BINS_FOR_ENERGY * i, m]
                x[m, i], y[m, i] = one.real, one.imag
        for n in range(channels):
            for i in range(bins):
                u[i], v[i] = np.float32(0.0), np.float32(0.0)
            for m in range(channels):
                c, s = real[n, m], imag[n, m]
                for i in range(bins):
                    u[i] += c * x[m, i] - s * y[m, i]
                    v[i] += c * y[m, i] + s * x[m, i]
            for i in range(bins):
                total += weight[k, place[i]] * (u[i] * u[i] + v[i] * v[i])
    return total


def unlike(first: Replicas, second: Replicas) -> tuple[BoolArray, BoolArray]:
    """Masks of the signals that only one of both has."""
    same = matches(first, second)
    return ~np.any(same, axis=1), ~np.any(same, axis=0)


def matches(first: Replicas, second: Replicas) -> BoolArray:
    """Mask of pairs of equal signals, ``(first, second)``.

    Two numbers tell them: the amplitude on the first channel, and the real part of the wave on the
    last channel and the last ramp, which alone has the azimuth and its rate.
    """
    same = first.amplitude[:, None, 0] == second.amplitude[:, 0]
    same &= first.wave[:, None, -1, 0, -1] == second.wave[:, -1, 0, -1]
    return np.asarray(same, dtype=np.bool_)
