r"""Noise of white channels that still differs between directions, at some ranges.

One matrix makes the channels white over the whole map (`noise.whitening`), but the signal of an
interferer is not equally strong at all ranges. Where it is stronger than in the mean, noise from
its direction exceeds that from others, and exceeds a threshold for white channels far more often
than stated. With the eigenvectors :math:`u_m` of the channels' covariance there, and the noise
powers :math:`\lambda_m` of a sample along them, the test of a white channel,
:math:`\sum|z_m|^2 > T\sigma^2`, becomes (Kay 1998, Fundamentals of Statistical Signal Processing
II, 4.5)

.. math:: \sum_m \frac{|u_m^H z|^2}{\lambda_m} > T, \quad\text{thus}\quad
    \sigma^2 = \frac{|z|^2}{\sum_m |u_m^H z|^2/\lambda_m}

is the noise power that counts for amplitudes z.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.receiver.coherent.coherent_map import GREATEST_OF_NOISE, range_floors
from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.profiles import Profiles
from polychirp.receiver.coherent.rate_blocks import total_weights
from polychirp.receiver.signal_model.grid import Grid

BAND = 24
"""Least number of ranges of the map, half a cell apart, of which a covariance is taken; chosen: the
interference of the paper's street changes little over twelve cells."""

RATES = 200
"""Number of range rates from which it is taken; chosen: with a band of ranges they tell powers to
some per cent."""

CELLS_PER_VALUE = 4.0
"""Number of the map's values per independent one: they are half a cell apart on either axis."""

LEAST_SPREAD = 1.1
"""Greatest eigenvalue of a covariance over the greatest that white noise has, from which directions
count; chosen: white noise hardly exceeds it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NoiseDirections:
    r"""Noise powers of a sample by direction, in bands of ranges of a map.

    Parameters
    ----------
    axes : of the map
    band : number of the band of every range, ``(range,)``
    floor : noise power of a sample at every range, the mean of all directions, W, ``(range,)``
    whitening : matrix whose rows are :math:`u_m^H/\sqrt{\lambda_m}`, with the powers over those
        of the floor, ``(band, channel, channel)``; of white noise it is the unit matrix
    """

    axes: Grid
    band: IntArray
    floor: FloatArray
    whitening: ComplexArray

    @classmethod
    def of(cls, seen: Observation, profiles: Profiles) -> Self:
        """The noise of profiles whose channels are white and which show no points."""
        axes = profiles.axes
        rates = axes.range_rate[:: max(1, axes.range_rate.size // RATES)]
        real, imag = profiles.sums(seen, rates).astype(np.float64)
        place, _ = profiles.places(seen, rates)
        size = total_weights(profiles.weight, place, axes.range.size)
        sums = (real + 1j * imag) / np.sqrt(size)
        power = np.sum(np.abs(sums) ** 2, axis=0).astype(np.float32)
        number = max(1, axes.range.size // BAND)
        band = np.arange(axes.range.size) * number // axes.range.size
        cells = [sums[..., band == one].reshape(len(sums), -1) for one in range(number)]
        return cls(
            axes=axes,
            band=band,
            floor=range_floors(power, len(sums)),
            whitening=np.stack([_whitening(some) for some in cells]),
        )

    @property
    def is_white(self) -> BoolArray:
        """Mask of the bands in which all directions have the same noise, ``(band,)``."""
        is_unit = self.whitening == np.eye(self.whitening.shape[-1])
        return np.asarray(np.all(is_unit, axis=(1, 2)))

    def below(self, seen: Observation, points: Points) -> Points:
        """Points with floors of at least the noise from their directions.

        They are the same where noise is white at all ranges.
        """
        if np.all(self.is_white):
            return points
        own = self.towards(mixed(seen, points.amplitude), points.motion[:, 0])
        own = np.maximum(own, points.floor)
        return replace(points, floor=own, power=points.strength / own)

    def towards(self, amplitude: ComplexArray, distance: FloatArray) -> FloatArray:
        """Noise power of a sample that counts for points, W, ``(point,)``.

        Parameters
        ----------
        amplitude : on the map's white channels, V, ``(point, channel)``
        distance : range of the points, m, ``(point,)``
        """
        column = np.rint((distance - self.axes.range[0]) / self.axes.range_step)
        column = np.clip(column, 0, self.floor.size - 1).astype(np.int64)
        white = np.einsum("pmn,pn->pm", self.whitening[self.band[column]], amplitude)
        power = np.sum(np.abs(amplitude) ** 2, axis=1)
        least = np.finfo(np.float64).tiny
        ratio = power / np.maximum(np.sum(np.abs(white) ** 2, axis=1), least)
        return np.asarray(self.floor[column] * np.where(power > 0.0, ratio, 1.0))


def _whitening(cells: ComplexArray) -> ComplexArray:
    """Matrix that makes cells ``(channel, cell)`` white that are so in the mean.

    Powers along the eigenvectors are medians, which the cells of points do not raise. They are
    relative to a floor that is the median of the channels' sum, as if they were white.
    """
    from scipy.special import gammaincinv

    channels = len(cells)
    total = np.sum(np.abs(cells) ** 2, axis=0)
    middle = float(np.median(total))
    if channels == 1 or middle <= 0.0:
        return np.eye(channels, dtype=np.complex128)
    noise = cells[:, total <= GREATEST_OF_NOISE * middle]
    value, vector = np.linalg.eigh(noise @ noise.conj().T)
    if value[-1] <= LEAST_SPREAD * _greatest_of_white(noise.shape) * value.mean():
        return np.eye(channels, dtype=np.complex128)
    along = vector.conj().T @ cells
    power = np.median(np.abs(along) ** 2, axis=1) / np.log(2.0)
    power /= middle / gammaincinv(channels, 0.5)
    least = np.finfo(np.float64).tiny
    return np.asarray(vector.conj().T / np.sqrt(np.maximum(power, least))[:, None])


def _greatest_of_white(shape: tuple[int, int]) -> float:
    """Greatest eigenvalue, over the mean, of the covariance of white cells ``(channel, cell)``.

    The law of Marchenko and Pastur (1967), for many channels and cells.
    """
    channels, cells = shape
    return float((1.0 + np.sqrt(channels * CELLS_PER_VALUE / cells)) ** 2)
