"""Agreement of the ramps that there is a point.

A point has one amplitude on all ramps. Where rising and falling ramps differ by more than noise
explains, beats of two bodies meet, or those of one body alone whose amplitude changes during the
frame. And power that adds up on no ramp with another is noise, interference, or the rest of such a
body: a point must stand out of it as out of noise.
"""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray
from polychirp.jit import reordered
from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas
from polychirp.receiver.coherent.residual import Residual

DEVIATIONS = 5.0
"""Standard deviations of noise above which the spread of the ramps is a floor of its own; chosen:
some 10⁵ cells of noise stay below."""

LEAST_AGREEMENT = 4.0
"""Power of all ramps over that of the difference between rising and falling ones, less its mean in
noise, from which there is a point; chosen: beats that only one kind of ramps has give 1."""

LEAST_SIZE = float(np.finfo(np.float64).tiny)
"""Least number of samples by which sums are divided: a ramp without samples has no size and no
value."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Agreement:
    """Sums over the ramps at the beats of places, W, each ``(place,)``.

    Parameters
    ----------
    power : sum of all ramps in phase, over the number of samples, summed over channels
    difference : power by which separate amplitudes on rising and falling ramps fit better; zero
        if all ramps are of one direction
    spread : power of what does not add up, per channel and degree of freedom: the noise power of a
        sample, in white noise
    num_averaged : degrees of freedom of ``spread``
    num_channels : of the array
    """

    power: FloatArray
    difference: FloatArray
    spread: FloatArray
    num_averaged: int
    num_channels: int

    @classmethod
    def at(cls, seen: Observation, residual: Residual, points: Points) -> Self:
        """Sums over the residual at the motions of points that are not subtracted from it."""
        here = Replicas.of(seen, points)
        value = mixed(seen, here.matched(residual.sums(seen, here)))
        return cls.of(seen, value, here.size(seen))

    @classmethod
    def of(cls, seen: Observation, value: ComplexArray, size: FloatArray) -> Self:
        """Sums over the ramps.

        Parameters
        ----------
        value : sums over each ramp without the places' phases, on white channels, V, ``(place,
            channel, ramp)``
        size : number of the samples times their weights, ``(place, ramp)``
        """
        is_used = seen.count > 0
        rises = seen.model.schedule.slope > 0
        has_both = bool(np.any(rises & is_used) and np.any(~rises & is_used))
        num_averaged = value.shape[1] * (seen.num_used - 1)
        sums = np.empty((3, len(value)))
        _sums_over_ramps(value, size, rises, sums)
        power, sides, energy = sums
        return cls(
            power=power,
            difference=sides - power if has_both else np.zeros(len(value)),
            spread=np.maximum(energy - power, 0.0) / max(num_averaged, 1),
            num_averaged=num_averaged,
            num_channels=value.shape[1],
        )

    def greatest_power(self, floor: FloatArray) -> FloatArray:
        """Greatest power that phases from ramp to ramp can give, W, ``(place,)``.

        It is that of all ramps less the noise, which has up to `DEVIATIONS` less than its mean. It
        is at least the power that the ramps have without further phases: side lobes of a strong
        point raise the floor above what its ramps hold besides it.
        """
        noise = (self.num_averaged - DEVIATIONS * np.sqrt(self.num_averaged)) * floor
        gain = self.spread * self.num_averaged - noise
        return np.asarray(self.power + np.maximum(gain, 0.0))

    def shows_points(self, floor: FloatArray, threshold: float) -> BoolArray:
        """Mask of the places at which there is a point, ``(place,)``.

        Parameters
        ----------
        floor : noise power of a sample, W, ``(place,)``
        threshold : least power over it
        """
        least = 1.0 + DEVIATIONS / np.sqrt(max(self.num_averaged, 1))
        noise = np.where(self.spread > least * floor, self.spread, floor)
        beyond_noise = self.difference - self.num_channels * floor
        is_one = self.power > LEAST_AGREEMENT * beyond_noise
        return np.asarray(is_one & (self.power > threshold * noise), dtype=np.bool_)


@reordered
def _sums_over_ramps(
    value: Any, size: Any, rises: Any, out: Any
) -> None:  # pragma: no cover - compiled
    """Powers of the sums over all ramps, over rising plus over falling ones, and of no sum.

    Each is over the number of samples: ``(3, place)``.
    """
    places, channels, ramps = value.shape
    for n in range(places):
        up, down, energy = 0.0, 0.0, 0.0
        for k in range(ramps):
            up += size[n, k] if rises[k] else 0.0
            down += 0.0 if rises[k] else size[n, k]
        whole, of_up, of_down = 0.0, 0.0, 0.0
        for m in range(channels):
            a, b, c, d = 0.0, 0.0, 0.0, 0.0
            for k in range(ramps):
                x, y = value[n, m, k].real, value[n, m, k].imag
                a += x if rises[k] else 0.0
                b += y if rises[k] else 0.0
                c += 0.0 if rises[k] else x
                d += 0.0 if rises[k] else y
                energy += (x * x + y * y) / max(size[n, k], LEAST_SIZE)
            whole += (a + c) ** 2 + (b + d) ** 2
            of_up += a * a + b * b
            of_down += c * c + d * d
        out[0, n] = whole / (up + down)
        out[1, n] = of_up / max(up, LEAST_SIZE) + of_down / max(down, LEAST_SIZE)
        out[2, n] = energy
