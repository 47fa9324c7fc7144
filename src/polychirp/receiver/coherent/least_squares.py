"""Amplitudes that fit best, and values on white channels."""

from dataclasses import replace

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.receiver.angle.doa import ESTIMATORS
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import groups_of
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas, products
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.solutions import REGULARISATION


def fitted(seen: Observation, residual: Residual, points: Points) -> Points:
    """New points, of which the residual has none, with the amplitudes and azimuths that fit best.

    Those that overlap are fitted together.
    """
    here = Replicas.of(seen, points)
    matched = here.matched(residual.sums(seen, here)).sum(axis=-1)
    amplitude, size = points.amplitude.copy(), np.ones(len(points))
    for own in groups_of(seen, here):
        inverse = inverse_of(products(seen, here[own])[0].sum(axis=-1))
        amplitude[own] = inverse @ matched[own]
        size[own] = np.diagonal(inverse).real
    power = np.sum(np.abs(mixed(seen, amplitude)) ** 2, axis=1)
    power = power / np.maximum(size, 1e-300) / points.floor
    return replace(points, amplitude=amplitude, power=power, sine=sines(seen, amplitude))


def mixed(seen: Observation, value: ComplexArray) -> ComplexArray:
    """Values ``(point, channel, …)`` on channels whose noise is white."""
    return np.asarray(np.einsum("ab,pb...->pa...", seen.mixing, value))


def sines(seen: Observation, amplitude: ComplexArray) -> FloatArray:
    """Sines of the azimuths to which most power of ``amplitude`` ``(point, channel)`` belongs."""
    channel_y = seen.model.channel_y
    if channel_y.size < 2:
        return np.zeros(len(amplitude))
    spacing = float(channel_y[1] - channel_y[0]) * float(seen.frequency.mean()) / SPEED_OF_LIGHT
    return ESTIMATORS["bartlett"](amplitude[:, :, None], spacing=spacing)


def inverse_of(gram: ComplexArray) -> ComplexArray:
    """Inverse of a Gram matrix, slightly regularised."""
    scale = 1.0 / np.sqrt(np.maximum(np.diagonal(gram).real, 1e-300))
    outer = np.outer(scale, scale)
    return np.asarray(np.linalg.inv(gram * outer + REGULARISATION * np.eye(len(gram))) * outer)
