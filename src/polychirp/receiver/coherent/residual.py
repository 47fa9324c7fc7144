"""`Residual`: the samples without the signals of points, and sums over what other points leave."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from polychirp.axes import BoolArray, ComplexArray
from polychirp.jit import reordered
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points, without
from polychirp.receiver.coherent.replicas import Replicas, sums_of
from polychirp.receiver.coherent.signals import moments
from polychirp.receiver.coherent.spectra import Spectra

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
        return replace(self, energy=_energy(seen, self.spectra))

    def sums(self, seen: Observation, at: Replicas, points: Replicas | None = None) -> ComplexArray:
        """Sums of the samples at the motions of ``at``, ``(3, point, channel, ramp)``.

        Parameters
        ----------
        points : those that are taken as subtracted; None for those that are
        """
        sums = self.spectra.sums(seen, at)
        is_bent = np.max(np.abs(np.pi * at.drift) * seen.reach**2, axis=1) > GREATEST_BEND
        if np.any(is_bent):
            phases, times = at[is_bent].phases(seen), seen.model.times
            sums[:, is_bent] = moments(self.samples, seen.present, phases, times)
        if points is None:
            return sums
        gone, come = unlike(self.subtracted, points)
        if np.any(gone):
            sums = sums + sums_of(seen, self.subtracted[gone], at)
        if np.any(come):
            sums = sums - sums_of(seen, points[come], at)
        return sums


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
    """Masks of the signals that only one of both has.

    Values on the first ramp tell them: the beat, the amplitude on the first channel, and the shape
    on the last one, which alone has the azimuth and its rate.
    """
    same = first.beat[:, None, 0] == second.beat[:, 0]
    same &= first.amplitude[:, None, 0] == second.amplitude[:, 0]
    same &= first.shape[:, None, -1, 0, 0] == second.shape[:, -1, 0, 0]
    return ~np.any(same, axis=1), ~np.any(same, axis=0)
