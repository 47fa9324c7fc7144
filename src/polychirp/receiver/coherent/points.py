"""`Points`: the points that are found in a frame so far, and their signals."""

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.signals import subtract


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Points:
    """Points, each with one motion and one amplitude per channel over the whole frame.

    Parameters
    ----------
    motion : R, m, v, m/s, a, m/s², and the rate of the azimuth's sine, 1/s, in the middle of the
        frame, ``(point, 4)``
    amplitude : V, ``(point, channel)``
    floor : noise power of a sample at the point's range, W, ``(point,)``
    sine : sine of the azimuth, ``(point,)``: the elements' delays change the beats a little
    growth : rate of the logarithm of the amplitude beyond that of 1/R², 1/s, ``(point,)``
    power : fall of the fit if the point were left out, over ``floor``, ``(point,)``
    """

    motion: FloatArray
    amplitude: ComplexArray
    floor: FloatArray
    sine: FloatArray
    growth: FloatArray
    power: FloatArray

    @classmethod
    def none(cls, num_channels: int) -> Self:
        """No points."""
        return cls(
            motion=np.zeros((0, 4)),
            amplitude=np.zeros((0, num_channels), dtype=np.complex128),
            floor=np.zeros(0),
            sine=np.zeros(0),
            growth=np.zeros(0),
            power=np.zeros(0),
        )

    def __len__(self) -> int:
        return len(self.motion)

    def __getitem__(self, which: BoolArray | IntArray) -> Self:
        return replace(self, **{name: value[which] for name, value in self._columns().items()})

    def __add__(self, other: Self) -> Self:
        more = other._columns()
        both = {name: np.concatenate([v, more[name]]) for name, v in self._columns().items()}
        return replace(self, **both)

    @property
    def strength(self) -> FloatArray:
        """Fall of the fit if the point were left out, W, ``(point,)``."""
        return self.power * self.floor

    @property
    def negated(self) -> Self:
        """The points with the opposite signals: subtracting them adds the signals."""
        return replace(self, amplitude=-self.amplitude)

    def replaced(self, which: IntArray, other: Self) -> Self:
        """Points of which those numbered ``which`` are replaced by ``other``."""
        new = {name: value.copy() for name, value in self._columns().items()}
        for name, value in other._columns().items():
            new[name][which] = value
        return replace(self, **new)

    def _columns(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}


def without(seen: Observation, samples: ComplexArray, points: Points) -> ComplexArray:
    """``samples`` less the signals of points, ``(channel, ramp, fast)``; the twin of `Residual`."""
    out = samples.copy()
    if len(points):
        shape = seen.shape(points.motion, points.sine, points.growth)
        polynomial = points.amplitude[:, :, None, None] * shape
        phases = seen.phases(points.motion)
        subtract(out, seen.present, phases, polynomial, seen.model.times)
    return out
