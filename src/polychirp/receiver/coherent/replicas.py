r"""Replicas: the signals that points have on every ramp, and sums of products of such signals.

The signal of a point on channel m and ramp k is :math:`\alpha_m g_{mk}(u)\,e^{j2\pi(\varphi_k +
f_k u + \frac12 d_k u^2)}`, with the time u from the middle of the ramp's sampling window, and with
the polynomial g of `Observation.shape`. The beats of two points differ by :math:`\Delta`, and the
curvatures of their phases by little: with N samples in a window of length 2T and
:math:`z = 2\pi\Delta T` the sums of products of their phasors with powers 0, 1 and 2 of u are
:math:`N j_0(z)`, :math:`jNT j_1(z)` and :math:`-NT^2 j_0''(z)`, of spherical Bessel functions.
Missing samples reduce N.
"""

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.jit import compiled, reordered, reordered_inner
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.ramps import (
    BEGIN,
    ELAPSED,
    FIRST_FREQUENCY,
    FREQUENCY,
    HALF,
    HALF_LENGTH,
    SLOPE,
    USED,
)
from polychirp.receiver.signal_model.point_signal import LEAST_RANGE_SHARE

BEAT, DRIFT, WEIGHT, TURN, COSINE, SINE = range(6)
"""Rows of `Replicas.track`."""

