r"""Correlation of a cell of the map with the noise floor that is estimated from the same map.

The floor F at a cell is a median over cells that include the cell itself, S, and neighbours that
read the same bins. F therefore rises with S, and fewer cells cross a threshold above F than above
the true floor. With the correlation ρ between cells and the cells' weights w in the floor,

.. math:: C = \frac{\mathrm{cov}(S, F)}{\mathrm{var}\,S} = \sum_j w_j \rho_{0j}, \qquad
          V = \frac{\mathrm{var}\,F}{\mathrm{var}\,S} = \sum_{jl} w_j w_l \arcsin\rho_{jl}

for normal variables. The arcsine stands in V because a median depends on the cells' signs about it,
and the covariance of two signs is proportional to the arcsine of ρ.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from polychirp.axes import FloatArray
from polychirp.receiver.detection.range_rate_map import cosine_sum
from polychirp.receiver.signal_model.spectral_fit import BINS_PER_CELL

MOST_RAMPS_USED = 4
"""Greatest number of ramps, evenly spread over the frame, from which C and V are computed. Chosen:
all ramps would change the threshold by less than 0.001 nepers."""

CORRELATION_REACH = 3
"""Distance in resolution cells beyond which the correlation of noise is taken as zero, because
`log_correlation` is below 0.001 there."""


class FloorCorrelation(NamedTuple):
    """Covariance C of floor and cell, and the floor's variance V, both over the cell's variance."""

    covariance: float
    variance: float


def log_correlation(cells: FloatArray) -> FloatArray:
    r"""Correlation of ln(power) of noise at distances in resolution cells, under Hann's window.

    The correlation μ of the complex amplitudes is the transform of the window's square. The powers
    are exponential variables; their logarithms have the covariance :math:`\mathrm{Li}_2(\mu^2)`
    and each the variance π²/6.

    >>> log_correlation(np.array([0.0, 0.5, 1.0, 2.0])).round(2)
    array([1.  , 0.68, 0.31, 0.02])
    """
    from scipy.special import spence

    amplitude = cosine_sum(np.asarray(cells), (3 / 8, -1 / 4, 1 / 16)) / (3 / 8)
    return np.asarray(spence(1.0 - np.minimum(amplitude**2, 1.0)) * 6.0 / np.pi**2)


def floor_correlation(
    place: FloatArray, step: FloatArray, *, sampled: int, block: int
) -> FloorCorrelation:
    """C and V of a floor that is a median over blocks of range, a straight line between blocks.

    Parameters
    ----------
    place : start of each row on each ramp's spectrum, range steps, ``(range_rate, ramp)``
    step : bins per range step, ``(ramp,)``
    sampled : number of rows from one row that the floor is estimated from to the next
    block : number of range steps over which one median is taken
    """
    ramps = np.linspace(0, step.size - 1, min(MOST_RAMPS_USED, step.size)).astype(np.int64)
    chosen, pitch = place[::sampled, ramps], step[ramps]
    others = place[:: max(1, sampled - 3), ramps]  # includes rows between the chosen ones
    own, both = _lag_weights(block)
    covariance = _mean_correlation(others, chosen, pitch, own)
    variance = _mean_correlation(chosen, chosen, pitch, both)
    lags = np.arange(-CORRELATION_REACH * BINS_PER_CELL, CORRELATION_REACH * BINS_PER_CELL + 1)
    same_row = np.mean(np.interp(np.abs(np.outer(pitch, lags)) / BINS_PER_CELL, *_table()), axis=0)
    bent = (np.arcsin(np.minimum(same_row, 1.0)) - same_row) @ both[lags + both.size // 2]
    return FloorCorrelation(covariance, float(variance + bent / len(chosen)))


@lru_cache(maxsize=4)
def _lag_weights(block: int) -> tuple[FloatArray, FloatArray]:
    """Mean weights of cells in the floor, by distance along range: ``(lag,)`` from −3 blocks on.

    First those of a cell at a distance from the floor's own cell, then those of pairs of cells at a
    distance from each other, both averaged over the floor's position in its block.
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
    """Sum of correlations weighted by lag along range, averaged over pairs of rows and ramps."""
    apart = some[:, None] - others  # range steps; (row, other row, ramp)
    nearest = np.rint(apart).astype(np.int64)
    reach = int(np.ceil(CORRELATION_REACH * BINS_PER_CELL / np.min(np.abs(pitch))))
    offset = np.arange(-reach, reach + 1)
    lag = nearest[..., None] + offset
    distance = (lag - apart[..., None]) * pitch[:, None] / BINS_PER_CELL
    middle = weight.size // 2
    known = np.where(np.abs(lag) <= middle, weight[np.clip(lag + middle, 0, weight.size - 1)], 0.0)
    correlation = np.interp(np.abs(distance), *_table(), right=0.0)
    return float(np.mean(np.sum(known * correlation, axis=-1)))


@lru_cache(maxsize=1)
def _table() -> tuple[FloatArray, FloatArray]:
    cells = np.linspace(0.0, CORRELATION_REACH, 64 * CORRELATION_REACH + 1)
    return cells, log_correlation(cells)
