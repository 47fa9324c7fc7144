"""Powers of the points that are found, and what each part of the samples contributes to them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from polychirp.axes import ComplexArray, FloatArray
from polychirp.receiver.coherent.least_squares import inverse_of, mixed
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.overlap import LEAST_REDUNDANCY
from polychirp.receiver.coherent.points import Points
from polychirp.receiver.coherent.replicas import Replicas, correlations, total_products
from polychirp.receiver.coherent.residual import Residual

PartPowers = Callable[[ComplexArray], FloatArray]
"""Function from samples of parts, V ``(part, channel, ramp, fast)``, to the power that each of them
contributes to each detection of a frame, W ``(detection, part)``."""


def powers(seen: Observation, points: Points) -> FloatArray:
    """Power of every point, W, a mean over channels, ``(point,)``.

    Of points that share a cell it is no more than the power that they have together, at the place
    of each: points much nearer than a cell describe a body that fades, and may nearly cancel each
    other with amplitudes far above that of the body.
    """
    here = Replicas.of(seen, points)
    gram = total_products(seen, here, here)
    is_shared = correlations(seen, here, here) > LEAST_REDUNDANCY
    together = (gram * is_shared) @ points.amplitude / np.diagonal(gram)[:, None]
    every = np.abs(np.stack([points.amplitude, together])) ** 2
    return np.asarray(np.min(every.mean(axis=2), axis=0))


def part_powers(seen: Observation, points: Points, parts: ComplexArray) -> FloatArray:
    r"""Power that each part contributes to each point, W, ``(point, part)``.

    All points are fitted to each part at once, with the weights of the ramps and on the white
    channels on which they were found, so that the amplitudes :math:`a_p` of all parts add up to the
    amplitude a of the point. A part contributes :math:`\|a\|^2\,|a_p^H a|^2/\|a\|_w^4`, with the
    product and the norm of index w taken on white channels: interference that whitening of the
    channels removes contributes nothing. If all of the amplitude comes from one part, its power is
    :math:`\|a\|^2`, the sum of the point's powers in all channels.

    Parameters
    ----------
    parts : samples of each after mitigation, V, ``(part, channel, ramp, fast)``
    """
    here = Replicas.of(seen, points)
    inverse = inverse_of(total_products(seen, here, here))
    none = Points.none(parts.shape[1])
    own = mixed(seen, points.amplitude)
    size = np.maximum(np.sum(np.abs(own) ** 2, axis=1), 1e-300)
    scale = np.sum(np.abs(points.amplitude) ** 2, axis=1) / size**2
    out = np.empty((len(points), len(parts)))
    for n, samples in enumerate(parts):
        left = Residual.of(replace(seen, samples=np.ascontiguousarray(samples)), none)
        amplitude = inverse @ here.matched(left.sums(seen, here)).sum(axis=-1)
        out[:, n] = scale * np.abs(np.sum(mixed(seen, amplitude).conj() * own, axis=1)) ** 2
    return out
