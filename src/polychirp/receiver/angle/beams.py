r"""Beams over both direction cosines: Bartlett's and Capon's estimators for elements anywhere.

Both maximise :math:`\sum_r |a(u, w)^H f_r|^2` with factors :math:`f_r` made of the snapshots: first
on a grid, then by Newton's method.

**Bartlett:** the factors are the snapshots, and the sum is the beam's mean power. For one wave in
white noise its maximum is the maximum-likelihood estimate.

**Capon** (1969) maximises :math:`1/(a^H R^{-1} a)`. With the eigenvalues λ and eigenvectors v of
the snapshots' covariance and the diagonal loading ε,

.. math:: \varepsilon\,a^H (R + \varepsilon I)^{-1} a
          = a^H a - \sum_r \frac{\lambda_r}{\lambda_r + \varepsilon} |a^H v_r|^2,

so that the factors are :math:`\sqrt{\lambda_r/(\lambda_r + \varepsilon)}\,v_r`. Of one snapshot,
both have the same maximum. With more snapshots but fewer than channels, eigenvectors of noise have
the weight of a wave's, and the errors of Capon's maximum do not shrink with the SNR.
"""

import math
from typing import NamedTuple

import numpy as np

from polychirp.axes import BoolArray, ComplexArray, FloatArray, IntArray
from polychirp.receiver.angle.elements import Elements

POINTS_PER_CELL = 8
"""Grid points per cell 1/extent of the array along an axis. Chosen: between four of them, the beam
of a wave is weaker by 0.1 dB at most."""

LOADING = 1e-6
"""Diagonal loading of Capon's covariance over its mean eigenvalue; chosen as in `doa.capon`."""

NEWTON_STEPS = 6
"""Steps of Newton's method from the best grid point; chosen: four reach the rounding errors."""


MOST_TERMS = 100_000_000
"""Greatest number of points of `grid` times that of channels; chosen: a second per detection."""


class Grid(NamedTuple):
    """Direction cosines to the left and up, ``(left,)`` and ``(up,)``; one zero without extent."""

    left: FloatArray
    up: FloatArray


def grid_size(elements: Elements, *, reach: float = 1.0) -> tuple[int, int]:
    """Number of points of `grid` along both axes."""
    count = 2 * np.ceil(reach * POINTS_PER_CELL * elements.extent).astype(np.int64) + 1
    left, up = (int(count[n]) if n in elements.axes else 1 for n in range(2))
    return left, up


def grid(elements: Elements, *, reach: float = 1.0) -> Grid:
    """Direction cosines from −``reach`` to ``reach``, `POINTS_PER_CELL` to a cell of the array."""
    left, up = (
        reach * np.linspace(-1.0, 1.0, count) if count > 1 else np.zeros(1)
        for count in grid_size(elements, reach=reach)
    )
    return Grid(left, up)


def too_large(elements: Elements) -> str:
    """Sentence that says that an array needs more than `MOST_TERMS`; empty if it does not."""
    beams, channels = math.prod(grid_size(elements)), len(elements.place)
    if beams * channels <= MOST_TERMS:
        return ""
    width, height = elements.extent
    return (
        f"its {channels} virtual elements span {width:.4g} by {height:.4g} wavelengths, and sums "
        f"over them for {beams} beams take too long; use fewer elements, or bring them together"
    )


def beam_power(factor: ComplexArray, elements: Elements, points: Grid) -> FloatArray:
    """Sum over factors of |aᴴf|², ``(left, up)``, of ``factor`` ``(channel, factor)``."""
    left = np.exp(2j * np.pi * np.outer(points.left, elements.place[:, 0]))
    up = np.exp(2j * np.pi * np.outer(elements.place[:, 1], points.up))
    beams = left @ (factor.T[:, :, None] * up)
    return np.asarray(np.sum(np.abs(beams) ** 2, axis=0))


def capon_factors(snapshots: ComplexArray) -> ComplexArray:
    """Factors ``(detection, channel, factor)`` of Capon's beams, of ``(detection, channel, …)``."""
    vectors, singular, _ = np.linalg.svd(snapshots, full_matrices=False)
    power = singular**2
    load = LOADING * np.sum(power, axis=-1, keepdims=True) / snapshots.shape[1] + 1e-300
    return np.asarray(vectors * np.sqrt(power / (power + load))[:, None])


