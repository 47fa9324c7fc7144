r"""`Elements`: places of an array's channels in wavelengths, and the directions that they measure.

A direction of azimuth φ and elevation ε has the direction cosines

.. math:: u = \cos\varepsilon\,\sin\varphi \ \text{(to the left)}, \qquad
          w = \sin\varepsilon \ \text{(up)}.

A wave from there reaches an element at y to the left and z up earlier than one at the origin, by
:math:`(yu + zw)/c`. The mixer conjugates the received wave, so that the beat of channel m lags by

.. math:: a_m(u, w) = e^{-j 2\pi (y_m u + z_m w)/\lambda}.

Channels at one height do not tell w from its negative or from zero, so that only u is measured.
"""

from dataclasses import dataclass
from typing import Annotated, NamedTuple, Self

import numpy as np

from polychirp.axes import Axes, ComplexArray, FloatArray, IntArray, Sealed
from polychirp.constants import SPEED_OF_LIGHT

SAME_PLACE = 1e-6
"""Distance below which two places count as one, wavelengths; chosen: above the rounding errors of
positions, and 6e-6 rad of phase."""

MOST_DIVISIONS = 8
"""Greatest number of equal steps into which the least gap of a line is divided in the search for
the step of all its places; chosen: sparse arrays are laid out on half wavelengths."""


class Line(NamedTuple):
    """Step of a line of elements, wavelengths, its axis (0: left, 1: up), and places in steps.

    The places are ``(channel,)`` and begin at 0 with the rightmost, or lowest, channel.
    """

    axis: int
    step: float
    steps: IntArray

    @property
    def is_uniform(self) -> bool:
        """True if one channel is at every step, from right to left or from bottom to top."""
        return bool(np.array_equal(self.steps, np.arange(self.steps.size)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Elements(Sealed):
    """Places of an array's channels, to the left and up, in wavelengths, ``(channel, 2)``.

    Examples
    --------
    >>> row = Elements(place=[[0.0, 0.0], [0.5, 0.0], [1.5, 0.0]])
    >>> row.axes, row.line().step, row.line().steps
    ((0,), 0.5, array([0, 1, 3]))
    """

    place: Annotated[FloatArray, Axes("channel", "2")]

    @classmethod
    def of(cls, position: FloatArray, *, frequency: float) -> Self:
        """The elements at positions ``(channel, xyz)`` in the radar's frame, m, at a frequency."""
        return cls(place=(position - position.mean(axis=0))[:, 1:] * frequency / SPEED_OF_LIGHT)

    @property
    def extent(self) -> FloatArray:
        """Width and height of the array, wavelengths, ``(2,)``."""
        return np.asarray(np.ptp(self.place, axis=0))

    @property
    def axes(self) -> tuple[int, ...]:
        """Axes along which the array has an extent and measures a direction cosine: 0, 1."""
        return tuple(int(axis) for axis in np.flatnonzero(self.extent > SAME_PLACE))

    @property
    def is_slanted_line(self) -> bool:
        """True if all elements are on one line that is neither horizontal nor vertical."""
        if len(self.axes) < 2:
            return False
        singular = np.linalg.svd(self.place - self.place.mean(axis=0), compute_uv=False)
        return bool(singular[1] < SAME_PLACE)

    def steering(self, cosines: FloatArray) -> ComplexArray:
        """Phases ``(…, channel)`` of waves from direction cosines ``(…, 2)``."""
        return np.asarray(np.exp(-2j * np.pi * (cosines @ self.place.T)))

    def line(self) -> Line | None:
        """The line of all elements, if it is along an axis and their gaps have a common step."""
        if len(self.axes) != 1:
            return None
        axis = self.axes[0]
        along = self.place[:, axis] - self.place[:, axis].min()
        gaps = np.diff(np.sort(along))
        least = float(np.min(gaps[gaps > SAME_PLACE]))
        for parts in range(1, MOST_DIVISIONS + 1):
            index = np.round(along / (least / parts))
            step = float(along.max() / index.max())
            if np.all(np.abs(along - step * index) <= SAME_PLACE):
                return Line(axis, step, index.astype(np.int64))
        return None

    def mirrored(self) -> IntArray | None:
        """Number of the channel at each channel's mirror image in the array's middle, or None."""
        middle = 0.5 * (self.place.min(axis=0) + self.place.max(axis=0))
        image = 2.0 * middle - self.place
        apart = np.linalg.norm(self.place[:, None] - image, axis=-1)
        index = np.argmin(apart, axis=0)
        is_image = np.all(apart.min(axis=0) <= SAME_PLACE)
        return index if is_image and np.unique(index).size == index.size else None

    def both_ways(self, snapshots: ComplexArray) -> ComplexArray:
        """Snapshots ``(…, channel, snapshot)`` and, if there are any, their mirror images.

        In an array that equals its mirror image, :math:`J x^*` is a snapshot of the same waves with
        other phases (forward–backward averaging, Pillai and Kwon 1989).
        """
        index = self.mirrored()
        if index is None:
            return snapshots
        return np.concatenate([snapshots, snapshots[..., index, :].conj()], axis=-1)
