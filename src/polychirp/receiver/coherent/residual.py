"""`Residual`: the samples without the signals of points, and sums over what other points leave."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.jit import reordered, reordered_inner
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.ramps import HALF, HALF_LENGTH
from polychirp.receiver.coherent.replicas import (
    BEAT,
    DRIFT,
    WEIGHT,
    Replicas,
    as_complex,
    sums_of,
)
from polychirp.receiver.coherent.spectra import (
    ORDERS,
    TAPS,
    Spectra,
    from_middle_into,
    interpolated_into,
    lagrange,
    transform_size,
)
from polychirp.receiver.signal_model.unit_signal import unit_signal_into

GREATEST_BEND = 0.7
"""Greatest phase, rad, by which a point's signal differs from a tone at the ends of a ramp where
sums follow from spectra; chosen: they are wrong by some per cent then."""


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
        subtracted = Replicas.of(seen, points)
        return cls._of(seen, seen.samples, points, subtracted, subtracted)

    def after(self, seen: Observation, points: Points) -> Self:
        """The residual of other points.

        If few differ from those that are subtracted, only these are changed.
        """
        subtracted = Replicas.of(seen, points)
        gone, come = unlike(self.subtracted, subtracted)
        if np.count_nonzero(gone) + np.count_nonzero(come) >= len(points):
            return self._of(seen, seen.samples, points, subtracted, subtracted)
        change = self.subtracted[gone].negated + subtracted[come]
        return self._of(seen, self.samples, points, subtracted, change)

    @classmethod
    def _of(
        cls,
        seen: Observation,
        samples: ComplexArray,
        points: Points,
        subtracted: Replicas,
        change: Replicas,
    ) -> Self:
        left, turned = _subtracted(seen, samples, change)
        spectra = Spectra.of_turned(seen, turned)
        return cls(
            samples=left,
            spectra=spectra,
            points=points,
            subtracted=subtracted,
            energy=spectra.power(seen),
        )

    def weighted(self, seen: Observation) -> Self:
        """The same samples with the energy that follows from other weights and another mixing."""
        subtracted = Replicas.of(seen, self.points) if len(self.points) else self.subtracted
        return replace(self, subtracted=subtracted, energy=self.spectra.power(seen))

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
        sums = as_complex(value)
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
            counts=np.asarray(seen.model.times.num_samples),
            spectra=self.spectra.value.view(np.float32),
            table=np.ascontiguousarray(np.moveaxis(lagrange(TAPS), 2, 0)),
        )


class Left(NamedTuple):
    """Arrays of a `Residual` and its observation for kernels.

    Parameters
    ----------
    samples : those of the residual, zero where none is present
    counts : number of samples of every ramp, ``(ramp,)``
    spectra : real and imaginary parts of those of the residual, ``(ramp, bin, 2 channels)``
    table : coefficients that interpolate them, ``(power, derivative, tap)``
    """

    samples: ComplexArray
    counts: IntArray
    spectra: NDArray[np.float32]
    table: FloatArray


@reordered_inner
def left_into(ramps: Any, left: Any, track: Any, sums: Any) -> None:  # pragma: no cover - compiled
    """Sums over the samples of a residual at one place, ``(3, 2, channel, ramp)``.

    They are exact on ramps where the phase bends by more than `GREATEST_BEND`.
    """
    work = np.empty((TAPS + 2 * ORDERS, max(TAPS, left.spectra.shape[2])))
    for k in range(track.shape[1]):
        bend = np.pi * abs(track[DRIFT, k]) * ramps.table[HALF_LENGTH, k] ** 2
        if bend <= GREATEST_BEND:
            interpolated_into(ramps, left.spectra, left.table, track, k, work, sums)
        else:
            _summed_into(ramps, left.samples[:, k, : left.counts[k]], track, k, sums)


@reordered_inner
def _summed_into(
    ramps: Any, samples: Any, track: Any, k: int, sums: Any
) -> None:  # pragma: no cover - compiled
    """Sums over the samples ``(channel, fast)`` of ramp k, which are zero where none is present."""
    channels, count = samples.shape
    real, imag = np.empty(count), np.empty(count)
    half, beat, drift = ramps.table[HALF, k], track[BEAT, k], track[DRIFT, k]
    phase = (half * (0.5 * drift * half - beat), beat - drift * half, drift)
    unit_signal_into(real, imag, phase, ramps.rate)
    root = np.sqrt(track[WEIGHT, k])
    for m in range(channels):
        a, b, c, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(count):
            time = i / ramps.rate - half
            x, y = samples[m, i].real, samples[m, i].imag
            re, im = x * real[i] + y * imag[i], y * real[i] - x * imag[i]
            a += re
            b += im
            c += re * time
            d += im * time
            e += re * time * time
            f += im * time * time
        sums[0, 0, m, k], sums[0, 1, m, k] = root * a, root * b
        sums[1, 0, m, k], sums[1, 1, m, k] = root * c, root * d
        sums[2, 0, m, k], sums[2, 1, m, k] = root * e, root * f


@reordered
def _sums(ramps: Any, left: Any, track: Any, sums: Any) -> None:  # pragma: no cover - compiled
    for p in range(len(track)):
        left_into(ramps, left, track[p], sums[p])


def _subtracted(
    seen: Observation, samples: ComplexArray, points: Replicas
) -> tuple[ComplexArray, NDArray[np.complex64]]:
    """The samples without signals, and the same in the order of `from_middle_into`."""
    channels, ramps, _ = samples.shape
    left = np.empty(samples.shape, dtype=np.complex128)
    turned = np.empty((ramps, transform_size(seen), channels), dtype=np.complex64)
    counts = np.asarray(seen.model.times.num_samples)
    signals = points.track, points.wave, points.amplitude
    _subtract(seen.ramps, samples, seen.present, counts, signals, left, turned)
    return left, turned


@reordered
def _subtract(
    ramps: Any, samples: Any, present: Any, counts: Any, signals: Any, left: Any, turned: Any
) -> None:  # pragma: no cover - compiled
    """Samples without signals, which are as of `Replicas`, in two orders, in place."""
    track, wave, amplitude = signals
    channels, num_ramps, fast = samples.shape
    real, imag, time = np.empty(fast), np.empty(fast), np.empty(fast)
    x, y = np.empty((channels, fast)), np.empty((channels, fast))
    for k in range(num_ramps):
        count, half = counts[k], ramps.table[HALF, k]
        for n in range(count):
            time[n] = n / ramps.rate - half
        for m in range(channels):
            for n in range(count):
                x[m, n], y[m, n] = 0.0, 0.0
        for p in range(len(track)):
            beat, drift = track[p, BEAT, k], track[p, DRIFT, k]
            phase = (half * (0.5 * drift * half - beat), beat - drift * half, drift)
            unit_signal_into(real[:count], imag[:count], phase, ramps.rate)
            scale = 1.0 / np.sqrt(track[p, WEIGHT, k])
            for m in range(channels):
                one = scale * amplitude[p, m]
                q0 = one * complex(wave[p, m, 0, k], wave[p, m, 1, k])
                q1 = one * complex(wave[p, m, 2, k], wave[p, m, 3, k])
                q2 = one * complex(wave[p, m, 4, k], wave[p, m, 5, k])
                a, b, c, d, e, f = q0.real, q0.imag, q1.real, q1.imag, q2.real, q2.imag
                for n in range(count):
                    t = time[n]
                    g, h = a + t * (c + t * e), b + t * (d + t * f)
                    x[m, n] += g * real[n] - h * imag[n]
                    y[m, n] += g * imag[n] + h * real[n]
        for m in range(channels):
            for n in range(count):
                is_there = present[k, n]
                g = x[m, n] if is_there else 0.0
                h = y[m, n] if is_there else 0.0
                left[m, k, n] = samples[m, k, n] - complex(g, h)
            for n in range(count, fast):
                left[m, k, n] = samples[m, k, n]
        from_middle_into(left[:, k], count, turned[k])


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
