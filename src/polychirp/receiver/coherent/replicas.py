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

from polychirp.axes import ComplexArray, FloatArray, IntArray
from polychirp.jit import reordered
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Replicas:
    """Signals of points on all ramps, ready for sums.

    Parameters
    ----------
    middle : phasor in the middle of each ramp's sampling window, ``(point, ramp)``
    beat : frequency there, Hz, ``(point, ramp)``
    drift : rate of the beat, Hz/s, ``(point, ramp)``
    shape : as of `Observation.shape`, ``(point, channel, ramp, 3)``
    weight : as of `Observation.weights`, ``(point, ramp)``
    amplitude : V, ``(point, channel)``
    """

    middle: ComplexArray
    beat: FloatArray
    drift: FloatArray
    shape: ComplexArray
    weight: FloatArray
    amplitude: ComplexArray

    @classmethod
    def of(cls, seen: Observation, points: Points) -> Self:
        """Replicas of points."""
        phases = seen.phases(points.motion)
        half = 0.5 * (seen.model.times.num_samples - 1) / seen.model.times.rate
        cycles = phases[..., 0] + half * (phases[..., 1] + 0.5 * half * phases[..., 2])
        beat = phases[..., 1] + half * phases[..., 2]
        return cls(
            middle=np.exp(2j * np.pi * (cycles % 1.0)),
            beat=beat,
            drift=phases[..., 2],
            shape=seen.shape(points.motion, points.sine),
            weight=seen.weight_at(beat),
            amplitude=points.amplitude,
        )

    def __len__(self) -> int:
        return len(self.beat)

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

    def replaced(self, which: IntArray, other: Self) -> Self:
        """Replicas of which those numbered ``which`` are replaced by ``other``."""
        new = {f.name: getattr(self, f.name).copy() for f in fields(self)}
        for name, value in new.items():
            value[which] = getattr(other, name)
        return replace(self, **new)

    def phases(self, seen: Observation) -> FloatArray:
        """Phases at the first sample of each ramp as of `beat_phase`, ``(point, ramp, 3)``."""
        half = 0.5 * (seen.model.times.num_samples - 1) / seen.model.times.rate
        beat = self.beat - half * self.drift
        start = np.angle(self.middle) / (2.0 * np.pi) - half * (beat + 0.5 * half * self.drift)
        return np.stack([start, beat, self.drift], axis=-1)

    def matched(self, sums: ComplexArray) -> ComplexArray:
        """Sums over samples times the conjugate shapes, with the ramps' weights.

        Parameters
        ----------
        sums : without the points' phases, times powers 0, 1 and 2 of the time, ``(3, point,
            channel, ramp)``

        Returns
        -------
        times powers 0 and 1 of the time, ``(2, point, channel, ramp)``
        """
        shape = self.shape.conj() * self.weight[:, None, :, None]
        zeroth = shape[..., 0] * sums[0] + shape[..., 1] * sums[1] + shape[..., 2] * sums[2]
        return np.stack([zeroth, shape[..., 0] * sums[1] + shape[..., 1] * sums[2]])


def sums_of(
    seen: Observation,
    of: Replicas,
    at: Replicas,
    group: IntArray | None = None,
    own: IntArray | None = None,
) -> ComplexArray:
    """Sums over signals as over samples: without the phases of ``at``, times powers of the time.

    Parameters
    ----------
    of : points whose signals are summed
    own, group : numbers of the groups to which ``at`` and ``of`` belong; only signals of the own
        group count. All signals count if None

    Returns
    -------
    times powers 0, 1 and 2 of the time, ``(3, point, channel, ramp)``
    """
    if group is None or own is None:
        group, own = np.zeros(len(of), dtype=np.int64), np.zeros(len(at), dtype=np.int64)
    mean = of.amplitude[:, :, None] * of.shape[..., 0] * of.middle[:, None]
    growth = of.amplitude[:, :, None] * of.shape[..., 1] * of.middle[:, None]
    real, imag = _sums_of(
        _angles(seen, at),
        own,
        _angles(seen, of),
        group,
        np.stack([mean.real, growth.real], axis=1),
        np.stack([mean.imag, growth.imag], axis=1),
        seen.count,
        seen.reach,
    )
    return np.asarray(at.middle.conj()[:, None] * (real + 1j * imag))


def _angles(seen: Observation, points: Replicas) -> FloatArray:
    """Phases from the middle to the end of the ramps, rad, their cosines and sines."""
    turn = 2.0 * np.pi * points.beat * seen.reach
    return np.stack([turn, np.cos(turn), np.sin(turn)], axis=1)


def products(seen: Observation, points: Replicas, group: IntArray) -> ComplexArray:
    """Sums over ramps of products of the signals of amplitude 1 of pairs in one group.

    The first of a pair is conjugated: ``(3, point, point, ramp)``, times powers 0, 1 and 2 of the
    time. They hold the weights of the ramps, and are means over channels.
    """
    gain = _gains(points)
    real, imag = _products(
        _angles(seen, points), group, gain.real, gain.imag, seen.count, seen.reach
    )
    return np.asarray(real + 1j * imag)


