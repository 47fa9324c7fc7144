"""In sight: geometry, noise and dynamic range, each a condition of its own."""

from itertools import product

import numpy as np
import pytest

from polychirp.model.truth import Truth
from polychirp.scoring.sight import GREATEST_RATIO, LEAST_SHARE, LEAST_SNR, BodyEchoes, in_sight


def one(*, share, is_visible=True):
    zero = np.zeros(1)
    return Truth(
        time=0.0,
        name=("car",),
        range=zero + 10.0,
        range_rate=zero,
        azimuth=zero,
        elevation=zero,
        point=np.zeros((1, 3)),
        is_visible=[is_visible],
        visible_share=[share],
    )


@pytest.mark.parametrize(
    ("by_share", "by_noise", "by_range"), list(product([0.99, 1.01], repeat=3))
)
def test_a_body_is_in_sight_if_it_meets_all_three_conditions(by_share, by_noise, by_range):
    snr = LEAST_SNR * by_noise
    bodies = BodyEchoes(snr=np.array([snr]), strongest=snr * GREATEST_RATIO / by_range)
    expected = min(by_share, by_noise, by_range) > 1.0
    assert in_sight(one(share=LEAST_SHARE * by_share), bodies).tolist() == [expected]


def test_a_hidden_body_is_not_in_sight_however_strong_its_echo():
    bodies = BodyEchoes(snr=np.array([1e12]), strongest=1e12)
    assert in_sight(one(share=1.0, is_visible=False), bodies).tolist() == [False]


def test_the_strongest_body_needs_no_more_than_the_noise_allows():
    bodies = BodyEchoes(snr=np.array([LEAST_SNR]), strongest=LEAST_SNR)
    assert in_sight(one(share=1.0), bodies).tolist() == [True]
