"""Phase-shift beamforming of the receiving channels."""

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray


def orthogonal_sines(num_channels: int) -> FloatArray:
    """Sines of orthogonal beams of a half-wave array, ``(beam,)``.

    The beams are symmetric about boresight, one for each channel; their noise is independent.

    >>> orthogonal_sines(4)
    array([-0.75, -0.25,  0.25,  0.75])
    """
    return (2.0 * np.arange(num_channels) - (num_channels - 1)) / num_channels


def steering(
    array: AntennaArray, *, frequency: float, sine: FloatArray, rise: FloatArray | None = None
) -> ComplexArray:
    r"""Weights ``(beam, channel)`` that add up waves in phase.

    An element at y to the left and z up receives a wave of the direction cosines u to the left and
    w up earlier by :math:`(yu + zw)/c`. In :math:`s_{tx}\overline{s_{rx}}` its beat therefore has
    the phase :math:`-2\pi f\,(yu + zw)/c`, which the weight removes. Each row has unit norm, so
    that the noise power of a beam is that of a channel.

    Parameters
    ----------
    frequency : Hz
    sine : u, ``(beam,)``; the sine of the azimuth if the elevation is zero
    rise : w, ``(beam,)``, the sine of the elevation; by default zero
    """
    delays = np.outer(sine, array.position[:, 1])
    if rise is not None:
        delays += np.outer(rise, array.position[:, 2])
    cycles = frequency / SPEED_OF_LIGHT * delays
    return np.asarray(np.exp(2j * np.pi * cycles) / np.sqrt(array.num_channels))


def beamform(samples: ComplexArray, weights: ComplexArray) -> ComplexArray:
    """Beams ``(beam, ramp, fast)`` of channels ``(channel, ramp, fast)``.

    The sum runs channel by channel, as the rounding of a matrix product depends on the number of
    threads.
    """
    beams = weights[:, 0, None, None] * samples[0]
    for channel in range(1, samples.shape[0]):
        beams += weights[:, channel, None, None] * samples[channel]
    return np.asarray(beams)
