"""Noise alone crosses a CFAR threshold as often as is stated: on exponential and Gamma cells."""

import numpy as np
import pytest
from scipy.stats import binom

from polychirp.receiver.detection.cfar import (
    CfarWindow,
    ordered_statistic,
    ordered_statistic_factor,
)

CONFIDENCE = 1 - 1e-4


def interval(trials: int, probability: float) -> tuple[float, float]:
    """Counts between which a binomial variable lies with the confidence of this file."""
    low, high = binom.interval(CONFIDENCE, trials, probability)
    return float(low), float(high)


@pytest.mark.parametrize("num_looks", [1, 8])
@pytest.mark.parametrize("num_cells", [8, 40])
@pytest.mark.parametrize("probability", [1e-2, 1e-3])
def test_a_cell_among_independent_training_cells_crosses_as_often_as_stated(
    num_looks: int, num_cells: int, probability: float
):
    """200 000 independent trials: a cell and its own training cells."""
    trials = 200_000
    random = np.random.default_rng([num_looks, num_cells, round(1 / probability)])
    cell = random.gamma(num_looks, size=trials)
    training = random.gamma(num_looks, size=(trials, num_cells))
    rank = round(0.75 * num_cells)
    options = {"false_alarm_probability": probability, "num_looks": num_looks}
    order = (
        ordered_statistic_factor(num_cells, rank, **options)
        * np.partition(training, rank - 1, axis=1)[:, rank - 1]
    )
    low, high = interval(trials, probability)
    assert low <= np.count_nonzero(cell > order) <= high


@pytest.mark.parametrize("probability", [1e-2, 1e-3])
def test_a_whole_map_of_noise_crosses_as_often_as_stated_edges_included(probability):
    """Neighbouring decisions share training cells, which widens the binomial law a little.

    Their floor, of N ≥ 63 cells, is uncertain by 1/√N, so the conditional probability of a cell
    by a factor of about 1 ± α/√N, common to about N cells; over 262 144 cells that adds less
    than a quarter of the binomial spread at 1e-2 and less at 1e-3. The interval is taken a
    quarter wider.
    """
    power = np.random.default_rng(7).exponential(size=(512, 512))
    window = CfarWindow(guard=(2, 2), training=(5, 5), is_circular=(True, False))
    found = ordered_statistic(power, window=window, false_alarm_probability=probability)
    low, high = interval(power.size, probability)
    expected = probability * power.size
    assert abs(found.row.size - expected) <= 1.25 * max(expected - low, high - expected)
    # the edges, where training cells are fewer, are no exception
    is_edge = (found.column < 7) | (found.column >= 505)
    low, high = interval(512 * 14, probability)
    assert low <= np.count_nonzero(is_edge) <= high


@pytest.mark.parametrize("num_cells", [4, 16, 64])
def test_the_quadrature_for_many_looks_is_rohlings_product_for_one(num_cells: int):
    """The general law at one look, against the closed product formula."""
    from scipy.special import gammaincc

    from polychirp.receiver.detection.cfar import _order_statistic

    rank = 3 * num_cells // 4
    alpha = ordered_statistic_factor(num_cells, rank, false_alarm_probability=1e-4)
    value, weight = _order_statistic(num_cells, rank, 1)
    assert weight @ gammaincc(1, alpha * value) == pytest.approx(1e-4, rel=1e-4)
