"""The ideal coherent detector, by other routes."""

import math

import numpy as np
import pytest

from polychirp.scoring.ideal_detector import cell_threshold, ideal_detection, needed_snr
from polychirp.scoring.statistics import mean_count, poisson_mean
from polychirp.units import to_db


@pytest.mark.parametrize("channels", [1, 4, 12])
def test_drawn_channels_cross_the_threshold_as_often_as_stated(channels):
    """Powers of M complex normal numbers with a share of the point's amplitude in each."""
    draw, count = np.random.default_rng(1), 40_000
    for snr, probability in ((6.0, 1e-2), (14.0, 1e-3)):
        threshold = cell_threshold(probability, num_channels=channels)
        noise = draw.normal(scale=np.sqrt(0.5), size=(2, count, channels))
        share = draw.dirichlet(np.ones(channels))
        statistic = np.sum((np.sqrt(snr * share) + noise[0]) ** 2 + noise[1] ** 2, axis=1)
        expected = float(ideal_detection(snr, num_channels=channels, threshold=threshold))
        spread = math.sqrt(expected * (1.0 - expected) / count)
        assert np.mean(statistic > threshold) == pytest.approx(expected, abs=4.0 * spread)


@pytest.mark.parametrize("channels", [1, 4, 12])
@pytest.mark.parametrize("probability", [1e-3, 1e-6])
def test_without_a_point_it_has_the_false_alarm_probability(channels, probability):
    threshold = cell_threshold(probability, num_channels=channels)
    found = ideal_detection(0.0, num_channels=channels, threshold=threshold)
    assert float(found) == pytest.approx(probability, rel=1e-6)


@pytest.mark.parametrize("channels", [1, 2, 8])
@pytest.mark.parametrize("detection", [0.5, 0.9])
def test_the_needed_snr_is_that_of_albersheim(channels, detection):
    """Albersheim 1981: 0.2 dB from the truth for a sum of magnitudes of N samples.

    The SNR of a sample, dB, is −5 log N + (6.2 + 4.54/√(N + 0.44)) log(A + 0.12 A B + 1.7 B); a sum
    of powers needs as much within 0.2 dB (Richards, Fundamentals of Radar Signal Processing).
    """
    a, b = math.log(0.62 / 1e-6), math.log(detection / (1.0 - detection))
    one = -5 * math.log10(channels) + (6.2 + 4.54 / math.sqrt(channels + 0.44)) * math.log10(
        a + 0.12 * a * b + 1.7 * b
    )
    threshold = cell_threshold(1e-6, num_channels=channels)
    needed = needed_snr(detection, num_channels=channels, threshold=threshold)
    assert float(to_db(needed / channels)) == pytest.approx(one, abs=0.4)


@pytest.mark.parametrize(
    ("events", "low", "high"), [(0, 0.0, 3.689), (1, 0.0253, 5.572), (10, 4.795, 18.39)]
)
def test_limits_of_a_poisson_number_are_those_of_tables(events, low, high):
    """Garwood's limits, as of Pearson and Hartley's table 40."""
    found = poisson_mean(np.array([float(events), 0.0]))
    assert (2 * found.low, 2 * found.high) == (
        pytest.approx(low, abs=1e-3),
        pytest.approx(high, rel=1e-3),
    )
    assert found.value == events / 2


def test_the_intervals_of_poisson_numbers_contain_their_mean():
    """In 95 % of cases or more, since the number is discrete; 2000 draws of each mean."""
    draw = np.random.default_rng(1)
    for mean in (0.02, 0.3):
        counts = draw.poisson(mean, (2000, 50)).astype(float)
        found = [poisson_mean(row) for row in counts]
        assert np.mean([one.low <= mean <= one.high for one in found]) > 0.94
    few = np.zeros(50)
    few[0] = 1.0
    assert poisson_mean(few).half_width < mean_count(few).half_width