def strongest_directions(
    factors: ComplexArray, elements: Elements, *, num_waves: int
) -> FloatArray:
    """Direction cosines of the highest maxima of the beams, ``(detection, wave, 2)``.

    Those of one detection are sorted from strong to weak; NaN if there are fewer. Cosines along an
    axis without extent are zero.
    """
    points = grid(elements)
    is_visible = _visible(points)
    start = np.full((len(factors), num_waves, 2), np.nan)
    for number, factor in enumerate(factors):
        power = np.where(is_visible, beam_power(factor, elements, points), -np.inf)
        row, column = highest(power, is_maximum(power))
        found = np.stack([points.left[row], points.up[column]], axis=-1)[:num_waves]
        start[number, : len(found)] = found
    each = np.repeat(factors, num_waves, axis=0)
    return refined(start.reshape(-1, 2), each, elements).reshape(start.shape)


def strongest_beam(amplitude: ComplexArray, elements: Elements) -> FloatArray:
    """Power of the strongest of the beams, W ``(…,)``, of amplitudes ``(…, channel)``.

    The beams are evenly spread over a period of the phases if the channels are a uniform line, and
    on the visible points of `grid` otherwise: an array in rows has equal beams at cosines that no
    wave has.
    """
    line = elements.line()
    if not elements.axes:
        return np.asarray(np.abs(amplitude.sum(axis=-1)) ** 2)
    if line is not None and line.is_uniform:
        beams = np.fft.fft(amplitude, POINTS_PER_CELL * line.steps.size, axis=-1)
        return np.asarray(np.max(np.abs(beams) ** 2, axis=-1))
    points, flat = grid(elements), amplitude.reshape(-1, amplitude.shape[-1], 1)
    is_visible = _visible(points)
    powers = [np.max(beam_power(factor, elements, points)[is_visible]) for factor in flat]
    return np.array(powers, dtype=np.float64).reshape(amplitude.shape[:-1])


def _visible(points: Grid) -> BoolArray:
    """Mask ``(left, up)`` of the direction cosines that a plane wave may have."""
    return np.asarray(points.left[:, None] ** 2 + points.up**2 <= 1.0 + 1e-9)


def highest(power: FloatArray, mask: BoolArray) -> tuple[IntArray, IntArray]:
    """Rows and columns of the points in a mask, from the greatest power to the least."""
    row, column = np.nonzero(mask)
    order = np.argsort(-power[row, column], kind="stable")
    return row[order], column[order]


def is_maximum(power: FloatArray) -> BoolArray:
    """Mask ``(left, up)`` of the finite values that no neighbour, of eight, exceeds."""
    rows, columns = power.shape
    padded = np.pad(power, 1, constant_values=-np.inf)
    around = [
        padded[i : i + rows, j : j + columns]
        for i in range(3)
        for j in range(3)
        if (i, j) != (1, 1)
    ]
    return np.asarray((power >= np.max(around, axis=0)) & np.isfinite(power))


def refined(start: FloatArray, factors: ComplexArray, elements: Elements) -> FloatArray:
    """Maxima of the beams near direction cosines ``(point, 2)``, by Newton's method.

    ``factors`` is ``(point, channel, factor)``. Where the power is not concave, the step goes
    uphill; no step is longer than a grid cell.
    """
    axes = list(elements.axes)
    if not axes or not len(start):
        return start
    place = 2.0 * np.pi * elements.place[:, axes]
    longest = 1.0 / (POINTS_PER_CELL * elements.extent[axes])
    found = start.copy()
    for _ in range(NEWTON_STEPS):
        turned = elements.steering(found).conj()[..., None] * factors
        beam = np.sum(turned, axis=1)
        first = 1j * np.einsum("mk,pmr->pkr", place, turned)
        second = -np.einsum("mk,ml,pmr->pklr", place, place, turned)
        slope = 2.0 * np.einsum("pr,pkr->pk", beam.conj(), first).real
        bend = (
            2.0
            * (
                np.einsum("pkr,plr->pkl", first.conj(), first)
                + np.einsum("pr,pklr->pkl", beam.conj(), second)
            ).real
        )
        known = np.all(np.isfinite(bend), axis=(1, 2))
        value, vector = np.linalg.eigh(bend[known])
        along = np.einsum("pkl,pk->pl", vector, slope[known])
        step = np.einsum("pkl,pl->pk", vector, along / np.maximum(np.abs(value), 1e-300))
        found[np.ix_(known, axes)] += np.clip(step, -longest, longest)
    return found
