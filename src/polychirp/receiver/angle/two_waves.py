r"""Two plane waves in one snapshot of a line of elements, against one: maximum likelihood.

With unit noise per element, the snapshot β is explained by waves of the sines :math:`u_1, u_2` up
to the power :math:`\beta^H P\,\beta`, where P projects onto the two steering vectors. Two waves
have three more real parameters than one.
"""

import math
from dataclasses import dataclass

import numpy as np

from polychirp.axes import ComplexArray, FloatArray

FALSE_PAIR_PROBABILITY = 1e-4
"""Probability with which noise makes two waves of one; chosen."""

LEAST_POWER_RATIO = 0.01
"""Least power of the weaker wave over that of the stronger one; chosen: errors of a model that a
strong wave leaves are below."""

LEAST_SEPARATION = 0.4
"""Least difference of the sines, in cells 1/(M d/λ) of the line of M elements; chosen: nearer waves
of opposite phases fit any small error of one wave."""

FEWEST_ELEMENTS = 4
"""Number of elements from which two waves leave something unexplained."""

GRID_PER_CELL = 8
"""Number of sines per cell that are tried first; chosen below the width of a beam."""

ZOOMS = 6
"""Number of refinements, each by three, of the best pair of sines; chosen: to 1e-3 of a cell."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TwoWaves:
    """Sines of the azimuths and amplitudes of two waves, ``(2,)`` each, strongest first."""

    sine: FloatArray
    amplitude: ComplexArray


def two_waves(snapshot: ComplexArray, *, spacing: float) -> TwoWaves | None:
    """The two waves in a snapshot ``(element,)`` of unit noise power, or None if it has one.

    Parameters
    ----------
    spacing : distance of neighbouring elements, in wavelengths

    Examples
    --------
    >>> element = np.arange(4)
    >>> wave = lambda sine: np.exp(-1j * np.pi * element * sine)
    >>> found = two_waves(30 * wave(0.1) + 20j * wave(-0.5), spacing=0.5)
    >>> found.sine.round(2), np.abs(found.amplitude).round(0)
    (array([ 0.1, -0.5]), array([30., 20.]))
    >>> two_waves(30 * wave(0.1) + 0.5, spacing=0.5) is None
    True
    """
    count = snapshot.size
    if count < FEWEST_ELEMENTS:
        return None
    cell = 1.0 / (count * spacing)
    widest = min(1.0, 0.5 / spacing)
    sines = np.linspace(-widest, widest, 2 * math.ceil(widest / cell * GRID_PER_CELL) + 1)
    alone = _explained_by_one(snapshot, sines, spacing)
    # two waves explain no more than all power
    least = alone - math.log(FALSE_PAIR_PROBABILITY / count)
    if float(np.sum(np.abs(snapshot) ** 2)) < least:
        return None
    pairs = np.stack(np.meshgrid(sines, sines, indexing="ij"), axis=-1).reshape(-1, 2)
    pairs = pairs[pairs[:, 1] - pairs[:, 0] >= LEAST_SEPARATION * cell]
    best = _best(snapshot, pairs, spacing)
    offsets = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 2)
    step = sines[1] - sines[0]
    for _ in range(ZOOMS):
        step /= 3.0
        best = _best(snapshot, best + step * offsets, spacing)
    together, amplitude = _explained(snapshot, best[None], spacing)
    if together[0] < least:
        return None
    order = np.argsort(-np.abs(amplitude[0]))
    strong, weak = np.abs(amplitude[0, order]) ** 2
    if weak < LEAST_POWER_RATIO * strong:
        return None
    return TwoWaves(sine=best[order], amplitude=amplitude[0, order])


def _explained_by_one(snapshot: ComplexArray, sines: FloatArray, spacing: float) -> float:
    """Power that one wave explains, whose sine is refined from the best of evenly spaced ones."""
    step, near, power = sines[1] - sines[0], sines, np.zeros(0)
    for _ in range(ZOOMS + 1):
        power = np.abs(_steering(near, snapshot.size, spacing).conj() @ snapshot) ** 2
        step /= 3.0
        near = near[np.argmax(power)] + step * np.arange(-1, 2)
    return float(np.max(power) / snapshot.size)


def _steering(sines: FloatArray, count: int, spacing: float) -> ComplexArray:
    """Steering vectors ``(sine, element)``."""
    return np.asarray(np.exp(-2j * np.pi * spacing * np.outer(sines, np.arange(count))))


def _best(snapshot: ComplexArray, pairs: FloatArray, spacing: float) -> FloatArray:
    """The pair of sines, of ``(pair, 2)``, that explains most."""
    return np.asarray(pairs[np.argmax(_explained(snapshot, pairs, spacing)[0])])


def _explained(
    snapshot: ComplexArray, pairs: FloatArray, spacing: float
) -> tuple[FloatArray, ComplexArray]:
    """Power that every pair of waves explains, ``(pair,)``, and its amplitudes, ``(pair, 2)``."""
    count = snapshot.size
    first, second = (_steering(pairs[:, n], count, spacing) for n in range(2))
    x, y = first.conj() @ snapshot, second.conj() @ snapshot
    cross = np.sum(first.conj() * second, axis=1)
    determinant = np.maximum(count**2 - np.abs(cross) ** 2, 1e-9)
    a = (count * x - cross * y) / determinant
    b = (count * y - cross.conj() * x) / determinant
    return np.real(a * x.conj() + b * y.conj()), np.stack([a, b], axis=-1)