def total_products(seen: Observation, first: Replicas, second: Replicas) -> ComplexArray:
    """Sums over all ramps of the products of pairs of signals, ``(first, second)``."""
    here, there = _gains(first), _gains(second)
    return np.asarray(
        _total_products(
            _angles(seen, first), _angles(seen, second), here, there, seen.count, seen.reach
        )
    )


def _gains(points: Replicas) -> ComplexArray:
    """Phasors in the middle of the ramps times weights and shapes, ``(point, channel, ramp)``."""
    gain = points.shape[..., 0] * (np.sqrt(points.weight) * points.middle)[:, None]
    return np.asarray(gain / np.sqrt(gain.shape[1]))


@reordered
def _bessel(
    zeroth: Any, first: Any, second: Any, here: Any, there: Any, count: Any, reach: Any
) -> None:  # pragma: no cover - compiled
    """Sums of phasors times powers 0, 1 and 2 of the time; that of power 1 is times 1/j."""
    for k in range(count.size):
        z = there[0, k] - here[0, k]
        cosine = there[1, k] * here[1, k] + there[2, k] * here[2, k]
        sine = there[2, k] * here[1, k] - there[1, k] * here[2, k]
        near = abs(z) < 0.05
        square = z * z
        safe = 1.0 if near else z
        a = 1.0 - square / 6.0 * (1.0 - square / 20.0) if near else sine / safe
        b = z / 3.0 * (1.0 - square / 10.0) if near else (a - cosine) / safe
        c = 1.0 / 3.0 - square / 10.0 if near else a - 2.0 * b / safe
        zeroth[k] = count[k] * a
        first[k] = count[k] * reach[k] * b
        second[k] = count[k] * reach[k] * reach[k] * c


@reordered
def _sums_of(
    at: Any, own: Any, of: Any, group: Any, real: Any, imag: Any, count: Any, reach: Any
) -> Any:  # pragma: no cover - compiled
    points, _, ramps = at.shape
    channels = real.shape[2]
    re, im = np.zeros((3, points, channels, ramps)), np.zeros((3, points, channels, ramps))
    a, b, c = np.empty(ramps), np.empty(ramps), np.empty(ramps)
    for q in range(points):
        for p in range(of.shape[0]):
            if group[p] != own[q]:
                continue
            _bessel(a, b, c, at[q], of[p], count, reach)
            for m in range(channels):
                for k in range(ramps):
                    u, v = real[p, 0, m, k], imag[p, 0, m, k]
                    s, t = real[p, 1, m, k], imag[p, 1, m, k]
                    re[0, q, m, k] += u * a[k] - t * b[k]
                    im[0, q, m, k] += v * a[k] + s * b[k]
                    re[1, q, m, k] += s * c[k] - v * b[k]
                    im[1, q, m, k] += t * c[k] + u * b[k]
                    re[2, q, m, k] += u * c[k]
                    im[2, q, m, k] += v * c[k]
    return re, im


@reordered
def _products(
    angles: Any, group: Any, real: Any, imag: Any, count: Any, reach: Any
) -> Any:  # pragma: no cover - compiled
    points, channels, ramps = real.shape
    re, im = np.zeros((3, points, points, ramps)), np.zeros((3, points, points, ramps))
    a, b, c = np.empty(ramps), np.empty(ramps), np.empty(ramps)
    u, v = np.empty(ramps), np.empty(ramps)
    for q in range(points):
        for p in range(points):
            if group[p] != group[q]:
                continue
            _bessel(a, b, c, angles[q], angles[p], count, reach)
            for k in range(ramps):
                u[k], v[k] = 0.0, 0.0
            for m in range(channels):
                for k in range(ramps):
                    u[k] += real[q, m, k] * real[p, m, k] + imag[q, m, k] * imag[p, m, k]
                    v[k] += real[q, m, k] * imag[p, m, k] - imag[q, m, k] * real[p, m, k]
            for k in range(ramps):
                re[0, q, p, k], im[0, q, p, k] = u[k] * a[k], v[k] * a[k]
                re[1, q, p, k], im[1, q, p, k] = -v[k] * b[k], u[k] * b[k]
                re[2, q, p, k], im[2, q, p, k] = u[k] * c[k], v[k] * c[k]
    return re, im


@reordered
def _total_products(
    at: Any, of: Any, here: Any, there: Any, count: Any, reach: Any
) -> Any:  # pragma: no cover - compiled
    points, channels, ramps = here.shape
    out = np.zeros((points, of.shape[0]), dtype=np.complex128)
    a, b, c = np.empty(ramps), np.empty(ramps), np.empty(ramps)
    for q in range(points):
        for p in range(of.shape[0]):
            _bessel(a, b, c, at[q], of[p], count, reach)
            re, im = 0.0, 0.0
            for m in range(channels):
                for k in range(ramps):
                    x, y = here[q, m, k], there[p, m, k]
                    re += (x.real * y.real + x.imag * y.imag) * a[k]
                    im += (x.real * y.imag - x.imag * y.real) * a[k]
            out[q, p] = complex(re, im)
    return out
