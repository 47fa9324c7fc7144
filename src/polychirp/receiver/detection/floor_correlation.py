r"""How far a floor that is read from the map follows the map, and what that does to a threshold.

The floor under a cell is a median over cells among which it is itself, and neighbours that read
the same bins. It rises where the cell does, and fewer cells cross a threshold above it than above
the true floor. With the correlation ρ between cells and weights w that the floor gives to them,

.. math:: C = \frac{\mathrm{cov}(S, F)}{\mathrm{var}\,S} = \sum_j w_j \rho_{0j}, \qquad
          V = \frac{\mathrm{var}\,F}{\mathrm{var}\,S} = \sum_{jl} w_j w_l \arcsin\rho_{jl}

for normal variables: the arcsine is of the covariance of signs, of which a median is the mean.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from polychirp.axes import FloatArray
from polychirp.receiver.detection.range_rate_map import cosine_sum
from polychirp.receiver.signal_model.spectral_fit import BINS

RAMPS = 4
"""Of the frame, evenly spread: all of them give the same threshold to 0.001 nepers."""

FARTHEST = 3
"""Resolution cells at which noise no longer correlates: below 0.001."""


def log_correlation(cells: FloatArray) -> FloatArray:
    r"""Correlation of ln(power) of noise at distances in resolution cells, under Hann's window.

    The amplitudes' correlation μ is the transform of the window's square; exponential variables
    with it have the covariance of logarithms :math:`\mathrm{Li}_2(\mu^2)`, against π²/6 of each.

    >>> log_correlation(np.array([0.0, 0.5, 1.0, 2.0])).round(2)
    array([1.  , 0.68, 0.31, 0.02])
    """
    from scipy.special import spence

    amplitude = cosine_sum(np.asarray(cells), (3 / 8, -1 / 4, 1 / 16)) / (3 / 8)
    return np.asarray(spence(1.0 - np.minimum(amplitude**2, 1.0)) * 6.0 / np.pi**2)


def following(
    place: FloatArray, step: FloatArray, *, sampled: int, block: int
) -> tuple[float, float]:
    """Covariance C of a floor with its cell, and its variance V, in variances of a cell.

    Parameters
    ----------
    place : where each row begins on each ramp's spectrum, range steps, ``(range_rate, ramp)``
    step : bins per range step, ``(ramp,)``
    sampled : the floor is read from every so many rows
    block : range steps that a median is taken over
    """
    ramps = np.linspace(0, step.size - 1, min(RAMPS, step.size)).astype(np.int64)
    chosen, pitch = place[::sampled, ramps], step[ramps]
    others = place[:: max(1, sampled - 3), ramps]  # rows between those as well
    own, both = _lag_weights(block)
    covariance = _mean_correlation(others, chosen, pitch, own)
    variance = _mean_correlation(chosen, chosen, pitch, both)
    lags = np.arange(-FARTHEST * BINS, FARTHEST * BINS + 1)
    same_row = np.mean(np.interp(np.abs(np.outer(pitch, lags)) / BINS, *_table()), axis=0)
    bent = (np.arcsin(np.minimum(same_row, 1.0)) - same_row) @ both[lags + both.size // 2]
    return covariance, float(variance + bent / len(chosen))


@lru_cache(maxsize=4)
def _lag_weights(block: int) -> tuple[FloatArray, FloatArray]:
    """Means over a block's cells of the weights that the floor gives, by distance along range.

    To cells at a distance from the cell itself, and to pairs at a distance from each other. Between
    the middles of two blocks the floor is a straight line. ``(lag,)`` each, from −3 blocks on.
    """
    cell = np.arange(block)
    toward = (cell - 0.5 * (block - 1)) / block
    share = np.stack([np.maximum(-toward, 0.0), 1.0 - np.abs(toward), np.maximum(toward, 0.0)])
    weight = np.repeat(share.T, block, axis=1) / block  # (cell, three blocks' cells)
    own, both = np.zeros(6 * block + 1), np.zeros(6 * block + 1)
    for c in cell:
        own[3 * block + np.arange(3 * block) - block - c] += weight[c] / block
        both[1:-1] += np.correlate(weight[c], weight[c], mode="full") / block
    return own, both


def _mean_correlation(
    some: FloatArray, others: FloatArray, pitch: FloatArray, weight: FloatArray
) -> float:
    """Weighted by distance along range, mean over rows and ramps."""
    apart = some[:, None] - others  # range steps; (row, other row, ramp)
    nearest = np.rint(apart).astype(np.int64)
    reach = int(np.ceil(FARTHEST * BINS / np.min(np.abs(pitch))))
    offset = np.arange(-reach, reach + 1)
    lag = nearest[..., None] + offset
    distance = (lag - apart[..., None]) * pitch[:, None] / BINS
    middle = weight.size // 2
    known = np.where(np.abs(lag) <= middle, weight[np.clip(lag + middle, 0, weight.size - 1)], 0.0)
    correlation = np.interp(np.abs(distance), *_table(), right=0.0)
    return float(np.mean(np.sum(known * correlation, axis=-1)))


@lru_cache(maxsize=1)
def _table() -> tuple[FloatArray, FloatArray]:
    cells = np.linspace(0.0, FARTHEST, 64 * FARTHEST + 1)
    return cells, log_correlation(cells)
