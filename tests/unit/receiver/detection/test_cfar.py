import numpy as np
import pytest

from polychirp.errors import InputError
from polychirp.receiver.detection.cfar import (
    CfarWindow,
    ordered_statistic,
    ordered_statistic_factor,
    training_count,
    training_sum,
)
from polychirp.receiver.detection.cfar_kernel import count_below
from tests.support.references.receiver import count_below_twin, training_cells

WINDOWS = [
    CfarWindow(guard=(1, 2), training=(2, 3), is_circular=(True, False)),
    CfarWindow(guard=(0, 1), training=(0, 4)),
    CfarWindow(guard=(2, 0), training=(1, 0), is_circular=(False, True)),
    CfarWindow(guard=(0, 0), training=(2, 2), is_circular=(True, True)),
    CfarWindow(guard=(1, 2), training=(3, 2), step=(2, 3), is_circular=(True, False)),
]


def noise(*shape: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).exponential(size=shape)


@pytest.mark.parametrize("window", WINDOWS)
def test_shifted_sums_are_the_sums_of_the_gathered_training_cells(window: CfarWindow):
    power = noise(11, 13)
    cells = [[training_cells(power, i, j, window) for j in range(13)] for i in range(11)]
    expected = np.array([[c.sum() for c in row] for row in cells])
    np.testing.assert_allclose(training_sum(power, window), expected, rtol=1e-13)
    np.testing.assert_array_equal(
        training_count(power.shape, window), [[c.size for c in row] for row in cells]
    )


@pytest.mark.parametrize("window", WINDOWS)
def test_compiled_counting_is_counting_in_numpy(window: CfarWindow):
    padded, far = noise(20, 22), window.reach
    level = noise(20 - 2 * far[0], 22 - 2 * far[1], seed=2)
    counted = count_below(padded, level, window.offsets)
    np.testing.assert_array_equal(counted, count_below_twin(padded, level, window.offsets))


@pytest.mark.parametrize("window", WINDOWS)
def test_counting_finds_what_sorting_finds(window: CfarWindow):
    """Slow reference of the ordered-statistic detector: sort every cell's training cells."""
    power = noise(16, 18)
    expected = []
    for i in range(16):
        for j in range(18):
            cells = np.sort(training_cells(power, i, j, window))
            rank = max(1, round(0.75 * cells.size))
            factor = ordered_statistic_factor(cells.size, rank, false_alarm_probability=0.05)
            if power[i, j] > factor * cells[rank - 1]:
                expected.append((i, j))
    found = ordered_statistic(power, window=window, false_alarm_probability=0.05)
    assert list(zip(found.row, found.column, strict=True)) == expected
    assert expected


def test_a_target_140_decibels_up_leaves_the_floor_of_its_own_cell_alone():
    power = np.ones((1, 65))
    power[0, 32] = 1e14
    window = CfarWindow(guard=(0, 2), training=(0, 8))
    np.testing.assert_array_equal(training_sum(power, window)[0, 32], 16.0)


def test_two_close_targets_do_not_mask_each_other():
    """One of the sixteen training cells of each is the other target, below the chosen rank."""
    power = np.ones((1, 64))
    power[0, [30, 34]] = 100.0
    window = CfarWindow(guard=(0, 1), training=(0, 8))
    found = ordered_statistic(power, window=window, false_alarm_probability=1e-6)
    np.testing.assert_array_equal(found.column, [30, 34])


@pytest.mark.parametrize("num_looks", [1, 8])
def test_the_floor_is_the_mean_power_of_noise(num_looks: int):
    """Every cell crosses at a probability near 1, and its floor is unbiased.

    Neighbouring floors share training cells; some 60 × 60 / 120 = 30 groups of 120 cells are
    independent, so that their mean is good to 1/√(3600 · num_looks) = 1.7 % for one look, a
    quantile's to somewhat more.
    """
    power = np.random.default_rng(3).gamma(num_looks, 1 / num_looks, size=(60, 60))
    found = ordered_statistic(
        power,
        window=CfarWindow(guard=(1, 1), training=(4, 4), is_circular=(True, True)),
        false_alarm_probability=0.99,
        num_looks=num_looks,
    )
    assert found.floor.mean() == pytest.approx(1.0, abs=0.06)


@pytest.mark.parametrize(
    ("shape", "probability", "message"),
    [
        ((64,), 1e-3, "2 axes"),
        ((4, 64), 1e-3, "does not fit a map of 4"),
        ((64, 64), 0.0, "not between 0 and 1"),
        ((64, 64), 1.0, "not between 0 and 1"),
    ],
)
def test_what_cannot_be_tested_is_refused(shape, probability, message: str):
    with pytest.raises(InputError, match=message):
        ordered_statistic(np.ones(shape), window=CfarWindow(), false_alarm_probability=probability)


def test_a_window_without_training_cells_is_refused():
    with pytest.raises(InputError, match="at least one training cell"):
        CfarWindow(training=(0, 0))


def test_a_quantile_beyond_the_last_cell_is_refused():
    with pytest.raises(InputError, match="quantile"):
        ordered_statistic(
            np.ones((32, 32)), window=CfarWindow(), false_alarm_probability=0.1, quantile=1.1
        )
