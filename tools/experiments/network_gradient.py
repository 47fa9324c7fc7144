"""Gradient of a complex network's loss by its weights, and steps of Adam, in NumPy.

The gradient of a real loss L by a complex weight w is ∂L/∂(Re w) + j ∂L/∂(Im w).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.receiver.mitigation.network_layers import (
    LEAST_MODULUS,
    OFFSETS,
    SPREADS,
    Network,
    neighbours,
    shrunk,
)

DECAYS: Final = (0.9, 0.999)
"""Decays of Adam's means of gradients and of their squares (Kingma and Ba 2015)."""


def loss_and_gradient(
    network: Network, planes: ComplexArray, kept: FloatArray, weight: FloatArray
) -> tuple[float, Network]:
    """Weighted cross-entropy of the cells, and its gradient.

    Parameters
    ----------
    planes : ``(plane, frequency, slice)``
    kept : share of each cell that should be kept, 0 … 1
    weight : weight of each cell
    """
    x = planes[None]
    inputs, sums = [], []
    for n, (kernel, spread) in enumerate(zip(network.kernels, SPREADS, strict=True)):
        columns = _columns(x, spread)
        z = (_flat(kernel) @ columns).reshape(-1, *planes.shape)
        inputs.append(columns)
        sums.append(z)
        x = shrunk(z, network.biases[n]) if n < len(network.biases) else z
    modulus = np.abs(sums[-1])
    columns = _columns(modulus, 1)
    logit = (_flat(network.readout) @ columns).reshape(planes.shape) + network.offset
    share = weight / weight.sum()
    loss = float(np.sum(share * (np.logaddexp(0.0, logit) - kept * logit)))

    slope = (share * (1.0 / (1.0 + np.exp(-logit)) - kept))[None].astype(modulus.dtype)
    readout = (slope.reshape(1, -1) @ columns.T).reshape(network.readout.shape)
    back = _spread_back(network.readout, slope, 1)
    slope_z = back * sums[-1] / np.maximum(modulus, LEAST_MODULUS)
    kernels, biases = [], []
    for n in reversed(range(len(SPREADS))):
        if n < len(network.biases):
            slope_z, bias = _through_shrinking(slope_z, sums[n], network.biases[n])
            biases.append(bias)
        flat = slope_z.reshape(len(slope_z), -1)
        kernels.append((flat @ inputs[n].conj().T).reshape(network.kernels[n].shape))
        if n:
            slope_z = _spread_back(network.kernels[n], slope_z, SPREADS[n])
    gradient = Network(
        tuple(reversed(kernels)),
        tuple(reversed(biases)),
        readout,
        slope.sum(keepdims=True)[0, 0, 0],
    )
    return loss, gradient


class Adam:
    """Steps of Adam (Kingma and Ba 2015)."""

    def __init__(self, network: Network) -> None:
        self._mean = [np.zeros_like(part) for part in parts_of(network)]
        self._square = [np.zeros(part.shape) for part in parts_of(network)]
        self._steps = 0

    def step(self, network: Network, gradient: Network, rate: float) -> Network:
        """The network after a step of this rate."""
        self._steps += 1
        out = []
        for n, (part, slope) in enumerate(zip(parts_of(network), parts_of(gradient), strict=True)):
            first, second = DECAYS
            self._mean[n] = first * self._mean[n] + (1.0 - first) * slope
            self._square[n] = second * self._square[n] + (1.0 - second) * np.abs(slope) ** 2
            mean = self._mean[n] / (1.0 - first**self._steps)
            square = self._square[n] / (1.0 - second**self._steps)
            out.append((part - rate * mean / (np.sqrt(square) + 1e-8)).astype(part.dtype))
        return of_parts(out)


def parts_of(network: Network) -> list[np.ndarray]:
    """All arrays of weights."""
    return [*network.kernels, *network.biases, network.readout, network.offset]


def of_parts(parts: list[np.ndarray]) -> Network:
    """The network of the arrays that `parts_of` gives."""
    count = len(SPREADS)
    return Network(tuple(parts[:count]), tuple(parts[count:-2]), parts[-2], parts[-1])


def _through_shrinking(
    slope: ComplexArray, z: ComplexArray, bias: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """Gradients by z and the bias from that by the modReLU of z."""
    modulus = np.maximum(np.abs(z), LEAST_MODULUS)
    beside = bias.reshape(-1, *(1,) * (z.ndim - 1))
    is_on = modulus + beside > 0.0
    along = np.where(is_on, (slope.conj() * z).real / modulus, 0.0)
    by_z = np.where(is_on, slope * (1.0 + beside / modulus), 0.0)
    by_z = by_z - beside * along / modulus**2 * z
    return by_z.astype(z.dtype), along.reshape(len(z), -1).sum(axis=1)


def _spread_back(kernel: np.ndarray, slope: np.ndarray, spread: int) -> np.ndarray:
    """Gradient by the input of a convolution from that by its output."""
    flat = _flat(kernel).conj().T @ slope.reshape(len(slope), -1)
    columns = flat.reshape(-1, len(OFFSETS), *slope.shape[1:])
    slices = slope.shape[-1]
    out = np.zeros_like(columns[:, 0])
    for n, (row, late) in enumerate(OFFSETS):
        shift = late * spread
        first, last = max(0, -shift), min(slices, slices - shift)
        if first < last:
            turned = np.roll(columns[:, n], row, axis=-2)
            out[..., first + shift : last + shift] += turned[..., first:last]
    return np.asarray(out)


def _columns(x: np.ndarray, spread: int) -> np.ndarray:
    return np.asarray(neighbours(x, spread).reshape(len(x) * len(OFFSETS), -1))


def _flat(kernel: np.ndarray) -> np.ndarray:
    return np.asarray(kernel.reshape(len(kernel), -1))
