"""Correlation of the floor with the map from which it is estimated."""

import numpy as np
import pytest

from polychirp.receiver.chain import Receiver, _Search
from polychirp.receiver.detection.floor_correlation import log_correlation
from polychirp.receiver.detection.threshold import log_mean_of_noise, log_threshold_above_floor
from polychirp.rng import Streams
from polychirp.waveform import Triangular
from tests.support.points import frame_of


def test_logarithms_of_noise_correlate_as_drawn():
    """20 000 draws of noise under Hann's window, read at some distances: ±0.02, 3 sigma."""
    draw = np.random.default_rng(1)
    length = 64
    time = (np.arange(length) + 0.5) / length
    noise = draw.normal(size=(20_000, length)) + 1j * draw.normal(size=(20_000, length))
    cells = np.array([0.0, 0.3, 0.5, 1.0, 1.5, 2.5])
    lines = np.exp(-2j * np.pi * np.outer(time, 10.0 + cells)) * np.sin(np.pi * time[:, None]) ** 2
    logs = np.log(np.abs(noise @ lines) ** 2)
    assert np.corrcoef(logs.T)[0] == pytest.approx(log_correlation(cells), abs=0.022)


@pytest.mark.slow
def test_a_floors_variance_and_covariance_are_those_of_drawn_maps():
    """Over 150 frames of noise; both are 2 to 3 % of a cell's variance, found within 0.3 %."""
    ramps = Triangular(bandwidth=1e9, ramp_duration=1e-3).schedule(
        num_sweeps=16, streams=Streams(2)
    )
    products = []
    for seed in range(150):
        search = _Search(Receiver(), frame_of(ramps, [], seed=seed))
        search.map.update(search.spectra, np.zeros((0, ramps.num_ramps)))
        floor = search.map.floor()
        cell = search.map.statistic - log_mean_of_noise()
        apart = floor - np.median(floor)
        products.append([np.mean(cell * apart), np.mean(apart**2)])
    unit = np.pi**2 / 6.0 / ramps.num_ramps
    found = np.mean(products, axis=0) / unit
    assert found == pytest.approx(search.map.floor_correlation(), abs=0.005)


def test_a_threshold_above_a_correlated_floor_is_that_of_normal_noise():
    """400 000 cells S and floors C S + ε: as many cross as stated, within 4 sigma and 1 %."""
    draw = np.random.default_rng(4)
    ramps, probability, covariance, variance = 16, 3e-3, 0.05, 0.04
    cells = np.log(draw.exponential(size=(400_000, ramps))).mean(axis=1)
    unit = np.pi**2 / 6.0 / ramps
    own = draw.normal(size=cells.size) * np.sqrt(unit * (variance - covariance**2))
    known = {"num_ramps": ramps, "false_alarm_probability": probability}
    level = log_threshold_above_floor(**known, covariance=0.0, variance=0.0)
    above = cells - covariance * (cells - log_mean_of_noise()) - own
    median = log_mean_of_noise() + 2.0 * 1.2020569 / (np.pi**2 * ramps)
    sigma = np.sqrt(probability / cells.size)
    close = 4.0 * sigma + 0.01 * probability
    assert np.mean(cells > level + median) == pytest.approx(probability, abs=close)
    level = log_threshold_above_floor(**known, covariance=covariance, variance=variance)
    assert np.mean(above > level + median) == pytest.approx(probability, abs=close)
