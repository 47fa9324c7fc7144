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

import itertools
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.receiver.coherent.coherent_map import GREATEST_OF_NOISE, range_floors
from polychirp.receiver.coherent.least_squares import mixed
from polychirp.receiver.coherent.noise import medians
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
        place, _ = profiles.places(seen, rates)
        size = total_weights(profiles.weight, place, axes.range.size)
        scale = 1.0 / np.sqrt(size).astype(np.float64)
        real, imag = profiles.sums(seen, rates)
        sums = np.empty(real.shape, dtype=np.complex128)
        np.multiply(real, scale, out=sums.real)
        np.multiply(imag, scale, out=sums.imag)
        power = np.asarray(sum(map(_squares, sums)))
        number = max(1, axes.range.size // BAND)
        band = np.arange(axes.range.size) * number // axes.range.size
        begin = np.searchsorted(band, np.arange(number + 1))
        bands = [slice(*ends) for ends in itertools.pairwise(begin)]
        return cls(
            axes=axes,
            band=band,
            floor=range_floors(power.astype(np.float32), len(sums)),
            whitening=np.stack([_whitening(sums[:, :, one], power[:, one]) for one in bands]),
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


def _squares(value: ComplexArray) -> FloatArray:
    """Squares of the magnitudes, which take less time than those of `numpy.abs`."""
    return np.asarray(value.real**2 + value.imag**2)


def _whitening(cells: ComplexArray, power: FloatArray) -> ComplexArray:
    """Matrix that makes cells ``(channel, rate, range)`` white that are so in the mean.

    Powers along the eigenvectors are medians, which the cells of points do not raise. They are
    relative to a floor that is the median of the channels' sum, ``power`` ``(rate, range)``, as if
    they were white.
    """
    from scipy.special import gammaincinv

    channels = len(cells)
    cells, total = cells.reshape(channels, -1), power.ravel()
    middle = float(medians(total))
    if channels == 1 or middle <= 0.0:
        return np.eye(channels, dtype=np.complex128)
    is_noise = total <= GREATEST_OF_NOISE * middle
    value, vector = np.linalg.eigh((cells * is_noise) @ cells.conj().T)
    spread = LEAST_SPREAD * _greatest_of_white(channels, int(np.count_nonzero(is_noise)))
    if value[-1] <= spread * value.mean():
        return np.eye(channels, dtype=np.complex128)
    powers = medians(_squares(vector.conj().T @ cells)) / np.log(2.0)
    powers /= middle / gammaincinv(channels, 0.5)
    least = np.finfo(np.float64).tiny
    return np.asarray(vector.conj().T / np.sqrt(np.maximum(powers, least))[:, None])


def _greatest_of_white(channels: int, cells: int) -> float:
    """Greatest eigenvalue, over the mean, of the channels' covariance over so many white cells.

    The law of Marchenko and Pastur (1967), for many channels and cells.
    """
    return float((1.0 + np.sqrt(channels * CELLS_PER_VALUE / cells)) ** 2)
