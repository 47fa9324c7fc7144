r"""Layers of a small complex network on the time-frequency planes of ramps.

Three layers convolve by complex kernels of 3×3 cells. After the first two a bias b shrinks or
raises moduli and keeps phases (modReLU; Arjovsky, Shah and Bengio 2016),

.. math:: z \leftarrow \frac{z}{|z|} \max(|z| + b, 0),

and after the third a real kernel adds up the moduli of all channels. A common phase of the samples
therefore does not change the result. Frequencies are a ring; beyond the first and last slice there
are zeros.
"""

from typing import Final, NamedTuple

import numpy as np

from polychirp.axes import ComplexArray, FloatArray

SPREADS: Final = (1, 2, 4)
"""Distance in slices between the cells of each layer's kernel. Chosen: the network then sees 8
slices on either side, over which the beat of a nearly parallel chirp moves by some cells."""

OFFSETS: Final = tuple((row, late) for row in (-1, 0, 1) for late in (-1, 0, 1))
"""Cells of a kernel, in rows and slices from its middle."""

LEAST_MODULUS: Final = 1e-12
"""Modulus below which a cell has no phase."""


class Network(NamedTuple):
    """Weights of a network, in 32 bits or in 64.

    kernels : of the three layers, each ``(out, in, 9)``, in the order of `OFFSETS`
    biases : of the moduli after the first two layers, each ``(out,)``
    readout : real kernel of the moduli after the third layer, ``(1, in, 9)``
    offset : constant of the result, ``(1,)``
    """

    kernels: tuple[np.ndarray, ...]
    biases: tuple[np.ndarray, ...]
    readout: np.ndarray
    offset: np.ndarray

    @property
    def num_weights(self) -> int:
        """Number of real weights."""
        real = sum(bias.size for bias in self.biases) + self.readout.size + self.offset.size
        return int(2 * sum(kernel.size for kernel in self.kernels) + real)


def logits(network: Network, planes: ComplexArray) -> FloatArray:
    """Logits of the share of each cell that is kept, ``(plane, frequency, slice)`` as ``planes``.

    Examples
    --------
    >>> kernels = (np.ones((2, 1, 9)) + 0j, np.ones((2, 2, 9)) + 0j, np.ones((1, 2, 9)) + 0j)
    >>> network = Network(kernels, (np.zeros(2), np.zeros(2)), np.zeros((1, 1, 9)), np.array([3.0]))
    >>> network.num_weights
    158
    >>> float(logits(network, np.ones((1, 4, 6)) + 0j).max())
    3.0
    """
    x = planes[None]
    for kernel, spread, bias in zip(network.kernels, SPREADS, (*network.biases, None), strict=True):
        z = convolved(x, kernel, spread)
        x = z if bias is None else shrunk(z, bias)
    return np.asarray(convolved(np.abs(x), network.readout, 1)[0] + network.offset)


def convolved(x: np.ndarray, kernel: np.ndarray, spread: int) -> np.ndarray:
    """Convolution of ``(in, plane, frequency, slice)`` by a kernel, over ``(out, …)``."""
    columns = neighbours(x, spread)
    flat = columns.reshape(columns.shape[0] * len(OFFSETS), -1)
    return np.asarray((kernel.reshape(len(kernel), -1) @ flat).reshape(-1, *x.shape[1:]))


def neighbours(x: np.ndarray, spread: int) -> np.ndarray:
    """Cells at all `OFFSETS` from each cell, ``(in, 9, plane, frequency, slice)``."""
    slices = x.shape[-1]
    out = np.zeros((len(x), len(OFFSETS), *x.shape[1:]), dtype=x.dtype)
    for n, (row, late) in enumerate(OFFSETS):
        shift = late * spread
        first, last = max(0, -shift), min(slices, slices - shift)
        if first < last:
            turned = np.roll(x, -row, axis=-2)
            out[:, n, ..., first:last] = turned[..., first + shift : last + shift]
    return out


def shrunk(z: ComplexArray, bias: FloatArray) -> ComplexArray:
    """The modReLU of ``(channel, …)`` with a bias of each channel."""
    modulus = np.maximum(np.abs(z), LEAST_MODULUS)
    return np.asarray(z * np.maximum(1.0 + _beside(bias, z) / modulus, 0.0).astype(modulus.dtype))


def _beside(bias: FloatArray, z: ComplexArray) -> FloatArray:
    return bias.reshape(-1, *(1,) * (z.ndim - 1))