FAR_APART = 100.0
"""Least phase, rad, by which two signals turn against each other from the middle of a ramp to its
end, on all ramps, from which their products count as zero; they are below 1 % there."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Replicas:
    """Signals of points on all ramps, ready for sums.

    Parameters
    ----------
    track : frequency in the middle of each ramp's sampling window, Hz; its rate, Hz/s; the weight
        as of `Observation.weights`; the phase from the middle to the end of the window, rad, its
        cosine and its sine, ``(point, 6, ramp)``
    wave : polynomial of `Observation.shape` times the phasor in the middle of the window and the
        root of the weight, its real and imaginary parts, ``(point, channel, 6, ramp)``
    amplitude : V, ``(point, channel)``
    """

    track: FloatArray
    wave: FloatArray
    amplitude: ComplexArray

    @classmethod
    def of(cls, seen: Observation, points: Points) -> Self:
        """Replicas of points."""
        count, ramps, channels = len(points), seen.ramps.num_ramps, seen.ramps.channel_y.size
        track, wave = np.empty((count, 6, ramps)), np.empty((count, channels, 6, ramps))
        motion, sine = np.ascontiguousarray(points.motion), np.ascontiguousarray(points.sine)
        growth = np.ascontiguousarray(points.growth)
        _replicas(seen.ramps, seen.weight, motion, sine, growth, track, wave)
        return cls(track=track, wave=wave, amplitude=points.amplitude)

    def __len__(self) -> int:
        return len(self.track)

    def __getitem__(self, which: Any) -> Self:
        chosen: dict[str, Any] = {f.name: getattr(self, f.name)[which] for f in fields(self)}
        return replace(self, **chosen)

    def __add__(self, other: Self) -> Self:
        both = {
            f.name: np.concatenate([getattr(self, f.name), getattr(other, f.name)])
            for f in fields(self)
        }
        return replace(self, **both)

    @property
    def negated(self) -> Self:
        """The opposite signals."""
        return replace(self, amplitude=-self.amplitude)

    def size(self, seen: Observation) -> FloatArray:
        """Number of samples of each ramp times the weight and the shape's power, ``(point, ramp)``.

        It is the sum of the squares of a signal of amplitude 1, as a mean over channels.
        """
        size = np.empty((len(self), seen.ramps.num_ramps))
        _sizes(seen.ramps, self.wave, size)
        return size

    def matched(self, sums: ComplexArray) -> ComplexArray:
        """Sums over samples times the conjugate shapes, with the ramps' weights.

        Parameters
        ----------
        sums : as of `Residual.sums`, ``(3, point, channel, ramp)``

        Returns
        -------
        ``(point, channel, ramp)``
        """
        wave = self.wave[:, :, 0::2] - 1j * self.wave[:, :, 1::2]
        return np.asarray(
            wave[:, :, 0] * sums[0] + wave[:, :, 1] * sums[1] + wave[:, :, 2] * sums[2]
        )


def sums_of(seen: Observation, of: Replicas, at: Replicas) -> ComplexArray:
    """Sums over signals as over samples: without the beats of ``at``, times powers of the time.

    They hold the roots of the weights of the signals that are summed.

    Returns
    -------
    times powers 0, 1 and 2 of the time, ``(3, point, channel, ramp)``
    """
    sums = np.zeros((len(at), 3, 2, *at.wave.shape[1::2]))
    _sums_of(seen.ramps, of.track, of.wave, of.amplitude, at.track, sums)
    return as_complex(sums)


def as_complex(sums: FloatArray) -> ComplexArray:
    """Sums of kernels, ``(point, 3, 2, channel, ramp)``, as ``(3, point, channel, ramp)``."""
    parts = np.moveaxis(sums, (2, 1), (0, 1))
    out = np.empty(parts.shape[1:], dtype=np.complex128)
    out.real, out.imag = parts
    return out


def products(seen: Observation, points: Replicas) -> ComplexArray:
    """Sums over samples of products of the signals of amplitude 1 of all pairs, per ramp.

    The first of a pair is conjugated: ``(3, point, point, ramp)``, times powers 0, 1 and 2 of the
    time. They hold the weights of the ramps, and are means over channels.
    """
    out = np.empty((3, 2, len(points), len(points), seen.ramps.num_ramps))
    _products(seen.ramps, points.track, points.wave, out)
    return np.asarray(out[:, 0] + 1j * out[:, 1])


def total_products(seen: Observation, first: Replicas, second: Replicas) -> ComplexArray:
    """Sums of `products` over all ramps, of pairs of both sets, ``(first, second)``."""
    out = np.zeros((len(first), len(second)), dtype=np.complex128)
    _total_products(seen.ramps, first.track, first.wave, second.track, second.wave, out)
    return out


def correlations(seen: Observation, first: Replicas, second: Replicas) -> FloatArray:
    """Magnitude of the correlation of pairs of signals of amplitude 1, ``(first, second)``."""
    sizes = (np.sqrt(np.maximum(one.size(seen).sum(axis=1), 1e-300)) for one in (first, second))
    return np.asarray(np.abs(total_products(seen, first, second)) / np.outer(*sizes))


@reordered_inner
def _range_at(
    time: float, distance: float, rate: float, bend: float
) -> Any:  # pragma: no cover - compiled
    """Range ``time`` after the middle of the frame, as of `path_of`, m."""
    square = distance * distance + (2.0 * distance * rate + bend * time) * time
    return np.copysign(np.sqrt(max(square, (LEAST_RANGE_SHARE * distance) ** 2)), distance)


@reordered_inner
def replica_into(
    ramps: Any, weights: Any, motion: Any, sine: float, growth: float, track: Any, wave: Any
) -> None:  # pragma: no cover - compiled
    """The signal of one point; arrays as those of `Replicas`, without the axis of points."""
    distance, rate, acceleration, sine_rate = motion[0], motion[1], motion[2], motion[3]
    bins, channels = weights.shape[1], ramps.channel_y.size
    bend = rate * rate + distance * acceleration
    least = LEAST_RANGE_SHARE * abs(distance)
    for k in range(ramps.table.shape[1]):
        slope, time, frequency = (
            ramps.table[SLOPE, k],
            ramps.table[BEGIN, k],
            ramps.table[FIRST_FREQUENCY, k],
        )
        now = _range_at(time, distance, rate, bend)
        velocity = (distance * rate + bend * time) / now
        delay = 2.0 * now / (SPEED_OF_LIGHT + velocity)
        lengthening = 2.0 * velocity / (SPEED_OF_LIGHT + velocity)
        first = slope * delay + (frequency - slope * delay) * lengthening
        bent = 2.0 * slope * lengthening - slope * lengthening * lengthening
        bent += frequency * 2.0 / SPEED_OF_LIGHT * (bend - velocity * velocity) / now
        half = ramps.table[HALF, k]
        cycles = (
            frequency * delay - 0.5 * slope * delay * delay + half * (first + 0.5 * half * bent)
        )
        beat = first + half * bent
        phase = 2.0 * np.pi * (cycles % 1.0)
        weight = weights[k, int(np.rint(beat * bins / ramps.rate)) % bins]
        turn = 2.0 * np.pi * beat * ramps.table[HALF_LENGTH, k]
        track[BEAT, k], track[DRIFT, k], track[WEIGHT, k] = beat, bent, weight
        track[TURN, k], track[COSINE, k], track[SINE, k] = turn, np.cos(turn), np.sin(turn)

        time, frequency = ramps.table[ELAPSED, k], ramps.table[FREQUENCY, k]
        now = _range_at(time, distance, rate, bend)
        velocity = (distance * rate + bend * time) / now
        steady = distance + rate * time
        straight = np.copysign(max(np.copysign(1.0, distance) * steady, least), distance)
        sine_now = (sine * straight + sine_rate * distance * time) / now
        delay = 2.0 * steady / (SPEED_OF_LIGHT + rate)
        lengthening = 2.0 * rate / (SPEED_OF_LIGHT + rate)
        tone = 1j * (slope * delay * (1.0 - lengthening) + frequency * lengthening)
        spreading = (distance / now) ** 2 * np.exp(growth * time)
        size = np.sqrt(weight) * spreading * complex(np.cos(phase), np.sin(phase))
        for corner in ramps.corners:
            size *= tone / (corner + tone)
        for m in range(channels):
            by_sine = -2.0 * np.pi / SPEED_OF_LIGHT * ramps.channel_y[m]
            phase = by_sine * (frequency * sine_now - ramps.mean_frequency * sine)
            rise = complex(
                growth - 2.0 * velocity / now,
                by_sine * (slope * sine_now + frequency * sine_rate),
            )
            value = size * complex(np.cos(phase), np.sin(phase))
            for n in range(3):
                wave[m, 2 * n, k], wave[m, 2 * n + 1, k] = value.real, value.imag
                value *= rise / (n + 1.0)


@reordered_inner
def bessel_into(  # pragma: no cover - compiled
    ramps: Any, here: Any, there: Any, zeroth: Any, first: Any, second: Any
) -> bool:
    """Sums of phasors times powers 0, 1 and 2 of the time; that of power 1 is times 1/j.

    False, without sums, if the signals are far apart on all ramps.
    """
    count = ramps.table.shape[1]
    least = np.inf
    for k in range(count):
        least = min(least, abs(there[TURN, k] - here[TURN, k]))
    if least > FAR_APART:
        return False
    for k in range(count):
        z = there[TURN, k] - here[TURN, k]
        cosine = there[COSINE, k] * here[COSINE, k] + there[SINE, k] * here[SINE, k]
        sine = there[SINE, k] * here[COSINE, k] - there[COSINE, k] * here[SINE, k]
        near = abs(z) < 0.05
        square = z * z
        safe = 1.0 if near else z
        a = 1.0 - square / 6.0 * (1.0 - square / 20.0) if near else sine / safe
        b = z / 3.0 * (1.0 - square / 10.0) if near else (a - cosine) / safe
        c = 1.0 / 3.0 - square / 10.0 if near else a - 2.0 * b / safe
        size, reach = ramps.table[USED, k], ramps.table[HALF_LENGTH, k]
        zeroth[k] = size * a
        first[k] = size * reach * b
        second[k] = size * reach * reach * c
    return True


@reordered_inner
def signal_into(  # pragma: no cover - compiled
    sums: Any, wave: Any, factor: Any, zeroth: Any, first: Any, second: Any
) -> None:
    """Add a signal of amplitude ``factor`` to ``sums`` ``(3, 2, channel, ramp)``."""
    for m in range(factor.size):
        x, y = factor[m].real, factor[m].imag
        for k in range(zeroth.size):
            p = x * wave[m, 0, k] - y * wave[m, 1, k]
            q = x * wave[m, 1, k] + y * wave[m, 0, k]
            r = x * wave[m, 2, k] - y * wave[m, 3, k]
            s = x * wave[m, 3, k] + y * wave[m, 2, k]
            t = x * wave[m, 4, k] - y * wave[m, 5, k]
            u = x * wave[m, 5, k] + y * wave[m, 4, k]
            a, b, c = zeroth[k], first[k], second[k]
            sums[0, 0, m, k] += p * a - s * b + t * c
            sums[0, 1, m, k] += q * a + r * b + u * c
            sums[1, 0, m, k] += r * c - q * b
            sums[1, 1, m, k] += s * c + p * b
            sums[2, 0, m, k] += p * c
            sums[2, 1, m, k] += q * c


@reordered_inner
def product(  # pragma: no cover - compiled
    here: Any, there: Any, zeroth: Any, first: Any, second: Any
) -> Any:
    """Product of two signals' polynomials on one channel, summed over all ramps.

    The first is conjugated; they are ``(6, ramp)``.
    """
    re, im = 0.0, 0.0
    for k in range(zeroth.size):
        a, b, c = zeroth[k], first[k], second[k]
        p, q, r, s, t, u = here[0, k], here[1, k], here[2, k], here[3, k], here[4, k], here[5, k]
        x, y = there[0, k], there[1, k]
        re += (p * x + q * y) * a + (t * x + u * y) * c - (r * y - s * x) * b
        im += (p * y - q * x) * a + (t * y - u * x) * c + (r * x + s * y) * b
        x, y = there[2, k], there[3, k]
        re += (r * x + s * y) * c - (p * y - q * x) * b
        im += (r * y - s * x) * c + (p * x + q * y) * b
        x, y = there[4, k], there[5, k]
        re += (p * x + q * y) * c
        im += (p * y - q * x) * c
    return complex(re, im)


@reordered
def _replicas(
    ramps: Any, weights: Any, motion: Any, sine: Any, growth: Any, track: Any, wave: Any
) -> None:  # pragma: no cover - compiled
    for p in range(len(motion)):
        replica_into(ramps, weights, motion[p], sine[p], growth[p], track[p], wave[p])


@compiled
def _sizes(ramps: Any, wave: Any, out: Any) -> None:  # pragma: no cover - compiled
    channels = wave.shape[1]
    for p in range(len(wave)):
        for k in range(out.shape[1]):
            total = 0.0
            for m in range(channels):
                total += wave[p, m, 0, k] ** 2 + wave[p, m, 1, k] ** 2
            out[p, k] = total / channels * ramps.table[USED, k]


@reordered
def _sums_of(
    ramps: Any, track: Any, wave: Any, amplitude: Any, at: Any, sums: Any
) -> None:  # pragma: no cover - compiled
    count = ramps.table.shape[1]
    a, b, c = np.empty(count), np.empty(count), np.empty(count)
    for q in range(len(at)):
        for p in range(len(track)):
            if bessel_into(ramps, at[q], track[p], a, b, c):
                signal_into(sums[q], wave[p], amplitude[p], a, b, c)


@reordered
def _products(ramps: Any, track: Any, wave: Any, out: Any) -> None:  # pragma: no cover - compiled
    count = ramps.table.shape[1]
    a, b, c = np.empty(count), np.empty(count), np.empty(count)
    for q in range(len(track)):
        for p in range(len(track)):
            if not bessel_into(ramps, track[q], track[p], a, b, c):
                for k in range(count):
                    a[k], b[k], c[k] = 0.0, 0.0, 0.0
            gains_into(wave[q], wave[p], out[0, 0, q, p], out[0, 1, q, p])
            for k in range(count):
                u, v = out[0, 0, q, p, k], out[0, 1, q, p, k]
                out[0, 0, q, p, k], out[0, 1, q, p, k] = u * a[k], v * a[k]
                out[1, 0, q, p, k], out[1, 1, q, p, k] = -v * b[k], u * b[k]
                out[2, 0, q, p, k], out[2, 1, q, p, k] = u * c[k], v * c[k]


@reordered_inner
def gains_into(here: Any, there: Any, real: Any, imag: Any) -> None:  # pragma: no cover - compiled
    """Products of shapes ``(channel, 6, ramp)`` in the ramps' middles, means over channels."""
    channels = len(here)
    for k in range(real.size):
        real[k], imag[k] = 0.0, 0.0
    for m in range(channels):
        for k in range(real.size):
            p, q = here[m, 0, k] / channels, here[m, 1, k] / channels
            x, y = there[m, 0, k], there[m, 1, k]
            real[k] += p * x + q * y
            imag[k] += p * y - q * x


@reordered
def _total_products(
    ramps: Any, at: Any, here: Any, of: Any, there: Any, out: Any
) -> None:  # pragma: no cover - compiled
    count = ramps.table.shape[1]
    a, b, c = np.empty(count), np.empty(count), np.empty(count)
    u, v = np.empty(count), np.empty(count)
    for q in range(len(at)):
        for p in range(len(of)):
            if bessel_into(ramps, at[q], of[p], a, b, c):
                gains_into(here[q], there[p], u, v)
                re, im = 0.0, 0.0
                for k in range(u.size):
                    re += u[k] * a[k]
                    im += v[k] * a[k]
                out[q, p] = complex(re, im)
