"""Thresholds over the median of a row of overlapping slices, for a false-alarm probability."""

from functools import lru_cache
from typing import Final

import numpy as np

from polychirp.axes import FloatArray

SLICES_PER_DRAW: Final = 2.39
"""Slices that count as one independent draw of a row's median.

Fitted to drawn rows (tests/statistics/test_excision_thresholds.py): Hann windows an eighth of their
length apart, 25 to 249 slices, 1 to 12 looks, probabilities from 1e-2 to 1e-6. At twice the value,
rows of 57 slices and four looks exceed a threshold of 1e-5 at 0.4 times the stated rate, at half of
it at 1.7 times."""

DRAWS_BELOW: Final = 1.2
DRAWS_ABOVE: Final = 1.95
"""Draws below and above the median, of a row without slices and for a cell without neighbours;
fitted with `SLICES_PER_DRAW`."""

NEIGHBOURS: Final = 3
"""Slices on either side that are high together with a cell: their windows share 38 % of their
energy or more with the cell's. Those four hops away share 17 %."""

DRAWS_PER_NEIGHBOUR: Final = 0.437
"""Draws above the median that a neighbour takes away; fitted with `SLICES_PER_DRAW`. Independent
slices would take away one half each."""


def median_factors(slices: int, looks: FloatArray, *, probability: float) -> FloatArray:
    r"""Multiples of each row's median that a cell of noise exceeds, ``(row, slice)``.

    .. math:: P = E\left[Q_M\left(\alpha\,Q_M^{-1}(1 - u)\right)\right], \qquad
              u \sim \mathrm{Beta}(a, b)

    with the tail :math:`Q_M` of the Gamma distribution of M looks, as of an ordered statistic of
    independent cells (Rohling 1983; `ordered_statistic_factor`). There a and b are the numbers of
    draws up to the statistic and above it. Slices that overlap are fewer draws than slices, and a
    cell that is high lifts its neighbours above the median, so that the median is a higher quantile
    of the others:

    .. math:: a = \frac{n}{2 g} + a_0, \qquad b = \frac{n}{2 g} + b_0 - b_1 m

    for n slices of which m are neighbours of the cell. The constants are g =
    `SLICES_PER_DRAW`, a₀ = `DRAWS_BELOW`, b₀ = `DRAWS_ABOVE` and b₁ = `DRAWS_PER_NEIGHBOUR`. A
    whole number of independent slices, as many as give the mean power's variance, was tried first:
    noise then exceeded the thresholds 0.15 to 4.6 times as often as stated.

    Parameters
    ----------
    slices : n, number of slices in a row, each an eighth of a Hann window from the next one
    looks : M, number of independent looks in a cell of each row, ``(row,)``

    Examples
    --------
    >>> median_factors(249, np.array([1.0, 4.0]), probability=1e-5)[:, 100].round(1)
    array([18. ,  5.2])
    """
    place = np.arange(slices)
    near = np.minimum(place, NEIGHBOURS) + np.minimum(place[::-1], NEIGHBOURS)
    counts, of_slice = np.unique(near, return_inverse=True)
    kinds, of_row = np.unique(looks, return_inverse=True)
    table = [
        [_factor(slices, neighbours, kind, probability) for neighbours in counts.tolist()]
        for kind in kinds.tolist()
    ]
    return np.array(table)[of_row.reshape(-1)[:, None], of_slice.reshape(-1)]


@lru_cache(maxsize=4096)
def _factor(slices: int, neighbours: int, looks: float, probability: float) -> float:
    """Multiple of the median for a cell with so many neighbours; see `median_factors`."""
    from scipy.optimize import brentq
    from scipy.special import gammaincc, gammainccinv, gammaincinv, roots_jacobi

    half = 0.5 * slices / SLICES_PER_DRAW
    below, above = half + DRAWS_BELOW, half + DRAWS_ABOVE - DRAWS_PER_NEIGHBOUR * neighbours
    node, weight = roots_jacobi(60, above - 1.0, below - 1.0)
    median = gammaincinv(looks, 0.5 * (1.0 + node))
    weight = weight / weight.sum()

    def excess(level: float) -> float:
        tail = float(weight @ gammaincc(looks, np.exp(level) * median))
        return float(np.log(max(tail, 1e-300) / probability))

    known = float(np.log(gammainccinv(looks, probability) / gammaincinv(looks, 0.5)))
    lowest, highest = known - 2.0, known + 1.0
    while excess(highest) > 0.0:
        highest += 1.0
    return float(np.exp(brentq(excess, lowest, highest, xtol=1e-9)))
